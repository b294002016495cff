"""Traffic in SUMO, through libsumo or traci: both offer the same calls."""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from itertools import count
from math import dist, inf
from typing import Any

import numpy as np
from shapely import LineString, Point

from loopgate.errors import ClosedLaneError, TrafficError
from loopgate.network.stops import Stop
from loopgate.traffic.base import Collision, Dynamics, Insertion, Light, Phase, Program, Whereabouts

_STATIC = 0  # SUMO's number for lights that follow a timetable
_RAIL_CROSSING = 2
"""SUMO's number for the program of a level crossing."""

_FIGURES = ("getRedYellowGreenState", "getNextSwitch", "getProgram", "getPhase", "getSpentDuration")
"""What reads the figures of a `Light`, one after the other."""


class SumoLights:
    """The calls of `Traffic` that are about lights; `read` finds a reading by its name."""

    def __init__(self, api: Any, read: Callable[[str], Callable[..., Any]]) -> None:  # noqa: ANN401  no types
        self._programs_of, self._program_of = (
            api.trafficlight.getAllProgramLogics,
            read("trafficlight_getProgram"),
        )
        self._lights, self._set_program = api.trafficlight.getIDList, api.trafficlight.setProgram
        self._figures = [read(f"trafficlight_{name}") for name in _FIGURES]

    def light(self, light: str) -> Light:
        return Light._make([figure(light) for figure in self._figures])

    def close_rail_crossings(self) -> None:
        """Let level crossings close before trains, where all lights have been switched off."""
        for light in self._lights():
            for logic in self._programs_of(light):
                if int(logic.type) == _RAIL_CROSSING:
                    self._set_program(light, logic.programID)

    def light_program(self, light: str) -> Program:
        name = self._program_of(light)
        logic = next((one for one in self._programs_of(light) if one.programID == name), None)
        if logic is None:
            return Program((), fixed=False)
        fixed = int(logic.type) == _STATIC
        count = len(logic.phases)
        return Program(
            tuple(
                Phase(
                    state=phase.state,
                    longest_s=float(phase.duration if fixed else phase.maxDur),
                    following=int(phase.next[0]) if phase.next else (number + 1) % count,
                )
                for number, phase in enumerate(logic.phases)
            ),
            fixed=fixed,
        )


_RENEW_EVERY_S = 10.0
"""A route that SUMO has refused is tried again in this interval [s]."""


class SumoRoutes:
    """The calls of `Traffic` that are about routes; `read` finds a reading by its name."""

    def __init__(
        self,
        api: Any,  # noqa: ANN401  no types
        error: type[Exception] | tuple[type[Exception], ...],
        read: Callable[[str], Callable[..., Any]],
    ) -> None:
        self._vehicle, self._error, self._add_route = api.vehicle, error, api.route.add
        self._route_id = read("vehicle_getRouteID")
        self._unrenewed: dict[str, str] = {}
        """The routes that SUMO has refused, by vehicle."""
        self._renew_again_s = -inf
        self._numbers = count()

    def lead(self, vehicle: str, edges: Sequence[str]) -> None:
        self._unrenewed.pop(vehicle, None)
        try:
            self._vehicle.setRoute(vehicle, list(edges))
        except self._error as error:
            # SUMO puts the edges that are driven before them, and checks these too: one may be closed since.
            if not self._lead_from_here(vehicle, edges):
                msg = f"vehicle {vehicle}: SUMO does not take the route {' '.join(edges)}: {error}"
                raise TrafficError(msg) from error

    def _lead_from_here(self, vehicle: str, edges: Sequence[str]) -> bool:
        """Give a vehicle a route without the edges that it has driven; return whether SUMO takes it."""
        name = f"{vehicle}@{next(self._numbers)}"
        try:
            self._add_route(name, list(edges))
            self._vehicle.setRouteID(vehicle, name)
        except self._error:
            return False
        return True

    def route(self, vehicle: str) -> tuple[Sequence[str], int]:
        return self._vehicle.getRoute(vehicle), int(self._vehicle.getRouteIndex(vehicle))

    def route_id(self, vehicle: str) -> str:
        return str(self._route_id(vehicle))

    def add_route(self, name: str, edges: Sequence[str]) -> None:
        self._add_route(name, list(edges))

    def renew(self, vehicle: str, route: str) -> None:
        self._unrenewed.pop(vehicle, None)
        try:
            self._vehicle.setRouteID(vehicle, route)
        except self._error:  # a street on it is closed to the vehicle
            self._unrenewed[vehicle] = route

    @property
    def without_way(self) -> tuple[str, ...]:
        """The vehicles whose routes SUMO does not renew, because a street is closed."""
        return tuple(sorted(self._unrenewed))

    def renew_again(self, now_s: float) -> None:
        """Try again to renew the routes that SUMO has refused; call it after each step."""
        if not self._unrenewed or now_s < self._renew_again_s:
            return
        self._renew_again_s = now_s + _RENEW_EVERY_S
        there, again = set(self._vehicle.getIDList()), self._unrenewed
        self._unrenewed = {}
        for vehicle in sorted(there & again.keys()):
            self.renew(vehicle, again[vehicle])


_FOR_EVER_S = 1e7

_SAME_STOP_M = 0.05
"""Largest distance between a stop in SUMO and the position that was asked for [m]."""

_APART_M = 0.12
"""Least distance between two stops of a vehicle: SUMO takes those within 0.1 m for one [m]."""

_FLAGS = {"lane": 0, "busStop": 8, "containerStop": 16, "chargingStation": 32, "parkingArea": 64}
_PARKS, _TRIGGERS = 1, {"person": 2, "container": 4}
"""SUMO's flags of stops."""

_NONE_S = -(2.0**30)
"""SUMO's number for a missing time."""

_LEFT, _RIGHT = 1, -1  # SUMO's numbers for directions

_INSERTS_FROM = (1, 28)
"""Before this version of SUMO, `insertStop` lets a vehicle find another route to the end of its own."""


def sumo_version(api: Any) -> tuple[int, ...]:  # noqa: ANN401  neither API has types
    """Return the version of the running SUMO, as ``(1, 28, 0)``; empty if it says none.

    `api`: the module ``libsumo`` or ``traci``, or a connection of the latter.
    """
    return tuple(map(int, re.findall(r"\d+", api.getVersion()[1])))


class SumoStops:
    """The calls of `Traffic` about stops.

    `api`, `error`, `shared`: as in `loopgate.traffic.sumo.SumoTraffic`. `read`: returns the function for a
    call by its name.
    """

    def __init__(
        self,
        api: Any,  # noqa: ANN401  neither API has types
        error: type[Exception] | tuple[type[Exception], ...],
        read: Callable[[str], Callable[..., Any]],
        *,
        shared: bool,
    ) -> None:
        self._api = api
        self._error = error
        self._shared = shared
        self._vehicle = api.vehicle
        self._simulation = api.simulation
        self._persons, self._bus_stops = api.person, api.busstop
        self._lane_of, self._stops_of = read("vehicle_getLaneID"), read("vehicle_getStops")
        self._insert_stop, self._set_stop = read("vehicle_insertStop"), read("vehicle_setStop")
        self._replace_stop, self._is_stopped = read("vehicle_replaceStop"), read("vehicle_isStopped")
        self._stops_starting = read("simulation_getStopStartingVehiclesIDList")
        self._holds: dict[str, tuple[str, float]] = {}
        """For each held vehicle, its lane and the position of the hold there [m]."""
        self._stopping: set[str] = set()
        """The vehicles with stops of their own."""
        self._disallowed: dict[str, Sequence[str]] = {}
        """The classes to which each lane was closed before `close_lanes`."""
        self._inserts = sumo_version(api) >= _INSERTS_FROM
        self._lets_change: dict[tuple[str, str], bool] = {}
        self._classes: dict[str, str] = {}
        """The vehicle classes that other code cannot change."""

    def hold(self, vehicle: str, edge: str, lane_index: int, position_m: float) -> bool:
        """Set a stop on this pass that only `release` ends.

        Raises `TrafficError` if SUMO refuses it, because the vehicle is too near to brake or the lane is not
        on its route; `ClosedLaneError` if the lane is closed to it.
        """
        lane = f"{edge}_{lane_index}"
        here = self._lane_of(vehicle)
        position_m = self._apart(vehicle, lane, position_m)
        on_edge = here == lane
        if not on_edge and here.rpartition("_")[0] == edge:
            return False
        stop = position_m, lane_index, _FOR_EVER_S
        alone = vehicle not in self._holds if self._is_ours(vehicle) else not self._stops_of(vehicle, 1)
        try:
            if on_edge and alone and self._inserts and self._may_insert(edge, self._class_of(vehicle)):
                self._insert_stop(vehicle, 0, edge, *stop)
            else:
                self._set_stop(vehicle, edge, *stop)
        except self._error as error:
            msg = f"vehicle {vehicle}: SUMO cannot hold it on {lane} at {position_m:.1f} m: {error}"
            closed = self._vehicle.getVehicleClass(vehicle) in self._api.lane.getDisallowed(lane)
            raise (ClosedLaneError if closed else TrafficError)(msg) from error
        self._holds[vehicle] = lane, position_m
        taken = self._stops_of(vehicle, 1) if alone else self._stop_number(vehicle) is not None
        if not taken:
            del self._holds[vehicle]
            msg = f"vehicle {vehicle}: SUMO has not taken the stop on {lane} at {position_m:.1f} m"
            raise TrafficError(msg)
        return True

    def _apart(self, vehicle: str, lane: str, position_m: float) -> float:
        """Return a position for a hold behind a stop of the vehicle's owner, or before it at the lane's end.

        SUMO makes one stop of two that are this near to each other, and the owner's would end the hold.
        """
        if not self._is_ours(vehicle):
            for stop in self._stops_of(vehicle, 0):
                near = stop.lane == lane and abs(stop.endPos - position_m) < _APART_M
                if near and not self._is_hold(vehicle, stop):
                    behind_m = float(stop.endPos) + _APART_M
                    return (
                        behind_m if behind_m < self._api.lane.getLength(lane) else behind_m - 2.0 * _APART_M
                    )
        return position_m

    def close_lanes(self, lanes: Sequence[str], *, closed: bool) -> None:
        for lane in lanes:
            if closed:
                self._disallowed.setdefault(lane, self._api.lane.getDisallowed(lane))
            self._api.lane.setDisallowed(lane, ["all"] if closed else self._disallowed.pop(lane, ()))

    def lost_hold(self, vehicle: str) -> bool:
        return vehicle in self._holds and self._stop_number(vehicle) is None

    def _is_ours(self, vehicle: str) -> bool:
        """Return whether the vehicle has no stops of its own."""
        return not (self._shared or vehicle in self._stopping)

    def _class_of(self, vehicle: str) -> str:
        vclass = self._classes.get(vehicle)
        if vclass is None:
            vclass = str(self._vehicle.getVehicleClass(vehicle))
            if not self._shared:
                self._classes[vehicle] = vclass
        return vclass

    def _may_insert(self, edge: str, vclass: str) -> bool:
        """Return whether `insertStop` sets a stop on this pass of a vehicle without other stops.

        `setStop` always does so, but SUMO 1.28 never frees 0.9 kB for each call. `insertStop` starts its
        search where a vehicle can still choose another way: at the next edge if the vehicle is inside a
        junction, or on an edge on which some vehicles must not change lanes. On a route of two rounds the
        stop would then lie a lap later. Before other stops it would be in the wrong order.
        """
        key = edge, vclass
        free = self._lets_change.get(key)
        if free is None:
            free = self._lets_change[key] = self._may_change_anywhere(edge, vclass)
        return free

    def _may_change_anywhere(self, edge: str, vclass: str) -> bool:
        may = self._api.lane.getChangePermissions
        lanes = [f"{edge}_{index}" for index in range(self._api.edge.getLaneNumber(edge))]
        return all(vclass in may(lane, way) for lane in lanes for way in (_LEFT, _RIGHT))

    def _stop_number(self, vehicle: str) -> int | None:
        """Return the index of the stop that holds the vehicle, or None."""
        stops = self._stops_of(vehicle, 0)
        if self._is_ours(vehicle):
            return 0 if stops else None
        return next((number for number, stop in enumerate(stops) if self._is_hold(vehicle, stop)), None)

    def _is_hold(self, vehicle: str, stop: Any) -> bool:  # noqa: ANN401  neither API has types
        """Return whether a stop is the stop that holds the vehicle."""
        lane, position_m = self._holds.get(vehicle, ("", 0.0))
        lasts, off_m = stop.duration >= _FOR_EVER_S / 2, abs(stop.endPos - position_m)
        return bool(stop.lane == lane and lasts and off_m < _SAME_STOP_M)

    def find_holds(self, vehicles: Iterable[str]) -> None:
        """Find the stops that hold vehicles anew, after another state has been loaded."""
        there = set(self._vehicle.getIDList())
        for vehicle in vehicles:
            self._holds.pop(vehicle, None)
            stops = self._stops_of(vehicle, 0) if vehicle in there else ()
            for stop in (stop for stop in stops if stop.duration >= _FOR_EVER_S / 2):
                self._holds[vehicle] = stop.lane, stop.endPos

    def drop_hold(self, vehicle: str) -> None:
        """Remove the stop that holds a vehicle, whether reached or not, and no other stop."""
        if vehicle not in self._holds:
            return
        number = 0 if self._is_ours(vehicle) else self._stop_number(vehicle)
        del self._holds[vehicle]
        if number is None:
            return
        try:
            self._replace_stop(vehicle, number, "")
        except self._error:
            if self._stops_of(vehicle, 1):
                raise  # otherwise no stop is left: it was on a route that the vehicle has left

    def forget_stops(self, vehicle: str, edge: str, route: str, alone: str) -> bool:
        """Lead a vehicle off the edges of its stops and back: SUMO keeps only stops on the present route."""
        if self._vehicle.getRoadID(vehicle) != edge or self._stops_of(vehicle, 1):
            return False  # SUMO would also forget a stop ahead that loopgate has not set
        self._vehicle.setRouteID(vehicle, alone)
        self._vehicle.setRouteID(vehicle, route)
        return True

    def halted(self) -> Sequence[str]:
        """Return the held vehicles that came to rest in the last step at the stop that holds them."""
        if not self._holds:
            return ()
        ids = self._stops_starting()
        held = [vehicle for vehicle in ids if vehicle in self._holds]
        return [vehicle for vehicle in held if self._is_ours(vehicle) or self._stop_number(vehicle) == 0]

    def next_stop(self, vehicle: str) -> tuple[str, float, bool] | None:
        for number, stop in enumerate(self._stops_of(vehicle, 2)):
            if not self._is_hold(vehicle, stop):
                return stop.lane.rpartition("_")[0], stop.endPos, number > 0
        return None

    def set_stop(self, vehicle: str, stop: Stop) -> None:
        flags = (
            _FLAGS[stop.kind] | (_PARKS if stop.parks else 0) | sum(_TRIGGERS[one] for one in stop.triggers)
        )
        times = {"duration": stop.duration_s, "until": _NONE_S if stop.until_s is None else stop.until_s}
        where: dict[str, float] = {}
        if stop.kind == "lane":
            index = int(stop.lane.rpartition("_")[2])
            where = {"pos": stop.end_m, "laneIndex": index, "startPos": stop.start_m}
        get = self._vehicle
        self._stopping.add(vehicle)
        try:
            get.setStop(vehicle, stop.edge if where else stop.name, flags=flags, **where, **times)
            for name, value in stop.told:
                get.setStopParameter(vehicle, self._number_of(vehicle, stop), name, value)
        except self._error as error:
            msg = f"vehicle {vehicle}: SUMO does not take the stop at {stop.name}: {error}"
            raise TrafficError(msg) from error

    def _number_of(self, vehicle: str, stop: Stop) -> int:
        """Return the index of the vehicle's last stop at a place."""
        stops = self._stops_of(vehicle, 0)
        for number in range(len(stops) - 1, -1, -1):
            there = stops[number].lane == stop.lane and (
                abs(stops[number].endPos - stop.end_m) < _SAME_STOP_M
                if stop.kind == "lane"
                else stops[number].stoppingPlaceID == stop.name
            )
            if there:
                return number
        msg = f"vehicle {vehicle}: SUMO knows of no stop at {stop.name}"
        raise TrafficError(msg)

    def drop_stop(self, vehicle: str, stop: Stop) -> None:
        self._vehicle.replaceStop(vehicle, self._number_of(vehicle, stop), "")

    def stops_ahead(self, vehicle: str) -> int:
        held = vehicle in self._holds and self._stop_number(vehicle) is not None
        return len(self._stops_of(vehicle, 0)) - held

    def stays_s(self, vehicle: str) -> float:
        """Return for how long a vehicle will stand at its stop [s]; SUMO counts down."""
        stops = self._stops_of(vehicle, 1)
        return float(stops[0].duration) if stops and self._is_stopped(vehicle) else 0.0

    def stay(self, vehicle: str, for_s: float) -> None:
        self._vehicle.setStopParameter(vehicle, 0, "duration", f"{for_s:g}")

    def awaits(self, vehicle: str) -> bool:
        return bool(self._vehicle.isStoppedTriggered(vehicle))

    def lot_ahead_m(self, vehicle: str, stop: Stop) -> float:
        """Return the distance to the vehicle's lot; SUMO puts it back on its lane beside that lot."""
        lot, at_m = self._vehicle.getPosition(vehicle), float(self._vehicle.getLanePosition(vehicle))
        if any(dist(lot, space) < _SAME_STOP_M for space in stop.spaces):
            return stop.end_m - at_m
        lane = LineString(self._api.lane.getShape(stop.lane))
        return float(lane.project(Point(lot)) * self._api.lane.getLength(stop.lane) / lane.length) - at_m

    def is_full(self, car_park: str) -> bool:
        taken, lots = (
            int(self._simulation.getParameter(car_park, f"parkingArea.{what}"))
            for what in ("occupancy", "capacity")
        )
        return taken >= lots

    def stops_begun(self) -> Sequence[str]:
        return [v for v in self._stops_starting() if self.at_own_stop(v)]

    def at_own_stop(self, vehicle: str) -> bool:
        """Return whether a vehicle stands at a stop that does not hold it."""
        held = vehicle in self._holds and self._stop_number(vehicle) == 0
        return not held and bool(self._is_stopped(vehicle))  # a held one was released

    def awaits_lot(self, vehicle: str) -> bool:
        """Return whether a vehicle is on the lane of its next stop, a car park whose lots are all taken."""
        return any(
            stop.stopFlags & _FLAGS["parkingArea"]
            and stop.lane == self._lane_of(vehicle)
            and self.is_full(stop.stoppingPlaceID)
            for stop in self._stops_of(vehicle, 1)
        )

    def stops_ended(self) -> Sequence[str]:
        ids: Sequence[str] = self._simulation.getStopEndingVehiclesIDList()
        return ids


GATED_SPEED_MODE = 23
"""SUMO's speed mode of gated vehicles: safe speed, accelerations and red lights hold. The gate replaces the
right of way, but vehicles that are inside a junction still count (bit 5 unset)."""

YIELDING_SPEED_MODE = 31
"""The same with SUMO's right of way, for runs with ordinary traffic."""

_CLOCK_DIGITS = 3
"""SUMO counts milliseconds."""

_ANY_LIGHT = ~16
"""Mask that removes lights from a speed mode, for a vehicle that drives on at any light."""

_LANE_CHANGE_FOR_ROUTE_ONLY = 0b01_00_00_00_01
"""Lane changes only where the route demands them, and never into an occupied gap."""

_LANE_CHANGE_AS_TOLD_ONLY = 0b11_00_00_00_00
"""Lane changes only by `SumoTraffic.change_lane`, and only if no vehicle must brake hard."""

_VIA, _STATE, _RED = 4, 5, "ru"
"""Where a link has the lane inside the junction and the state of its light, and states of a red one."""

_MUST_CHANGE, _KEPT_FROM_IT, _LETS_IN = 0x108, 0x3E00, 1 << 27
"""Bits of SUMO's lane-change state: strategic and urgent; a leader, a follower or a body beside is in the
way; the driver stands so that another can come over (``LCA_AMBACKBLOCKER_STANDING``)."""

_AT_JUNCTION_M = 15.0
"""A vehicle nearer than this to the end of its lane may stand there because of the light [m]."""

_ANY_DECELERATION = ~4
"""Mask that removes the limit on deceleration from a speed mode (bit 2)."""


class SumoTraffic(SumoStops, SumoLights, SumoRoutes):
    """A SUMO simulation with the interface `Traffic`, which documents the calls.

    Parameters
    ----------
    api
        The libsumo module or a traci connection, started.
    error
        The exception types that `api` raises.
    yields
        Whether gated vehicles also obey SUMO's right of way, because there is ordinary traffic.
    shared
        Whether other code may set stops for gated vehicles.
    reads
        Faster replacements of calls of ``api``, by domain and name, such as ``vehicle_getSpeed``.
    close
        Function that ends the simulation; by default that of `api`.
    """

    def __init__(
        self,
        api: Any,  # noqa: ANN401  neither API has types
        error: type[Exception] | tuple[type[Exception], ...],
        *,
        yields: bool = False,
        shared: bool = True,
        reads: Mapping[str, Callable[..., Any]] | None = None,
        close: Callable[[], None] | None = None,
    ) -> None:
        def read(name: str) -> Callable[..., Any]:
            domain, _, call = name.partition("_")
            found: Callable[..., Any] = (reads or {}).get(name) or getattr(getattr(api, domain), call)
            return found

        SumoStops.__init__(self, api, error, read, shared=shared)
        SumoLights.__init__(self, api, read)
        SumoRoutes.__init__(self, api, error, read)
        self._yields = yields
        self._speed_mode = YIELDING_SPEED_MODE if yields else GATED_SPEED_MODE
        self._heedless: set[str] = set()
        self._first: set[str] = set()
        """The vehicles that ignore the right of way."""
        self._running = True
        self._close: Callable[[], None] = close or api.close
        self._odometer, *self._place_and_speed = (
            read(f"vehicle_{name}") for name in ("getDistance", "getLanePosition", "getSpeed")
        )
        self._vehicles, self._arrived = read("vehicle_getIDList"), read("simulation_getArrivedIDList")
        self._departed, self._colliding = (
            read(f"simulation_get{name}") for name in ("DepartedIDList", "CollidingVehiclesNumber")
        )
        self._set_speed, self._set_speed_mode = read("vehicle_setSpeed"), read("vehicle_setSpeedMode")
        self._is_parking = read("vehicle_isStoppedParking")
        self._lane_change = read("vehicle_getLaneChangeState")
        self._like = [
            read(f"vehicle_{name}")
            for name in (
                "getLength",
                "getAccel",
                "getDecel",
                "getSpeedFactor",
                "getMinGap",
                "getMaxSpeed",
                "getImperfection",
            )
        ]
        self._seen, self._seen_s = Whereabouts(), -inf
        self._now = float(api.simulation.getTime())
        self._step_s = float(api.simulation.getDeltaT())
        self._onto: dict[str, list[tuple[str, list[str]]]] = {}
        """The lanes that lead onto each lane, and the lanes between; found when first needed."""
        self._braked: dict[str, float] = {}
        """For each braked vehicle, its speed one step before [m/s]."""
        self._slowed: dict[str, float] = {}
        """The vehicles whose speed is limited, and the limit [m/s]."""
        self._standing: set[str] = set()
        """The vehicles that shall stay where they stand."""
        self._modes: dict[str, tuple[int, int]] = {}
        """For each gated vehicle, its speed mode and lane-change mode from before."""

    @property
    def now_s(self) -> float:
        return self._now

    @property
    def step_s(self) -> float:
        return self._step_s

    @property
    def in_this_process(self) -> bool:
        return getattr(self._api, "__name__", "") == "libsumo"

    @property
    def gives_way(self) -> bool:
        return self._yields

    def step(self) -> None:
        try:
            self._api.simulationStep()
        except self._error as error:
            msg = f"SUMO stopped at {self._now:.0f} s: {error}"
            raise TrafficError(msg) from error
        self._now, self._seen_s = round(self._now + self._step_s, _CLOCK_DIGITS), -inf
        self.renew_again(self._now)

    def look_at_clock(self) -> None:
        """Note that a step was made, possibly by other code."""
        self._now, self._seen_s = float(self._simulation.getTime()), -inf
        self.renew_again(self._now)

    def outside(self) -> Sequence[str]:
        ids: Sequence[str] = self._simulation.getPendingVehicles()
        return ids

    def vehicles(self) -> Sequence[str]:
        ids: Sequence[str] = self._vehicles()
        return ids

    def departed(self) -> Sequence[str]:
        ids: Sequence[str] = self._departed()
        return ids

    def arrived(self) -> Sequence[str]:
        ids: Sequence[str] = self._arrived()
        return ids

    def put_in(self, vehicle: str, how: Insertion) -> None:
        own = how.attributes
        try:
            self._vehicle.add(
                vehicle,
                how.route,
                typeID=how.kind,
                departLane=str(how.lane_index),
                departPos=f"{how.position_m:.3f}",
                departSpeed="max" if how.rolling else "0",
                arrivalPos=own.get("arrivalPos", "max"),
                arrivalSpeed=own.get("arrivalSpeed", "current"),
                line=own.get("line", ""),
                personNumber=int(own.get("personNumber", "0")),
            )
            for name, value in how.parameters.items():
                self._vehicle.setParameter(vehicle, name, value)
        except self._error as error:
            msg = f"vehicle {vehicle}: SUMO does not take it: {error}"
            raise TrafficError(msg) from error

    def take_out(self, vehicle: str) -> None:
        self._seen_s = -inf
        self._holds.pop(vehicle, None)
        with suppress(*((self._error,) if isinstance(self._error, type) else self._error)):
            self._vehicle.remove(vehicle)

    def odometer(self, vehicle: str) -> float:
        return float(self._odometer(vehicle))

    def odometers(self, vehicles: Sequence[str]) -> list[float]:
        try:
            return [*map(self._odometer, vehicles)]
        except self._error as error:
            msg = (
                f"{error} SUMO has taken it out: calibrators, rerouters and the like must leave vehicles on "
                f"loops alone; give them vTypes"
            )
            raise TrafficError(msg) from error

    def whereabouts(self) -> Whereabouts:
        """Return the positions of all vehicles; they are read again after a step or a removal."""
        if self._seen_s != self._now:
            self._seen_s, vehicles, before = self._now, self.vehicles(), self._seen.vehicles
            if vehicles == before:
                vehicles = before  # the same object is faster to compare
            self._seen = self.whereabouts_of(vehicles)
        return self._seen

    def whereabouts_of(self, vehicles: Sequence[str]) -> Whereabouts:
        figures = (
            np.fromiter(map(read, vehicles), np.float64, len(vehicles)) for read in self._place_and_speed
        )
        return Whereabouts(vehicles, [*map(self._lane_of, vehicles)], *figures)

    def lane(self, vehicle: str) -> tuple[str, float]:
        return self._lane_of(vehicle), float(self._place_and_speed[0](vehicle))

    def speed(self, vehicle: str) -> float:
        return float(self._place_and_speed[1](vehicle))

    def parks(self, vehicle: str) -> bool:
        return bool(self._is_parking(vehicle))

    def position(self, vehicle: str) -> tuple[float, float]:
        x, y = self._vehicle.getPosition(vehicle)
        return float(x), float(y)

    def show(self, low: tuple[float, float], high: tuple[float, float]) -> None:
        """Show the part of the map between two corners [m] in the window."""
        self._api.gui.setBoundary(self._api.gui.getIDList()[0], *low, *high)

    def paint(self, vehicle: str, colour: tuple[int, int, int]) -> None:
        """Give a vehicle a colour: red, green, blue from 0 to 255."""
        self._vehicle.setColor(vehicle, (*colour, 255))

    def put_under_gate(self, vehicle: str, *, keeps_lane: bool = False) -> None:
        """Set the modes of a gated vehicle for speed and lane changes."""
        get = self._vehicle
        self._modes.setdefault(vehicle, (get.getSpeedMode(vehicle), get.getLaneChangeMode(vehicle)))
        get.setSpeedMode(vehicle, self._speed_mode)
        mode = _LANE_CHANGE_AS_TOLD_ONLY if keeps_lane else _LANE_CHANGE_FOR_ROUTE_ONLY
        get.setLaneChangeMode(vehicle, mode)

    def leave_gate(self, vehicle: str) -> None:
        """Undo every hold, and restore the vehicle's modes."""
        modes = self._modes.pop(vehicle, None)
        self._heedless.discard(vehicle)
        self._first.discard(vehicle)
        if vehicle in self.arrived() or vehicle not in self._vehicle.getIDList():
            self._holds.pop(vehicle, None)
            self._braked.pop(vehicle, None)
            self._slowed.pop(vehicle, None)
            self._standing.discard(vehicle)
            return
        self.release(vehicle)
        if vehicle in self._slowed or vehicle in self._standing:
            self._standing.discard(vehicle)
            self.keep_to(vehicle, None)
        if modes is not None:
            self._set_speed_mode(vehicle, modes[0])
            self._vehicle.setLaneChangeMode(vehicle, modes[1])

    def mean_speed(self, edge: str) -> float:
        return float(self._api.edge.getLastStepMeanSpeed(edge))

    def lane_index(self, vehicle: str) -> int:
        return int(self._vehicle.getLaneIndex(vehicle))

    def change_lane(self, vehicle: str, lane_index: int) -> None:
        """Ask for the lane until the end of the next step."""
        self._vehicle.changeLane(vehicle, lane_index, self._step_s)

    def put_on_lane(self, vehicle: str, lane_index: int) -> bool:
        """Move the vehicle sideways, if all vehicles on that lane keep their gaps."""
        get = self._vehicle
        lane = f"{get.getRoadID(vehicle)}_{lane_index}"
        front_m = float(get.getLanePosition(vehicle))
        rear_m = front_m - get.getLength(vehicle) - get.getMinGap(vehicle)
        for other in self._api.lane.getLastStepVehicleIDs(lane):
            ahead_m = float(get.getLanePosition(other))
            if ahead_m > rear_m and ahead_m - get.getLength(other) - get.getMinGap(vehicle) < front_m:
                return False
        try:
            get.moveTo(vehicle, lane, front_m)
        except self._error:
            return False
        self._seen_s = -inf
        return True

    def keep_to(self, vehicle: str, speed_mps: float | None) -> None:
        if speed_mps is None:
            self._slowed.pop(vehicle, None)
        else:
            self._slowed[vehicle] = speed_mps
        self._limit(vehicle)

    def stand(self, vehicle: str, *, stands: bool) -> None:
        (self._standing.add if stands else self._standing.discard)(vehicle)
        self._limit(vehicle)

    def _limit(self, vehicle: str) -> None:
        """Tell SUMO the present limit of a vehicle's speed."""
        stays = vehicle in self._standing or vehicle in self._braked
        self._set_speed(vehicle, 0.0 if stays else self._slowed.get(vehicle, -1.0))

    def release(self, vehicle: str) -> None:
        """Drop the stop by which the vehicle is held, reached or not, and no other stop."""
        if vehicle in self._braked:
            del self._braked[vehicle]
            self._limit(vehicle)
            self._set_speed_mode(vehicle, self._mode(vehicle))
        self.drop_hold(vehicle)

    def heed_lights(self, vehicle: str, *, heeds: bool) -> None:
        (self._heedless.discard if heeds else self._heedless.add)(vehicle)
        self._set_mode(vehicle)

    def give_way(self, vehicle: str, *, gives: bool) -> None:
        """Set whether a gated vehicle keeps SUMO's right of way, or yields only to vehicles inside."""
        (self._first.discard if gives else self._first.add)(vehicle)
        self._set_mode(vehicle)

    def _set_mode(self, vehicle: str) -> None:
        if vehicle not in self._braked:
            try:
                self._set_speed_mode(vehicle, self._mode(vehicle))
            except self._error:  # it has just arrived
                self._heedless.discard(vehicle)
                self._first.discard(vehicle)

    def _mode(self, vehicle: str) -> int:
        mode = GATED_SPEED_MODE if vehicle in self._first else self._speed_mode
        return mode & _ANY_LIGHT if vehicle in self._heedless else mode

    def brake(self, vehicle: str, *, hard: bool = True) -> None:
        self._braked[vehicle] = float(self._vehicle.getSpeed(vehicle))
        if hard:
            self._set_speed_mode(vehicle, self._speed_mode & _ANY_DECELERATION)
        self._set_speed(vehicle, 0.0)

    def stay_braked(self) -> None:
        for vehicle, before_mps in list(self._braked.items()):
            self.brake(vehicle, hard=self._vehicle.getSpeed(vehicle) >= before_mps > 0.0)

    def collisions(self) -> Sequence[Collision]:
        if not self._colliding():
            return ()
        return tuple(Collision(c.collider, c.victim, c.lane) for c in self._simulation.getCollisions())

    def teleports(self) -> Sequence[str]:
        if not self._simulation.getStartingTeleportNumber():
            return ()
        return tuple(self._simulation.getStartingTeleportIDList())

    def persons_at(self, bus_stop: str) -> int | None:
        if not self._persons.getIDCount():
            return None
        return int(self._bus_stops.getPersonCount(bus_stop))

    def size(self, vehicle: str) -> tuple[float, float]:
        return float(self._like[0](vehicle)), float(self._vehicle.getMinGap(vehicle))

    def goes_on(self, vehicle: str) -> Sequence[tuple[Sequence[str], float, int]]:
        return [
            ((lane, *after[1:]), float(length_m), int(to_best))
            for lane, length_m, _, to_best, _, after in self._vehicle.getBestLanes(vehicle)
        ]

    def lane_wish(self, vehicle: str) -> tuple[int, bool]:
        states = {side: int(self._lane_change(vehicle, side)[1]) for side in (-1, 1)}
        kept = (side for side, state in states.items() if state & _MUST_CHANGE == _MUST_CHANGE)
        return next((side for side in kept if states[side] & _KEPT_FROM_IT), 0), any(
            state & _LETS_IN for state in states.values()
        )

    def faces_red(self, vehicle: str) -> bool:
        links = self._vehicle.getNextLinks(vehicle)
        if not links or links[0][_STATE] not in _RED:
            return False
        lane, front_m = self.lane(vehicle)
        return float(self._api.lane.getLength(lane)) - front_m <= _AT_JUNCTION_M

    def impatient_s(self) -> float:
        after_s = float(self._simulation.getOption("time-to-impatience"))
        return max(0.0, after_s)

    def dynamics(self, vehicle: str) -> Dynamics:
        return Dynamics(*(float(read(vehicle)) for read in self._like))

    def show_brakes(self, vehicle: str) -> None:
        """Set SUMO's `apparentDecel`, which `setDecel` leaves as it was."""
        decel = self._vehicle.getDecel(vehicle)
        if decel > self._vehicle.getApparentDecel(vehicle):
            self._vehicle.setApparentDecel(vehicle, decel)

    def advise(self, vehicle: str, speed_factor: float) -> None:
        self._vehicle.setSpeedFactor(vehicle, speed_factor)

    def jump(self, vehicle: str) -> float | None:
        """Put the vehicle on the first edge ahead on its route where it has room."""
        get = self._vehicle
        route = get.getRoute(vehicle)
        for edge in route[get.getRouteIndex(vehicle) + 1 :]:
            for index in range(self._api.edge.getLaneNumber(edge)):
                position_m = self._room_on(f"{edge}_{index}", *self.size(vehicle))
                if position_m is None:
                    continue
                skipped = float(get.getDrivingDistance(vehicle, edge, position_m, index))
                try:
                    get.moveTo(vehicle, f"{edge}_{index}", position_m)
                except self._error:
                    continue
                self._seen_s = -inf
                return skipped
        return None

    def _room_on(self, lane: str, length_m: float, gap_m: float) -> float | None:
        """Return where the front of a vehicle can be put on a lane so that nobody has to brake hard [m].

        None if there is no such position. Vehicles on their way to the lane count too.
        """
        get, lanes = self._vehicle, self._api.lane
        begin_m = gap_m
        for before, inside in self._ways_onto(lane):
            after_m = 0.0
            for one in reversed(inside):
                after_m += lanes.getLength(one)
                for other in lanes.getLastStepVehicleIDs(one):
                    begin_m = max(begin_m, self._clear_m(other) - after_m + get.getLanePosition(other))
            if first := lanes.getLastStepVehicleIDs(before)[-1:]:
                left_m = lanes.getLength(before) - get.getLanePosition(first[0])
                begin_m = max(begin_m, self._clear_m(first[0]) - after_m - left_m)
        for other in lanes.getLastStepVehicleIDs(lane):  # from the last one on
            if begin_m + length_m + gap_m <= get.getLanePosition(other) - get.getLength(other):
                break
            begin_m = get.getLanePosition(other) + self._clear_m(other)
        position_m = float(begin_m + length_m)
        return position_m if position_m + gap_m + _AT_JUNCTION_M <= lanes.getLength(lane) else None

    def _clear_m(self, vehicle: str) -> float:
        """Return how far ahead of a vehicle another can appear so that it need not brake hard [m]."""
        get, speed = self._vehicle, float(self._vehicle.getSpeed(vehicle))
        braking_m = speed * (get.getTau(vehicle) + self._step_s) + speed**2 / (2.0 * get.getDecel(vehicle))
        return float(get.getMinGap(vehicle) + braking_m)

    def _ways_onto(self, lane: str) -> Sequence[tuple[str, Sequence[str]]]:
        """Return the lanes that lead onto a lane, each with the lanes inside the junction between them."""
        if not self._onto:
            get = self._api.lane
            for before in get.getIDList():
                for link in () if before.startswith(":") else get.getLinks(before):
                    onto, inside, over = link[0], link[_VIA], []
                    while inside:
                        over.append(inside)
                        following = get.getLinks(inside)
                        inside = following[0][_VIA] if following else ""
                    self._onto.setdefault(onto, []).append((before, over))
        return self._onto.get(lane, ())

    def expects_more(self) -> bool:
        return bool(self._simulation.getMinExpectedNumber() > 0)

    def close(self) -> None:
        if self._running:
            self._running = False
            self._close()
