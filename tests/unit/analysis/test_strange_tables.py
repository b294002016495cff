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


ROWS = [(10, "v1", "edge", "e1"), (40, "v2", "edge", "e1"), (70, "v1", "edge", "e2")]
SEEN = pd.DataFrame(ROWS, columns=["time_s", "vehicle", "event", "place"])
LAPPED = RUNS.assign(lap_quantiles_s=pd.Series([[float(number) for number in range(21)]] * 2))
LOCKED = RUNS.assign(first_deadlock_s=[9.0, float("nan")], observed_s=[9.0, 60.0])
STREETS = pd.DataFrame(
    {"edge": ["e1"], "street": "", "visits": 3, "idleness_s": 9.0, "worst_idleness_s": 20.0}
)


def test_a_name_is_a_list_of_one() -> None:
    """As in pandas; its letters are no columns and no streets."""
    assert analysis.compute_mean(runs=RUNS, by="gate")["gate"].tolist() == ["open"]
    pairs = pd.DataFrame({"gate": ["open", "mine"], "seed": 1, "vehicles": 2, "km_per_h": [9.0, 8.0]})
    paired = analysis.compute_paired(runs=pairs, baseline="open", by="vehicles", match="seed")
    assert paired["pairs"].tolist() == [1]
    watch = analysis.compute_watch(events=SEEN, streets="e1", end_s=100, bound_s=60)
    assert watch["edge"].tolist() == ["e1"]
    assert analysis.compute_districts(watch=watch, districts={"north": "e1"})["streets"].tolist() == [1]
    within = analysis.compute_seen_within(events=SEEN, streets="e1", end_s=100, times_s=[100])
    assert within["always"].tolist() == [1.0]


FLOW = pd.DataFrame({"time_s": [10.0], "vehicles": 5, "standing": 0, "distance_m": 9.0, "laps": 1})


@pytest.mark.parametrize(
    ("use", "message"),
    [
        (
            lambda: analysis.compute_rarest(streets=STREETS, first=-1),
            "first is -1; expected a number from 1 on",
        ),
        (
            lambda: analysis.compute_capacity(runs=RUNS, resamples=0),
            "resamples is 0; expected a number from 1 on",
        ),
        (lambda: analysis.compute_capacity(runs=RUNS, level=-1), "level -1 is no confidence level"),
        (lambda: analysis.compute_survival(runs=LOCKED, level=95), "level 95 is no confidence level"),
        (lambda: analysis.compute_lap_distribution(runs=LAPPED, quantiles=[50]), "quantile 50 is none"),
        (
            lambda: analysis.compute_time_to_deadlock(runs=LOCKED, horizon_s=float("nan")),
            "horizon nan s is none",
        ),
        (
            lambda: analysis.compute_flow(flow=FLOW, every_s=float("nan")),
            "intervals of nan s are too short",
        ),
        (
            lambda: analysis.compute_watch(events=SEEN, streets=["e1"], end_s=100, bound_s=-1),
            "bound_s of e1 is -1; expected seconds from 0 on",
        ),
        (
            lambda: analysis.compute_watch(events=SEEN, streets=["e1", "e2"], end_s=100, bound_s={"e1": 9.0}),
            "bound_s of e2 is None",
        ),
        (
            lambda: analysis.compute_paired(runs=RUNS.assign(seed=1), baseline=3, of="vehicles", by="gate"),  # type: ignore[arg-type]
            "baseline 3: no run used that vehicles; there are 20",
        ),
    ],
)
def test_numbers_that_mean_nothing_are_refused(use: Callable[[], object], message: str) -> None:
    """None of these was told: the last rows were missing, or a figure was one of something else."""
    with pytest.raises(AnalysisError, match=message):
        use()


def test_no_mean_time_to_deadlock_beyond_what_was_observed() -> None:
    """Half of the runs locked up at 9 s, the others were watched for 60 s: of 1000 s nothing is known."""
    near, far = (
        analysis.compute_time_to_deadlock(runs=LOCKED, by="gate", horizon_s=until)["restricted_mean_s"]
        for until in (60.0, 1000.0)
    )
    assert near.tolist() == [0.5 * 9.0 + 0.5 * 60.0]
    assert far.isna().all()


def test_a_wrong_call_stays_one() -> None:
    """It is no fault of a table."""
    with pytest.raises(TypeError, match="unexpected keyword argument"):
        analysis.compute_mean(runs=RUNS, of="x")  # type: ignore[call-arg]


def test_functions_travel_to_other_processes() -> None:
    """By the name under which they are offered."""
    for function in (analysis.compute_mean, plots.plot_mean):
        assert pickle.loads(pickle.dumps(function)) is function  # noqa: S301  it was made here
