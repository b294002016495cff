"""The five-by-five grid close to its limit: the gate, SUMO's rules and lights, and a bound.

    python analysis/limit.py --seeds 5 --step 0.5 --write
    python analysis/limit.py --seeds 5 --step 0.5 --drivers machine --write

drives the loops of ``throughput.py`` under four rules and five kinds of lights, the best of which is the
rival, and under the gate, at steps of one second or of half a one. The limit is a linear programme over the
flow on each loop: no vehicle drives faster than all by itself, each movement over a junction takes the
headway at which a queue is discharged, and of those that cross each other one takes its turn at a time. No
rule exceeds it by which movements that cross take turns; a rule by which single vehicles slip through between
those of another movement could.
"""

from __future__ import annotations

import argparse
import json
import runpy
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, product
from pathlib import Path
from typing import Any

import networkx as nx
import numpy as np
import pandas as pd
from alone import one_km
from scipy.optimize import linprog
from signals import CONTROLLERS, controlled
from throughput import GRID, LOOPS
from throughput_study import (
    LONGEST_WAIT,
    ROOT,
    RULE,
    VEHICLE_KM,
    WARMUP_S,
    Rule,
    Study,
    details,
    kilometres,
    markdown,
    parser,
    ratios,
    safety,
    simulate,
    waits,
    write_study,
)

from loopgate import Scenario
from loopgate.abstraction.itinerary import Itinerary
from loopgate.cli.terminal import show_progress
from loopgate.results import columns as c
from loopgate.simulation.assembly import assemble
from loopgate.simulation.run import simulate as simulate_one

HEADWAY_S, SPACE_M = {"human": 1.3, "machine": 0.5}, 7.5
"""Drivers follow each other over a junction at this time [s] and the time for this length [m] at their speed.

Each is measured at a green light, at steps of half a second; that of machines is their ``tau``.
"""

LIGHTS = {
    "fixed time": ("--tls.cycle.time=40",),
    "delay based": ("--tls.default-type=delay_based",),
}
"""A cycle of 40 s lets more through than 60 and 90 do, and both more than SUMO's NEMA."""

OURS = "certified, pressure"
_BUILD = runpy.run_path(str(ROOT / "networks" / "build.py"))
LIT = str(ROOT / "networks" / "grid5-actuated.net.xml")
ALONE_S = 1200.0
"""For how long the speed of each alone is measured."""


@dataclass(frozen=True, slots=True)
class Use:
    """How often the vehicles of each loop make a movement in a lap, how long it takes, whom it crosses."""

    headway_s: float
    begin: str
    end: str
    foes: frozenset[str]
    passes: Mapping[str, int]


def uses(itineraries: Mapping[str, Itinerary], drivers: str = "human") -> dict[str, Use]:
    """Return all movements over junctions that the loops make, by name."""
    passes: dict[str, dict[str, int]] = {}
    kinds: dict[str, tuple[float, str, str, frozenset[str]]] = {}
    for loop, itinerary in itineraries.items():
        for leg, after in zip(itinerary.legs, (*itinerary.legs[1:], itinerary.legs[0]), strict=True):
            for way in leg.crossings:
                kinds[way.id] = (
                    HEADWAY_S[drivers] + SPACE_M / way.speed_mps,
                    leg.state,
                    after.state,
                    way.foes,
                )
                by_loop = passes.setdefault(way.id, {})
                by_loop[loop] = by_loop.get(loop, 0) + 1
    return {way: Use(*kind, passes[way]) for way, kind in kinds.items()}


def exclusive(found: Mapping[str, Use]) -> Iterator[Sequence[str]]:
    """Yield sets of movements of which one takes its turn at a time.

    Those from one place, those into one, and those that all cross each other or leave the same place.
    """
    for key in ("begin", "end"):
        by_place: dict[str, list[str]] = {}
        for way, use in found.items():
            by_place.setdefault(getattr(use, key), []).append(way)
        yield from by_place.values()
    meet: nx.Graph[str] = nx.Graph()
    meet.add_nodes_from(found)
    for one, other in combinations(found, 2):
        if other in found[one].foes or found[one].begin == found[other].begin:
            meet.add_edge(one, other)
    yield from nx.find_cliques(meet)


def alone_mps(scenario: Scenario) -> dict[str, float]:
    """Return the mean speed on each loop of a vehicle of mean temper that is all by itself, lights off."""
    assembly = assemble(scenario)
    found = {}
    for start in assembly.starts:
        if start.loop.id not in found:
            kind = replace(start.type, attributes={**start.type.attributes, "speedDev": "0"})
            km = one_km(
                scenario, assembly.network.file, replace(start, demand=replace(start.demand, type=kind))
            )
            found[start.loop.id] = km * 1000 / scenario.duration_s
    return found


def limit_km(alone: Mapping[str, float], itineraries: Sequence[Itinerary], drivers: str = "human") -> float:
    """Return the most vehicle-km in an hour that vehicles on these itineraries can make, one each.

    `alone` is the speed on each loop that none exceeds in the mean [m/s].
    """
    by_loop = {itinerary.loop.id: itinerary for itinerary in itineraries}
    names = list(by_loop)
    column = {loop: k for k, loop in enumerate(names)}
    vehicles = np.array([sum(one.loop.id == loop for one in itineraries) for loop in names])
    found = uses(by_loop, drivers)
    turns = list(exclusive(found))
    taken = np.zeros((len(turns), len(names)))
    for row, ways in enumerate(turns):
        for way in ways:
            for loop, number in found[way].passes.items():
                taken[row, column[loop]] += number * found[way].headway_s
    metres = np.array([by_loop[loop].loop.length_m for loop in names])
    most = [(0.0, n * alone[loop] / m) for loop, n, m in zip(names, vehicles, metres, strict=True)]
    solved = linprog(-metres, A_ub=taken, b_ub=np.ones(len(turns)), bounds=most, method="highs")
    return 3.6 * float(metres @ solved.x)


def lit(name: str, folder: Path) -> str:
    """Build the streets of the grid with other lights; return the file."""
    file = folder / f"grid5-{name.replace(' ', '-').replace(',', '')}.net.xml"
    if not file.exists():
        words = [
            *_BUILD["GRID"],
            "--default-junction-type=traffic_light",
            *LIGHTS[name],
            f"--output-file={file}",
        ]
        subprocess.run([str(_BUILD["TOOLS"] / "netgenerate"), *words], check=True, capture_output=True)
    return str(file)


def as_given(step_s: float, drivers: str) -> dict[str, Any]:
    """Return what a scenario says of steps and drivers: humans are the default, and do not change its key."""
    return {"step_s": step_s} | ({} if drivers == "human" else {"drivers": drivers})


def study(step_s: float, folder: Path, drivers: str = "human") -> Study:
    """Return the study of the grid at a step: SUMO's rules, other lights, and the gate."""
    lights = [
        Rule(f"SUMO, {name}", {"network": lit(name, folder), "gate": "open"}, yardstick=True)
        for name in LIGHTS
    ]
    some = [rule for rule in GRID.rules if rule.yardstick or rule.name == OURS]
    lights += [Rule(f"SUMO, {name}", {}, yardstick=True) for name in CONTROLLERS]
    rules = [
        replace(rule, scenario={**rule.scenario, **as_given(step_s, drivers)})
        for rule in (*some[:-1], *lights, some[-1])
    ]
    name, title = f"limit-{step_s:g}", f"Five-by-five grid at steps of {step_s:g} s"
    if drivers != "human":
        name, title = f"{name}-{drivers}", f"{title}, {drivers} drivers"
    return Study(name, title, tuple(rules), (60, 140, 180, 240, 300, 400), GRID.loops)


def limits(runs: pd.DataFrame, folder: Path, common: Mapping[str, Any]) -> pd.DataFrame:
    """Return the limit by number of vehicles, and the shares of it that are reached."""
    network = str(GRID.rules[0].scenario["network"])
    ours, rivals = runs[runs[RULE] == OURS], runs[runs[RULE] != OURS]
    rows: dict[str, dict[str, str]] = {}
    speeds: dict[int, dict[str, float]] = {}
    for count, group in ours.groupby(c.VEHICLES):
        most = []
        for seed in group[c.SEED]:
            routes = str(folder / f"loops{seed}.rou.xml")
            scenario = Scenario(
                network=network, routes=routes, vehicles=int(str(count)), seed=int(seed), **common
            )
            if seed not in speeds:
                every = replace(scenario, vehicles=LOOPS, duration_s=ALONE_S, gate="open")
                speeds[seed] = alone_mps(every)
            lain = assemble(scenario).abstraction
            most += [limit_km(speeds[seed], lain.itineraries, scenario.drivers)] if lain else []
        limit = float(np.mean(most))
        best = rivals[rivals[c.VEHICLES] == count].groupby(RULE)[c.KM_PER_H].mean()
        column = rows.setdefault(str(count), {})
        column["limit [km]"] = f"{limit:.0f}"
        column["certified"] = f"{100 * group[c.KM_PER_H].mean() / limit:.0f} %"
        if len(best):
            column["best rival"] = (
                f"{100 * best.max() / limit:.0f} % ({str(best.idxmax()).removeprefix('SUMO, ')})"
            )
    return pd.DataFrame(rows).rename_axis("of the limit").reset_index()


def section(runs: pd.DataFrame, made: Study, folder: Path, common: Mapping[str, Any]) -> str:
    """Return the study's part of the page."""
    seeds, hours = runs[c.SEED].nunique(), runs[c.DURATION].max() / 3600
    return "\n\n".join(
        (
            f"## {made.title}",
            f"{len(runs)} runs of {hours:g} h, {seeds} seed{'s' * (seeds > 1)}.",
            VEHICLE_KM,
            markdown(kilometres(runs, made)),
            "Ratio to the best of the others with as many vehicles, seed by seed:",
            markdown(ratios(runs, made)),
            "The limit, and the share of it that is reached:",
            markdown(limits(runs, folder, common)),
            LONGEST_WAIT,
            markdown(waits(runs, made)),
            safety(runs),
        )
    )


def _by_sumo(made: Study) -> Study:
    return replace(made, rules=tuple(rule for rule in made.rules if "network" in rule.scenario))


def under_controllers(made: Study, given: argparse.Namespace, common: Mapping[str, Any]) -> pd.DataFrame:
    """Return rows like those of the study for the lights that are switched from outside of SUMO."""
    rows = []
    cases = list(product(CONTROLLERS, made.vehicles, range(1, given.seeds + 1)))
    with show_progress("controllers", total=len(cases)) as report:
        for number, (name, vehicles, seed) in enumerate(cases, 1):
            report(number)
            if given.vehicles and vehicles not in given.vehicles:
                continue
            if given.rules and not any(word in name for word in given.rules):
                continue
            scenario = Scenario(
                network=LIT,
                routes=str(given.out / made.name / f"loops{seed}.rou.xml"),
                vehicles=vehicles,
                seed=seed,
                gate="open",
                **common,
                duration_s=given.duration,
                warmup_s=WARMUP_S,
                on_deadlock="continue",
            )
            kept = given.out / made.name / f"{name.replace(' ', '-')}-{vehicles}-{seed}.json"
            if not kept.exists():
                with controlled(name):
                    kept.write_text(json.dumps(simulate_one(scenario)), encoding="utf-8")
            found = json.loads(kept.read_text(encoding="utf-8"))
            rows.append(
                {
                    RULE: f"SUMO, {name}",
                    c.SEED: seed,
                    c.VEHICLES: vehicles,
                    c.STATUS: c.STATUS_OK,
                    c.KM_PER_H: found["km_per_h"],
                    c.LAPS: found["laps"],
                    c.LAPLESS: found["vehicles_without_a_lap"],
                    c.DEADLOCKS: len(found["deadlocks"]),
                    c.COLLISIONS: found["collisions"],
                    c.TELEPORTS: found["teleports"],
                    c.AUDIT: c.NOT_GATED,
                    c.DURATION: given.duration,
                }
            )
    return pd.DataFrame(rows)


def main() -> None:
    """Run what is missing, print the tables, and renew the page if asked to."""
    words = parser(__doc__)
    words.add_argument("--step", type=float, default=1.0, help="of the simulation [s]")
    words.add_argument("--drivers", choices=list(HEADWAY_S), default="human", help="of all rules alike")
    given: argparse.Namespace = words.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    common = as_given(given.step, given.drivers)
    made = study(given.step, given.out, given.drivers)
    runs = pd.concat(
        [simulate(_by_sumo(made), given), under_controllers(made, given, common)], ignore_index=True
    )
    text = section(runs, made, given.out / made.name, common)
    print(text)
    every = f"{text}\n\nAll figures:\n\n{markdown(details(runs, made))}\n"
    (given.out / f"{made.name}.md").write_text(every, encoding="utf-8")
    if given.write:
        write_study(text, made.name)


if __name__ == "__main__":
    main()
