"""Quantiles in constant memory."""

import random

from loopgate.results.histogram import Histogram


def test_quantiles_are_exact_to_the_class() -> None:
    """Within 2.4 % of the sorted list's own quantiles; the maximum is exact."""
    rng = random.Random(1)
    values = [rng.lognormvariate(3.0, 1.0) for _ in range(5000)]
    histogram = Histogram()
    for value in values:
        histogram.add(value)
    values.sort()
    for q in (0.5, 0.99):
        exact = values[int(q * len(values)) - 1]
        assert abs(histogram.quantile(q) - exact) <= 0.024 * exact
    assert histogram.max == values[-1]


def test_parts_together_are_the_whole() -> None:
    """Histograms of parts of the numbers give the same as one of all."""
    rng = random.Random(2)
    values = [rng.lognormvariate(3.0, 1.0) for _ in range(9000)]
    whole, parts = Histogram(), [Histogram() for _ in range(3)]
    for value in values:
        whole.add(value)
        rng.choice(parts).add(value)
    together = Histogram(parts)
    assert together.summary() == whole.summary()
    assert together.count == whole.count
    assert abs(together.total - whole.total) < 1e-6 * whole.total


def test_nothing_counted_gives_zeros() -> None:
    """An open run has no decisions."""
    assert Histogram().summary() == {"median": 0.0, "p99": 0.0, "max": 0.0}
