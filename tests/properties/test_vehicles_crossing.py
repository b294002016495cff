"""A crossing that is leased: never two vehicles in each other's way, and somebody goes on."""

from __future__ import annotations

from dataclasses import replace

import pytest

from loopgate.research.vehicles.crossing import begin, explore
from loopgate.vehicles import keeper as keepers
from loopgate.vehicles import vehicle as cars
from loopgate.vehicles.keeper import Keeper, receive
from loopgate.vehicles.messages import Ask, Goes, Grant, Left, Refuse, ToPost, Why
from loopgate.vehicles.post import Post

PAIR = begin([(0, 1)], (1, 1))
ACROSS = frozenset({((3, 7), (4, 8)), ((4, 8), (3, 7))})


@pytest.mark.parametrize("late", [False, True])
def test_two_are_never_in_each_others_way_in_any_order(*, late: bool) -> None:
    """Messages lost, late, in any order, and time that goes by at any moment."""
    found = explore(PAIR, limit=30_000, most=2, gives_back=0, late=late)
    assert found.complete
    assert found.states > 5_000
    assert (found.unsafe, found.stuck) == (0, 0)


def test_of_three_the_outer_two_go_at_the_same_time() -> None:
    """Who is in nobody's way has a lease of its own."""
    found = explore(begin([(0, 1), (1, 2)], (1, 1, 1)), limit=60_000, most=1, gives_back=0)
    assert found.complete
    assert (found.unsafe, found.stuck, found.most_leases) == (0, 0, 2)


def test_without_leases_two_set_out_at_the_same_time() -> None:
    """Nobody sees the other yet."""

    def no_leases(keeper: Keeper, post: Post, message: ToPost, now_s: float) -> keepers.Answer:
        free = replace(keeper, leases=())
        after, post, out = receive(free, post, message, now_s)
        return after, post, out

    assert explore(PAIR, limit=5_000, most=2, gives_back=0, receive=no_leases).unsafe > 0


def test_a_vehicle_that_takes_a_grant_for_one_that_lasts_is_noticed() -> None:
    """The keeper counts on it that nobody goes by a lease that is over."""
    found = explore(PAIR, limit=5_000, most=2, gives_back=0, in_time=lambda *_: True)
    assert found.unsafe > 0


def test_a_grant_says_until_when_by_the_clock_of_the_vehicle() -> None:
    """Its ask says what that shows; clocks need not agree."""
    keeper, post, out = receive(Keeper(ACROSS, 2.0), Post(7, 2), Ask(7, 1, 1, 3, 9, (0, 1), 10.0), 500.0)
    assert out == [Grant(1, 1, 7, until_s=12.0, there=1)]
    assert cars.in_time(Grant(1, 1, 7, until_s=12.0), 12.0)
    assert not cars.in_time(Grant(1, 1, 7, until_s=12.0), 12.5)
    again, _, out = receive(keeper, post, Ask(7, 1, 1, 3, 9, (0, 1), 11.0), 501.0)
    assert out == [Grant(1, 1, 7, until_s=13.0, there=1)]
    assert [one.ends_s for one in again.leases] == [503.0 + keepers.SEEN_S]


def test_an_ask_waits_for_the_end_of_a_lease_and_is_looked_at_again() -> None:
    """When the vehicle gives back, or is silent for too long; if it goes, who waits sees that."""
    other = Ask(8, 2, 1, 4, 9, (0, 2), 10.0)
    keeper, post, _ = receive(Keeper(ACROSS, 2.0), Post(7, 2), Ask(7, 1, 1, 3, 9, (0, 1), 10.0), 10.0)
    keeper, _, out = receive(keeper, Post(8, 2), other, 10.5)
    assert out == []
    for ends, again in ((Goes(7, 1, 1), False), (Left(7, 1, 1), True)):
        after, _, out = receive(keeper, post, ends, 11.0)
        assert after.leases == ()
        assert (other in out) is again
        assert not any(one.held for one in after.claims)
    _, _, out = receive(keeper, Post(8, 2), other, 13.1)
    assert isinstance(out[0], Grant)


def test_an_ask_for_the_same_grant_again_makes_no_lease_of_one_that_is_over() -> None:
    """It is asked what has become of the grant; the vehicle gives it back."""
    keeper, post, _ = receive(Keeper(ACROSS, 2.0), Post(7, 3), Ask(7, 1, 1, 3, 9, (0, 1), 10.0), 10.0)
    _, _, out = receive(keeper, post, Ask(7, 5, 1, 3, 9, (0, 5), 13.5), 13.5)
    assert out == []  # it waits behind the grant that nobody has used yet
    _, _, out = receive(
        keeper, replace(post, waiting=Ask(7, 6, 1, 3, 9, (0, 6))), Ask(7, 5, 1, 3, 9, (0, 5)), 13.5
    )
    told = next(one for one in out if isinstance(one, Grant))
    assert not cars.in_time(told, 0.0)


def test_way_and_last_slot_are_kept_for_who_has_waited_for_long() -> None:
    """From younger ones, until it has not asked for some time."""
    waits = Ask(7, 1, 1, 3, 9, (0, 1), 40.0, free=False)
    keeper, post, out = receive(Keeper(ACROSS, 2.0), Post(7, 2), waits, 40.0)
    assert out == [Refuse(1, 1, 7, Why.CROSSING)]
    younger = Ask(8, 2, 1, 4, 9, (35.0, 2), 41.0)
    assert receive(keeper, Post(8, 2), younger, 41.0)[2] == [Refuse(2, 1, 8, Why.CROSSING)]
    assert isinstance(receive(keeper, Post(8, 2), younger, 46.0)[2][0], Grant)
    full = replace(post, rears=((9, 1),))
    beside = Ask(7, 3, 1, 5, 9, (35.0, 3), 41.0)
    assert receive(keeper, full, beside, 41.0)[2] == [Refuse(3, 1, 7, Why.FULL)]
    assert isinstance(receive(keeper, post, beside, 41.0)[2][0], Grant)
