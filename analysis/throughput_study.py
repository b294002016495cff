"""What the studies of throughput share: the same loops and vehicles under several rules, as tables.

Runs that are done are kept as rows of a sweep in a results folder and not repeated; a study may be ended at
any time.
"""

from __future__ import annotations

import argparse
import math
import re
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
from sweep_runs import sweep_runs

from loopgate.analysis.statistics import mean_interval
from loopgate.network import Loop, write_loops
from loopgate.results import columns as c
from loopgate.sweep import Sweep

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "studies" / "throughput.md"
TABLES = ROOT / "analysis" / "tables" / "throughput.md"
"""Every table of the studies; the page shows those that :func:`shown` keeps."""

RULE = "rule"
SUMO = "SUMO"
WARMUP_S = 300.0
LONGEST_WAIT = (
    "Longest wait under gates in any run; in brackets the mean number of vehicles without a lap in the last "
    "half hour:"
)
_MOST_TIMES = 10
"""More than so many times a rule that has locked up is not told."""


@dataclass(frozen=True, slots=True)
class Rule:
    """A column of the study: who rules at the junctions.

    Attributes
    ----------
    name
        As the tables call it.
    scenario
        What the rule sets of a scenario.
    yardstick
        Whether it is one of SUMO's own, which the others are measured by.
    vehicles
        The counts it is run at; all of the study's if empty.
    beside
        The yardstick that it is measured by; if empty, the best of them.
    """

    name: str
    scenario: Mapping[str, Any]
    yardstick: bool = False
    vehicles: tuple[int, ...] = ()
    beside: str = ""


@dataclass(frozen=True, slots=True)
class Study:
    """Rules compared on the same loops and vehicles.

    Attributes
    ----------
    name
        Of its part of the page and of its results folder.
    title
        Above its tables.
    rules
        In the order of the tables.
    vehicles
        The counts.
    loops
        Makes the loops of a seed.
    """

    name: str
    title: str
    rules: tuple[Rule, ...]
    vehicles: tuple[int, ...]
    loops: Callable[[int], Sequence[Loop]]


def parser(description: str | None) -> argparse.ArgumentParser:
    """Return what all studies of throughput take from the command line."""
    made = argparse.ArgumentParser(description=(description or "").splitlines()[0])
    made.add_argument("--seeds", type=int, default=1, help="how many seeds; 5 for the figures of the page")
    made.add_argument("--vehicles", type=int, nargs="+", help="only these of the study's counts")
    made.add_argument("--rules", nargs="+", help="only rules whose name contains one of these words")
    made.add_argument("--duration", type=float, default=3600.0, help="measured time [s]")
    made.add_argument("--jobs", type=int, default=2, help="processes")
    made.add_argument("--out", type=Path, default=ROOT / "out" / "throughput", help="results folder")
    made.add_argument(
        "--write",
        action="store_true",
        help=f"renew the study's part of docs/studies/{PAGE.name} and of analysis/tables/{TABLES.name}",
    )
    return made


def simulate(study: Study, given: argparse.Namespace) -> pd.DataFrame:
    """Run what is missing; return the rows of the study with a column for the rule.

    The loops of a seed are made once and driven under every rule, by vehicles that start at the same places.
    """
    folder = given.out / study.name
    folder.mkdir(parents=True, exist_ok=True)
    counts = [count for count in study.vehicles if not given.vehicles or count in given.vehicles]
    include, names = [], []
    for seed in range(1, given.seeds + 1):
        routes = folder / f"loops{seed}.rou.xml"
        write_loops(study.loops(seed), routes)
        for count in counts:
            for rule in study.rules:
                if rule.vehicles and count not in rule.vehicles:
                    continue
                if given.rules and not any(word in rule.name for word in given.rules):
                    continue
                common = {"routes": str(routes), "vehicles": count, "seed": seed}
                include.append({**common, **rule.scenario})
                names.append(rule.name)
    if not include:
        chosen = " ".join(map(str, study.vehicles)), ", ".join(rule.name for rule in study.rules)
        sys.exit(f"{study.name}: nothing is left to run; its vehicles are {chosen[0]}, its rules {chosen[1]}")
    base = {
        "abstraction": "queues",
        "on_deadlock": "continue",  # the hour goes on around it
        "duration_s": given.duration,
        "warmup_s": WARMUP_S,
    }
    sweep = Sweep(study.name, base, {}, include=include, folder=ROOT)
    rules = {point.key: name for point, name in zip(sweep.points(), names, strict=True)}
    runs = sweep_runs(sweep, folder, workers=given.jobs)
    runs[RULE] = [rules[key] for key in runs[c.KEY]]
    return runs


def kilometres(runs: pd.DataFrame, study: Study) -> pd.DataFrame:
    """Return mean vehicle-km in the hour, with half its 95 % interval, by rule and vehicles."""
    return _wide(runs, study, _km)


def ratios(runs: pd.DataFrame, study: Study) -> pd.DataFrame:
    """Return the vehicle-km of each rule over those of the best yardstick, with half the 95 % interval.

    The best is that with the greatest mean at this number of vehicles; a rule that names its yardstick is
    measured by that. Runs are compared seed by seed.
    """
    done = runs[runs[c.STATUS] == c.STATUS_OK]
    own = {rule.name for rule in study.rules if rule.yardstick}
    beside = {rule.name: rule.beside for rule in study.rules}

    def yardstick(count: int, rule: str) -> pd.Series[float] | None:
        """Return the distance under the rule that this one is measured by, by seed."""
        of = done[(done[c.VEHICLES] == count) & done[RULE].isin({beside[rule]} if beside[rule] else own)]
        if of.empty:
            return None
        best = of.groupby(RULE)[c.KM_PER_H].mean().idxmax()
        return of[of[RULE] == best].set_index(c.SEED)[c.KM_PER_H]

    def ratio(group: pd.DataFrame) -> str:
        by = yardstick(int(group[c.VEHICLES].iloc[0]), str(group[RULE].iloc[0]))
        if by is None:
            return ""
        values = (group.set_index(c.SEED)[c.KM_PER_H] / by).dropna()
        return f"> {_MOST_TIMES}" if values.mean() > _MOST_TIMES else with_half(values, 2)

    return _wide(done[~done[RULE].isin(own)], study, ratio)


def details(runs: pd.DataFrame, study: Study) -> pd.DataFrame:
    """Return a row per number of vehicles and rule with all that a run of it came to."""
    rows = []
    cases = [(count, rule.name) for count in sorted(set(runs[c.VEHICLES])) for rule in study.rules]
    for count, rule in cases:
        group = runs[(runs[RULE] == rule) & (runs[c.VEHICLES] == count)]
        if group.empty:
            continue
        done = group[group[c.STATUS] == c.STATUS_OK]
        if done.empty:
            rows.append({"vehicles": count, "rule": rule, "km": f"refused: {group[c.ERROR].iloc[0]}"})
            continue
        gated = done[done[c.AUDIT] != c.NOT_GATED]
        rows.append(
            {
                "vehicles": count,
                "rule": rule,
                "km": with_half(done[c.KM_PER_H], 0),
                "laps": with_half(done[c.LAPS], 0),
                "without a lap at the end": f"{done[c.LAPLESS].mean():.1f}",
                "locked": f"{int((done[c.DEADLOCKS] > 0).sum())} of {len(done)}",
                "longest wait [s]": f"{done[c.LONGEST_WAIT].max():.0f}" if len(gated) else "",
                "collisions": f"{int(done[c.COLLISIONS].sum())}",
                "teleports": f"{int(done[c.TELEPORTS].sum())}",
                "clean audits": f"{int((gated[c.AUDIT] == 'clean').sum())} of {len(gated)}"
                if len(gated)
                else "",
            }
        )
    return pd.DataFrame(rows).fillna("")


def _km(group: pd.DataFrame) -> str:
    done = group[group[c.STATUS] == c.STATUS_OK]
    if done.empty:
        return "refused"
    locked = int((done[c.DEADLOCKS] > 0).sum())
    return with_half(done[c.KM_PER_H], 0) + (f" ({locked} of {len(done)} locked)" if locked else "")


def waits(runs: pd.DataFrame, study: Study) -> pd.DataFrame:
    """Return the longest wait under each gate, of any run, and how many vehicles made no lap at the end."""
    return _wide(runs, study, _wait)


def _wait(group: pd.DataFrame) -> str:
    done = group[group[c.STATUS] == c.STATUS_OK]
    gated = done[done[c.AUDIT] != c.NOT_GATED]
    without = done[c.LAPLESS].mean()
    parts = [f"{gated[c.LONGEST_WAIT].max():.0f} s"] * bool(len(gated))
    return " ".join(parts + [f"({without:.1f})"] * bool(without > 0))


def safety(runs: pd.DataFrame) -> str:
    """Return how many collisions SUMO counted, by rule, and how many audits found nothing."""
    done = runs[runs[c.STATUS] == c.STATUS_OK]
    gated = done[done[c.AUDIT] != c.NOT_GATED]
    counts = done.groupby(RULE, sort=False)[c.COLLISIONS].sum()
    counted = [f"{name} {count:.0f}" for name, count in counts.items() if count]
    clean = f"{int((gated[c.AUDIT] == 'clean').sum())} of {len(gated)}"
    return (
        f"Collisions: {', '.join(counted) or 'none'}{'; under the others none' if counted else ''}. "
        f"Clean audits of gated runs: {clean}. Teleports: {int(done[c.TELEPORTS].sum())}."
    )


def with_half(values: Iterable[float], digits: int) -> str:
    """Return mean and half the 95 % interval, if there are values enough for one."""
    interval = mean_interval(list(values))
    if math.isnan(interval.high):
        return f"{interval.estimate:.{digits}f}"
    return f"{interval.estimate:.{digits}f} ± {interval.high - interval.estimate:.{digits}f}"


def _wide(runs: pd.DataFrame, study: Study, figure: Callable[[pd.DataFrame], str]) -> pd.DataFrame:
    cells: dict[str, dict[str, str]] = {}
    for rule in study.rules:
        for count in sorted(set(runs[c.VEHICLES])):
            group = runs[(runs[RULE] == rule.name) & (runs[c.VEHICLES] == count)]
            if len(group):
                cells.setdefault(rule.name, {})[str(count)] = figure(group)
    columns = [str(count) for count in sorted(set(runs[c.VEHICLES]))]
    table = pd.DataFrame.from_dict(cells, orient="index").reindex(columns=columns).fillna("")
    return table.rename_axis("rule").reset_index()


def markdown(table: pd.DataFrame) -> str:
    """Return the table as Markdown."""
    head = [str(name) for name in table.columns]
    rows = [[str(value) for value in row] for row in table.itertuples(index=False)]
    first, *others = ("| " + " | ".join(cells) + " |" for cells in (head, *rows))
    return "\n".join((first, "|" + "---|" * len(head), *others))


def section(runs: pd.DataFrame, study: Study) -> str:
    """Return the study's part of the page."""
    seeds, hours = runs[c.SEED].nunique(), runs[c.DURATION].max() / 3600
    explained = (
        f"{len(runs)} runs of {hours:g} h after {WARMUP_S:g} s of warm-up, {seeds} seed{'s' * (seeds > 1)}"
        ". Means with 95 % intervals over the seeds. *Locked*: runs with a deadlock."
    )
    parts = [
        f"## {study.title}",
        explained,
        VEHICLE_KM,
        markdown(kilometres(runs, study)),
        "Ratio to the best of SUMO's own rules with as many vehicles, seed by seed:",
        markdown(ratios(runs, study)),
        LONGEST_WAIT,
        markdown(waits(runs, study)),
        safety(runs),
    ]
    return "\n\n".join(parts)


_IN_TABLES_ONLY = (
    *("| SUMO, right before left |", "| certified, random |", "| certified, oldest |"),
    *("| certified, pressure:", "| algorithm2", "| banker"),
)
"""Rows that stay in the file of tables: what they say is said on the page in a sentence."""

_COLUMNS_IN_TABLES_ONLY = ("100", "240")
"""Numbers of vehicles whose columns stay in the file of tables."""


def shown(text: str, *left_out: str) -> str:
    """Return the part of a section that the page shows.

    Parameters
    ----------
    text
        The whole section.
    left_out
        Tables whose heading begins so stay in the file of tables; the table of waits always does.
    """
    kept: list[str] = []
    parts = iter(text.split("\n\n"))
    for part in parts:
        if part.startswith((LONGEST_WAIT, *left_out)):
            next(parts)  # its table
        else:
            lines = [line for line in part.splitlines() if not line.startswith(_IN_TABLES_ONLY)]
            kept.append("\n".join(_without_columns(lines)))
    return "\n\n".join(kept)


def _without_columns(lines: Sequence[str]) -> list[str]:
    """Return the lines of a table without the columns that stay in the file of tables."""
    if not lines or not lines[0].startswith("|"):
        return list(lines)
    named = [cell.strip() for cell in lines[0].split("|")]
    return [
        "|".join(c for c, n in zip(line.split("|"), named, strict=True) if n not in _COLUMNS_IN_TABLES_ONLY)
        for line in lines
    ]


VEHICLE_KM = "Vehicle-km per hour, by number of vehicles:"
NOT_ON_PAGE = ("limit-1", "braunschweig", "lights-grid")
"""Studies of which the page tells in a sentence."""


def left_to_tables(name: str) -> tuple[str, ...]:
    """Return the tables of a study that the page leaves to the file of tables: ratios say as much."""
    return (VEHICLE_KM,) if name.startswith(("limit", "lights")) else ()


def write_study(text: str, name: str, *left_out: str) -> None:
    """Renew a study's section in the file of tables, and what the page shows of it."""
    write_section(text, name, TABLES)
    if name not in NOT_ON_PAGE:
        write_section(shown(text, *left_out, *left_to_tables(name)), name)


def write_section(text: str, name: str, page: Path = PAGE) -> None:
    """Put a study's part into the page, between its marks; the rest of the page stays.

    Raises
    ------
    ValueError
        If the page has no marks for it.
    """
    begin, end = f"<!-- {name}: begin -->", f"<!-- {name}: end -->"
    before = page.read_text(encoding="utf-8")
    marks = re.compile(re.escape(begin) + r".*?" + re.escape(end), flags=re.DOTALL)
    if not marks.search(before):
        msg = f"{page}: there is no {begin} ... {end}"
        raise ValueError(msg)
    after = marks.sub(lambda _: f"{begin}\n{text}\n{end}", before)
    page.write_text(after, encoding="utf-8")


def in_place_of(old: pd.DataFrame, runs: pd.DataFrame, key: Sequence[str]) -> pd.DataFrame:
    """Return old runs and new ones, each new one in place of the old one with the same `key`."""
    every = pd.concat([old, runs], ignore_index=True)
    place = every.groupby(list(key), sort=False, dropna=False).ngroup()
    newest = every.drop_duplicates(list(key), keep="last")
    return newest.loc[place[newest.index].sort_values(kind="stable").index]


def conduct(study: Study, given: argparse.Namespace) -> pd.DataFrame:
    """Run what is missing of a study, print its tables, and renew the page if asked to; return the runs."""
    runs = simulate(study, given)
    text = section(runs, study)
    print(text)
    every = f"{text}\n\nAll figures:\n\n{markdown(details(runs, study))}\n"
    (given.out / f"{study.name}.md").write_text(every, encoding="utf-8")
    runs = runs.drop(columns=[*c.EDGE_LISTS.values(), c.LAP_QUANTILES, c.SCENARIO], errors="ignore")
    runs.to_csv(given.out / f"{study.name}.csv", index=False)
    if given.write:
        write_study(text, study.name)
    return runs
