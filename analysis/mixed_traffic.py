"""A public benchmark of real junctions, SUMO beside the gate: delays of trips by kind of junction and demand.

The benchmark is that of arXiv 2501.16728 (repository xiaochy/MixedTraffic-Benchmark): junctions from
OpenStreetMap, each with trips of one to four demands. ``python analysis/mixed_traffic.py FOLDER`` drives
the scenarios of ``test_files`` in a checked-out copy for 20 minutes each: under SUMO's rules with the
network's lights, and under the gate with lights off and obeyed. ``--files train_files --draw 12`` drives
so many of either kind, drawn by ``--seed``, of the other part; ``--share 20`` puts so many in a hundred of
the vehicles under the gate; what the table then says of the gate is about these alone. Runs that are done
are kept in ``out/mixed-traffic``, see ``--out``.

``--write`` keeps a row for each run in ``analysis/tables/mixed-traffic.csv`` and renews the tables in the
README and in ``docs/studies/throughput.md``; without a folder they are renewed from that file.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from random import Random
from typing import Any, Final
from xml.etree import ElementTree as ET

import pandas as pd
from any_traffic import EVERYONE
from frame_table import frame_table
from rich.console import Console
from sweep_runs import sweep_runs
from throughput_study import markdown, write_section

from loopgate.results import columns as c
from loopgate.sweep import Sweep

ROOT = Path(__file__).resolve().parents[1]
KEPT = ROOT / "analysis" / "tables" / "mixed-traffic.csv"
"""A row for each run that the pages tell of."""
README, SECTION = ROOT / "README.md", "mixed-traffic"

KINDS = ("intersection", "roundabout")
DEMANDS: Final = {"400": 400, "easy": 1000, "middle": 3000, "hard": 5000}
"""Demands by the name of their folder, and how many vehicles an hour they ask for."""
SUMO = "SUMO"
RULES: Final[dict[str, dict[str, Any]]] = {
    SUMO: {"gate": "open", "lights": "keep"},
    "gate": {"gate": "certified", "lights": "off"},
    "gate, lights obeyed": {"gate": "certified", "lights": "obey"},
}
SUFFIX = ".sumo.cfg"
KIND, DEMAND, NAME, RULE, SHARE, ORDINARY = "kind", "demand", "scenario", "rule", "share", "ordinary"
SCENARIO = [KIND, DEMAND, NAME]
FIGURES = (
    *(
        c.STATUS,
        c.SEED,
        c.VEHICLES,
        c.ARRIVED,
        c.UNFINISHED,
        c.MEAN_DELAY,
        c.MEAN_DEPART_DELAY,
        c.WORST_DELAY,
    ),
    *(c.DEADLOCKS, c.STARVING, c.COLLISIONS, c.TELEPORTS, c.KEPT, c.ON_RED, c.ERROR),
    *(c.LOOPGATE_CODE, c.SUMO_VERSION),
)
"""What the file of runs keeps of each."""


def configurations(folder: Path, part: str) -> pd.DataFrame:
    """Return the scenarios of a part of the benchmark: kind, demand, name and configuration."""
    rows = [
        {KIND: kind, DEMAND: demand, NAME: file.name.removesuffix(SUFFIX), "file": str(file.resolve())}
        for kind in KINDS
        for demand in DEMANDS
        for file in sorted((folder / part / kind / demand / "outputs").glob(f"*/*{SUFFIX}"))
    ]
    if not rows:
        sys.exit(f"{folder / part}: no scenarios; expected KIND/DEMAND/outputs/NAME_dict/NAME{SUFFIX} there")
    return pd.DataFrame(rows)


def routes_of(configuration: str) -> Path | None:
    """Return the route file of a configuration; None if it is cut off, as the largest of some copies are."""
    named = ET.parse(configuration).getroot().find("input/route-files")  # noqa: S314
    if named is None:
        return None
    file = Path(configuration).parent / named.get("value", "")
    try:
        ET.parse(file)  # noqa: S314
    except (OSError, ET.ParseError):
        return None
    return file


def drawn(scenarios: pd.DataFrame, count: int, seed: int) -> pd.DataFrame:
    """Return so many whole scenarios of each kind, drawn by a seed."""
    chosen: list[int] = []
    for kind in KINDS:
        rows = [int(str(row)) for row in scenarios.index[scenarios[KIND] == kind]]
        Random(f"{seed} {kind}").shuffle(rows)
        whole = (row for row in rows if routes_of(str(scenarios.loc[row, "file"])))
        chosen += [row for row, _ in zip(whole, range(count), strict=False)]
    return scenarios.loc[sorted(chosen)]


def planned(scenarios: pd.DataFrame, given: argparse.Namespace) -> Iterator[tuple[dict[str, Any], Any, str]]:
    """Yield the scenario of each run, whose it is, and its rule."""
    for one in scenarios.itertuples(index=False):
        who = {}
        if given.share < EVERYONE:
            routes = routes_of(str(one.file))
            if routes is None:
                sys.exit(f"{one.file}: its routes cannot be read")
            named = given.out / f"{one.kind}-{one.demand}-{one.scenario}-{given.share}-{given.seed}.txt"
            names = [
                vehicle.get("id", "")
                for vehicle in ET.parse(routes).getroot().iter("vehicle")  # noqa: S314
                if float(vehicle.get("depart", "0")) < given.duration
            ]
            some = Random(given.seed).sample(names, len(names) * given.share // EVERYONE)
            named.write_text("\n".join(some) + "\n", encoding="utf-8")
            who = {"who": str(named.resolve())}
        for rule in given.rules:
            gated = who if rule != SUMO else {}
            yield {"network": one.file, **RULES[rule], **gated}, one, rule


def simulate(scenarios: pd.DataFrame, given: argparse.Namespace) -> pd.DataFrame:
    """Run what is missing; return a row for each run."""
    given.out.mkdir(parents=True, exist_ok=True)
    runs = list(planned(scenarios, given))
    base = {"duration_s": given.duration, "seed": given.seed, "on_deadlock": "continue"}
    sweep = Sweep("mixed-traffic", base, {}, include=[scenario for scenario, _, _ in runs], folder=ROOT)
    found = sweep_runs(sweep, given.out, workers=given.jobs).set_index(c.KEY)
    keys = [point.key for point in sweep.points()]
    rows = [
        {KIND: one.kind, DEMAND: one.demand, NAME: one.scenario, RULE: rule}
        | {SHARE: given.share if rule != SUMO else 0}
        | {ORDINARY: _ordinary(str(found.loc[key, c.WARNINGS])) if rule != SUMO else 0}
        | {name: found.loc[key, name] for name in FIGURES}
        for key, (_, one, rule) in zip(keys, runs, strict=True)
    ]
    return pd.DataFrame(rows)


def _ordinary(warnings: str) -> int:
    """Return how many vehicles a gated run leaves to SUMO's rules, as it warns."""
    return sum(int(number) for number in re.findall(r"(\d+) vehicles? in ordinary traffic", warnings))


def by_class(runs: pd.DataFrame) -> pd.DataFrame:
    """Return a row for each kind, demand and rule, and one for each rule over all: what it came to.

    Means are over the scenarios that every rule drove. *Less delay* says in how many of them the mean delay
    was smaller than under SUMO's rules.
    """
    driven = runs.assign(**{c.MEAN_DELAY: runs[c.MEAN_DELAY].where(runs[c.STATUS] == c.STATUS_OK)})
    whole = _delays(driven).dropna().index
    done = runs.set_index(SCENARIO).loc[whole].reset_index()
    groups = [
        (done[(done[KIND] == kind) & (done[DEMAND] == name)], kind, name)
        for kind in KINDS
        for name in DEMANDS
    ]
    rows = []
    for group, kind, name in [*groups, (done, "all", "")]:
        if group.empty:
            continue
        delays = _delays(group)
        named = {"junctions": kind, "vehicles/h": str(DEMANDS.get(name, "")), "scenarios": len(delays)}
        rows += [{**named, RULE: rule, **_figures(group, delays, rule)} for rule in delays.columns]
    return pd.DataFrame(rows).fillna("")


def _figures(group: pd.DataFrame, delays: pd.DataFrame, rule: str) -> dict[str, str]:
    """Return what a rule came to in these scenarios."""
    of_rule = group[group[RULE] == rule]
    found = {
        "delay [s]": f"{delays[rule].mean():.0f}",
        "arrived": f"{of_rule[c.ARRIVED].sum():.0f}",
        "locked": f"{(of_rule[c.DEADLOCKS] > 0).sum()}",
        "collisions": f"{of_rule[c.COLLISIONS].sum():.0f}",
    }
    if rule != SUMO:
        found["clean"] = f"{(of_rule[c.KEPT] == True).sum()}"  # noqa: E712  it can be missing
        if SUMO in delays:
            found["less delay"] = f"{(delays[rule] < delays[SUMO]).sum()}"
    return found


def _delays(runs: pd.DataFrame) -> pd.DataFrame:
    """Return the mean delay of trips, waits to depart in it, by scenario and rule."""
    wide = runs.set_index([*SCENARIO, RULE])[c.MEAN_DELAY].unstack(RULE)  # noqa: PD010  one figure for each pair
    return wide[[rule for rule in RULES if rule in wide]]


def in_short(runs: pd.DataFrame) -> pd.DataFrame:
    """Return the README's table: mean delays by kind and demand, and where the gate had less than SUMO."""
    rows = []
    for key, group in by_class(runs).groupby(["junctions", "vehicles/h", "scenarios"], sort=False):
        kind, vehicles, count = (str(part) for part in list(key))
        of = group.set_index(RULE)
        row = {"junctions": f"{count} {kind}s" if vehicles else f"all {count}", "vehicles/h": vehicles}
        row |= {f"{rule} [s]": str(of.loc[rule, "delay [s]"]) for rule in RULES}
        less = {rule: f"{of.loc[rule, 'less delay']!s} of {count}" for rule in RULES if rule != SUMO}
        rows.append(row | {f"{rule}: less delay": text for rule, text in less.items()})
    return pd.DataFrame(rows)


def section(runs: pd.DataFrame) -> str:
    """Return the part of the page on throughput."""
    gated, first = runs[runs[RULE] != SUMO], runs.iloc[0]
    once = gated.drop_duplicates(SCENARIO)
    apart = int(((gated[ORDINARY] > 0) & (gated[c.DEADLOCKS] > 0)).sum())
    said = f"""{len(runs)} runs of 20 minutes, seed {first[c.SEED]}, one state of the code.
Delay: the mean over trips of the time lost on the way and waited to depart. *Locked*: runs with a deadlock.
*Clean*: gated runs that kept what is promised. *Less delay*: scenarios with a smaller mean delay than under
SUMO's rules. The gate cannot take {once[ORDINARY].sum():.0f} of {once[c.VEHICLES].sum():.0f} vehicles,
in {(once[ORDINARY] > 0).sum()} of {len(once)} scenarios: there is no space to change lanes, or to wait.
These drive by SUMO's rules among the others; {apart} such runs lock up."""
    return f"{' '.join(said.split())}\n\n{markdown(by_class(runs))}"


def write(runs: pd.DataFrame) -> None:
    """Renew the tables of the README and of the page on throughput."""
    write_section(markdown(in_short(runs)), SECTION, README)
    write_section(section(runs), SECTION)


def print_runs(runs: pd.DataFrame) -> None:
    """Print the table by class, each scenario's delays, and what failed or was not clean."""
    console = Console(highlight=False, width=230)
    table = by_class(runs)
    console.print(frame_table(table, {name: str(name) for name in table.columns}, title="20 minutes each"))
    each = _delays(runs).reset_index()
    console.print(frame_table(each, {name: str(name) for name in each.columns}, title="Mean delay [s]"))
    for one in runs.to_dict("records"):
        named = f"{one[KIND]} {one[DEMAND]} {one[NAME]}, {one[RULE]}"
        if one[c.STATUS] != c.STATUS_OK:
            console.print(f"{named}: {str(one[c.ERROR])[:300]}")
        elif one[RULE] != SUMO and not one[c.KEPT]:
            console.print(f"{named}: not clean, {one[c.COLLISIONS]} collisions, {one[c.DEADLOCKS]} deadlocks")
    if len(set(runs[c.LOOPGATE_CODE])) > 1:
        console.print("The runs were made by several states of the code.")


def main() -> None:
    """Run what is missing, print, and renew the pages if asked to."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path, nargs="?", help="checked-out copy of the benchmark")
    parser.add_argument("--files", default="test_files", choices=("test_files", "train_files"))
    parser.add_argument("--kinds", nargs="+", default=list(KINDS), choices=KINDS)
    parser.add_argument("--demands", nargs="+", default=list(DEMANDS), choices=list(DEMANDS))
    parser.add_argument("--names", nargs="+", help="only junctions of these names")
    parser.add_argument("--draw", type=int, help="only so many scenarios of each kind, drawn by the seed")
    parser.add_argument("--rules", nargs="+", default=list(RULES), choices=list(RULES))
    parser.add_argument("--share", type=int, default=EVERYONE, help="vehicles in a hundred under the gate")
    parser.add_argument("--seed", type=int, default=1, help="of SUMO, of --draw and of --share")
    parser.add_argument("--duration", type=float, default=1200.0, help="simulated time of each run [s]")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "mixed-traffic", help="results folder")
    parser.add_argument("--write", action="store_true", help="keep a row for each run, and renew the pages")
    given = parser.parse_args()
    if given.folder is None:
        write(pd.read_csv(KEPT, dtype={DEMAND: str}, keep_default_na=False, na_values=[""]))
        return
    found = configurations(given.folder, given.files)
    found = found[found[KIND].isin(given.kinds) & found[DEMAND].isin(given.demands)]
    if given.names:
        found = found[found[NAME].isin(given.names)]
    runs = simulate(drawn(found, given.draw, given.seed) if given.draw else found, given)
    print_runs(runs)
    if given.write:
        runs.to_csv(KEPT, index=False)
        write(runs)


if __name__ == "__main__":
    main()
