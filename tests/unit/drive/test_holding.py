"""Who is ahead of the middle between its neighbours is held for so long as was said, and no longer."""

from __future__ import annotations

from random import Random

import pytest
from books import Books

from builders import system
from loopgate.abstraction.itinerary import Leg
from loopgate.gates import make_gate
from loopgate.negotiation.simple import OldestFirst

A, B = range(2)


def two_in_a_place(b_at: int) -> Books:
    """Both drive from place s to place t and back; A, the head of s, asks. B stands in s or in t."""
    robots = system({"a": "s t", "b": "s t"}, starts={"b": b_at}, capacity={"s": 3, "t": 3}, fifo=("s", "t"))
    legs = [Leg(robots.robots[0].path[0], 0.0, 40.0), Leg(robots.robots[0].path[1], 50.0, 100.0)]
    books = Books(robots, [legs, legs], make_gate("certified", robots), OldestFirst(Random(1)))
    books.asks(A, 10.0)
    return books


@pytest.mark.parametrize("spare_s", [2.0, 6.0])
def test_it_is_passed_over_until_its_time_is_up(spare_s: float) -> None:
    """Told once why, it waits for nobody, and goes when so long has passed since it asked."""
    books = two_in_a_place(b_at=1)
    books.columns["spare_s"][A] = spare_s
    assert books.decide(10.0) == [(A, False, "spacing")]
    assert books.blockers(A) == []
    assert books.decide(10.0 + spare_s - 1.0) == []
    assert books.decide(10.0 + spare_s) == [(A, True, "free")]


def test_it_goes_as_soon_as_it_is_no_longer_ahead() -> None:
    """What it may be held for is looked at in every step."""
    books = two_in_a_place(b_at=1)
    books.columns["spare_s"][A] = 6.0
    assert books.decide(10.0) == [(A, False, "spacing")]
    books.columns["spare_s"][A] = 0.0
    assert books.decide(11.0) == [(A, True, "free")]


def test_nobody_is_held_before_others() -> None:
    """B waits behind A in the same place: A goes at once."""
    books = two_in_a_place(b_at=0)
    books.columns["spare_s"][A] = 6.0
    assert books.decide(10.0) == [(A, True, "free")]
