"""Arc length and lane position, there and back; where vehicles can be held."""

from __future__ import annotations

import numpy as np
import pytest
from roads import polygon

from loopgate.errors import RouteError
from loopgate.network import LaneSpan, Loop

SQUARE = polygon("q", [(0, 0), (100, 0), (100, 100), (0, 100)])


def junctions() -> Loop:
    """Two lanes of 50 m and 0.3 m, each followed by 10 m inside a junction."""

    def span(name: str, begin: float, end: float, *, internal: bool = False) -> LaneSpan:
        return LaneSpan(name, 0, f"{name}_0", internal, begin, end, (f"{name}_0",), (((begin, 0), (end, 0)),))

    spans = (
        span("a", 0, 50),
        span(":j", 50, 60, internal=True),
        span("b", 60, 60.3),
        span(":k", 60.3, 70.3, internal=True),
    )
    return Loop("l", ("a", "b"), spans)


def test_locate_goes_round() -> None:
    """Positions repeat every lap, before the beginning too."""
    assert tuple(SQUARE.locate(130.0)) == ("q.e1", 0, pytest.approx(30.0))
    assert SQUARE.locate(530.0) == SQUARE.locate(130.0)
    assert tuple(SQUARE.locate(-10.0)) == ("q.e3", 0, pytest.approx(90.0))


@pytest.mark.parametrize("arc", [0.0, 0.5, 99.99, 100.0, 250.0, 399.9])
def test_arc_undoes_locate(arc: float) -> None:
    """An arc length comes back from edge and position."""
    place = SQUARE.locate(arc)
    assert SQUARE.arc(place.edge, place.position_m) == pytest.approx(arc)


def test_an_edge_used_twice_is_found_after_a_given_arc() -> None:
    """The first pass at or after the arc length asked from, going round."""
    once, again = SQUARE.spans[0], SQUARE.spans[2]
    twice = LaneSpan("q.e0", 0, "q.e0_0", False, again.begin_m, again.end_m, ("q.e0_0",), once.shapes)  # noqa: FBT003
    loop = Loop("l", ("q.e0", "q.e1", "q.e0", "q.e3"), (once, SQUARE.spans[1], twice, SQUARE.spans[3]))
    assert [loop.arc("q.e0", 20.0, after_m=after) for after in (0.0, 50.0, 300.0)] == [20.0, 220.0, 20.0]


def test_an_edge_elsewhere_is_named() -> None:
    """Asking for an edge that the loop does not use is an error that names both."""
    with pytest.raises(RouteError, match="loop q: edge x is not on it"):
        SQUARE.arc("x", 0.0)


@pytest.mark.parametrize(
    ("arc", "before", "after"),
    [
        (30.0, 30.0, 30.0),
        (49.95, 49.9, 70.4),  # past the end of lane a: no lane but a is long enough
        (55.0, 49.9, 70.4),  # inside the junction
        (60.1, 49.9, 70.4),  # on a lane too short to stop on
        (0.05, -20.4, 0.1),  # too near to the lane's beginning: back over the loop's beginning
        (140.6, 120.2, 140.7),  # the second lap: 70.3 m further on
    ],
)
def test_vehicles_are_held_on_lanes_only(arc: float, before: float, after: float) -> None:
    """A lap is 70.3 m; lane a can hold vehicles from 0.1 m to 49.9 m, lane b and the junctions cannot."""
    loop = junctions()
    assert loop.hold_before(arc) == pytest.approx(before)
    assert loop.hold_after(arc) == pytest.approx(after)


def test_the_curve_has_the_lengths_of_lanes_not_of_the_drawing() -> None:
    """A square drawn with 100 m sides whose lanes are 120 m long."""
    points, arcs = polygon("q", [(0, 0), (100, 0), (100, 100), (0, 100)], stretch=1.2).curve()
    assert arcs.max() == pytest.approx(480.0)
    assert np.interp(180.0, arcs, points[:, 1]) == pytest.approx(50.0)
