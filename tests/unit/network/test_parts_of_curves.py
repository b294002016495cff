"""Parts of closed curves."""

import numpy as np
import pytest

from loopgate.network.loop import cut_curve, gap

SQUARE = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0], [0.0, 0.0]])
ARCS = np.array([0.0, 10.0, 20.0, 30.0, 40.0])


@pytest.mark.parametrize(
    ("begin_m", "end_m", "points"),
    [
        (2.0, 5.0, [[2, 0], [5, 0]]),
        (5.0, 15.0, [[5, 0], [10, 0], [10, 5]]),
        (-5.0, 5.0, [[0, 5], [0, 0], [0, 0], [5, 0]]),
        (35.0, 45.0, [[0, 5], [0, 0], [0, 0], [5, 0]]),
        (7.0, 7.0, [[7, 0], [7, 0]]),
    ],
)
def test_a_part_may_lie_across_the_beginning(begin_m: float, end_m: float, points: list[list[float]]) -> None:
    """The corners between the two ends, wherever the curve begins."""
    assert cut_curve(SQUARE, ARCS, 40.0, begin_m, end_m).tolist() == points


@pytest.mark.parametrize(
    ("from_m", "to_m", "far_m"), [(5.0, 8.0, 3.0), (38.0, 2.0, 4.0), (5.0, 5.0, 0.0), (5.0, 5.0 - 1e-12, 0.0)]
)
def test_rounding_is_no_lap(from_m: float, to_m: float, far_m: float) -> None:
    """Two that touch are not a whole lap apart."""
    assert gap(40.0, from_m, to_m) == pytest.approx(far_m)
