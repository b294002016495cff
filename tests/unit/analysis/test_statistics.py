"""Intervals and estimators against published figures and cases worked out by hand."""

import numpy as np
import pytest

from loopgate.analysis.statistics import (
    bootstrap_interval,
    mean_interval,
    weighted_quantiles,
    wilson_interval,
)
from loopgate.errors import AnalysisError


@pytest.mark.parametrize(
    ("successes", "trials", "low", "high"),
    [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611), (1, 29, 0.0061, 0.1718)],
)
def test_wilson_as_published(successes: int, trials: int, low: float, high: float) -> None:
    """Newcombe, Statistics in Medicine 17 (1998) 857-872, Table I, method 3."""
    interval = wilson_interval(successes, trials)
    assert interval.estimate == successes / trials
    assert (interval.low, interval.high) == pytest.approx((low, high), abs=5e-5)


def test_wilson_without_trials_knows_nothing() -> None:
    """No runs: no rate and no interval, and no error."""
    assert np.isnan(wilson_interval(0, 0)).all()


def test_more_successes_than_trials_are_refused() -> None:
    """The error says both."""
    with pytest.raises(AnalysisError, match="3 of 2 is no rate"):
        wilson_interval(3, 2)


def test_mean_interval_by_hand() -> None:
    """1, 2, 3: mean 2, deviation 1, t(0.975; 2) = 4.3027, half width 4.3027 / sqrt(3) = 2.4841."""
    interval = mean_interval([1, 2, np.nan, 3])
    assert interval == pytest.approx((2, 2 - 2.4841, 2 + 2.4841), abs=1e-4)


def test_one_value_has_no_interval() -> None:
    """A single run says nothing of the spread."""
    assert mean_interval([7])[0] == 7
    assert np.isnan(mean_interval([7])[1:]).all()
    assert np.isnan(bootstrap_interval([7])[1:]).all()
    assert np.isnan(mean_interval([])).all()


def test_bootstrap_is_the_same_each_time_and_holds_the_mean() -> None:
    """The interval of 0..9 lies about the mean 4.5, within a normal interval's reach of 1.9."""
    once, again = bootstrap_interval(range(10), seed=3), bootstrap_interval(range(10), seed=3)
    assert once == again
    assert 2.3 < once.low < 3.2
    assert 5.8 < once.high < 6.7
    assert bootstrap_interval([2.0, 2.0, 2.0]) == (2, 2, 2)


def test_weighted_quantiles_by_hand() -> None:
    """Weights 1, 1, 2 on 10, 20, 30: a quarter is at 10, a half at 20, all above at 30."""
    assert weighted_quantiles([30, 10, 20], [2, 1, 1], [0.25, 0.5, 0.51, 1]).tolist() == [10, 20, 30, 30]
    assert np.isnan(weighted_quantiles([], [], [0.5])).all()


def test_a_level_that_is_none() -> None:
    """95 is a percentage, not a level."""
    with pytest.raises(AnalysisError, match="level 95 is no confidence level"):
        mean_interval([1, 2], level=95)
