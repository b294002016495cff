"""Vehicles that join and leave a simulation of somebody else's, who stops, slows, moves and removes them.

Twenty vehicles on loops among seventy-five ordinary ones: nobody under the gate collides with another, goes
where it was not let, or runs through its line. Usage: python analysis/attached.py --help
"""

from __future__ import annotations

import argparse
import importlib
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from random import Random
from typing import Any

import loopgate
from loopgate.model import StateId
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

WILD_S = {
    "junction": 97,
    "close": 131,
    "open": 131,
    "brakes": 29,
    "still": 83,
    "target": 149,
    "break": 163,
    "block": 227,
    "free": 59,
}
"""The same with ``--wild``: put into a junction, a street closed and opened again, other brakes for one that
stands, speed 0 in a junction, led to another end; stands and is named, a street is named, one of these is
free again."""

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
    blocked: list[str] = field(default_factory=list)
    """What the gate is told of that stands."""

    def fill(self, edges: list[str]) -> None:
        """Keep up the number of ordinary vehicles."""
        get = self.api.vehicle
        ordinary = sum(1 for name in get.getIDList() if name.startswith("o"))
        for _ in range(min(3, ORDINARY - ordinary)):
            start, end = self.rng.sample([e for e in edges if e != self.closed.rpartition("_")[0]], 2)
            route = self.api.simulation.findRoute(start, end).edges
            if len(route) < 2:  # noqa: PLR2004  it has to drive somewhere
                continue
            self.made += 1
            self.api.route.add(f"ro{self.made}", route)
            get.add(f"o{self.made}", f"ro{self.made}", departPos="base", departSpeed="0")

    def put(self) -> str:
        """Let another vehicle depart on some loop; return its name."""
        self.made += 1
        name = f"v{self.made}"
        loop = self.rng.choice([one for one in self.loops if self.closed.rpartition("_")[0] not in one.edges])
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
        present = [v for v in gate.vehicles if v in get.getIDList()]
        inside = [v for v in present if get.getRoadID(v).startswith(":")]
        own = [v for v in present if v not in inside]
        standing = [v for v in own if get.getSpeed(v) == 0.0]
        due = {what for what, every in WILD_S.items() if now % every == _AFTER_S.get(what, 0)}
        if "junction" in due and own:
            vehicle = rng.choice(own)
            self._put_into_junction(vehicle)
        if "open" in due and self.closed:
            self.api.lane.setDisallowed(self.closed, [])
            self.closed = ""
        if "close" in due and own:
            self.closed = get.getLaneID(rng.choice(own))
            self.api.lane.setDisallowed(self.closed, ["passenger"])
        if "brakes" in due and standing:
            get.setDecel(rng.choice(standing), rng.choice((2.5, 4.5, 6.0)))
        if "still" in due and inside:
            slowed[rng.choice(inside)] = now + SLOW_S
            get.setSpeed(next(reversed(slowed)), 0.0)
        if "target" in due and own:
            self._do(get.changeTarget, rng.choice(own), rng.choice(self.loops).edges[0])
        self._say_what_stands(gate, due, own)

    def _put_into_junction(self, vehicle: str) -> None:
        """Put it into the junction ahead, if nobody is there or about to be: two cannot be in one spot."""
        api = self.api
        junction = api.edge.getToJunction(api.vehicle.getRoadID(vehicle))
        lanes = [lane for lane in api.lane.getIDList() if lane.startswith(f":{junction}_")]
        lanes += [f"{edge}_0" for edge in api.junction.getIncomingEdges(junction) if not edge.startswith(":")]
        there = [v for lane in lanes for v in api.lane.getLastStepVehicleIDs(lane) if v != vehicle]
        if not any(api.vehicle.getSpeed(v) > 0.0 or api.vehicle.getRoadID(v)[0] == ":" for v in there):
            x, y = api.junction.getPosition(junction)
            self._do(api.vehicle.moveToXY, vehicle, "", 0, x, y, keepRoute=1)

    def _say_what_stands(self, gate: loopgate.Attached, due: set[str], own: list[str]) -> None:
        """Let a vehicle break down, close a street, end one of these; and tell the gate each time."""
        get, rng = self.api.vehicle, self.rng
        present = {*gate.vehicles, *gate.waiting}
        self.blocked = [one for one in self.blocked if one[0] != "v" or one in present]
        if "break" in due and own:
            self.blocked.append(rng.choice([v for v in own if v not in self.blocked] or own))
            get.setSpeed(self.blocked[-1], 0.0)
            gate.block(self.blocked[-1])
        if "block" in due:
            self.blocked.append(rng.choice(rng.choice(self.loops).edges))
            gate.block(self.blocked[-1])
        if "free" in due and self.blocked:
            over = self.blocked.pop(rng.randrange(len(self.blocked)))
            self.blocked = [one for one in self.blocked if one != over]
            gate.free(over)
            if over in get.getIDList():
                get.setSpeed(over, -1)

    def _do(self, act: Callable[..., None], *args: object, **named: object) -> None:
        """Do something that SUMO may refuse, as a stop on a lane that is closed."""
        with suppress(self.api.TraCIException):
            act(*args, **named)

    def _stop(self, vehicle: str) -> None:
        route, at = self.api.vehicle.getRoute(vehicle), self.api.vehicle.getRouteIndex(vehicle)
        edge = route[min(len(route) - 1, at + self.rng.randint(1, 3))]
        position_m = 0.6 * self.api.lane.getLength(f"{edge}_0")
        self._do(self.api.vehicle.setStop, vehicle, edge, pos=position_m, duration=STOP_S)

    def _move(self, vehicle: str) -> None:
        """Put it on a lane of its loop where nobody is, and where it can stop."""
        get = self.api.vehicle
        for edge in get.getRoute(vehicle)[get.getRouteIndex(vehicle) + 1 :]:
            lane = f"{edge}_0"
            if self.api.lane.getLastStepVehicleNumber(lane) == 0:
                self._do(get.moveTo, vehicle, lane, 0.4 * self.api.lane.getLength(lane))
                return


def run(
    backend: str,
    seed: int,
    duration_s: int,
    *,
    traffic: bool = True,
    words: Sequence[str] = (),
    wild: bool = False,
    **rules: Any,  # noqa: ANN401  of several types
) -> dict[str, Any]:
    """Run one simulation; return the gate's figures, and how long it took.

    `rules`: gate and negotiation, as in `loopgate.attach`.
    """
    began = time.perf_counter()
    api = importlib.import_module(backend)
    roads = RoadNetwork.open(NETWORK)
    loops = list(generate_loops(roads, 12, length_m=(500.0, 1500.0), seed=seed))
    edges = sorted(roads.edges)
    program = "sumo" if backend == "libsumo" else str(Path(sys.prefix) / "bin" / "sumo")
    options = ["--no-step-log", "--no-warnings", "--collision.check-junctions", "--seed", str(seed), *words]
    if wild:  # else SUMO ends where a vehicle is to depart onto a street that has been closed
        options.append("--ignore-route-errors")
    api.start([program, "-n", str(NETWORK), *options])
    world = World(api, loops, Random(seed))
    errors = misordered = 0
    try:
        with loopgate.attach(api, **rules) as gate:
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
                errors += count_errors(gate, f"seed {seed}, {now} s")
                misordered += count_misordered(api, gate)
    finally:
        api.close()
    counted = {"errors": errors, "misordered": misordered}
    return {**gate.summary, **counted, "wall_s": round(time.perf_counter() - began, 1)}


def count_errors(gate: loopgate.Attached, when: str) -> int:
    """Let the gate act after a step; return 1 if it raised an error, which is printed."""
    try:
        gate.after_step()
    except Exception as error:  # noqa: BLE001  whatever leaves it is counted
        print(f"{when}: {type(error).__name__}: {error}", file=sys.stderr)
        return 1
    return 0


def count_misordered(api: Any, gate: loopgate.Attached) -> int:  # noqa: ANN401  libsumo or traci
    """Return how many vehicles are ahead of the next one on their lane on the road, but not in the books."""
    fleet = gate._fleet  # noqa: SLF001  its books are what is looked at
    there = set(api.vehicle.getIDList())
    on_lanes: dict[tuple[StateId, str], list[tuple[float, str]]] = {}
    for name, diary in fleet.diaries.items():
        if name in there and diary.vehicle.is_settled():
            key = diary.drawn(diary.vehicle.granted).state, api.vehicle.getLaneID(name)
            on_lanes.setdefault(key, []).append((-api.vehicle.getLanePosition(name), name))
    wrong = 0
    for (place, _), found in on_lanes.items():
        line = [diary.vehicle.name for diary in fleet.leads.line(place)]
        booked = [line.index(vehicle) for _, vehicle in sorted(found)]
        wrong += sum(one > other for one, other in pairwise(booked))
    return wrong


def main() -> int:
    """Run all seeds; return 1 if a run was not clean."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--backend", choices=("libsumo", "traci"), default="libsumo")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--sumo", default="", help="more options of SUMO")
    parser.add_argument("--hours", type=float, default=2.0)
    parser.add_argument("--first", type=int, default=1, help="first seed")
    parser.add_argument("--wild", action="store_true", help="interfere in more ways")
    parser.add_argument("--gate", default="certified")
    parser.add_argument("--negotiation", default="pressure")
    given = parser.parse_args()
    rules = {"gate": given.gate, "negotiation": given.negotiation}
    clean = True
    shown = (
        "trespasses",
        "overruns",
        "collisions",
        "errors",
        "misordered",
        "mended",
        "collisions_with_others",
        "changes",
        "left",
        "laps",
    )
    print("seed", *shown, "longest_wait_s", "wall_s")
    for seed in range(given.first, given.first + given.seeds):
        words, seconds = given.sumo.split(), int(given.hours * 3600)
        summary = run(given.backend, seed, seconds, words=words, wild=given.wild, **rules)
        figures = [*(summary[name] for name in shown), summary["longest_wait_s"], summary["wall_s"]]
        print(seed, *figures, flush=True)
        clean &= not any(summary[name] for name in shown[:5])
    return 0 if clean else 1


if __name__ == "__main__":
    sys.exit(main())
