"""One run folder as one row of a results table."""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from loopgate.analysis.trips import compute_laps
from loopgate.errors import ResultsError
from loopgate.reading import read_toml, refusing
from loopgate.results import columns as c
from loopgate.results.columns import LAP_TIME
from loopgate.results.figures import closed_at_s
from loopgate.results.row_schema import ROW_SCHEMA
from loopgate.results.table_reading import lacks, maker, read_summary, read_table

LAP_GRID = np.linspace(0.0, 1.0, 21)
"""Quantiles of the lap times that a row keeps."""

_HALF_HOUR_S = 1800.0
_NO_EDGES = pd.DataFrame(columns=list(c.EDGE_COLUMNS))
_EDGE_COLUMNS = (
    c.EDGE,
    c.EDGE_LENGTH,
    c.VISITS,
    c.MEAN_REVISIT,
    c.MAX_REVISIT,
    c.IDLENESS,
    c.EDGE_HOLD,
    c.SHAPE,
)
"""Columns of the edges that a row needs; there may be more."""

_OF_WATCH = (
    c.NEVER_SEEN,
    c.HEADWAY_CV,
    c.BUNCHED,
    c.WITHIN,
    c.WITHIN_OF_SEEN,
    c.STREETS_OVER,
    c.IF_EVEN,
    c.WORST_IF_EVEN,
)
"""Columns about all streets, in a summary under ``watch``."""

_NEEDED = (
    *(c.NETWORK, c.GATE, c.VEHICLES, c.LOOPS, c.SEED, c.DURATION),
    *(c.LAPS, c.DISTANCE_KM, c.LAPS_PER_H, c.KM_PER_H, c.OUTCOME, c.DEADLOCKS),
)
"""Without these a summary says nothing; what else is missing is only not known of the run."""


class RunRow(NamedTuple):
    """A row, and the edges that its lists per edge refer to."""

    row: dict[str, Any]
    edges: pd.DataFrame
    """`EDGE`, `EDGE_LENGTH` [m], `SHAPE`."""


def read_run_row(folder: Path) -> RunRow:
    """Return the row of a run folder.

    Raises `ResultsError` if ``scenario.toml``, ``summary.json`` or ``events.parquet`` is missing, or one of
    these or ``edges.parquet`` cannot be read or lacks a figure or column that the row cannot do without.
    """
    with refusing(folder, "run folder", ResultsError):
        summary = read_summary(folder)
        missing = [name for name in _NEEDED if name not in summary]
        made_by = maker(summary)
        if missing:
            raise lacks(folder / "summary.json", missing, made_by, what="figure")
        scenario = read_toml(folder / "scenario.toml", "scenario", ResultsError)
        kinds = [str(kind) for kind in (c.Event.START, c.Event.EDGE, c.Event.LAP)]
        events = read_table(
            folder / "events.parquet",
            c.EVENT_COLUMNS[:4],
            made_by=made_by,
            only=True,
            filters=[(c.EVENT, "in", kinds)],
        )
        # A run that locks up while it warms up has measured nothing, and has no edges.
        file = folder / "edges.parquet"
        edges = read_table(file, _EDGE_COLUMNS, made_by=made_by) if file.exists() else _NO_EDGES
        return run_row(scenario=scenario, summary=summary, events=events, edges=edges)


def run_row(
    *, scenario: Mapping[str, Any], summary: Mapping[str, Any], events: pd.DataFrame, edges: pd.DataFrame
) -> RunRow:
    """Return the part of a run's row that comes from its summary, laps and edges.

    Rates are over the time asked for: a run that was ended at its deadlock drove so much in that time, and
    would have driven little more.

    Parameters
    ----------
    scenario
        The content of ``scenario.toml``.
    summary
        The content of ``summary.json``; its duration is that which was measured.
    events
        `EVENT_COLUMNS`; start, edge and lap events suffice.
    """
    row: dict[str, Any] = {name: summary.get(name) for name in ROW_SCHEMA.names}
    row |= {c.STATUS: c.STATUS_OK, c.ERROR: "", c.SCENARIO: _asked(scenario)}
    if isinstance(longest := summary.get("longest_waits_s"), Mapping):
        row |= {name: float(longest.get(cause, 0.0)) for cause, name in c.LONGEST_FOR.items()}
    watch = _part(summary, "watch")
    row |= {name: watch.get(name) for name in _OF_WATCH}
    if isinstance(sinks := summary.get("starving"), list):
        row[c.STARVING] = len({vehicle for sink in sinks for vehicle in sink["vehicles"]})
    standing = _part(summary, "standing")
    row |= {name: standing.get(name) for name in (c.CLOSURES, c.BREAKDOWNS, c.LED_ROUND)}
    row[c.ON_RED] = _part(summary, "at_lights").get(c.ON_RED)
    row |= _time(scenario, summary) | _refusals(summary.get(c.REFUSALS))
    row[c.KM_PER_H_MEASURED] = row[c.KM_PER_H]
    row[c.STOOD_SHARE] = _stood_share(summary)
    all_there = bool(row[c.ARRIVED]) and not row[c.UNFINISHED]  # the run was over, it was not cut off
    if (hours := row[c.DURATION] / 3600) > 0 and row[c.MEASURED] < row[c.DURATION] and not all_there:
        row[c.LAPS_PER_H], row[c.KM_PER_H] = row[c.LAPS] / hours, row[c.DISTANCE_KM] / hours
    row[c.TRUNCATED] = row[c.OUTCOME] == "deadlock" and row[c.MEASURED] < row[c.DURATION]
    decision, wall, versions = (_part(summary, key) for key in ("decision_us", "wall_s", "versions"))
    row |= {
        c.DECISION_MEDIAN: decision.get("median"),
        c.DECISION_P99: decision.get("p99"),
        c.DECISION_MAX: decision.get("max"),
        c.WALL_SUMO: wall.get("sumo"),
        c.WALL_GATE: wall.get("gate"),
        c.WALL_TOTAL: wall.get("total"),
        c.LOOPGATE_VERSION: versions.get("loopgate"),
        c.SUMO_VERSION: versions.get("eclipse-sumo"),
    }
    audit = summary.get(c.AUDIT)
    audit = None if audit == c.NOT_AUDITED else audit
    row[c.AUDIT] = audit if audit is None or isinstance(audit, str) else json.dumps(audit)
    row[c.WARNINGS] = json.dumps(summary.get(c.WARNINGS) or [], ensure_ascii=False)
    row |= _laps(row, events, _begins_s(summary)) | _edges(edges)
    if audit == c.NOT_GATED:  # nobody was held, and nobody measured how long vehicles waited instead
        row |= dict.fromkeys((c.HOLD, c.LONGEST_WAIT, c.EDGE_HOLDS))
    known = [name for name in (c.JUNCTION, c.STREET) if name in edges]
    return RunRow(row, edges[[c.EDGE, c.EDGE_LENGTH, c.SHAPE, *known]])


def _stood_share(summary: Mapping[str, Any]) -> float | None:
    """Return the share of vehicle time standing, which older summaries have by way of the mean speed."""
    if "stood_share" in summary or c.STOOD not in summary or not summary.get(c.DISTANCE_KM):
        return summary.get("stood_share")
    return float(summary[c.STOOD] * summary.get(c.MEAN_SPEED, 0.0) / summary[c.DISTANCE_KM] / 1000.0)


def _asked(scenario: Mapping[str, Any]) -> str | None:
    """Return the scenario as JSON; a seed of the loops that follows from the run's seed was not asked for."""
    seed = scenario.get(c.SEED)
    asked = {name: value for name, value in scenario.items() if name != "loops_seed" or value != seed}
    return json.dumps(asked, sort_keys=True, default=str) if asked else None


def _part(summary: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    part = summary.get(key)
    return part if isinstance(part, Mapping) else {}


def _time(scenario: Mapping[str, Any], summary: Mapping[str, Any]) -> dict[str, Any]:
    deadlocks = summary.get(c.DEADLOCKS) or []
    first = deadlocks[0] if deadlocks else {}
    measured = float(summary[c.DURATION])
    warmup = float(scenario.get(c.WARMUP, 0.0))
    known = "closed_at_s" in first or "at_s" in first
    first_s = closed_at_s(first) - _begins_s(summary) if known else None
    return {
        c.DURATION: float(scenario.get(c.DURATION, measured)),
        c.WARMUP: warmup,
        c.MEASURED: measured,
        c.DEADLOCKS: len(deadlocks),
        c.FIRST_DEADLOCK: first_s,
        c.DEADLOCK_SIZE: len(first["vehicles"]) if "vehicles" in first else None,
        c.OBSERVED: warmup + measured if first_s is None else first_s,
    }


def _begins_s(summary: Mapping[str, Any]) -> float:
    return float(summary.get(c.BEGINS, 0.0))


def _refusals(reasons: object) -> dict[str, Any]:
    if not isinstance(reasons, Mapping):
        return {c.REFUSALS: reasons, c.REFUSAL_REASONS: None}
    return {c.REFUSALS: sum(reasons.values()), c.REFUSAL_REASONS: json.dumps(dict(reasons), sort_keys=True)}


def _laps(row: Mapping[str, Any], events: pd.DataFrame, begins_s: float) -> dict[str, Any]:
    begin, end = begins_s + row[c.WARMUP], begins_s + row[c.WARMUP] + row[c.MEASURED]
    if begin >= end or not row[c.LOOPS]:
        return {c.LAP_MEAN: None, c.LAP_QUANTILES: None, c.LAPLESS: None}
    late = events[c.TIME].gt(max(begin, end - _HALF_HOUR_S)) & events[c.TIME].le(end)
    lapping = events.loc[late & events[c.EVENT].eq(str(c.Event.LAP)), c.VEHICLE].nunique()
    times = compute_laps(events=events, begin_s=begin, end_s=end)[LAP_TIME].to_numpy(dtype=float)
    return {
        c.LAP_MEAN: float(times.mean()) if times.size else None,
        c.LAP_QUANTILES: np.quantile(times, LAP_GRID).tolist() if times.size else None,
        c.LAPLESS: row[c.VEHICLES] - lapping,
    }


def _edges(edges: pd.DataFrame) -> dict[str, Any]:
    named = edges[[c.EDGE, c.EDGE_LENGTH, c.SHAPE]].to_csv(index=False)
    revisits, longest = edges[c.MEAN_REVISIT].dropna(), edges[c.MAX_REVISIT].dropna()
    return {
        c.MEAN_REVISIT: float(revisits.mean()) if len(revisits) else None,
        c.MAX_REVISIT: float(longest.max()) if len(longest) else None,
        c.IDLENESS: float(edges[c.IDLENESS].mean()) if len(edges) else None,
        c.EDGE_KM: float(edges[c.EDGE_LENGTH].sum()) / 1000.0,
        c.EDGE_SET: hashlib.sha256(named.encode()).hexdigest()[:16],
        **{
            column: edges[name].astype(float).tolist() if name in edges else None
            for name, column in c.EDGE_LISTS.items()
        },
    }
