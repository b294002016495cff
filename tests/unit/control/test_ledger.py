"""The ledger by hand: lines, wakes, joining and leaving."""

from __future__ import annotations

import pytest

from loopgate.control.chain import circle_from, closes, closes_by_entering
from loopgate.control.ledger import Ledger
from loopgate.control.places import Place, path_of
from loopgate.control.rules import usual


def triangle() -> list[Place]:
    """Return three places that hold two each."""
    return [Place(name, 2) for name in "abc"]


def test_a_move_that_closes_a_circle_is_refused_and_woken_when_one_leaves() -> None:
    a, b, c = places = triangle()
    ledger, loop = Ledger(usual()), path_of(places, closed=True)
    cars = [ledger.take_in(f"v{n}", loop, at) for n, at in enumerate((0, 0, 1, 2, 2))]
    away = ledger.take_in("away", path_of([b, Place("home", 2)], closed=False), 0)
    outside = ledger.take_in("outside", path_of([Place("d", 2), b], closed=False), 0)
    b.line.reverse()  # the one that leaves heads its line
    ledger.ask(outside)
    assert ledger.answer() == []
    assert outside.reason == "occupied"
    ledger.ask(away)
    assert ledger.answer() == [away]
    assert outside.reason == "deadlock"  # woken by the slot, and seen to close the circle
    assert closes(outside) == [b, c, a]
    ledger.leave(cars[3])
    assert ledger.answer() == [outside]


def test_a_newcomer_that_closes_a_circle_is_told_before() -> None:
    places = triangle()
    ledger, loop = Ledger(usual()), path_of(places, closed=True)
    for number, at in enumerate((0, 0, 1, 1, 2)):
        ledger.take_in(f"v{number}", loop, at)
    assert closes_by_entering(loop[2])
    assert not closes_by_entering(path_of([Place("d", 1), *places], closed=False)[0])
    assert circle_from(places[0]) == []
    ledger.take_in("last", loop, 2)
    assert circle_from(places[0]) == places


def test_a_path_that_ends_is_left() -> None:
    a = Place("a", 1)
    ledger = Ledger(usual())
    car = ledger.take_in("car", path_of([a], closed=False), 0)
    ledger.ask(car)
    assert ledger.answer() == [car]
    assert not a.line
    assert not ledger.vehicles


def test_nobody_is_taken_in_twice_or_into_a_full_place() -> None:
    ledger, path = Ledger(usual()), path_of([Place("a", 1)], closed=False)
    ledger.take_in("car", path, 0)
    with pytest.raises(ValueError, match="vehicle car is there already, in place a"):
        ledger.take_in("car", path, 0)
    with pytest.raises(ValueError, match="vehicle bus does not fit into place a: its 1 slots are taken"):
        ledger.take_in("bus", path, 0)
