"""Ordinary vehicles, read from the simulation into their tables, once a step."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from loopgate.drive import step as drive
from loopgate.drive.codes import NOBODY
from loopgate.drive.engine import Engine
from loopgate.drive.gatekeeper import Gatekeeper
from loopgate.drive.ground import nothing_around
from loopgate.drive.sense import STANDING_MPS
from loopgate.drive.timetable import Timetable
from loopgate.drive.yielding import KEPT, WAITS
from loopgate.simulation.around.roads import Roads
from loopgate.simulation.around.ways import Ways
from loopgate.traffic.base import Traffic, Whereabouts

__all__ = ["Sight"]

_AT_FIRST: Final = {"others": 64, "rears": 256, "arrivals": 256, "routes": 4096}
"""Room in the tables; at least twice as much whenever that is not enough."""


class Sight:
    """The positions of ordinary vehicles, and the rules by which gated vehicles yield to them.

    O(vehicles) in a step in which any gated vehicle asks.

    Parameters
    ----------
    roads
        The tables of the network's roads.
    traffic
        The running simulation.
    engine, keeper
        The parts that drive the gated vehicles.
    timetable
        The table of the lights' colours.
    """

    def __init__(
        self, roads: Roads, traffic: Traffic, engine: Engine, keeper: Gatekeeper, timetable: Timetable
    ) -> None:
        self._roads, self._traffic, self._engine, self._keeper = roads, traffic, engine, keeper
        self._timetable = timetable
        self._tables: dict[str, NDArray[Any]] = {**nothing_around(), **roads.tables}
        self._names: list[str] = []
        """Of the vehicles by row; whose row is free has none."""
        self._routes: list[str] = []
        """Names of their routes."""
        self._lanes: list[str] = []
        """Names of the lanes that their fronts were on when it was looked last."""
        self._rows: dict[str, int] = {}
        """The rows of those that are there."""
        self._read: tuple[Sequence[str], int] = (), -1
        """Who was there at the last look, and the changes of the engine until then."""
        self._which = np.zeros(0, dtype=np.int64)
        """Which of these are ordinary ones."""
        self._at = np.zeros(0, dtype=np.int64)
        """Their rows."""
        self._routes_end = 0
        self._seen_s = -math.inf
        self._met: set[str] = set()
        """All that have been seen so far; not one that was about to come under the gate."""
        self._lit: Mapping[str, Sequence[tuple[int, int]]] = {}
        """By light, the approaches that have a link of it, and the link."""
        self._lights = self._shown = np.zeros(0, dtype=np.int64)
        """The numbers of these lights, and what the tables say that they show."""
        for name, length in _AT_FIRST.items():
            self._make_room(name, length)

    @property
    def count(self) -> int:
        """The number of ordinary vehicles seen so far."""
        return len(self._met)

    def plan(self, ways: Ways) -> None:
        """Read the paths of the gated vehicles, at the start or after a change."""
        self._tables |= ways.tables
        ways.place_on_lanes(self._tables["lanes"])
        numbers = (self._keeper.number(state) for state in ways.states)
        self._tables["places"]["state"] = [NOBODY if n is None else n for n in numbers]
        self._lit, self._lights = ways.lit, self._timetable.numbers_of(ways.lit)
        self._shown = np.full(len(self._lights), -1)
        for column in ("clear", "freed"):
            self._engine.vehicles[column] = NOBODY
        self._hand_over()

    def _hand_over(self) -> None:
        self._keeper.look_around(self._tables, self._names, self.look)

    def _make_room(self, name: str, length: int) -> None:
        """Make room for a number of rows in a growing table."""
        before = self._tables[name]
        self._tables[name] = made = np.zeros((length, *before.shape[1:]), dtype=before.dtype).view(
            type(before)
        )
        made[: len(before)] = before

    def look(self) -> None:
        """Read the present positions of the ordinary vehicles."""
        traffic = self._traffic
        if self._seen_s == traffic.now_s:
            return
        self._seen_s = traffic.now_s
        here, run = traffic.whereabouts(), self._engine.run
        if self._read != (here.vehicles, self._engine.changes):
            self._find(here.vehicles)
        run["others"] = len(self._at)
        if len(self._at):
            self._write_down(here)
            self._look_at_lights()
            self._look_at_routes()
        elif not run["seen"][0]:
            return
        needed = self._keeper.ask(drive.SEE)
        if needed > len(self._tables["rears"]):  # as long as the other one
            for name in ("rears", "arrivals"):
                self._make_room(name, 2 * needed)
            self._hand_over()
            self._keeper.ask(drive.SEE)

    def _write_down(self, here: Whereabouts) -> None:
        """Write down where they are; lanes only where they have changed: numbers are slow to look up."""
        others, at, lanes, known = self._tables["others"], self._at, here.lanes, self._lanes
        on, speeds_mps = others["lane"], here.speeds_mps[self._which]
        for n, row in zip(self._which.tolist(), at.tolist(), strict=True):
            if lanes[n] != known[row]:
                known[row] = lanes[n]
                on[row] = self._roads.lanes.get(lanes[n], NOBODY)
        others["position_m"][at] = here.positions_m[self._which]
        others["speed"][at] = speeds_mps
        others["parks"][at] = on[at] == NOBODY  # in a parking area behind others, or being teleported
        for row in at[speeds_mps <= STANDING_MPS].tolist():
            if self._traffic.parks(self._names[row]):
                others["parks"][row] = True

    def _find(self, vehicles: Sequence[str]) -> None:
        """Give rows to new ordinary vehicles; take rows from vehicles that are gone or gated."""
        gated = self._engine.driver_of
        if self._read[1] != self._engine.changes:
            self._met -= gated.keys()
        which = [number for number, vehicle in enumerate(vehicles) if vehicle not in gated]
        there = [vehicles[number] for number in which]
        for vehicle in self._rows.keys() - there:
            self._names[self._rows.pop(vehicle)] = ""
        fresh = [vehicle for vehicle in there if vehicle not in self._rows]
        free = [row for row, name in enumerate(self._names) if not name] if fresh else []
        for vehicle in fresh:
            self._add(vehicle, free.pop() if free else len(self._names))
        self._which = np.array(which, dtype=np.int64)
        self._at = np.array([self._rows[vehicle] for vehicle in there], dtype=np.int64)
        self._tables["others"]["read"][: len(there)] = self._at
        self._read = vehicles, self._engine.changes

    def _add(self, vehicle: str, row: int) -> None:
        """Give a vehicle its row."""
        if row == len(self._names):
            self._names.append("")
            self._routes.append("")
            self._lanes.append("")
            if row == len(self._tables["others"]):
                self._make_room("others", 2 * row)
                self._hand_over()
        self._met.add(vehicle)
        self._names[row], self._routes[row], self._lanes[row], self._rows[vehicle] = vehicle, "", "", row
        kind, one = self._traffic.dynamics(vehicle), self._tables["others"][row]
        one["length_m"], one["accel"], one["decel"] = kind.length_m, kind.accel_mps2, kind.decel_mps2
        one["route_at"] = one["route_end"] = one["at"] = 0
        one["lane"], one["on"], one["seen_s"] = NOBODY, NOBODY, -math.inf

    def _look_at_routes(self) -> None:
        """Read the routes of vehicles on a new edge, and of vehicles that may be rerouted."""
        read, names, routes = self._traffic.route_id, self._names, self._routes
        rows = self._tables["others"]["found"][: self._keeper.ask(drive.FOLLOW)].tolist()
        lost = int(self._engine.run["found"][0])
        for row in rows[:lost]:
            self._read_route(row, read(names[row]))
        for row in rows[lost:]:
            name = read(names[row])
            if name != routes[row]:
                self._read_route(row, name)

    def _read_route(self, row: int, name: str) -> None:
        """See where the route of a vehicle leads, and how far it is on that."""
        one = self._tables["others"][row]
        edges, at = self._traffic.route(self._names[row])
        if name != self._routes[row]:
            route = self._roads.route(edges)
            one["route_at"], one["route_end"] = self._write(route)
            self._routes[row] = name
        one["at"] = one["route_at"] + at
        lane = self._tables["lanes"][one["lane"]]
        is_there = lane["inside"] or (at < len(edges) and self._roads.edge(edges[at]) == lane["edge"])
        one["on"] = one["lane"] if is_there else NOBODY

    def _write(self, route: Sequence[tuple[int, int]]) -> tuple[int, int]:
        """Write a route; return where it begins and ends."""
        if self._routes_end + len(route) > len(self._tables["routes"]):
            self._gather_routes(len(route))
        begin = self._routes_end
        self._routes_end = begin + len(route)
        self._tables["routes"][begin : self._routes_end] = route
        return begin, self._routes_end

    def _gather_routes(self, more: int) -> None:
        """Write the routes of present vehicles into one array, with room for more edges."""
        before, others, end = self._tables["routes"], self._tables["others"], 0
        kept: list[NDArray[np.int64]] = []
        for row in self._rows.values():
            one = others[row]
            route = before[one["route_at"] : one["route_end"]]
            one["at"] += end - one["route_at"]
            one["route_at"], one["route_end"] = end, end + len(route)
            kept.append(route)
            end += len(route)
        self._make_room("routes", max(len(before), 2 * (end + more)))
        self._tables["routes"][:end] = np.concatenate([*kept, before[:0]])
        self._routes_end = end
        self._hand_over()

    def _look_at_lights(self) -> None:
        """Take note of which lights on the ways across movements are open."""
        if not self._lit:
            return
        shown = self._timetable.showing(self._lights)
        changed = (shown != self._shown).nonzero()[0].tolist()
        self._shown = shown
        lit, is_open = [*self._lit.items()] if changed else [], self._tables["approaches"]["is_open"]
        for number in changed:
            light, links = lit[number]
            for approach, link in links:
                is_open[approach] = self._timetable.is_open(light, link)

    def give_way(self) -> None:
        """Make gated vehicles yield to ordinary vehicles; call once a step (`loopgate.drive.yielding`)."""
        self.look()
        told = self._keeper.ask(drive.GIVE_WAY)
        if not told:
            return
        drivers, vehicles = self._engine.drivers, self._engine.vehicles
        calls = sorted(
            (drivers[robot].id, robot, what) for robot, what in self._engine.tables.calls[:told].tolist()
        )
        for vehicle, robot, what in calls:
            if what & KEPT:
                kept_mps = float(vehicles["kept_mps"][robot])
                self._traffic.keep_to(vehicle, None if math.isnan(kept_mps) else kept_mps)
        for vehicle, robot, what in calls:
            if what & WAITS:
                self._traffic.give_way(vehicle, gives=not vehicles["first"][robot])

    def has_room(self, robot: int) -> bool:
        """Return whether a returning vehicle fits between the ordinary vehicles in its place."""
        self.look()
        return bool(self._keeper.ask(drive.ROOM, robot))
