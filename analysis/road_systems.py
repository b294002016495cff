"""Small roads with capacity, every configuration of them, gate by gate, against the exact answer.

    python analysis/road_systems.py                 # systems of up to 2,500 configurations: a minute or two
    python analysis/road_systems.py --all           # up to 50,000, and three of up to a million; resumable

Rings, rings that share a place, rings with commuters, figure eights, grids of streets and roundabouts; places
that hold 1, 2 or 3, or where short ones hold 1 and the others 2; all numbers of vehicles for which there is a
start from which somebody can always move. Each gate is asked about every move in every configuration that it
lets come about. A row per system and gate goes to a CSV file; what is printed adds up the rows.
"""

from __future__ import annotations

import argparse
import csv
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd
from small_roads import (
    Roads,
    commuters,
    figure_eight,
    one_way_grid,
    ring,
    road_system,
    roundabout,
    two_rings,
    two_way_grid,
)

from loopgate.cli.terminal import show_progress
from loopgate.errors import GateError, SystemModelError
from loopgate.gates import make_gate
from loopgate.gates.certified import CertifiedGate
from loopgate.model import System
from loopgate.research.state_space import ExplorationLimitError, StateSpace, verify_space

FAMILIES: tuple[Roads, ...] = (
    *(ring(3), ring(5), two_rings(2), two_rings(3), two_rings(4), commuters(2), commuters(3)),
    *(figure_eight(2), figure_eight(3), figure_eight(4), one_way_grid(), two_way_grid()),
    *(roundabout(3), roundabout(4)),
)
CAPACITIES = ("1", "2", "3", "1 and 2")
GATES = (
    "open",
    "collision",
    "banker",
    "algorithm2",
    "certified:promise=everyone",
    "certified:promise=somebody",
)
LARGE = (
    (one_way_grid(), "2", 10),
    (two_rings(4), "2", 12),
    (roundabout(3), "2", 7),
)
"""Systems with several hundred thousand configurations each."""
MOST_VEHICLES = 16
MOST_FOR_ALL_GATES = 20_000
"""Beyond so many configurations only `IN_LARGE` is asked: the exact stage takes a millisecond for each."""
IN_LARGE = ("open", "algorithm2", "certified:promise=somebody")
DEFAULT_LIMIT, ALL_LIMIT, LARGE_LIMIT = 2_500, 50_000, 1_000_000
STARTS = 30
FIGURES = (
    *("configurations", "decisions", "safe", "safe_admitted", "unsafe_admitted", "stuck", "deadlocks"),
    *("starving", "budget_stops", "starts_refused", "live_starts_refused", "reachable_live"),
)
COLUMNS = (
    *(
        "system",
        "capacity",
        "vehicles",
        "start",
        "reachable",
        "locked",
        "somebody",
        "everyone",
        "auto",
        "gate",
    ),
    *("judge", *FIGURES, "kind", "moves", "where", "seconds"),
)


@dataclass(frozen=True)
class Case:
    """A system with a start, and everything that can be reached from it."""

    roads: Roads
    capacity: str
    vehicles: int
    start: str
    space: StateSpace


def capacity_of(roads: Roads, capacity: str) -> int | Callable[[str], int]:
    """Return the capacity by place."""
    return int(capacity) if capacity.isdigit() else lambda place: 1 if place in roads.narrow else 2


def find_case(roads: Roads, capacity: str, vehicles: int, limit: int) -> Case | None:
    """Return the system with the best of some starts, None if none is live or all systems are too large.

    Best is a start from which everyone can go on and that the chain rule takes, then one from which everyone
    can, then one from which somebody can.
    """
    best: tuple[int, Case] | None = None
    for seed in (None, *range(STARTS)):
        try:
            system = road_system(roads, vehicles, capacity_of(roads, capacity), seed=seed)
            space = StateSpace(system, limit=limit)
        except SystemModelError:
            continue
        except ExplorationLimitError:
            return None
        if not space.somebody[0]:
            continue
        rank = int(space.live[0]) + int(bool(space.live[0]) and takes(system))
        case = Case(roads, capacity, vehicles, "even" if seed is None else f"seed {seed}", space)
        if best is None or rank > best[0]:
            best = rank, case
        if best[0] == 2:  # noqa: PLR2004 - it does not get better
            break
    return best and best[1]


def takes(system: System) -> bool:
    """Return whether the chain rule takes the start."""
    try:
        CertifiedGate(system, promise="somebody")
    except GateError:
        return False
    return True


def promise_by_default(system: System) -> str:
    """Return what `certified` promises when nothing is asked of it."""
    try:
        return CertifiedGate(system).promise
    except GateError:
        return "refused"


def rows(case: Case) -> Iterator[dict[str, Any]]:
    """Check the gates on one system."""
    space = case.space
    system = space.system
    head = {
        "system": case.roads.name,
        "capacity": case.capacity,
        "vehicles": case.vehicles,
        "start": case.start,
        "reachable": space.count,
        "locked": int(space.locked.sum()),
        "somebody": int(space.somebody.sum()),
        "everyone": int(space.live.sum()),
        "auto": promise_by_default(system),
    }
    for gate in GATES:
        if space.count > MOST_FOR_ALL_GATES and gate not in IN_LARGE:
            continue
        promise = gate.partition("promise=")[2] or ("everyone" if space.live[0] else "somebody")
        began = time.perf_counter()
        found = verify_space(space, partial(make_gate, gate), promise=promise)
        figures = found.as_dict()
        example = found.counterexample
        yield {
            **head,
            "gate": gate,
            "judge": found.judge,
            **{name: figures[name] for name in FIGURES},
            "kind": example.kind if example else "",
            "moves": " ".join(example.moves) if example else "",
            "where": " ".join(example.configuration) if example else "",
            "seconds": round(time.perf_counter() - began, 3),
        }


def study(file: Path, limit: int, most: int, *, large: bool) -> pd.DataFrame:
    """Check all systems of up to `limit` configurations, and the large ones, without rows in `file` yet."""
    file.parent.mkdir(parents=True, exist_ok=True)
    done: set[tuple[str, str, int]] = set()
    if file.exists():
        with file.open(encoding="utf-8", newline="") as stream:
            done = {(r["system"], r["capacity"], int(r["vehicles"])) for r in csv.DictReader(stream)}
    todo = [
        (roads, capacity, vehicles, limit)
        for roads in FAMILIES
        for capacity in CAPACITIES
        for vehicles in range(2, most + 1)
    ]
    todo += [(*system, LARGE_LIMIT) for system in LARGE] if large else []
    todo = [system for system in todo if (system[0].name, *system[1:3]) not in done]
    with show_progress("systems", total=len(todo)) as report, file.open("a", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, COLUMNS, lineterminator="\n")
        if not done:
            writer.writeheader()
        for number, system in enumerate(todo):
            report(number)
            case = find_case(*system)
            if case is not None:
                writer.writerows(list(rows(case)))  # all rows of a system or, if stopped, none
                stream.flush()
    return pd.read_csv(file, keep_default_na=False)


def by_system(found: pd.DataFrame) -> pd.DataFrame:
    """Add up the rows of each system, capacity and gate over the numbers of vehicles."""
    keys = ["system", "capacity", "gate"]
    vehicles = found.groupby(keys, sort=False)["vehicles"].agg(lambda v: f"{v.min()}-{v.max()}")
    return vehicles.to_frame().join(_sums(found, keys)).reset_index()


def by_gate(found: pd.DataFrame) -> pd.DataFrame:
    """Add up the rows of each capacity and gate over the systems."""
    return _sums(found, ["capacity", "gate"]).reset_index()


def _sums(found: pd.DataFrame, keys: list[str]) -> pd.DataFrame:
    groups = found.groupby(keys, sort=False)
    sums = groups[["configurations", "decisions", "stuck", "unsafe_admitted", "deadlocks", "starving"]].sum()
    sums.insert(0, "systems", groups.size())
    sums["refused"] = groups["starts_refused"].sum()
    safe = groups[["safe", "safe_admitted"]].sum()
    sums["admits"] = [
        f"{100 * a / s:.2f} %" if s else "" for a, s in zip(safe["safe_admitted"], safe["safe"], strict=True)
    ]
    return sums.rename(columns={"unsafe_admitted": "unsafe"})


def findings(found: pd.DataFrame) -> list[str]:
    """Say in words what the rows show, and the smallest systems on which a gate fails."""
    one = found.drop_duplicates(["system", "capacity", "vehicles"])
    wide = one[one["capacity"].isin(["2", "3"])]
    equal = (wide["somebody"] == wide["reachable"] - wide["locked"]).sum()
    default = ", ".join(f"{count} {name}" for name, count in one["auto"].value_counts().items())
    claim = "whatever is not a circular wait lets somebody move for ever"
    lines = [
        f"{len(one)} systems, {one['reachable'].sum()} configurations, {found['decisions'].sum()} decisions",
        f"places that hold two or more: on {equal} of {len(wide)} systems {claim}",
        f"certified promises by default: {default}",
    ]
    for gate in GATES:
        mine = found[found["gate"] == gate]
        for kind, column in (("unsafe", "unsafe_admitted"), ("stuck", "stuck")):
            bad = mine[mine[column] > 0]
            if len(bad) and gate not in {"open", "banker"}:
                least = bad.sort_values(["vehicles", "reachable"], kind="stable").iloc[0]
                lines.append(
                    f"{gate}: {kind} on {len(bad)} of {len(mine)} systems, the smallest {least['system']}, "
                    f"capacity {least['capacity']}, {least['vehicles']} vehicles, start {least['start']}: "
                    f"after {least['moves'] or 'no move'} they stand in {least['where']}"
                )
    return lines


def main() -> None:
    """Run the study."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--limit", type=int, help=f"most configurations of a system (default {DEFAULT_LIMIT})"
    )
    parser.add_argument(
        "--vehicles", type=int, default=MOST_VEHICLES, help="most vehicles (default %(default)s)"
    )
    parser.add_argument("--all", action="store_true", help=f"up to {ALL_LIMIT}, and some large ones")
    parser.add_argument("--systems", action="store_true", help="print a line for each system, not only sums")
    parser.add_argument("-o", "--output", type=Path, help="CSV file (default out/road-systems-LIMIT.csv)")
    arguments = parser.parse_args()
    limit: int = arguments.limit or (ALL_LIMIT if arguments.all else DEFAULT_LIMIT)
    file = arguments.output or Path(f"out/road-systems-{limit}.csv")
    found = study(file, limit, arguments.vehicles, large=arguments.all)
    table = by_system(found) if arguments.systems or arguments.all else by_gate(found)
    with pd.option_context("display.max_rows", None, "display.width", 200):
        print(table.to_string(index=False))
    print(*findings(found), f"rows in {file}", sep="\n")
    certified = found[found["gate"].str.startswith("certified")]
    broken = certified[["unsafe_admitted", "stuck", "deadlocks"]].to_numpy().sum()
    sys.exit(f"certified broke its promise {broken} times" if broken else 0)


if __name__ == "__main__":
    main()
