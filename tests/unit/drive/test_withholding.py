"""Grants that the caller withholds are delayed, and nothing else changes."""

from collections.abc import Callable
from random import Random

import pytest
import service_cases
from books import Books

from builders import system
from loopgate.abstraction.itinerary import Leg
from loopgate.gates import Reason, make_gate
from loopgate.model import StateId
from loopgate.negotiation.simple import OldestFirst


def keeper() -> Books:
    """Two robots, each with a private state, and a state that they share."""
    robots = system({"a": "pa s", "b": "pb s"})
    legs = [(Leg(StateId(f"p{name}"), 0.0, 50.0), Leg(StateId("s"), 50.0, 100.0)) for name in ("a", "b")]
    return Books(robots, legs, make_gate("collision", robots), OldestFirst(Random(1)))


def compiled() -> Books:
    """Two robots whose requests are decided in compiled code."""
    books = service_cases.books({"a": "p s", "b": "s p"}, {"p": 3, "s": 3})
    assert books.compiled
    return books


@pytest.mark.parametrize("make", [keeper, compiled])
def test_a_grant_is_withheld_until_it_is_no_more(make: Callable[[], Books]) -> None:
    """It is looked at again every step though nothing in the system has changed, and told once."""
    books = make()
    books.withhold(Reason.RED, 0)
    books.asks(0, 0.0)
    assert books.decide(0.0) == [(0, False, "red")]
    assert books.decide(0.5) == []
    books.withhold()
    assert books.decide(1.0) == [(0, True, "free")]


def test_who_waits_for_what_is_outside_waits_for_no_vehicle_of_the_system() -> None:
    """The wait-for graph has no edge for it."""
    books = keeper()
    for reason in (Reason.RED, Reason.TRAFFIC):
        books.withhold(reason, 0)
        books.asks(0, 0.0)
        books.decide(0.0)
        assert books.blockers(0) == []
        assert books.outside_blockers(0, ()) == []


def test_a_full_state_goes_before_what_is_withheld() -> None:
    """The reason is the state's, so the wait-for graph keeps its edge."""
    books = keeper()
    books.asks(0, 0.0)
    books.decide(0.0)
    books.withhold(Reason.RED, 1)
    books.asks(1, 1.0)
    assert books.decide(1.0) == [(1, False, "occupied")]
    assert books.blockers(1) == [[0]]
    assert books.outside_blockers(1, ()) == []
