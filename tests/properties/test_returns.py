"""Whether a parked vehicle may return among ordinary ones, beside where all of them are on one line."""

from __future__ import annotations

from among_others import Scene
from hypothesis import given
from hypothesis import strategies as st

from loopgate.control.ordinary import lets_return
from loopgate.control.places import braking_m
from loopgate.control.roads import Other, Rear, RoadEdge, RoadLane, RoadTurn

LENGTHS = st.sampled_from([2.0, 5.0, 12.0])
SPEEDS = st.sampled_from([0.0, 3.0, 10.0])
STEPS_S = (0.5, 1.0)
ON_LANE = st.tuples(st.just("here"), st.integers(0, 110).map(float), LENGTHS, SPEEDS)
GONE = st.tuples(st.just("gone"), st.integers(0, 110).map(float), LENGTHS, SPEEDS)
COMING = st.tuples(
    st.sampled_from(["side", "turn", "far", "parks"]), st.integers(0, 20).map(float), LENGTHS, SPEEDS
)
THROUGH_M = 15.0
"""The length of the turn into the road."""


def put(scene: Scene, kind: str, at_m: float, length_m: float, speed: float) -> tuple[Other, float]:
    """Put an ordinary vehicle on the road; return it, and its front's position on the lane `here` [m].

    The road `side`, of 20 m, leads into `here` by a turn, and `far`, of 20 m, into `side` without one.
    """
    other = Other(kind, length_m, 2.6, 4.5, 1.0)
    other.speed, other.position_m, other.parks = speed, at_m, kind == "parks"
    here = scene.lanes["here"]
    if kind == "here":
        other.lane = here
        here.fronts.append(other)
        return other, at_m
    if kind == "gone":
        here.rears.append(Rear(other, at_m))
        return other, at_m + length_m
    side, far = RoadEdge(20.0, 10.0), RoadEdge(20.0, 10.0)
    other.edges, other.turns = [side, here.edge], [RoadTurn(THROUGH_M), None]
    other.lane = RoadLane(kind, side, 20.0, 10.0, inside=False)
    here.edge.coming[other] = None
    if kind == "far":
        other.lane = RoadLane(kind, far, 20.0, 10.0, inside=False)
        other.edges, other.turns = [far, *other.edges], [None, *other.turns]
        return other, at_m - 40.0 - THROUGH_M
    if kind == "turn":
        other.lane = RoadLane(kind, RoadEdge(1e9, 10.0), THROUGH_M, 10.0, inside=True)
        other.position_m = min(at_m, THROUGH_M)
        return other, other.position_m - THROUGH_M
    return other, at_m - 20.0 - THROUGH_M


@given(
    st.integers(10, 99).map(float),
    st.lists(st.one_of(ON_LANE, GONE, COMING), max_size=3),
    st.sampled_from(STEPS_S),
)
def test_a_vehicle_returns_where_nobody_is_beside_it_and_all_behind_can_brake(
    front_m: float, others: list[tuple[str, float, float, float]], step_s: float
) -> None:
    """Nobody's body is between its rear and its gap ahead; who is behind has a second to react."""
    scene = Scene()
    scene.car.front_m = front_m
    rear_m, ahead_m = front_m - scene.car.make.length_m, front_m + scene.car.make.gap_m
    free = True
    for kind, at_m, length_m, speed in others:
        other, x_m = put(scene, kind, at_m, length_m, speed)
        fast = speed + 2.6 * step_s
        needed_m = scene.car.make.gap_m + fast * (2.0 * step_s + 1.0) + braking_m(fast, 4.5, step_s)
        if kind == "parks":
            continue
        if kind == "gone":
            free &= not rear_m < x_m - length_m < ahead_m
        elif x_m < rear_m:
            free &= rear_m - x_m >= needed_m
        else:
            free &= x_m - other.length_m >= ahead_m
    assert lets_return(scene.car, step_s) == free
