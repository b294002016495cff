"""Lap distributions, decision time and edge means against cases worked out by hand."""

import numpy as np
import pandas as pd

from loopgate.analysis import compute_decision_time, compute_edge_means, compute_lap_distribution

FIGURES = ["runs", "visits", "hold_s", "mean_revisit_s", "max_revisit_s"]


def test_lap_distribution_weighs_runs_by_their_laps() -> None:
    """30 laps of 10 s and 10 laps of 50 s: the 75 % quantile is still 10 s, the next one 50 s."""
    runs = pd.DataFrame(
        {
            "status": "ok",
            "gate": "a",
            "vehicles": 5,
            "laps": [30, 10, 0],
            "lap_quantiles_s": [np.full(21, 10.0), np.full(21, 50.0), None],
        }
    )
    table = compute_lap_distribution(runs=runs, quantiles=[0.5, 0.75, 0.76])
    assert table["lap_s"].tolist() == [10.0, 10.0, 50.0]
    assert table["laps"].tolist() == [40, 40, 40]
    assert compute_lap_distribution(runs=runs.iloc[:0]).empty


def test_lap_distribution_of_one_run_is_its_own() -> None:
    """Laps spread evenly over 0 to 100 s: the middle of the slice that holds the median."""
    runs = pd.DataFrame(
        {"gate": "a", "vehicles": 5, "laps": [100], "lap_quantiles_s": [np.linspace(0, 100, 21)]}
    )
    assert compute_lap_distribution(runs=runs, quantiles=[0.5])["lap_s"].tolist() == [47.5]


def test_decision_time() -> None:
    """Medians over runs, the greatest maximum; messages only over the runs that count them."""
    runs = pd.DataFrame(
        {
            "gate": "a",
            "vehicles": 5,
            "decisions": [10, 30],
            "refusals": [5, 5],
            "messages": [40.0, np.nan],
            "decision_median_us": [1.0, 3.0],
            "decision_p99_us": [5.0, 7.0],
            "decision_max_us": [9.0, 8.0],
        }
    )
    row = compute_decision_time(runs=runs).iloc[0]
    assert (row["decision_median_us"], row["decision_p99_us"], row["decision_max_us"]) == (2.0, 6.0, 9.0)
    assert (row["decisions"], row["refused_share"], row["messages_per_decision"]) == (40, 0.25, 4.0)


def test_edge_means_over_runs_with_different_loops() -> None:
    """Edge b is on the loops of both sets; its hold is (2 + 4 + 9) / 3; a is never revisited in run 2."""
    sets = {
        "one": pd.DataFrame({"edge": ["a", "b"], "length_m": 1.0, "shape": ["0,0 1,0", "1,0 1,1"]}),
        "two": pd.DataFrame({"edge": ["b"], "length_m": 1.0, "shape": ["1,0 1,1"]}),
    }
    runs = pd.DataFrame(
        {
            "gate": "g",
            "edge_set": ["one", "one", "two", "unknown"],
            "edge_visits": [[1, 2], [3, 4], [6], [1]],
            "edge_hold_s": [[0.0, 2.0], [1.0, 4.0], [9.0], [1.0]],
            "edge_mean_revisit_s": [[5.0, 1.0], [np.nan, 2.0], [3.0], [1.0]],
            "edge_idleness_s": [[4.0, 1.0], [2.0, 2.0], [6.0], [1.0]],
            "edge_max_revisit_s": [[7.0, 1.0], [np.nan, 2.0], [8.0], [1.0]],
        }
    )
    table = compute_edge_means(runs=runs, edge_sets=sets).set_index("edge")
    assert list(table.loc["a", FIGURES]) == [2, 2.0, 0.5, 5.0, 7.0]
    assert list(table.loc["b", FIGURES]) == [3, 4.0, 5.0, 2.0, 8.0]
    assert list(table["idleness_s"]) == [3.0, 3.0]
