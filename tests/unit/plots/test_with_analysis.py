"""Each figure from the plain result of the function that makes its table, by one call each."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from loopgate import analysis, plots, read_results, read_run
from loopgate.plots.charts import figure_spec
from loopgate.runs.results import Results
from loopgate.runs.run import Run
from loopgate.sweep import Sweep, run_sweep
from loopgate.sweep.task import load_runner

RUNNER = f"{Path(__file__).parents[1] / 'sweep' / 'fake_runner.py'}:run"

OF_RUNS: dict[str, tuple[Callable[..., Any], ...]] = {
    "compute_mean": (plots.plot_mean,),
    "compute_fundamental": (plots.plot_fundamental,),
    "compute_deadlock_rate": (plots.plot_deadlock_rate,),
    "compute_decision_time": (plots.plot_decision_time,),
    "compute_lap_distribution": (plots.plot_laps,),
    "compute_longest_waits": (plots.plot_ranked,),
    "compute_capacity": (plots.plot_capacity,),
    "compute_survival": (plots.plot_survival,),
    "compute_paired": (plots.plot_paired,),
    "compute_edge_means": (plots.plot_edges,),
    "compute_ranked": (plots.plot_ranked,),
}
"""By the function of the table: the figures that show it."""

OF_ONE: dict[str, Callable[..., Any]] = {
    "compute_flow": plots.plot_flow,
    "compute_causes": plots.plot_ranked,
    "compute_time_space": plots.plot_time_space,
    "compute_seen_within": plots.plot_seen_within,
    "compute_rarest": plots.plot_ranked,
    "compute_worst_movements": plots.plot_ranked,
}
ELSEWHERE = {"figure_svg", "plot_against", "plot_unwatched"}
"""What takes any table, or one that no function makes."""


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    """Return a small sweep."""
    folder = tmp_path_factory.mktemp("sweep")
    grid: dict[str, list[Any]] = {"vehicles": [40, 80], "gate": ["open", "certified"], "seed": [1, 2, 3]}
    with ThreadPoolExecutor(1) as pool:
        run_sweep(
            Sweep("made", {"network": "sumo:DRT", "duration_s": 400}, grid),
            folder,
            executor=pool,
            runner=RUNNER,
        )
    return read_results(folder)


@pytest.fixture(scope="module")
def one(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """Return a run folder."""
    folder = tmp_path_factory.mktemp("one")
    load_runner(RUNNER)({"vehicles": 40, "gate": "certified", "seed": 1, "duration_s": 900}, folder)
    return read_run(folder)


def rows_drawn(chart: Any) -> int:  # noqa: ANN401 - Altair's own chart types
    """Return how many rows the largest data of a figure have."""
    spec = figure_spec(chart)
    inline = [len(spec.get("data", {}).get("values", ()))]
    return max([*inline, *(len(rows) for rows in spec.get("datasets", {}).values())])


@pytest.mark.parametrize("by", [None, ["gate", "vehicles"], ["series", "vehicles"], ["series"], []])
@pytest.mark.parametrize("name", OF_RUNS)
def test_a_table_of_runs_is_drawn_by_one_call(results: Results, name: str, by: list[str] | None) -> None:
    """Whatever the runs were grouped by: by gate, by series, or not at all."""
    runs = analysis.add_series(results.runs)
    options: dict[str, Any] = {} if by is None else {"by": by}
    if name in {"compute_edge_means", "compute_ranked"}:
        options |= {"edge_sets": results.edge_sets}
    if name == "compute_paired":
        options = {"baseline": "open"}
        if by and by[0] == "series":
            options = {"baseline": "SUMO's rules", "of": "series"}
    needs_vehicles = name not in {
        *("compute_capacity", "compute_survival", "compute_edge_means", "compute_ranked"),
        *("compute_fundamental", "compute_paired", "compute_longest_waits"),
    }
    if by is not None and needs_vehicles and "vehicles" not in by:
        pytest.skip("drawn against vehicles, and the table has none")
    if name == "compute_capacity" and by and "vehicles" in by:
        pytest.skip("the vehicles are what it finds")
    table = getattr(analysis, name)(runs=runs, **options)
    assert len(table)
    for plot in OF_RUNS[name]:
        chart = plot(table)
        assert plots.figure_svg(chart).endswith("</svg>")
        assert rows_drawn(chart) > 0


@pytest.mark.parametrize("name", OF_ONE)
def test_a_table_of_a_run_is_drawn_by_one_call(one: Run, name: str) -> None:
    """Movements and streets, which the fake run has not, as their functions return them."""
    movement = {"junction": "J", "movement": "a to b", "lost_h": 0.2}
    street = {"edge": "e1", "street": "", "worst_idleness_s": 9.0}
    table = {
        "compute_flow": lambda: analysis.compute_flow(flow=one.flow),
        "compute_causes": lambda: analysis.compute_causes(events=one.events, end_s=900.0),
        "compute_time_space": lambda: analysis.compute_time_space(
            events=one.events, vehicles=one.vehicles, loops=one.loops, loop=one.loops["loop"].iloc[0]
        ),
        "compute_seen_within": lambda: analysis.compute_seen_within(
            events=one.events, streets=one.edges["edge"], end_s=900.0
        ),
        "compute_rarest": lambda: pd.DataFrame([street]),
        "compute_worst_movements": lambda: pd.DataFrame([movement]),
    }[name]()
    assert len(table)
    chart = OF_ONE[name](table)
    assert plots.figure_svg(chart).endswith("</svg>")
    assert rows_drawn(chart) > 0


def test_no_figure_is_left_out() -> None:
    """A figure that is new has its table here."""
    known = {plot.__name__ for some in OF_RUNS.values() for plot in some}
    assert known | {plot.__name__ for plot in OF_ONE.values()} | ELSEWHERE == set(plots.__all__)


def test_runs_that_are_not_grouped_are_points(results: Results) -> None:
    """A line through single runs, several of which have one density, would go to and fro."""
    alone = plots.plot_fundamental(analysis.compute_fundamental(runs=results.runs)).to_dict()
    grouped = plots.plot_fundamental(analysis.compute_fundamental(runs=results.runs, by=["gate", "vehicles"]))
    assert [layer["mark"]["type"] for layer in alone["layer"]] == ["point"]
    assert [layer["mark"]["type"] for layer in grouped.to_dict()["layer"]] == ["line", "point"]


def test_axes_say_what_was_asked_for(results: Results) -> None:
    """Words with a unit, as a paper has them."""
    means = analysis.compute_mean(runs=results.runs, value="laps_per_h")
    drawn = plots.figure_svg(plots.plot_mean(means))
    assert ">laps [1/h]<" in drawn
    drawn = plots.figure_svg(plots.plot_fundamental(analysis.compute_fundamental(runs=results.runs)))
    assert ">density [veh/km], of road on loops<" in drawn
    assert ">flow [veh/h]<" in drawn
