"""A public benchmark of real junctions, SUMO beside the gate: delays of trips by kind of junction and demand.

The benchmark is that of arXiv 2501.16728 (repository xiaochy/MixedTraffic-Benchmark): junctions from
OpenStreetMap, each with trips of one to four demands. ``python analysis/mixed_traffic.py FOLDER`` drives
the scenarios of ``test_files`` in a checked-out copy for 20 minutes each: under SUMO's rules with the
network's lights, and under the gate with lights off and obeyed. ``--files train_files --draw 12`` drives
so many of either kind, drawn by ``--seed``, of the other part. Runs that are done are kept in
``out/mixed-traffic``, see ``--out``.

``--shares 5 20 60`` puts only so many in a hundred of the vehicles under the gate, the others drive by
SUMO's rules among them; beside it SUMO's rules with lights on and off. The figures are then of all vehicles.

``--write`` keeps a row for each run in ``analysis/tables/mixed-traffic.csv``, of shares in
``mixed-traffic-shares.csv`` there, and renews the tables in the README and in
``docs/studies/throughput.md``; without a folder they are renewed from these files.
"""

from __future__ import annotations

import argparse
import json
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
from real_networks import trips
from rich.console import Console
from sweep_runs import sweep_runs
from throughput_study import in_place_of, markdown, write_section

from loopgate import Scenario
from loopgate.cli.terminal import show_progress
from loopgate.errors import LoopgateError
from loopgate.results import columns as c
from loopgate.simulation.run import simulate as drive
from loopgate.sweep import Sweep

ROOT = Path(__file__).resolve().parents[1]
KEPT = ROOT / "analysis" / "tables" / "mixed-traffic.csv"
"""A row for each run that the pages tell of."""
KEPT_SHARES = KEPT.with_name("mixed-traffic-shares.csv")
README, SECTION, SHARES_SECTION = ROOT / "README.md", "mixed-traffic", "mixed-traffic-shares"

KINDS = ("intersection", "roundabout")
DEMANDS: Final = {"400": 400, "easy": 1000, "middle": 3000, "hard": 5000}
"""Demands by the name of their folder, and how many vehicles an hour they ask for."""
SUMO = "SUMO"
RULES: Final[dict[str, dict[str, Any]]] = {
    SUMO: {"gate": "open", "lights": "keep"},
    "gate": {"gate": "certified", "lights": "off"},
    "gate, lights obeyed": {"gate": "certified", "lights": "obey"},
}
DARK = "SUMO, lights off"
LIGHTS = {"gate": DARK, "gate, lights obeyed": SUMO}
"""SUMO's rules with the same lights as under the gate."""
SUFFIX = ".sumo.cfg"
KIND, DEMAND, NAME, RULE, SHARE, ORDINARY = "kind", "demand", "scenario", "rule", "share", "ordinary"
SCENARIO = [KIND, DEMAND, NAME]
GATED_DELAY, ERRED = "gated_delay_s", "collisions_by_others"
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
        for rule in given.rules:
            yield {"network": one.file, **RULES[rule]}, one, rule


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
        | {SHARE: EVERYONE if rule != SUMO else 0}
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


def beside_unlit(runs: pd.DataFrame, shares: pd.DataFrame) -> str:
    """Return what SUMO's drivers lose with the lights off, beside the gate, in a sentence for each kind."""
    pairs = ((runs, "gate"), (shares, DARK))
    gate, sumo = (some[some[RULE] == rule].set_index(SCENARIO)[c.MEAN_DELAY] for some, rule in pairs)
    both = pd.concat([sumo, gate], axis=1, keys=["sumo", "gate"]).dropna().groupby(KIND)
    said = [
        f"at {kind}s {some['sumo'].mean():.0f} s, the gate {some['gate'].mean():.0f} s (less in "
        f"{(some['gate'] < some['sumo']).sum()} of {len(some)})"
        for kind, some in both
    ]
    return f"SUMO's drivers have their lights there. With the lights off they lose {'; '.join(said)}."


def write(runs: pd.DataFrame) -> None:
    """Renew the tables of the README and of the page on throughput."""
    unlit = beside_unlit(runs, _kept(KEPT_SHARES))
    write_section(f"{markdown(in_short(runs))}\n\n{unlit}", SECTION, README)
    write_section(f"{section(runs)}\n\n{unlit}", SECTION)


def some_of(configuration: str, called: str, share: int, given: argparse.Namespace) -> Path:
    """Write the names of so many in a hundred of the vehicles; a greater share has these too."""
    routes = routes_of(configuration)
    if routes is None:
        sys.exit(f"{configuration}: its routes cannot be read")
    names = [
        vehicle.get("id", "")
        for vehicle in ET.parse(routes).getroot().iter("vehicle")  # noqa: S314
        if float(vehicle.get("depart", "0")) < given.duration
    ]
    Random(given.seed).shuffle(names)
    file: Path = given.out / f"{called}-{share}-{given.seed}.txt"
    file.write_text("\n".join(names[: len(names) * share // EVERYONE]) + "\n", encoding="utf-8")
    return file


def drive_shares(scenarios: pd.DataFrame, given: argparse.Namespace) -> pd.DataFrame:
    """Drive with some of the vehicles under the gate, unless it was done; return a row for each run."""
    given.out.mkdir(parents=True, exist_ok=True)
    dark = {"gate": "open", "lights": "off"}
    named = [(0, SUMO, RULES[SUMO]), (0, DARK, dark)]
    named += [(share, rule, RULES[rule]) for share in given.shares for rule in given.rules if rule != SUMO]
    runs = [(one, *of) for one in scenarios.itertuples(index=False) for of in named]
    rows = []
    with show_progress("runs", total=len(runs)) as report:
        for number, (one, share, rule, words) in enumerate(runs, 1):
            called = f"{one.kind}-{one.demand}-{one.scenario}"
            key = f"{called}-{share}-{rule}-{given.seed}-{given.duration:g}"
            kept = given.out / f"{key.replace(' ', '_').replace(',', '')}.json"
            if not kept.exists():
                driven = {**words, "network": one.file}
                if 0 < share < EVERYONE:
                    driven["who"] = str(some_of(str(one.file), called, share, given).resolve())
                found = _of_all(driven, kept.with_suffix(""), given)
                kept.write_text(json.dumps(found), encoding="utf-8")
            row = {KIND: one.kind, DEMAND: one.demand, NAME: one.scenario, SHARE: share, RULE: rule}
            rows.append(row | json.loads(kept.read_text(encoding="utf-8")))
            report(number)
    return pd.DataFrame(rows)


def _of_all(words: dict[str, Any], folder: Path, given: argparse.Namespace) -> dict[str, Any]:
    """Drive a scenario; return what all its vehicles came to."""
    base = {"duration_s": given.duration, "seed": given.seed, "on_deadlock": "continue"}
    try:
        summary = drive(Scenario(**{**base, **words}), folder, overwrite=True)
    except LoopgateError as error:
        return {c.STATUS: "failed", c.ERROR: str(error)}
    others = summary.get("others") or {}
    return {
        c.STATUS: c.STATUS_OK,
        c.SEED: given.seed,
        **trips(summary),
        GATED_DELAY: summary[c.MEAN_DELAY] if others else None,
        ORDINARY: others.get("vehicles", 0),
        c.DEADLOCKS: len(summary["deadlocks"]),
        c.STARVING: len(summary["starving"]),
        c.COLLISIONS: summary[c.COLLISIONS],
        ERRED: summary.get("collisions_by_others", 0),
        c.KEPT: summary.get("clean"),
    }


def by_share(runs: pd.DataFrame) -> pd.DataFrame:
    """Return a row for each kind, share and rule, and one for both kinds; lights off first, then obeyed."""
    beside = [runs[runs[RULE].isin((SUMO, lights, rule))] for rule, lights in LIGHTS.items()]
    parts = [_by_share(some) for some, rule in zip(beside, LIGHTS, strict=True) if rule in set(some[RULE])]
    return pd.concat(parts, ignore_index=True).fillna("")


def _by_share(runs: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of one rule of the gate and of SUMO: scenarios that were driven with every share."""
    runs = runs.reset_index(drop=True)
    column = pd.Series([f"{share} {rule}" for share, rule in zip(runs[SHARE], runs[RULE], strict=True)])
    wide = runs.assign(column=column).pivot_table(index=SCENARIO, columns="column", values=c.MEAN_DELAY)
    wide = wide.dropna()
    done = runs.set_index(SCENARIO).loc[wide.index].reset_index()
    rows = []
    for kind in (*KINDS, "all"):
        group = done if kind == "all" else done[done[KIND] == kind]
        if group.empty:
            continue
        delays = wide.loc[pd.MultiIndex.from_frame(group[SCENARIO].drop_duplicates())]
        for (share, rule), of in group.groupby([SHARE, RULE], sort=False):
            row = {"junctions": kind, "scenarios": f"{len(delays)}", "share [%]": f"{share}", RULE: str(rule)}
            row["delay [s]"] = f"{of[c.MEAN_DELAY].mean():.0f}"
            gated = of[GATED_DELAY].dropna()
            row["of the gated [s]"] = f"{gated.mean():.0f}" if len(gated) else ""
            row["arrived"] = f"{of[c.ARRIVED].sum():.0f}"
            row["locked"] = f"{(of[c.DEADLOCKS] > 0).sum()}"
            row["collisions"] = f"{of[c.COLLISIONS].sum():.0f}"
            if rule in LIGHTS:
                own, same = delays[f"{share} {rule}"], delays[f"0 {LIGHTS[str(rule)]}"]
                row["no more than SUMO, its lights"] = f"{(own <= delays[f'0 {SUMO}']).sum()}"
                row["no more than SUMO, same lights"] = f"{(own <= same).sum()}"
            rows.append(row)
    return pd.DataFrame(rows)


def shares_section(runs: pd.DataFrame) -> str:
    """Return the part of the page on shares."""
    done = runs[runs[c.STATUS] == c.STATUS_OK]
    failed, some = len(runs) - len(done), done[done[SHARE] > 0]
    said = f"""{len(done)} runs of 20 minutes, seed {done[c.SEED].iloc[0]:.0f}; {failed} failed.
*Delay*: mean over the scenarios of the mean over all vehicles, waits to depart in it; *of the gated*: over
the gated ones. *Collisions*: with share 0 all, else those with a gated vehicle; in
{some[ERRED].sum():.0f} of these {some[c.COLLISIONS].sum():.0f} the ordinary driver erred.
*No more than SUMO*: scenarios with no more delay than with share 0, under the network's
lights and under the same lights as the gate."""
    return f"{' '.join(said.split())}\n\n{markdown(by_share(runs))}"


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


def _kept(file: Path) -> pd.DataFrame:
    return pd.read_csv(file, dtype={DEMAND: str}, keep_default_na=False, na_values=[""])


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
    parser.add_argument("--shares", type=int, nargs="+", help="vehicles in a hundred under the gate")
    parser.add_argument("--seed", type=int, default=1, help="of SUMO, of --draw and of --shares")
    parser.add_argument("--duration", type=float, default=1200.0, help="simulated time of each run [s]")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "mixed-traffic", help="results folder")
    parser.add_argument("--write", action="store_true", help="keep a row for each run, and renew the pages")
    given = parser.parse_args()
    if given.folder is None:
        write(_kept(KEPT))
        write_section(shares_section(_kept(KEPT_SHARES)), SHARES_SECTION)
        return
    found = configurations(given.folder, given.files)
    found = found[found[KIND].isin(given.kinds) & found[DEMAND].isin(given.demands)]
    if given.names:
        found = found[found[NAME].isin(given.names)]
    found = drawn(found, given.draw, given.seed) if given.draw else found
    if given.write and given.files != "test_files":
        parser.error("--write keeps the runs of test_files")
    if given.shares:
        runs = drive_shares(found, given)
        print(shares_section(runs))
        if given.write:
            if KEPT_SHARES.exists():
                runs = in_place_of(_kept(KEPT_SHARES), runs, [*SCENARIO, SHARE, RULE])
            runs.to_csv(KEPT_SHARES, index=False)
            write_section(shares_section(runs), SHARES_SECTION)
        return
    runs = simulate(found, given)
    print_runs(runs)
    if given.write:
        if KEPT.exists():
            runs = in_place_of(_kept(KEPT), runs, [*SCENARIO, RULE])
        runs.to_csv(KEPT, index=False)
        write(runs)


if __name__ == "__main__":
    main()
