"""Means, pairs, capacity and the fundamental diagram against cases worked out by hand."""

import pandas as pd
import pytest

from loopgate.analysis import compute_capacity, compute_fundamental, compute_mean, compute_paired
from loopgate.errors import AnalysisError


def runs(*rows: tuple[str, int, int, float]) -> pd.DataFrame:
    return pd.DataFrame(rows, columns=["gate", "vehicles", "seed", "km_per_h"]).assign(status="ok")


def test_mean_by_group() -> None:
    """Two groups; the failed run does not count."""
    table = runs(("a", 10, 0, 4.0), ("a", 10, 1, 6.0), ("b", 10, 0, 1.0), ("b", 10, 1, 99.0))
    table.loc[3, "status"] = "failed"
    result = compute_mean(runs=table)
    assert result["mean"].tolist() == [5.0, 1.0]
    assert result["runs"].tolist() == [2, 1]
    assert result["std"].tolist()[0] == pytest.approx(2**0.5)
    assert pd.isna(result["low"].tolist()[1])


def test_pairs_are_runs_with_the_same_seed() -> None:
    """Differences 2, 4 on seeds 0, 1; seed 2 has no partner. Ratio of sums: 16 / 10."""
    table = runs(
        ("a", 10, 0, 4.0), ("a", 10, 1, 6.0), ("b", 10, 1, 10.0), ("b", 10, 0, 6.0), ("b", 10, 2, 0.0)
    )
    row = compute_paired(runs=table, baseline="a").iloc[0]
    assert (row["gate"], row["baseline"], row["pairs"]) == ("b", "a", 2)
    assert (row["difference"], row["ratio"], row["better"]) == (3.0, 1.6, 1.0)
    assert row["interval"] == "none"  # of two pairs nothing is claimed
    assert pd.isna(row["low"])
    assert pd.isna(row["high"])


def test_few_pairs_have_the_interval_of_the_paired_t_test_and_many_that_of_the_bootstrap() -> None:
    """Differences 1, 2, 6: 3 with a deviation of 7^0.5; the bootstrap of three lies within their ends."""
    gains = (1.0, 2.0, 6.0, 3.0, 4.0, 2.0, 1.0, 5.0)
    for pairs, kind in ((3, "paired t"), (7, "paired t"), (8, "bootstrap")):
        rows = [(gate, 10, s, 9.0 + gains[s] * (gate == "b")) for gate in "ab" for s in range(pairs)]
        row = compute_paired(runs=runs(*rows), baseline="a").iloc[0]
        assert row["interval"] == kind
        if kind == "paired t" and len(rows) == 6:
            half = 4.302653 * (7.0 / 3.0) ** 0.5
            assert (row["low"], row["high"]) == (pytest.approx(3 - half), pytest.approx(3 + half))
            assert row["low"] < 0.0
        assert row["low"] < row["difference"] < row["high"]


def test_a_pair_that_could_be_two_is_refused() -> None:
    """Two runs with the same gate, vehicles and seed differ in something the caller did not name."""
    table = runs(("a", 10, 0, 4.0), ("a", 10, 0, 6.0))
    with pytest.raises(AnalysisError, match="several runs have gate a, vehicles 10, seed 0"):
        compute_paired(runs=table, baseline="a")


def test_an_unknown_baseline_is_named() -> None:
    """The error lists the gates there are."""
    with pytest.raises(AnalysisError, match="baseline x: no run used that gate; there are a"):
        compute_paired(runs=runs(("a", 10, 0, 4.0)), baseline="x")


def test_capacity_is_where_the_mean_peaks() -> None:
    """Means 5, 9, 7 at 10, 20, 30 vehicles; the seeds agree, so the interval is the peak alone."""
    table = runs(*(("a", n, s, v + s / 10) for n, v in [(10, 5.0), (20, 9.0), (30, 7.0)] for s in range(3)))
    row = compute_capacity(runs=table).iloc[0]
    assert (row["capacity_vehicles"], row["low"], row["high"]) == (20, 20, 20)
    assert row["peak"] == pytest.approx(9.1)
    assert not row["at_border"]
    border = compute_capacity(runs=table[table["vehicles"] < 30]).iloc[0]
    assert border["at_border"]
    assert pd.isna(border["high"])
    one = compute_capacity(runs=table[table["seed"] < 2]).iloc[0]
    assert pd.isna(one["low"])
    assert pd.isna(one["high"])


def test_fundamental_diagram() -> None:
    """40 vehicles on 8 km are 5 per km; 240 vehicle-km/h on them are 30 per hour; 10 m/s are 36 km/h."""
    table = runs(("a", 40, 0, 240.0), ("a", 1, 0, 0.0)).assign(edge_km=[8.0, 0.0], mean_speed_mps=10.0)
    result = compute_fundamental(runs=table)
    row = result.iloc[0]
    assert len(result) == 1
    assert (row["density_veh_per_km"], row["flow_veh_per_h"], row["speed_km_per_h"]) == (5.0, 30.0, 36.0)


def test_no_runs() -> None:
    """Empty tables keep their columns."""
    assert "mean" in compute_mean(runs=runs()).columns
    assert "at_border" in compute_capacity(runs=runs()).columns
