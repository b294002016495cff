"""Tables whose values no run has: one line that names the function, whatever it stumbles on."""

from __future__ import annotations

import pickle
from collections.abc import Callable

import pandas as pd
import pytest

from loopgate import analysis, plots
from loopgate.errors import AnalysisError

RUNS = pd.DataFrame({"gate": "open", "vehicles": 20, "laps": 5, "km_per_h": [9.0, 8.0]})
RAGGED = pd.Series([[1.0, 2.0], [3.0]])
EDGES = pd.DataFrame({"edge": ["e1"], "shape": ["here"], "gate": "open", "stood_s": [3.0]})
EVENTS = pd.DataFrame({"time_s": ["x", "y"], "vehicle": "v1", "event": ["start", "lap"], "place": "p"})


@pytest.mark.parametrize(
    ("name", "use"),
    [
        (
            "compute_lap_distribution",
            lambda: analysis.compute_lap_distribution(runs=RUNS.assign(lap_quantiles_s=RAGGED)),
        ),
        ("compute_mean", lambda: analysis.compute_mean(runs=RUNS.assign(km_per_h="fast"))),
        ("compute_laps", lambda: analysis.compute_laps(events=EVENTS, end_s=9.0)),
        ("plot_edges", lambda: plots.plot_edges(EDGES, "stood_s")),
        ("plot_flow", lambda: plots.plot_flow(pd.DataFrame({"time_s": ["x"]}))),
    ],
)
def test_one_line(name: str, use: Callable[[], object]) -> None:
    """Python's own error is its cause."""
    with pytest.raises(AnalysisError) as caught:
        use()
    assert str(caught.value).startswith(f"{name}: its tables hold what no run has (")
    assert "\n" not in str(caught.value)
    assert caught.value.__cause__ is not None


def test_a_wrong_call_stays_one() -> None:
    """It is no fault of a table."""
    with pytest.raises(TypeError, match="unexpected keyword argument"):
        analysis.compute_mean(runs=RUNS, of="x")  # type: ignore[call-arg]


def test_functions_travel_to_other_processes() -> None:
    """By the name under which they are offered."""
    for function in (analysis.compute_mean, plots.plot_mean):
        assert pickle.loads(pickle.dumps(function)) is function  # noqa: S301  it was made here
