"""Vehicles that join and leave a simulation of somebody else's, who stops, slows, moves and removes them.

Twenty vehicles on loops among seventy-five ordinary ones: nobody under the gate collides with another, goes
where it was not let, or runs through its line. Usage: python analysis/attached.py --help
"""

from __future__ import annotations

import argparse
import importlib
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any

import loopgate
from loopgate.network import Loop, RoadNetwork, generate_loops

ROOT = Path(__file__).resolve().parents[1]
NETWORK = ROOT / "networks" / "grid5-priority.net.xml"

ORDINARY = 75
ON_LOOPS = 20
FIRST_S = 100
"""When the first vehicles come under the gate [s]."""

EVERY_S = {"leave": 211, "stop": 67, "slow": 41, "move": 307, "remove": 509}
"""How often somebody leaves, is stopped, is told how fast to drive, is moved, is removed [s]."""

STOP_S, SLOW_S = 25.0, 30

WILD_S = {"junction": 97, "close": 131, "open": 131, "brakes": 29, "still": 83, "target": 149}
"""The same with ``--wild``: put into a junction, a street closed and opened again, other brakes for one that
stands, speed 0 in a junction, led to another end."""

_AFTER_S = {"open": 40}


@dataclass(slots=True)
class World:
    """A simulation with ordinary traffic and vehicles on loops, and what their owner does to them.

    Attributes
    ----------
    api
        ``libsumo`` or ``traci``.
    loops
        On which vehicles are put.
    rng
        Decides all that is left to chance.
    made, slowed
        How many vehicles there have been; who drives as told, until when [s].
    """

    api: Any
    loops: list[Loop]
    rng: Random
    made: int = 0
    slowed: dict[str, float] | None = None
    closed: str = ""
    """The lane that is closed."""

    def fill(self, edges: list[str]) -> None:
        """Keep up the number of ordinary vehicles."""
        get = self.api.vehicle
        ordinary = sum(1 for name in get.getIDList() if name.startswith("o"))
        for _ in range(min(3, ORDINARY - ordinary)):
            start, end = self.rng.sample(edges, 2)
            route = self.api.simulation.findRoute(start, end).edges
            if len(route) < 2:  # noqa: PLR2004  it has to drive somewhere
                continue
            self.made += 1
            self.api.route.add(f"ro{self.made}", route)
            get.add(f"o{self.made}", f"ro{self.made}", departPos="base", departSpeed="0")

    def put(self) -> str:
        """Let another vehicle depart on some loop; return its name."""
        self.made += 1
        name, loop = f"v{self.made}", self.rng.choice(self.loops)
        begin = self.rng.randrange(len(loop.edges))
        self.api.route.add(f"r{name}", (*loop.edges[begin:], *loop.edges[:begin]))
        self.api.vehicle.add(name, f"r{name}", departPos="base", departSpeed="0")
        return name

    def interfere(self, gate: loopgate.Attached, now: int) -> None:
        """Do to those under the gate what their owner might."""
        get = self.api.vehicle
        slowed = self.slowed = self.slowed or {}
        for vehicle in [v for v, until in slowed.items() if now >= until]:
            del slowed[vehicle]
            if vehicle in get.getIDList():
                get.setSpeed(vehicle, -1)
        for what, every in EVERY_S.items():
            own = [v for v in gate.vehicles if not get.getRoadID(v).startswith(":")]
            if now % every or not own:
                continue
            vehicle = self.rng.choice(own)
            if what == "leave":
                gate.leave(vehicle)
            elif what == "remove":
                get.remove(vehicle)
            elif what == "slow":
                get.setSpeed(vehicle, self.rng.choice([2.0, 5.0, 20.0]))
                slowed[vehicle] = now + SLOW_S
            elif what == "stop":
                self._stop(vehicle)
            else:
                self._move(vehicle)

    def interfere_wildly(self, gate: loopgate.Attached, now: int) -> None:
        """Do what an owner rarely does."""
        get, rng = self.api.vehicle, self.rng
        slowed = self.slowed = self.slowed or {}
        inside = [v for v in gate.vehicles if get.getRoadID(v).startswith(":")]
        own = [v for v in gate.vehicles if v not in inside]
        standing = [v for v in own if get.getSpeed(v) == 0.0]
        due = {what for what, every in WILD_S.items() if now % every == _AFTER_S.get(what, 0)}
        if "junction" in due and own:
            junction = rng.choice([j for j in self.api.junction.getIDList() if not j.startswith(":")])
            get.moveToXY(rng.choice(own), "", 0, *self.api.junction.getPosition(junction), keepRoute=1)
        if "open" in due and self.closed:
            self.api.lane.setDisallowed(self.closed, [])
        if "close" in due and own:
            self.closed = get.getLaneID(rng.choice(own))
            self.api.lane.setDisallowed(self.closed, ["passenger"])
        if "brakes" in due and standing:
            get.setDecel(rng.choice(standing), rng.choice((2.5, 4.5, 6.0)))
        if "still" in due and inside:
            slowed[rng.choice(inside)] = now + SLOW_S
            get.setSpeed(next(reversed(slowed)), 0.0)
        if "target" in due and own:
            get.changeTarget(rng.choice(own), rng.choice(self.loops).edges[0])

    def _stop(self, vehicle: str) -> None:
        route, at = self.api.vehicle.getRoute(vehicle), self.api.vehicle.getRouteIndex(vehicle)
        edge = route[min(len(route) - 1, at + self.rng.randint(1, 3))]
        position_m = 0.6 * self.api.lane.getLength(f"{edge}_0")
        self.api.vehicle.setStop(vehicle, edge, pos=position_m, duration=STOP_S)

    def _move(self, vehicle: str) -> None:
        """Put it on a lane of its loop where nobody is, and where it can stop."""
        get = self.api.vehicle
        for edge in get.getRoute(vehicle)[get.getRouteIndex(vehicle) + 1 :]:
            lane = f"{edge}_0"
            if self.api.lane.getLastStepVehicleNumber(lane) == 0:
                get.moveTo(vehicle, lane, 0.4 * self.api.lane.getLength(lane))
                return


def run(
    backend: str,
    seed: int,
    duration_s: int,
    *,
    traffic: bool = True,
    words: Sequence[str] = (),
    wild: bool = False,
) -> dict[str, Any]:
    """Run one simulation; return the gate's figures, and how long it took."""
    began = time.perf_counter()
    api = importlib.import_module(backend)
    roads = RoadNetwork.open(NETWORK)
    loops = list(generate_loops(roads, 12, length_m=(500.0, 1500.0), seed=seed))
    edges = sorted(roads.edges)
    program = "sumo" if backend == "libsumo" else str(Path(sys.prefix) / "bin" / "sumo")
    options = ["--no-step-log", "--no-warnings", "--collision.check-junctions", "--seed", str(seed), *words]
    api.start([program, "-n", str(NETWORK), *options])
    world = World(api, loops, Random(seed))
    try:
        with loopgate.attach(api) as gate:
            for now in range(duration_s):
                if traffic:
                    world.fill(edges)
                if now == FIRST_S // 2:
                    for _ in range(ON_LOOPS // 2):
                        world.put()
                if now == FIRST_S:
                    gate.add(*(v for v in api.vehicle.getIDList() if v.startswith("v")))
                if now > FIRST_S and now % 5 == 0 and len(gate.vehicles) + len(gate.waiting) < ON_LOOPS:
                    gate.add(world.put())
                if now > FIRST_S:
                    world.interfere(gate, now)
                if now > FIRST_S and wild:
                    world.interfere_wildly(gate, now)
                api.simulationStep()
                gate.after_step()
    finally:
        api.close()
    return {**gate.summary, "wall_s": round(time.perf_counter() - began, 1)}


def main() -> int:
    """Run all seeds; return 1 if a run was not clean."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--backend", choices=("libsumo", "traci"), default="libsumo")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--sumo", default="", help="more options of SUMO")
    parser.add_argument("--hours", type=float, default=2.0)
    parser.add_argument("--first", type=int, default=1, help="first seed")
    parser.add_argument("--wild", action="store_true", help="interfere in more ways")
    given = parser.parse_args()
    clean = True
    shown = (
        "trespasses",
        "overruns",
        "collisions",
        "mended",
        "collisions_with_others",
        "changes",
        "left",
        "laps",
    )
    print("seed", *shown, "longest_wait_s", "wall_s")
    for seed in range(given.first, given.first + given.seeds):
        words, seconds = given.sumo.split(), int(given.hours * 3600)
        summary = run(given.backend, seed, seconds, words=words, wild=given.wild)
        figures = [*(summary[name] for name in shown), summary["longest_wait_s"], summary["wall_s"]]
        print(seed, *figures, flush=True)
        clean &= not any(summary[name] for name in shown[:3])
    return 0 if clean else 1


if __name__ == "__main__":
    sys.exit(main())
