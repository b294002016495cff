"""Hand-solved cases of liveness, and the oracle's own limit."""

from __future__ import annotations

import pytest

from builders import ring_of_three, system
from loopgate.research.theory.oracle import Oracle, OracleLimitError


def test_a_circular_wait_is_not_live() -> None:
    """r1 in a waits for b, r2 in b waits for c, r3 in c waits for a: Definition 3, nobody moves again."""
    s = ring_of_three()
    oracle = Oracle(s)
    assert oracle.live(s.initial)
    assert not oracle.live(s.configuration((1, 1, 1)))
    assert oracle.live(s.configuration((1, 1, 0)))
    assert not oracle.safe(s.configuration((1, 1, 0)), 2)
    assert oracle.safe(s.configuration((1, 1, 0)), 1)


def test_live_means_everyone() -> None:
    """r4 can go round alone for ever, but r1, r2 and r3 stand in a circular wait, so it is not live."""
    s = system(
        {"r1": "p1 a b", "r2": "p2 b c", "r3": "p3 c a", "r4": "x y"}, starts={"r1": 1, "r2": 1, "r3": 1}
    )
    assert s.enabled(s.initial, 3)
    assert not Oracle(s).live(s.initial)


def test_a_deadlock_of_first_order() -> None:
    """Fig. 7's family with m = 4: t1 x t2, t2 t3, t3 x t4, t4 t1, a robot in each t.

    Nobody waits in a circle, for r1 and r3 may each enter x. If r1 does, r1, r2, r3 wait in the circle
    x, t2, t3; if r3 does, r3, r4, r1 wait in x, t4, t1. So the start is not live though no Definition 3
    deadlock, and each of the two moves is unsafe.
    """
    s = system({"r1": "t1 x t2 p1", "r2": "t2 t3 p2", "r3": "t3 x t4 p3", "r4": "t4 t1 p4"})
    assert [s.enabled(s.initial, i) for i in range(4)] == [True, False, True, False]
    assert not Oracle(s).live(s.initial)


def test_without_private_states_a_ring_turns_while_one_slot_is_free() -> None:
    """Two robots on a ring of three states turn for ever; on a ring of two they never move."""
    paths = {"r1": "a b c", "r2": "b c a"}
    assert Oracle(s := system(paths)).live(s.initial)
    assert not Oracle(s := system({"r1": "a b", "r2": "b a"})).live(s.initial)


def test_two_full_rings_cannot_exchange() -> None:
    """One slot short of full, a ring turns, yet with the other one as full nobody can change over.

    Ring one is a b, ring two is c d. r1 and r3 turn in them for ever; r2 goes from ring one to ring two
    and back. With r3 and r4 filling ring two, r2 never gets in.
    """
    full = {"r1": "a b", "r2": "b c", "r3": "c d", "r4": "d c"}
    assert not Oracle(s := system(full)).live(s.initial)
    assert Oracle(s := system({"r1": "a b e", "r2": "b c", "r3": "c d"})).live(s.initial)


def test_an_occupied_terminal_state_locks_out() -> None:
    """Open paths end where the robot stays; if that state is shared, whoever needs it is stuck."""
    s = system({"r1": "p1 a", "r2": "p2 a q"}, closed=False)
    oracle = Oracle(s)
    assert oracle.live(s.initial)
    assert not oracle.safe(s.initial, 0)
    assert oracle.safe(s.initial, 1)


def test_a_finished_robot_asks_for_nothing() -> None:
    """When all have arrived, the configuration is live though nobody moves."""
    s = system({"r1": "p1 a", "r2": "p2 b"}, starts={"r1": 1, "r2": 1}, closed=False)
    assert Oracle(s).live(s.initial)


def test_room_for_two_in_each_state_dissolves_the_circle() -> None:
    """With capacity 2 the three robots in the ring's states can all go on."""
    s = system(
        {"r1": "p1 a b", "r2": "p2 b c", "r3": "p3 c a"},
        starts={"r1": 1, "r2": 1, "r3": 1},
        capacity={"a": 2, "b": 2, "c": 2},
    )
    assert Oracle(s).live(s.initial)


def test_the_limit_is_kept() -> None:
    """Three robots on three states each have at most 27 configurations; five are too few to decide."""
    with pytest.raises(OracleLimitError, match="more than 5 configurations"):
        Oracle(ring_of_three(), limit=5).live(ring_of_three().initial)
