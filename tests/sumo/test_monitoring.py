"""What a run says of its monitoring, recomputed from its events second by second and from the network."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from loopgate.network import RoadNetwork
from loopgate.results.columns import EVENT, PLACE, TIME, Event
from loopgate.results.recorder import read_events
from loopgate.simulation.assembly import assemble
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario

pytestmark = pytest.mark.sumo

GRID = str(Path(__file__).parents[2] / "networks" / "grid5-priority.net.xml")


@pytest.mark.parametrize("warmup_s", [0.0, 200.0])
def test_idleness_of_a_run_counted_second_by_second(tmp_path: Path, warmup_s: float) -> None:
    """Six vehicles, 400 s: at the end of every second, how long ago each edge was entered.

    Steps are 1 s long, so visits fall on whole seconds; just before a visit the time since the last one is
    greatest, and over a second its mean is half a second less than at the second's end.
    """
    scenario = Scenario(network=GRID, loops=6, duration_s=400.0, warmup_s=warmup_s)
    summary = simulate(scenario, tmp_path / "run")
    events = read_events(tmp_path / "run" / "events.parquet")
    visits = events[events[EVENT] == Event.EDGE]
    begin = events[TIME].min() + warmup_s
    edges = {edge for loop in assemble(scenario).loops for edge in loop.edges}
    entered = {edge: np.sort(part[TIME].to_numpy()) for edge, part in visits.groupby(PLACE)}
    assert set(entered) <= edges
    means, worst = [], 0.0
    for edge in edges:
        times = entered.get(edge, np.zeros(0))
        since = [s - max(times[times < s], default=0.0) for s in begin + np.arange(1, 401)]
        means.append(np.mean(since) - 0.5)
        worst = max(worst, *since)
    assert summary["duration_s"] == 400.0
    assert summary["idleness_s"] == pytest.approx(np.mean(means), abs=1e-3)
    assert summary["worst_idleness_s"] == worst
    assert summary["idleness_s"] <= summary["worst_idleness_s"]
    table = pd.read_parquet(tmp_path / "run" / "edges.parquet")
    assert summary["unvisited_edges"] == int((table["visits"] == 0).sum())
    assert table.set_index("edge")["worst_idleness_s"].idxmax() == summary["worst_idleness_edge"]


def test_coverage_is_that_of_the_loops_that_are_driven(tmp_path: Path) -> None:
    """One lane per edge in the grid: both shares follow from the edges' names and lengths."""
    scenario = Scenario(network=GRID, loops=6, vehicles=3, duration_s=30.0)
    summary = simulate(scenario, tmp_path / "run")
    network = RoadNetwork.open(GRID)
    driven = set(pd.read_parquet(tmp_path / "run" / "edges.parquet")["edge"])
    assert summary["coverage_edges"] == pytest.approx(len(driven) / len(network.edges), abs=1e-6)
    metres = {edge.id: edge.length_m for edge in network.edges.values()}
    share = sum(metres[edge] for edge in driven) / sum(metres.values())
    assert summary["coverage_lane_km"] == pytest.approx(share, abs=1e-6)


def test_starts_are_even_and_more_vehicles_go_where_laps_are_long() -> None:
    """Ten vehicles on three loops, all roads as fast: no vehicle more would help another loop as much."""
    made = assemble(Scenario(network=GRID, loops=3, vehicles=10, starts="even"))
    fronts: dict[str, list[float]] = {loop.id: [] for loop in made.loops}
    for start in made.starts:
        fronts[start.loop.id].append(start.track.start_m)
    metres = {loop.id: loop.length_m for loop in made.loops}
    spacing = {loop: metres[loop] / len(at) for loop, at in fronts.items()}
    fewer = [metres[loop] / (len(at) - 1) for loop, at in fronts.items() if len(at) > 1]
    assert max(spacing.values()) <= min(fewer)
    for loop, at in fronts.items():
        gaps = np.diff(sorted(at))
        assert gaps == pytest.approx(spacing[loop], abs=100.0)  # each in the next place with room


def test_weights_districts_and_sides_of_a_street(tmp_path: Path) -> None:
    """A street of weight 4 has a quarter of the bound; a district has its streets; two sides are one."""
    (tmp_path / "weights").write_text("A0B0 4\n", encoding="utf-8")
    area = '<additional><poly id="corner" shape="-50,-50 120,-50 120,120 -50,120"/></additional>'
    (tmp_path / "area.xml").write_text(area, encoding="utf-8")
    scenario = Scenario(
        network=GRID,
        loops=3,
        duration_s=300.0,
        revisit_s=100.0,
        weights=str(tmp_path / "weights"),
        districts=str(tmp_path / "area.xml"),
    )
    watch = simulate(scenario, tmp_path / "run")["watch"]
    streets = pd.read_parquet(tmp_path / "run" / "streets.parquet").set_index("edge")
    assert streets["bound_s"].to_dict() == {edge: 25.0 if edge == "A0B0" else 100.0 for edge in streets.index}
    assert len(streets) == watch["streets"] == 80
    assert watch["either_way"]["streets"] == 40
    assert watch["either_way"]["never_seen"] < watch["never_seen"]
    (corner,) = watch["districts"]
    inside = streets.loc[["A0B0", "B0A0", "A0A1", "A1A0", "A1B1", "B1A1", "B0B1", "B1B0"]]
    assert (corner["district"], corner["streets"]) == ("corner", 8)
    assert corner["idleness_s"] == pytest.approx(inside["idleness_s"].mean(), abs=1e-3)
