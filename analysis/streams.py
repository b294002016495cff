"""Roundabouts, ramps, lane drops and weaving under the gate, beside SUMO's rules: who arrives, and delays.

``python analysis/streams.py`` drives made roundabouts, drawn by a seed from all with radius 8 to 50 m, one to
three lanes and three to six arms, two in a row, one with a slip lane, and motorways with ramps. It asks each
for 0.5, 1 and 1.5 times what SUMO lets through where far too many come. Trips depart for ten minutes and a
run ends five minutes later; those under way then count with what they have lost so far. Runs that are done
are kept in ``out/streams``.

``--write`` keeps a row for each run in ``analysis/tables/streams.csv``, beside those of other runs that are
there, and renews the table in ``docs/studies/throughput.md``; ``--table`` renews the page from that file.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import permutations, product
from math import pi
from pathlib import Path
from random import Random
from typing import Any, Final

import pandas as pd
from any_traffic import config
from frame_table import frame_table
from made_networks import lane_drop, off_ramp, on_ramp, roundabouts_in_a_row, weaving
from rich.console import Console
from throughput_study import in_place_of, markdown, with_half, write_section

from loopgate import Scenario
from loopgate.cli.terminal import show_progress
from loopgate.simulation.run import simulate

ROOT = Path(__file__).resolve().parents[1]
KEPT = ROOT / "analysis" / "tables" / "streams.csv"
SECTION = "streams"
DEPARTING_S, DURATION_S = 600.0, 900.0
TIMES: Final = (0.5, 1.0, 1.5)
RULES: Final[dict[str, dict[str, Any]]] = {
    "SUMO": {"gate": "open", "lights": "off"},
    "gate": {"gate": "certified", "lights": "off", "positions": True},
}
SUMO, GATE = RULES
FAR_TOO_MANY: Final = 1.0
"""Vehicles that depart in a second on each way in, to learn what SUMO lets through."""

Way = tuple[str, str, float]
"""From which edge to which, and which share of all."""


@dataclass(frozen=True, slots=True)
class Kind:
    """A network to make, and what is driven on it.

    Attributes
    ----------
    name, group
        Of the row, and of the kind of road.
    make
        Writes the network.
    ways
        From where to where, with shares that add up to 1.
    """

    name: str
    group: str
    make: Callable[[Path], Path]
    ways: tuple[Way, ...]


def roundabout(radius_m: float, lanes: int, arms: int, *, count: int = 1, slip: bool = False) -> Kind:
    """Return one or two roundabouts, with trips from each end to each other."""
    where = [(one, k) for one in range(count) for k in range(arms) if not _inner(one, k, arms, count)]
    ins, outs = [], []
    for end, (one, k) in enumerate(where):
        node = f"s{k}" if slip and not one and k in {1, 2} else f"r{one}.{k}"
        ins.append(f"E{end}-{node}")
        outs.append(f"{node}-E{end}")
    pairs = list(permutations(range(len(where)), 2))
    ways = tuple((ins[a], outs[b], 1.0 / len(pairs)) for a, b in pairs)
    more = ", two in a row" * (count > 1) + ", slip lane" * slip
    name = f"radius {radius_m:g} m, {lanes} lane{'s' * (lanes > 1)}, {arms} arms{more}"

    def make(file: Path) -> Path:
        return roundabouts_in_a_row(file, radius_m=radius_m, lanes=lanes, arms=arms, count=count, slip=slip)

    return Kind(name, "roundabout", make, ways)


def _inner(one: int, k: int, arms: int, count: int) -> bool:
    """Return whether an arm leads to the next roundabout or the one before."""
    return (k == 0 and one + 1 < count) or (2 * k == arms and one > 0)


def _merging(name: str, make: Callable[[Path], Path], share: float) -> Kind:
    return Kind(name, "on-ramp", make, (("A-B", "B-C", 1.0 - share), ("R-B", "B-C", share)))


def roads() -> list[Kind]:
    """Return the kinds that are no roundabouts."""
    weave = (
        *(("A-B", "C-D", 0.5), ("A-B", "C-S", 0.2)),
        *(("R-B", "C-D", 0.2), ("R-B", "C-S", 0.1)),
    )
    leave = (("A-B", "B-C", 0.75), ("A-B", "B-R", 0.25))
    through = (("A-B", "B-C", 1.0),)
    return [
        _merging("1 lane and ramp, no lane for merging", lambda f: on_ramp(f, lanes=1, merging_m=0.0), 0.5),
        _merging("1 lane, 150 m for merging", lambda f: on_ramp(f, lanes=1, merging_m=150.0), 0.4),
        _merging("2 lanes, 200 m for merging", lambda f: on_ramp(f, lanes=2, merging_m=200.0), 0.3),
        Kind("2 lanes", "off-ramp", lambda f: off_ramp(f, lanes=2), leave),
        Kind("2 to 1, 50 km/h", "lane drop", lambda f: lane_drop(f, lanes=2, speed_mps=13.9), through),
        Kind("3 to 2, 120 km/h", "lane drop", lambda f: lane_drop(f, lanes=3, speed_mps=33.3), through),
        Kind("2 lanes, 200 m", "weaving", lambda f: weaving(f, lanes=2, length_m=200.0), weave),
        Kind("2 lanes, 400 m", "weaving", lambda f: weaving(f, lanes=2, length_m=400.0), weave),
    ]


def drawn(count: int, seed: int) -> list[Kind]:
    """Return so many roundabouts, drawn by a seed from those that can be built."""
    every = [
        (radius_m, lanes, arms)
        for radius_m, lanes, arms in product(
            (8.0, 12.0, 16.0, 20.0, 28.0, 35.0, 50.0), (1, 2, 3), (3, 4, 5, 6)
        )
        if radius_m >= 4.0 + 4.0 * lanes and 2.0 * pi * radius_m / arms >= 10.0 + 3.2 * lanes
    ]
    return [roundabout(*one) for one in sorted(Random(seed).sample(every, count))]


def kinds(given: argparse.Namespace) -> list[Kind]:
    """Return all networks of the study."""
    special = [
        roundabout(20.0, 1, 4, count=2),
        roundabout(28.0, 2, 4, count=2),
        roundabout(20.0, 1, 4, slip=True),
    ]
    found = [*drawn(given.draw, given.drawn_by), *special, *roads()]
    return [kind for kind in found if not given.only or any(word in _called(kind) for word in given.only)]


def _called(kind: Kind) -> str:
    return f"{kind.group}, {kind.name}"


def write_trips(ways: Sequence[Way], per_s: float, seed: int, file: Path) -> Path:
    """Write trips that depart at random times."""
    rng, now_s, lines = Random(seed), 0.0, ["<routes>", '<vType id="car" vClass="passenger"/>']
    shares = [share for _, _, share in ways]
    while (now_s := now_s + rng.expovariate(per_s)) < DEPARTING_S:
        ((begin, end, _),) = rng.choices(ways, shares)
        lines.append(
            f'<trip id="t{len(lines)}" type="car" depart="{now_s:.2f}" from="{begin}" to="{end}" '
            'departLane="best" departSpeed="max"/>'
        )
    file.write_text("\n".join([*lines, "</routes>"]), encoding="utf-8")
    return file


def drive(kind: Kind, per_s: float, rule: str, seed: int, given: argparse.Namespace) -> dict[str, Any]:
    """Drive a kind of road at a demand, or return what it gave before."""
    safe = "".join(sign if sign.isalnum() else "-" for sign in _called(kind))
    key = f"{safe}-{per_s:.3f}-{seed}"
    kept = given.out / f"{key}-{rule}.json"
    if not kept.exists():
        net = given.out / f"{safe}.net.xml"
        if not net.exists():
            kind.make(net)
        routes = write_trips(kind.ways, per_s, seed, given.out / f"{key}.rou.xml")
        file = config(net, routes, 0.0, DURATION_S, given.out / f"{key}.sumocfg")
        each = {"seed": seed, "duration_s": DURATION_S, "on_deadlock": "continue", **RULES[rule]}
        summary = simulate(Scenario(network=str(file), **each), given.out / f"{key}-{rule}", overwrite=True)
        kept.write_text(json.dumps(summary), encoding="utf-8")
    found: dict[str, Any] = json.loads(kept.read_text(encoding="utf-8"))
    return found


def served(kind: Kind, given: argparse.Namespace) -> float:
    """Return how many vehicles a second SUMO lets through where far too many come."""
    ends = len({begin for begin, _, _ in kind.ways})
    found = drive(kind, FAR_TOO_MANY * ends, SUMO, 1, given)
    return float(found["arrived"]) / DURATION_S


def simulate_all(given: argparse.Namespace) -> pd.DataFrame:
    """Run what is missing; return a row for each run."""
    rows = []
    every = list(_planned(given))
    with show_progress("runs", total=len(every)) as report:
        for number, (kind, times, rule, seed) in enumerate(every, 1):
            per_s = served(kind, given) * times
            found = drive(kind, per_s, rule, seed, given)
            rows.append(
                {"group": kind.group, "kind": kind.name, "times": times, "rule": rule, "seed": seed}
                | {"asked_per_h": 3600.0 * per_s, "vehicles": found["trips"]}
                | {"ordinary": found["others"]["vehicles"] if found.get("others") and rule == GATE else 0}
                | {name: found[name] for name in ("arrived", "mean_delay_s", "collisions")}
                | {"locked": bool(found["deadlocks"]), "clean": found.get("clean")}
            )
            report(number)
    return pd.DataFrame(rows)


def _planned(given: argparse.Namespace) -> Iterator[tuple[Kind, float, str, int]]:
    for kind in kinds(given):
        for times, seed, rule in product(given.times, range(1, given.seeds + 1), given.rules):
            yield kind, times, rule, seed


def by_kind(runs: pd.DataFrame) -> pd.DataFrame:
    """Return a row for each kind: what is asked for, and arrived of all and delay at each demand by rule."""
    rows = []
    for (group, name), of in runs.groupby(["group", "kind"], sort=False):
        row = {
            "": f"{group}: {name}",
            "SUMO serves [1/h]": f"{of[of['times'] == 1.0]['asked_per_h'].mean():.0f}",
        }
        for times, at in of.groupby("times"):
            for figure, digits in (("arrived", 0), ("mean_delay_s", 1)):
                by_rule = [at[at["rule"] == rule][figure] for rule in RULES]
                text = ", ".join(with_half(found, digits) for found in by_rule if len(found))
                row[f"{'arrived' if not digits else 'delay [s]'}, {times:g}"] = text
        rows.append(row)
    return pd.DataFrame(rows)


def behind(runs: pd.DataFrame) -> pd.DataFrame:
    """Return by group and demand in how many rows the gate has fewer arrivals, or more delay, than SUMO."""
    of = runs.groupby(["group", "kind", "times", "rule"], sort=False)[["arrived", "mean_delay_s"]].mean()
    wide = of.unstack("rule")  # noqa: PD010  one figure for each pair
    fewer = wide["arrived"][GATE] < wide["arrived"][SUMO] - 0.5
    more = wide["mean_delay_s"][GATE] > wide["mean_delay_s"][SUMO] + 0.05
    counted = pd.DataFrame({"rows": 1, "fewer arrived": fewer.astype(int), "more delay": more.astype(int)})
    return counted.groupby(["group", "times"], sort=False).sum().reset_index()


def section(runs: pd.DataFrame) -> str:
    """Return the part of the page."""
    gated = runs[runs["rule"] == GATE]
    sumo = runs[runs["rule"] == SUMO]
    clean = sum(one is True for one in gated["clean"])
    left, all_of_them = gated["ordinary"].sum(), gated["vehicles"].sum() + gated["ordinary"].sum()
    said = f"""{len(runs)} runs of {DURATION_S:g} s; with intervals of 95 % where there are several seeds.
Trips depart for {DEPARTING_S:g} s, at 0.5, 1 and 1.5 times what SUMO lets through
(*SUMO serves*). Each cell: SUMO, gate. Collisions: SUMO {sumo["collisions"].sum()}, gate
{gated["collisions"].sum()}; locked: SUMO {sumo["locked"].sum()}, gate {gated["locked"].sum()};
clean, by positions: {clean} of {len(gated)}. Left to SUMO's rules: {left:.0f} of {all_of_them:.0f} vehicles.
By kind of road and demand, in how many rows the gate is behind SUMO:"""
    return "\n\n".join([" ".join(said.split()), markdown(behind(runs)), markdown(by_kind(runs))])


def main() -> None:
    """Run what is missing, print it beside the rows that are kept, and renew the page if asked to."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--draw", type=int, default=14, help="how many roundabouts are drawn")
    parser.add_argument("--drawn-by", type=int, default=1, help="the seed that draws them")
    parser.add_argument("--only", nargs="+", help="only kinds whose names contain one of these words")
    parser.add_argument("--times", nargs="+", type=float, default=list(TIMES))
    parser.add_argument("--rules", nargs="+", default=list(RULES), choices=list(RULES))
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "streams", help="results folder")
    parser.add_argument("--write", action="store_true", help="keep a row for each run, and renew the page")
    parser.add_argument("--table", action="store_true", help="only renew the page")
    given = parser.parse_args()
    if given.table:
        write_section(section(pd.read_csv(KEPT)), SECTION)
        return
    given.out.mkdir(parents=True, exist_ok=True)
    driven = simulate_all(given)
    key = ["group", "kind", "times", "rule", "seed"]
    every = in_place_of(pd.read_csv(KEPT), driven, key) if KEPT.exists() else driven
    runs = every[every["kind"].isin(driven["kind"])]
    console = Console(highlight=False, width=230)
    for table in (behind(runs), by_kind(runs)):
        console.print(frame_table(table, {name: str(name) for name in table.columns}, title="SUMO, gate"))
    if given.write:
        every.to_csv(KEPT, index=False)
        write_section(section(every), SECTION)


if __name__ == "__main__":
    main()
