"""Standstills: what is told of made networks that lock up, beside what SUMO's positions say afterwards.

``python analysis/standstills.py --seeds 200`` drives as many small networks of every junction type under
SUMO's own rules, with up to twice the vehicles that they hold, for an hour. The oracle are the positions of
a run twice as long: whoever does not move again until its end. Beside it stand the deadlock detector in a
run, the film of positions as `read-fcd` plays it, and an attached gate without vehicles.

Two more answers come from SUMO alone. *Left alone*: the run is driven again to the time at which the
deadlock was told, all others are taken away, and whoever waits only for those that are left stands five
minutes on. The same a minute before, with those that had stopped for good by then, says whether the deadlock
was told late. *Leaders*: whom SUMO names as the near leader of a vehicle is among those for whom we say it
waits.
``--gated 100`` drives loops under the gate, with closures, timetables and breakdowns that end: no deadlock.
Runs that are done are kept, and a study may be ended at any time.
"""

from __future__ import annotations

import argparse
import json
import random
import tempfile
from collections import defaultdict
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path
from typing import Any

import libsumo
import numpy as np
from made_networks import netgenerate, roundabouts

import loopgate
from loopgate.network import RoadNetwork, generate_loops
from loopgate.simulation.fcd.film import Film
from loopgate.simulation.fcd.frames import SeenVehicle
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.watching.ahead import Ahead, Future, SimulatedAhead
from loopgate.simulation.watching.deadlock_detector import Deadlock, DeadlockDetector
from loopgate.simulation.watching.road_waits import RoadWaits, SimulatedRoad
from loopgate.traffic import libsumo_backend
from loopgate.traffic.base import Whereabouts
from loopgate.traffic.sumo import SumoTraffic

KINDS = ("priority", "right_before_left", "allway_stop", "traffic_light", "roundabouts")
HOUR_S, EVERY_S, FRAME_S, AFTER_S = 3600, 10, 5, 40.0
NEVER_S, SOON_S, ALONE_S = 10**9, 60, 300
NEAR_M = 3.0
"""A leader counts whose rear is nearer than this beyond the minimum gap [m]."""
MOVES_MPS = 0.05
"""Drivers creep up to their leaders for hours, some millimetres a second; that is no move [m/s]."""
MOVED_M = 1.0
"""Who has driven farther than this was free to go; who only creeps has not [m]."""
FIRST_SEED = 10000
"""Seeds before were looked at while the detector was made."""


def _chance(rng: random.Random, share: float) -> bool:
    return rng.random() < share


def made(seed: int, folder: Path) -> tuple[Path, str]:
    """Make a network of few junctions; return it with what it is."""
    rng, kind = random.Random(seed), KINDS[seed % len(KINDS)]
    lanes, left = rng.choice((1, 1, 2, 2, 3)), _chance(rng, 0.25)
    length, file = rng.choice((50, 80, 120)), folder / "net.net.xml"
    if kind == "roundabouts":
        roundabouts(file, lanes=min(lanes, 2), side=2)
        return file, f"{kind}, {min(lanes, 2)} lanes"
    shape = f"--grid --grid.number {rng.choice((2, 2, 3))} --grid.length {length}"
    if _chance(rng, 0.2):
        shape = f"--spider --spider.arm-number {rng.choice((3, 4, 5))} --spider.space-radius {length}"
        shape += f" --spider.circle-number {rng.choice((1, 2))}"
    elif _chance(rng, 0.7):
        shape += f" --grid.attach-length {length}"
    side = " --lefthand" if left else ""
    turns = " --no-turnarounds" if _chance(rng, 0.5) else ""
    options = f"--default-junction-type {kind} --default.lanenumber {lanes} --tls.allred.time 0"
    netgenerate(f"{shape} {options} --seed {seed}{side}{turns}", file)
    return file, f"{kind}, {lanes} lanes{', left' if left else ''}"


def demand(seed: int, network: RoadNetwork, file: Path) -> None:
    """Write trips over random edges: up to twice as many vehicles as there is room for."""
    rng = random.Random(seed)
    edges = sorted(network.edges)
    until_s = rng.choice((120, 300, 600))
    room = sum(network.lanes[one].length_m for one in network.lanes if not network.lanes[one].internal) / 7.5
    count, lane, speed = (
        int(min(700, rng.uniform(0.4, 2.0) * room)),
        rng.choice(("best", "random", "free")),
        "max",
    )
    lines = [f'<vType id="car" sigma="{rng.choice((0, 0.5))}"/><vType id="bus" length="12" maxSpeed="12"/>']
    buses = 0.15 if _chance(rng, 0.3) else 0.0
    for number, depart_s in enumerate(sorted(rng.uniform(0, until_s) for _ in range(count))):
        way = _way(rng, network, edges)
        kind = "bus" if _chance(rng, buses) else "car"
        lines.append(
            f'<vehicle id="v{number}" type="{kind}" depart="{depart_s:.0f}" departLane="{lane}" '
            f'departSpeed="{speed}"><route edges="{" ".join(way)}"/></vehicle>'
        )
    file.write_text(f"<routes>{''.join(lines)}</routes>", encoding="utf-8")


def _way(rng: random.Random, network: RoadNetwork, edges: Sequence[str]) -> list[str]:
    """Return a walk over some edges that does not turn round where it need not."""
    way = [rng.choice(edges)]
    for _ in range(rng.randint(4, 16)):
        onward = [one for one in network.outgoing(way[-1]) if one.direction != "t"] or network.outgoing(
            way[-1]
        )
        if not onward:
            break
        way.append(rng.choice(sorted({one.to_edge for one in onward})))
    return way


class OneHour(Ahead):
    """What a film of the hour shows beyond now: `ahead` looks farther."""

    def __init__(self, ahead: SimulatedAhead) -> None:
        super().__init__()
        self._ahead = ahead

    def look(self, *, ends: bool) -> None:
        """Look at the rest of the hour."""
        self._ahead.look(ends=ends)
        future = self._ahead.future
        self.future = Future(min(future.until_s, HOUR_S), future.moves_s)


class Watcher:
    """A detector with what it has told: which vehicles first when, and each deadlock."""

    def __init__(self, detector: DeadlockDetector, hindsight_s: float = NEVER_S) -> None:
        self.detector, self.hindsight_s = detector, hindsight_s
        self.told_s: dict[str, float] = {}
        self.found: list[Deadlock] = []

    def check(self, now_s: float) -> None:
        """Look, as a run does every ten seconds."""
        found = self.detector.check()
        self.found += [found] if found else []
        for vehicle in self.detector.held_up:
            self.told_s.setdefault(vehicle, now_s)


def drive(seed: int, folder: Path) -> dict[str, Any]:
    """Drive a network for two hours, watched for one; return what was told beside what is so."""
    net, what = made(seed, folder)
    network = RoadNetwork.open(net)
    demand(seed, network, folder / "d.rou.xml")
    words = ["sumo", "-n", str(net), "-r", str(folder / "d.rou.xml"), "--seed", str(seed)]
    words += ["--time-to-teleport", "-1", "--collision.action", "warn", "--collision.check-junctions", "true"]
    words += ["--no-step-log", "--no-warnings", "--ignore-route-errors"]
    libsumo.start(words)
    try:
        row, for_good, first = _watched(network)
    finally:
        libsumo.close()
    return {"seed": seed, "what": what, **row, **_left_alone(words, for_good, first, row["told"])}


def _watched(network: RoadNetwork) -> tuple[dict[str, Any], dict[str, int], frozenset[str]]:
    """Return what was told, when each vehicle stopped that stands for good, and who was told first."""
    traffic = SumoTraffic(libsumo, libsumo_backend.ERROR, yields=True, reads=libsumo_backend.READS)
    film = Film(network, float(FRAME_S))
    road = RoadWaits(network, SimulatedRoad(traffic), impatient_s=traffic.impatient_s())
    watchers = {
        "run": Watcher(DeadlockDetector(traffic, road, after_s=AFTER_S)),
        "read-fcd": Watcher(DeadlockDetector(film, RoadWaits(network, film), after_s=AFTER_S), AFTER_S),
    }
    at_m: dict[str, list[tuple[int, float]]] = defaultdict(list)
    now, first, leaders = 0, frozenset[str](), (0, 0)

    def advance() -> None:
        libsumo.simulationStep()
        traffic.look_at_clock()

    ahead = watchers["run"].detector.ahead = SimulatedAhead(traffic, advance)
    watchers["read-fcd"].detector.ahead = OneHour(ahead)
    with loopgate.attach(libsumo) as gate:
        while now < 2 * HOUR_S and libsumo.simulation.getMinExpectedNumber():
            libsumo.simulationStep()
            traffic.look_at_clock()
            now += 1
            if now <= HOUR_S:
                gate.after_step()
            if now % FRAME_S:
                continue
            here = traffic.whereabouts()
            for vehicle, metres in zip(here.vehicles, traffic.odometers(here.vehicles), strict=True):
                at_m[vehicle].append((now, metres))
            if now > HOUR_S:
                continue
            film.show(now - FRAME_S, _seen(here))
            if now % EVERY_S == 0:
                for watcher in watchers.values():
                    watcher.check(now)
                if not first and watchers["run"].found:
                    first = watchers["run"].detector.held_up
                    leaders = _leaders(road, watchers["run"].detector)
        attached = gate.summary["deadlocks"]
    last_s = {name: _last_move_s(rows) for name, rows in at_m.items()} if now >= 2 * HOUR_S else {}
    for_good = {name: last for name, last in last_s.items() if at_m[name][-1][0] == now and last <= HOUR_S}
    told = {name: _compare(one, for_good) for name, one in watchers.items()}
    told["attach"] = _compare_figures(attached, for_good)
    row = {
        "for_good": len(for_good),
        "until_s": max(for_good.values(), default=None),
        "leaders": leaders,
        "told": told,
    }
    return row, for_good, first


def _seen(here: Whereabouts) -> Iterator[SeenVehicle]:
    """Yield the vehicles as a frame of FCD output has them."""
    columns = here.positions_m.tolist(), here.speeds_mps.tolist()
    for name, lane, pos_m, speed_mps in zip(here.vehicles, here.lanes, *columns, strict=True):
        yield SeenVehicle(name, "", lane, round(pos_m, 2), round(speed_mps, 2), 0.0, 0.0, 0.0)


def _leaders(road: RoadWaits, detector: DeadlockDetector) -> tuple[int, int]:
    """Return for how many vehicles SUMO names a near leader, and for how many of them we name it too."""
    named = same = 0
    for vehicle in sorted(detector.held_up):
        leader, gap_m = libsumo.vehicle.getLeader(vehicle, NEAR_M) or ("", 0.0)
        if leader and gap_m <= NEAR_M:
            named += 1
            same += any(leader in some for some in road.of(vehicle, detector.standing_s(vehicle)))
    return named, same


def _left_alone(
    words: Sequence[str], for_good: dict[str, int], first: frozenset[str], told: dict[str, Any]
) -> dict[str, Any]:
    """Return what SUMO does with vehicles once all others are gone, and how late deadlocks were told.

    A deadlock told late had closed more than `SOON_S` before it was told: `within_s` says how long, in steps
    of `EVERY_S`.
    """
    result: dict[str, Any] = {}
    known: dict[int, int] = {}
    for name, one in told.items():
        if not one["deadlocks"]:
            continue
        told_s = round(min(found[2] for found in one["deadlocks"]))
        if name == "run":
            result["alone"] = len(first), _stand_alone(words, told_s, first)
        if told_s not in known:
            early_s = told_s - SOON_S
            while _stand_alone(words, early_s, {one for one, last in for_good.items() if last <= early_s}):
                early_s -= EVERY_S
            known[told_s] = told_s - early_s
        result.setdefault("within_s", {})[name] = known[told_s]
    return result


def _stand_alone(words: Sequence[str], at_s: int, names: Collection[str]) -> int:
    """Return how many of some vehicles stand five minutes on, once all others are gone.

    Who moves is taken away too.
    """
    if not names:
        return 0
    libsumo.start(list(words))
    vehicle = libsumo.vehicle
    try:
        for _ in range(at_s):
            libsumo.simulationStep()
        started_m = {name: vehicle.getDistance(name) for name in names}
        for second in range(ALONE_S):
            left = vehicle.getIDList()
            gone = [name for name in left if name not in started_m]
            if second % FRAME_S == 0:
                gone += [
                    n for n in left if n in started_m and vehicle.getDistance(n) - started_m[n] > MOVED_M
                ]
            for name in gone:
                vehicle.remove(name)
                started_m.pop(name, None)
            if not started_m:
                return 0
            libsumo.simulationStep()
        return len(started_m.keys() & set(vehicle.getIDList()))
    finally:
        libsumo.close()


def _last_move_s(rows: Sequence[tuple[int, float]]) -> int:
    """Return when a vehicle moved last, but for creeping [s]."""
    times, metres = np.array(rows, dtype=float).T
    moving = np.flatnonzero(np.diff(metres) > MOVES_MPS * FRAME_S)
    return int(times[moving[-1] + 1]) if len(moving) else int(times[0])


def _compare(one: Watcher, for_good: dict[str, int]) -> dict[str, Any]:
    false = [name for name, at_s in one.told_s.items() if for_good.get(name, NEVER_S) > at_s]
    missed = [name for name, last in for_good.items() if last <= HOUR_S - 300 and name not in one.told_s]
    known = [
        _figures(
            found.vehicles,
            min(found.noticed_at_s, found.closed_at_s + one.hindsight_s),
            found.closed_at_s,
            for_good,
        )
        for found in one.found
    ]
    return {"false": len(false), "missed": len(missed), "deadlocks": known}


def _compare_figures(found: Sequence[dict[str, Any]], for_good: dict[str, int]) -> dict[str, Any]:
    known = [_figures(one["vehicles"], one["noticed_at_s"], one["closed_at_s"], for_good) for one in found]
    false = {name for one in found for name in one["vehicles"] if name not in for_good}
    return {"false": len(false), "missed": int(bool(for_good) and not found), "deadlocks": known}


def _figures(
    names: Sequence[str], noticed_s: float, closed_s: float, for_good: dict[str, int]
) -> list[float]:
    """Return when the last of a circle moved last, when its closing was said to be, and when it was told."""
    return [max(for_good.get(name, NEVER_S) for name in names), closed_s, noticed_s]


def drive_gated(seed: int, folder: Path) -> dict[str, Any]:
    """Drive loops under the gate past closures, breakdowns and stops by timetable, all of which end."""
    rng = random.Random(seed)
    net = folder / "net.net.xml"
    kind, side, lanes = rng.choice(KINDS[:4]), rng.choice((3, 4)), rng.choice((1, 2))
    grid = f"--grid --grid.number {side} --grid.length {rng.choice((100, 150))} --seed {seed}"
    netgenerate(f"{grid} --default-junction-type {kind} --default.lanenumber {lanes}", net)
    network = RoadNetwork.open(net)
    loops = generate_loops(network, 8, seed=seed, length_m=(300.0, 1200.0))
    lines, count = [], rng.choice((12, 24, 40))
    for number, loop in enumerate(loops):
        stop = ""
        if lanes == 1 and _chance(rng, 0.5):
            edge = loop.edges[len(loop.edges) // 2]
            until = f'until="{rng.choice((200, 400, 700))}"' if _chance(rng, 0.5) else ""
            end_m = network.edge(edge).length_m * 0.6
            stop = (
                f'<stop lane="{edge}_0" endPos="{end_m:.1f}" duration="{rng.choice((5, 30, 90))}" {until}/>'
            )
        lines.append(f'<route id="r{number}" edges="{" ".join(loop.edges)}">{stop}</route>')
    lines += [f'<vehicle id="v{k}" route="r{k % len(loops)}" depart="0"/>' for k in range(count)]
    (folder / "r.rou.xml").write_text(f"<routes>{''.join(lines)}</routes>", encoding="utf-8")
    edges = sorted({edge for loop in loops for edge in loop.edges})
    incidents = [
        f'[[closures]]\nedge = "{edge}"\nfrom = {rng.randint(0, 300)}\nto = {rng.randint(600, 1500)}\n'
        for edge in rng.sample(edges, 2)
    ]
    incidents += [
        f'[[breakdowns]]\nvehicle = "v{k}"\nfrom = {rng.randint(60, 300)}\nto = {rng.randint(600, 1500)}\n'
        for k in rng.sample(range(1, count + 1), 2)
    ]
    (folder / "i.toml").write_text("".join(incidents), encoding="utf-8")
    scenario = Scenario(
        network=str(net),
        routes=str(folder / "r.rou.xml"),
        incidents=str(folder / "i.toml"),
        vehicles=count,
        duration_s=1800.0,
        standing=rng.choice(("contain", "wait")),
        on_deadlock="continue",
        seed=seed,
    )
    summary = simulate(scenario)
    return {"seed": seed, "outcome": summary["outcome"], "deadlocks": len(summary["deadlocks"])}


def rows(out: Path, name: str, seeds: range) -> Iterator[dict[str, Any]]:
    """Yield the row of each seed; make those that are missing."""
    file = out / f"{name}.jsonl"
    known = (
        {row["seed"]: row for row in map(json.loads, file.read_text().splitlines())} if file.exists() else {}
    )
    for seed in seeds:
        if seed not in known:
            with tempfile.TemporaryDirectory() as folder:
                row = (drive if name == "open" else drive_gated)(seed, Path(folder))
            with file.open("a") as table:
                table.write(json.dumps(row) + "\n")
            known[seed] = row
        yield known[seed]


def report(found: Sequence[dict[str, Any]]) -> None:
    """Print what was missed, what was false, how soon the rest was told, and what SUMO says to it."""
    locked = [row for row in found if row["for_good"] > 1]
    vehicles = sum(row["for_good"] for row in locked)
    print(f"{len(found)} runs; {len(locked)} lock up for good, with {vehicles} vehicles")
    for name in ("run", "read-fcd", "attach"):
        told = {row["seed"]: row["told"][name] for row in found}
        missed = [row["seed"] for row in locked if not told[row["seed"]]["deadlocks"]]
        false = [seed for seed, one in told.items() if one["false"]]
        within = {row["seed"]: row["within_s"][name] for row in found if name in row.get("within_s", {})}
        late = {seed: seconds for seed, seconds in within.items() if seconds > SOON_S}
        print(
            f"{name}: runs missed {len(missed)} {missed}, with vehicles told falsely {len(false)} {false}; "
            f"vehicles missed {sum(one['missed'] for one in told.values())}, "
            f"told falsely {sum(one['false'] for one in told.values())}; "
            f"told within {SOON_S} s {len(within) - len(late)} of {len(within)}, the others within {late} s"
        )
    alone = [row["alone"] for row in found if "alone" in row]
    print(f"left alone: of {sum(one[0] for one in alone)} told first {sum(one[1] for one in alone)} stand on")
    named = [row["leaders"] for row in found]
    print(
        f"leaders: of {sum(one[0] for one in named)} that SUMO names {sum(one[1] for one in named)} the same"
    )


def main() -> None:
    """Drive what is missing, and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", type=int, default=0, help="number of runs under SUMO's own rules")
    parser.add_argument("--gated", type=int, default=0, help="number of gated runs")
    parser.add_argument("--first", type=int, default=FIRST_SEED)
    parser.add_argument("--out", type=Path, default=Path("out/standstills"))
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    if given.seeds:
        report([*rows(given.out, "open", range(given.first, given.first + given.seeds))])
    if given.gated:
        gated = [*rows(given.out, "gated", range(given.first, given.first + given.gated))]
        false = [row["seed"] for row in gated if row["deadlocks"]]
        print(f"{len(gated)} gated runs; deadlocks told in {len(false)} {false}")


if __name__ == "__main__":
    main()
