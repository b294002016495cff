"""Intervals and estimators shared by the comparisons, each on SciPy where SciPy has it."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import scipy

from loopgate.arrays import Floats
from loopgate.errors import AnalysisError

_RESAMPLES = 2000
_BOOTSTRAP_FROM = 8
FEWEST = 3
"""Of fewer pairs, or runs, nothing is claimed."""

BOOTSTRAP, PAIRED_T, NO_INTERVAL = "bootstrap", "paired t", "none"
"""Kinds of intervals of paired differences."""


class Interval(NamedTuple):
    """An estimate with its interval."""

    estimate: float
    low: float
    high: float


def wilson_interval(successes: int, trials: int, *, level: float = 0.95) -> Interval:
    """Return a rate with its Wilson score interval (Wilson 1927); NaN without trials.

    Raises `AnalysisError` if `successes` is not between 0 and `trials`, or `level` not between 0 and 1.
    """
    check_level(level)
    if not 0 <= successes <= trials:
        msg = f"{successes} of {trials} is no rate; expected 0 <= successes <= trials"
        raise AnalysisError(msg)
    if trials == 0:
        return Interval(np.nan, np.nan, np.nan)
    bounds = scipy.stats.binomtest(successes, trials).proportion_ci(confidence_level=level, method="wilson")
    return Interval(successes / trials, float(bounds.low), float(bounds.high))


def mean_interval(values: npt.ArrayLike, *, level: float = 0.95) -> Interval:
    """Return the mean with Student's t interval; the interval is NaN for fewer than two values.

    Raises `AnalysisError` if `level` is not between 0 and 1.
    """
    check_level(level)
    sample = _finite(values)
    if sample.size == 0:
        return Interval(np.nan, np.nan, np.nan)
    mean = float(sample.mean())
    if sample.size == 1:
        return Interval(mean, np.nan, np.nan)
    quantile = scipy.stats.t.ppf((1 + level) / 2, sample.size - 1)
    half = float(quantile * sample.std(ddof=1) / np.sqrt(sample.size))
    return Interval(mean, mean - half, mean + half)


def bootstrap_interval(values: npt.ArrayLike, *, level: float = 0.95, seed: int = 0) -> Interval:
    """Return the mean with its bias-corrected and accelerated bootstrap interval (Efron 1987).

    The interval is NaN for fewer than two values, and the value itself if all are equal. The same seed
    gives the same interval.

    Raises `AnalysisError` if `level` is not between 0 and 1.
    """
    check_level(level)
    sample = _finite(values)
    if sample.size == 0:
        return Interval(np.nan, np.nan, np.nan)
    mean = float(sample.mean())
    if sample.size == 1:
        return Interval(mean, np.nan, np.nan)
    if np.ptp(sample) <= 1e-12 * max(1.0, float(np.abs(sample).max())):
        return Interval(mean, mean, mean)
    result = scipy.stats.bootstrap(
        (sample,),
        np.mean,
        confidence_level=level,
        n_resamples=_RESAMPLES,
        method="BCa",
        rng=np.random.default_rng(seed),
    )
    return Interval(mean, float(result.confidence_interval.low), float(result.confidence_interval.high))


def paired_interval(
    differences: npt.ArrayLike, *, level: float = 0.95, seed: int = 0
) -> tuple[Interval, str]:
    """Return the mean of paired differences with an interval, and the name of the kind of interval.

    From eight pairs on it is the bootstrap's, see `bootstrap_interval`. The bootstrap of fewer differences is
    too narrow: that of two has only two ends. There it is that of the paired t-test, Student's t on the
    differences. Of fewer than three pairs no interval is given, and its kind is ``none``.

    Raises `AnalysisError` if `level` is not between 0 and 1.
    """
    sample = _finite(differences)
    if sample.size >= _BOOTSTRAP_FROM:
        return bootstrap_interval(sample, level=level, seed=seed), BOOTSTRAP
    found = mean_interval(sample, level=level)
    if sample.size >= FEWEST:
        return found, PAIRED_T
    return Interval(found.estimate, np.nan, np.nan), NO_INTERVAL


def weighted_quantiles(values: npt.ArrayLike, weights: npt.ArrayLike, quantiles: npt.ArrayLike) -> Floats:
    """Return the smallest values at which the cumulative weight reaches each quantile; NaN if empty."""
    sample, weight = np.asarray(values, dtype=float), np.asarray(weights, dtype=float)
    wanted = np.asarray(quantiles, dtype=float)
    keep = np.isfinite(sample) & (weight > 0)
    if not keep.any():
        return np.full(wanted.shape, np.nan)
    order = np.argsort(sample[keep], kind="stable")
    sample, cumulative = sample[keep][order], np.cumsum(weight[keep][order])
    # A sum of weights is only as exact as its last bits; a quantile must not slip past a value for them.
    at = np.searchsorted(cumulative, wanted * cumulative[-1] * (1 - 1e-12), side="left")
    result: Floats = sample[np.minimum(at, sample.size - 1)]
    return result


def _finite(values: npt.ArrayLike) -> Floats:
    sample = np.asarray(values, dtype=float)
    finite: Floats = sample[np.isfinite(sample)]
    return finite


def check_level(level: float) -> None:
    """Refuse what is no confidence level with an `AnalysisError`."""
    if not 0 < level < 1:
        msg = f"level {level:g} is no confidence level; expected a number between 0 and 1, such as 0.95"
        raise AnalysisError(msg)
