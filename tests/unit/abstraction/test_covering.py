"""Covering loops that do not work as queues, and how they are mended."""

from __future__ import annotations

from roads import roads

from loopgate.abstraction.covering import cover_streets
from loopgate.abstraction.queue_survey import survey_queues
from loopgate.network import make_loop
from loopgate.network.cover.design import CoverTask
from loopgate.network.cover.reasons import CoverReason
from loopgate.network.vehicle_type import DEFAULT_TYPE

_LENGTHS = {"a": (100, 1), "c": (100, 1), "s": (5, 1), "t": (5, 1)}
_RING = ["a_0>c_0", "c_0>a_0", "a_0>s_0", "s_0>t_0", "t_0>a_0"]
"""Two places a and c, and from a round to a over s and t, which are too short to wait on."""


def test_a_ring_without_another_place_is_left_out() -> None:
    """Nobody can wait between a and a, so s and t are not covered, and it is said why."""
    cover = cover_streets(roads(_LENGTHS, _RING), CoverTask(), 1)
    assert [sorted(loop.edges) for loop in cover.loops] == [["a", "c"]]
    assert cover.left_out == {"s": CoverReason.QUEUES, "t": CoverReason.QUEUES}
    assert set(cover.covered) == {"a", "c"}
    assert cover.design.bound(1) == cover.design.circulation
    assert cover.design.ways.cost.size == 0  # many covers at a time would fill the memory


def test_a_ring_is_led_over_from_one_place_to_another() -> None:
    """From t a way leads to c as well, so s and t lie between a and c."""
    cover = cover_streets(roads(_LENGTHS, [*_RING, "t_0>c_0"]), CoverTask(), 1)
    assert not cover.left_out
    (loop,) = cover.loops
    round_twice = " ".join(loop.edges * 2)
    assert "a s t c" in round_twice
    assert "a s t a" not in round_twice


def test_what_no_loop_can_do_does_not_keep_it_from_the_rest() -> None:
    """From t ways lead to c, and over u back to a alone: s and t lie between a and c, and u is left out."""
    ring = ["a_0>c_0", "c_0>a_0", "a_0>s_0", "s_0>t_0", "t_0>c_0", "t_0>u_0", "u_0>a_0"]
    cover = cover_streets(roads({**_LENGTHS, "u": (5, 1)}, ring), CoverTask(), 1)
    assert set(cover.covered) == {"a", "c", "s", "t"}
    assert cover.left_out == {"u": CoverReason.QUEUES}


def test_loops_with_a_single_place_are_joined() -> None:
    """Two loops were asked for, a c and a s t, and on the second is one place: one loop drives both."""
    cover = cover_streets(roads(_LENGTHS, _RING), CoverTask(), 2)
    assert [sorted(loop.edges) for loop in cover.loops] == [["a", "c"]]
    assert set(cover.left_out) == {"s", "t"}


def test_loops_that_need_a_second_place_have_it() -> None:
    """Round a s t and round b s t is one place each, so each of two loops leads over both."""
    network = roads(
        {"a": (100, 1), "b": (100, 1), "s": (5, 1), "t": (5, 1)},
        ["a_0>s_0", "b_0>s_0", "s_0>t_0", "t_0>a_0", "t_0>b_0"],
    )
    cover = cover_streets(network, CoverTask(), 2)
    assert [sorted(loop.edges) for loop in cover.loops] == [["a", "b", "s", "s", "t", "t"]] * 2


def test_a_loop_that_comes_back_to_a_lane_is_refused_alone() -> None:
    """The other one is looked at all the same."""
    network = roads(_LENGTHS, _RING)
    loops = [make_loop(network, "bad", ["a", "c", "a", "s", "t"]), make_loop(network, "good", ["a", "c"])]
    found = survey_queues(network, [(loop, DEFAULT_TYPE) for loop in loops])
    assert [loop.id for loop in found.loops] == ["good"]
    assert [(refusal.loop.id, refusal.edge) for refusal in found.refused] == [("bad", "a")]
    assert found.refused[0].reason.startswith("comes back from lane a_0 to itself")
