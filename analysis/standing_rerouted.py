"""SUMO alone with its rerouting device: vehicles on the same loops, led round jams by travel time.

The device leads a vehicle to the end of its route by the fastest way, past the edges that it must pass
(``via``). So each loop has as few of these as make it the fastest way when the roads are empty; while a
vehicle stands on one of them, that one need not be passed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import libsumo

from loopgate import Scenario
from loopgate.simulation.assembly import assemble
from loopgate.simulation.sumo.input import write_sumo_input
from loopgate.simulation.sumo.start import plain_options

EVERY_S = 60.0
"""So often each vehicle is led anew [s]."""

LOOKED_AT_S = 5
"""So often it is looked at whether a vehicle needs another round [s]."""

STILL_S, STILL_M = 600.0, 100.0
"""A vehicle that has driven less in the last so many seconds starves."""


@dataclass(frozen=True, slots=True)
class Way:
    """A loop from behind the edge that ends each route to that edge; and which of it must be passed."""

    edges: tuple[str, ...]
    checks: tuple[str, ...]

    def first(self, way: Sequence[str]) -> list[str]:
        """Return what must be passed on the first route of a vehicle, which ends as the loop does."""
        last = self.edges[-1]
        behind = self.edges[self.edges.index(way[0]) + 1 :] if way[0] != last else ()
        rounds = way.count(last) - 1
        return [*(edge for edge in self.checks if edge in behind), *(rounds * self.checks)][:-1]


def way_of(edges: Sequence[str], last: str) -> Way:
    """Return a loop with as few edges to be passed as make it the fastest way."""
    at = edges.index(last) + 1
    way = [last, *edges[at:], *edges[:at]]
    checks, here = list[str](), 0
    while here < len(way) - 1:
        there = here + 1
        while there + 1 < len(way) and is_fastest(way[here : there + 2]):
            there += 1
        checks.append(way[there])
        here = there
    return Way(tuple(way[1:]), tuple(checks))


def is_fastest(way: Sequence[str]) -> bool:
    """Return whether the fastest way between the ends of some edges leads along them."""
    if way[0] == way[-1]:
        return False
    return list(libsumo.simulation.findRoute(way[0], way[-1]).edges) == list(way)


def drive(scenario: Scenario, folder: Path, without: str, stands_s: tuple[float, float]) -> dict[str, Any]:
    """Run the vehicles of a scenario under SUMO alone; return what all but one did.

    That one stands between two times.
    """
    folder.mkdir(parents=True, exist_ok=True)
    assembly = assemble(scenario)
    starts = {start.vehicle: start for start in assembly.starts}
    given = write_sumo_input(assembly.starts, folder, renews=False)
    device = ["--device.rerouting.probability", "1", "--device.rerouting.period", f"{EVERY_S:g}"]
    network = ["-n", str(assembly.network.file)]
    libsumo.start(["sumo", *network, *given, *plain_options(scenario, folder / "sumo.log"), *device])
    get, hit, collisions = libsumo.vehicle, set[frozenset[str]](), 0
    try:
        ways = {name: way_of(s.loop.edges, s.edges[-1]) for s in starts.values() for name in [s.loop.id]}
        driven_m = dict.fromkeys(starts, 0.0)
        for now in range(int(scenario.duration_s)):
            libsumo.simulationStep()
            if now == 0:
                for vehicle, start in starts.items():
                    get.setRoute(vehicle, start.edges)  # the device has led it to its end as it departed
                    get.setVia(vehicle, ways[start.loop.id].first(start.edges))
            if now in stands_s and stands_s[0] < stands_s[1]:
                get.setSpeed(without, 0.0 if now == stands_s[0] else -1.0)
            if now % LOOKED_AT_S == 0:
                stands = stands_s[0] <= now < stands_s[1]
                blocked = get.getRoadID(without) if stands else ""
                for vehicle, start in starts.items():
                    lead(vehicle, ways[start.loop.id], blocked)
            if now == scenario.duration_s - STILL_S:
                driven_m = {vehicle: get.getDistance(vehicle) for vehicle in starts}
            new = {frozenset((c.collider, c.victim)) for c in libsumo.simulation.getCollisions()}
            collisions, hit = collisions + len(new - hit), new
        others_m = {vehicle: get.getDistance(vehicle) for vehicle in starts if vehicle != without}
        return {
            "km": sum(others_m.values()) / 1000.0,
            "laps": sum(int(metres / starts[vehicle].loop.lap_m) for vehicle, metres in others_m.items()),
            "starving": sum(metres - driven_m[vehicle] < STILL_M for vehicle, metres in others_m.items()),
            "collisions": collisions,
            "trespasses": None,
            "outcome": "done",
        }
    finally:
        libsumo.close()


def lead(vehicle: str, way: Way, blocked: str) -> None:
    """Give a vehicle another round while it has less than one ahead; it need not pass a blocked edge."""
    get = libsumo.vehicle
    via = list(get.getVia(vehicle))
    if len(via) < len(way.checks):
        edges = get.getRoute(vehicle)[get.getRouteIndex(vehicle) :]
        get.setRoute(vehicle, [*edges, *way.edges])
        get.setVia(vehicle, [edge for edge in (*via, edges[-1], *way.checks[:-1]) if edge != blocked])
    elif blocked in via:
        get.setVia(vehicle, [edge for edge in via if edge != blocked])
