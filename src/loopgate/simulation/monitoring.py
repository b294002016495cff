"""Figures of how well the loops of a run watched the streets, for ``summary.json``."""

from __future__ import annotations

import json
import math
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from statistics import fmean
from typing import Any

import numpy as np
import pandas as pd

from loopgate.abstraction.itinerary import Track
from loopgate.analysis.monitoring import compute_revisit_intervals
from loopgate.analysis.rows import LAP_GRID
from loopgate.analysis.watching import compute_districts, compute_watch
from loopgate.arrays import Floats
from loopgate.disk import writing
from loopgate.network import Edge, Loop
from loopgate.network.coverage import Coverage
from loopgate.network.road import both_ways
from loopgate.results.columns import (
    BOUND,
    BUNCHED,
    EDGE,
    EDGE_LENGTH,
    EVENT,
    HEADWAY_CV,
    IDLENESS,
    IF_EVEN,
    INTERVAL,
    PLACE,
    SHAPE,
    STREET,
    STREET_COLUMNS,
    TIME,
    VISITS,
    WEIGHTED_REVISIT,
    WITHIN,
    WORST_IDLENESS,
    WORST_IF_EVEN,
    Event,
)
from loopgate.results.recorder import read_events
from loopgate.simulation.assembly import Assembly
from loopgate.simulation.run_folder import EVENTS, Folder, Tally
from loopgate.simulation.scenario import Scenario

_LEAST_S = 300.0
"""A street without a visit for a shorter time is not reported [s]."""


def note_unwatched(
    blocked: Iterable[dict[str, Any]],
    tracks: Iterable[Track],
    events: pd.DataFrame,
    *,
    begin_s: float,
    end_s: float,
) -> None:
    """Add to each blocked place the streets without a visit meanwhile, each with its last visit [s].

    These are the edges of loops through the place that no vehicle entered while it was blocked, for at least
    300 s and for longer than ever before.

    Parameters
    ----------
    blocked
        As in ``summary.json``; each gets the key ``unwatched``.
    tracks
        At least one path on each loop.
    events
        The events of entered edges.
    begin_s, end_s
        When the run began and ended [s].
    """
    ways: dict[str, dict[str, None]] = {}
    for track in {one.loop: one for one in tracks}.values():
        for leg in track.legs:
            ways.setdefault(leg.state, {}).update(dict.fromkeys(name for _, name in track.edges))
    rows = events[events[EVENT] == Event.EDGE.value]
    entered = {str(edge): np.sort(some.to_numpy(np.float64)) for edge, some in rows.groupby(PLACE)[TIME]}
    for one in blocked:
        until_s = end_s if one["to_s"] is None else float(one["to_s"])
        edges = ways.get(one["place"], {})
        one["unwatched"] = _unwatched(edges, entered, (begin_s, float(one["from_s"]), until_s, end_s))


def _unwatched(
    edges: Iterable[str], entered: Mapping[str, Floats], times_s: Sequence[float]
) -> dict[str, float]:
    begin_s, from_s, until_s, end_s = times_s
    found: dict[str, float] = {}
    for edge in edges:
        at_s = entered.get(edge, np.zeros(0))
        before, after = at_s[at_s < from_s], at_s[at_s >= from_s]
        if not before.size or (after.size and after[0] < until_s):
            continue
        since_s, seen_s = float(before[-1]), float(after[0]) if after.size else end_s
        longest_s = max(later - sooner for sooner, later in pairwise([begin_s, *before.tolist()]))
        if seen_s - since_s >= max(_LEAST_S, longest_s):
            found[edge] = since_s
    return dict(sorted(found.items()))


STREETS = "streets.parquet"
_RANKED = 10


def monitoring_figures(edges: pd.DataFrame | None, coverage: Coverage | None) -> dict[str, Any]:
    """Return the figures of visits and idleness for ``summary.json``; None for unknown figures.

    Parameters
    ----------
    edges
        ``edges.parquet``; None or empty if nothing was measured. Each edge counts once in the mean,
        whatever its length; `loopgate.analysis.monitoring` defines idleness.
    coverage
        How much of the network the loops reach; None without loops.
    """
    figures: dict[str, Any] = {
        "coverage_edges": round(coverage.of_edges, 6) if coverage else None,
        "coverage_lane_km": round(coverage.of_lane_km, 6) if coverage else None,
    }
    if edges is None or edges.empty:
        nothing = (
            "idleness_s",
            "worst_idleness_s",
            "worst_idleness_edge",
            "worst_idleness_street",
            "unvisited_edges",
        )
        return figures | dict.fromkeys(nothing)
    worst = int(edges[WORST_IDLENESS].to_numpy().argmax())
    return figures | {
        "idleness_s": round(float(edges[IDLENESS].mean()), 3),
        "worst_idleness_s": round(float(edges[WORST_IDLENESS].iloc[worst]), 3),
        "worst_idleness_edge": str(edges[EDGE].iloc[worst]),
        "worst_idleness_street": str(edges[STREET].iloc[worst]),
        "unvisited_edges": int((edges[VISITS] == 0).sum()),
    }


def write_streets(
    scenario: Scenario,
    assembly: Assembly,
    tallies: Sequence[Tally],
    folder: Folder,
    *,
    begin_s: float,
    end_s: float,
) -> dict[str, Any]:
    """Write ``streets.parquet`` from the events, and return its figures for the summary.

    Its streets are all edges open to some vehicle's class, also edges on no loop.
    """
    network, wishes = assembly.network, assembly.wishes
    classes = {start.type.vclass for start in assembly.everybody}
    edges = [edge for edge in network.edges.values() if any(edge.allows(name) for name in classes)]
    bound_s = scenario.revisit_s or math.inf
    bounds = {edge.id: bound_s / wishes.weights.get(edge.id, 1.0) for edge in edges}
    events = read_events(folder / EVENTS, (Event.EDGE,))
    period, since_s = {"begin_s": begin_s, "end_s": end_s}, assembly.begin_s
    watch = compute_watch(events=events, streets=list(bounds), bound_s=bounds, since_s=since_s, **period)
    records = [network.edge(str(name)) for name in watch[EDGE]]
    table = watch.copy()
    table[STREET] = [edge.street for edge in records]
    table[EDGE_LENGTH] = [edge.length_m for edge in records]
    table[SHAPE] = [shape_text(edge) for edge in records]
    table = table[list(STREET_COLUMNS)]
    with writing(folder / STREETS):
        table.to_parquet(folder / STREETS, index=False)
    figures = watch_figures(table, bound_s=bound_s) | _if_even(assembly.loops, tallies, end_s - begin_s)
    intervals = compute_revisit_intervals(events=events, **period)[INTERVAL]
    if len(intervals):
        figures["interval_quantiles_s"] = np.quantile(intervals, LAP_GRID).round(1).tolist()
    streets = both_ways(network, list(bounds))
    figures["either_way"] = _either_way(events, streets, bounds, since_s=since_s, **period)
    if wishes.districts:
        districts = compute_districts(watch=watch, districts=wishes.districts).round(4)
        figures["districts"] = json.loads(districts.to_json(orient="records"))
    return figures


def shape_text(edge: Edge) -> str:
    """Return the shape of an edge's rightmost lane, as tables keep it."""
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in edge.lanes[0].shape)


def _either_way(
    events: pd.DataFrame,
    streets: Sequence[Sequence[str]],
    bounds: Mapping[str, float],
    *,
    since_s: float,
    begin_s: float,
    end_s: float,
) -> dict[str, Any]:
    """Return the figures of streets for which a visit in either direction counts."""
    named = {edge: street[0] for street in streets for edge in street}
    either = events.assign(**{PLACE: events[PLACE].map(lambda edge: named.get(edge, edge))})
    table = compute_watch(
        events=either,
        streets=[street[0] for street in streets],
        since_s=since_s,
        begin_s=begin_s,
        end_s=end_s,
        bound_s={street[0]: min(bounds[edge] for edge in street) for street in streets},
    )
    figures = _idleness(table, table[table[VISITS] > 0])
    return figures | ({"within": rounded(table[WITHIN].mean())} if np.isfinite(table[BOUND]).all() else {})


def watch_figures(table: pd.DataFrame, *, bound_s: float) -> dict[str, Any]:
    """Return the figures of all streets for ``summary.json``; each street counts once."""
    seen = table[table[VISITS] > 0]
    figures = _idleness(table, seen) | {
        "weighted_revisit_s": rounded(seen[WEIGHTED_REVISIT].mean()),
        "headway_cv": rounded(seen[HEADWAY_CV].mean()),
        "bunched": rounded(seen[BUNCHED].mean()),
        "rarest": _ranked(seen),
    }
    if np.isfinite(bound_s):
        broken = seen[seen[WITHIN] < 1.0]
        order = (broken[WORST_IDLENESS] / broken[BOUND]).sort_values(ascending=False, kind="stable").index
        figures |= {
            "bound_s": bound_s,
            "within": rounded(table[WITHIN].mean()),
            "within_of_seen": rounded(seen[WITHIN].mean()),
            "streets_over": len(broken),
            "broken": _ranked(broken.loc[order]),
        }
    return figures


def _idleness(table: pd.DataFrame, seen: pd.DataFrame) -> dict[str, Any]:
    return {
        "streets": len(table),
        "never_seen": len(table) - len(seen),
        "idleness_of_all_s": rounded(table[IDLENESS].mean()),
        "idleness_of_seen_s": rounded(seen[IDLENESS].mean()),
        "worst_idleness_of_seen_s": rounded(seen[WORST_IDLENESS].max()),
    }


def _ranked(streets: pd.DataFrame) -> list[dict[str, Any]]:
    columns = [EDGE, STREET, VISITS, IDLENESS, WORST_IDLENESS, BOUND, WITHIN]
    return [
        {
            "edge": edge,
            "street": street,
            "visits": int(visits),
            "idleness_s": rounded(mean),
            "worst_idleness_s": rounded(worst),
            **({"bound_s": rounded(bound), "within": rounded(within)} if math.isfinite(bound) else {}),
        }
        for edge, street, visits, mean, worst, bound, within in streets[columns]
        .head(_RANKED)
        .itertuples(index=False)
    ]


def rounded(value: float) -> float | None:
    """Return a figure as summaries have it; None for NaN."""
    return None if math.isnan(value) else round(float(value), 4)


def _if_even(loops: Sequence[Loop], tallies: Sequence[Tally], duration_s: float) -> dict[str, float | None]:
    """Return the idleness if the vehicles of each loop came at even intervals, at their real speeds.

    A street is visited at the sum of the rates of its loops. Its interval is the inverse of that sum, its
    mean idleness half of the interval.
    """
    driven = defaultdict[str, float](float)
    for tally in tallies:
        driven[tally.loop] += tally.distance_m
    visits = defaultdict[str, float](float)
    for loop in loops:
        for edge in loop.edges:
            visits[edge] += driven[loop.id] / loop.length_m
    if not visits or min(visits.values()) <= 0.0:
        return {IF_EVEN: None, WORST_IF_EVEN: None}
    intervals = [duration_s / number for number in visits.values()]
    return {IF_EVEN: round(fmean(intervals) / 2.0, 3), WORST_IF_EVEN: round(max(intervals), 3)}
