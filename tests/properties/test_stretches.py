"""Stretches for changing lanes: who excludes whom, and where they lie, for all lanes and lengths."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
from roads import roads

from loopgate.abstraction.movements import LEAST_CAPACITY, Passage, find_foes, lay_stretches, least_change_m
from loopgate.abstraction.queue_layout import lay_out_queues, why_not
from loopgate.network import make_loop
from loopgate.network.vehicle_type import DEFAULT_TYPE, VehicleType

lanes = st.integers(0, 4)
passages = st.lists(st.builds(lambda a, b: Passage("e", a, b, 20.0), lanes, lanes), min_size=1, unique=True)


@given(passages)
def test_vehicles_that_could_meet_exclude_each_other(ways: list[Passage]) -> None:
    """Two that may be under way at once are on different lanes throughout, or come from one lane.

    The second is allowed only if one of them stays on it, before or behind the one that leaves it, or if both
    make the same change.
    """
    foes = find_foes(ways, frozenset())
    for one in ways:
        for other in ways:
            assert (other.id in foes[one.id]) == (one.id in foes[other.id])
            if other.id in foes[one.id]:
                assert one.changes or other.changes
                continue
            apart = not set(one.swept) & set(other.swept)
            follows = one == other or not (one.changes and other.changes)
            assert apart or (one.lane == other.lane and follows)


@given(
    st.floats(5.0, 300.0),
    st.builds(
        lambda length, gap: VehicleType("kind", length, gap), st.floats(3.0, 18.0), st.floats(0.5, 4.0)
    ),
)
def test_every_place_holds_two_and_every_stretch_a_vehicle(length_m: float, kind: VehicleType) -> None:
    """Whatever the edge's length: places and stretch fill it, or the loop is refused for that edge."""
    network = roads({"a": (length_m, 2), "b": (90.0, 1), "c": (90.0, 1)}, ["a_0>b_0", "b_0>c_0", "c_0>a_1"])
    loop = make_loop(network, "l", ["a", "b", "c"])
    needed = max(kind.length_m + kind.min_gap_m, 7.5)
    if kind.length_m + kind.min_gap_m < needed:
        kind = DEFAULT_TYPE
    if length_m < least_change_m(needed):
        refusal = why_not(network, loop, kind)
        assert refusal is not None
        assert refusal.edge == "a"
        return
    stretch = lay_stretches(network, [(loop, kind)], {})[0]["a"]
    assert 0.0 <= stretch.begin_m < stretch.end_m <= length_m
    assert stretch.end_m - stretch.begin_m >= least_change_m(needed) - 1e-9
    layout = lay_out_queues(network, [(loop, kind), (loop, DEFAULT_TYPE)])
    for leg in layout.itineraries["l"].legs:
        place = layout.places[leg.state]
        assert place.capacity >= LEAST_CAPACITY
        assert place.capacity * needed <= leg.end_m - leg.begin_m
