"""What is kept for vehicles that wait for long: last slots, ways over crossings, and for whom."""

from __future__ import annotations

from math import inf

import pytest

from loopgate.control.keeping import Keeping
from loopgate.control.ledger import Ledger
from loopgate.control.places import ConflictGroup, Foe, Movement, Pass, Place, Vehicle, path_of
from loopgate.control.rules import usual


def two_before_one_slot() -> tuple[Ledger, Vehicle, Vehicle, Vehicle]:
    """Return a ledger in which `old` and `new` wait for a slot in s, which `there` leaves next.

    Two stand behind `new`, so it has more pressure.
    """
    s, out = Place("s", 1), Place("out", 9)
    ledger = Ledger(usual())
    there = ledger.take_in("there", path_of([s, out], closed=True), 0)
    old = ledger.take_in("old", path_of([Place("p", 9), s, out], closed=True), 0)
    behind = path_of([Place("d", 99), s, out], closed=True)
    new = ledger.take_in("new", behind, 0)
    for number in range(30):
        ledger.take_in(f"behind {number}", behind, 0)
    return ledger, there, old, new


@pytest.mark.parametrize(("after_s", "who"), [(20.0, "new"), (70.0, "old")])
def test_the_last_slot_is_kept_for_one_that_has_been_passed_over(after_s: float, who: str) -> None:
    ledger, there, old, new = two_before_one_slot()
    ledger.ask(old)
    assert ledger.answer(1.0) == []
    ledger.ask(new)
    assert ledger.answer(after_s) == []
    ledger.ask(there)
    assert ledger.answer(after_s + 1.0) == [there]
    assert ledger.answer(after_s + 2.0) == [ledger.vehicles[who]]


def test_a_way_is_kept_for_one_that_others_cross_again_and_again() -> None:
    junction = ConflictGroup()
    along, across = Movement("along", junction), Movement("across", junction)
    ways = Pass(along, 10.0, -inf, first=True), Pass(across, 10.0, -inf, first=True)
    for one, other in (ways, ways[::-1]):
        one.foes[other.movement] = Foe(other.movement, 0.0, inf, 0.0, 10.0, 10.0)
    ledger, goal = Ledger(usual()), Place("goal", 99)
    path = path_of([Place("street", 9), goal], closed=False)
    path[0].passes = [ways[0]]
    patient = ledger.take_in("patient", path, 0)
    path = path_of([Place("side", 9), goal], closed=False)
    path[0].passes = [ways[1]]
    stream = [ledger.take_in(f"v{number}", path, 0) for number in range(9)]
    gone: list[tuple[float, str]] = []
    for number in range(9):
        ledger.ask(stream[number])  # each comes before the one before it has left the junction
        if number == 0:
            gone += [(0.0, vehicle.name) for vehicle in ledger.answer(0.5)]
            ledger.ask(patient)
        elif stream[number - 1] not in ledger.waiting:
            stream[number - 1].front_m = inf
            ledger.passed(stream[number - 1])
        now_s = 20.0 * (number + 1)
        gone += [(now_s, vehicle.name) for vehicle in ledger.answer(now_s)]
    names = [name for _, name in gone]
    assert "patient" in names
    assert names.index("patient") <= 4
    assert patient.longest_s <= 100.0


def test_the_mover_of_a_long_chain_has_the_slot_that_all_wait_for() -> None:
    a, b, c, far = Place("a", 1), Place("b", 1), Place("c", 1), Place("far", 2)
    ledger = Ledger(usual())
    loop = path_of([a, b, c, far], closed=True)
    cars = [ledger.take_in(name, loop, at) for at, name in enumerate("abc")]
    standing = ledger.take_in("far", path_of([far, Place("out", 2)], closed=True), 0)
    rival = ledger.take_in("rival", path_of([Place("side", 3), far], closed=True), 0)
    ledger.ask(cars[0])
    ledger.answer(1.0)
    ledger.ask(rival)
    ledger.answer(62.0)
    assert far.mover is cars[2]
    assert cars[2].mover
    assert rival.reason == "service"
    assert ledger.why_not(cars[2]) == ""
    ledger.leave(cars[0])
    assert ledger.answer(63.0) == [rival]
    assert standing.name in ledger.vehicles


def test_a_request_from_behind_another_vehicle_keeps_nothing_from_that_vehicle() -> None:
    """It asked first, but it goes when it heads its line: until then the head goes where it wants."""
    a, b, c = Place("a", 3), Place("b", 2), Place("c", 1)
    ledger = Ledger(usual())
    head = ledger.take_in("head", path_of([a, c], closed=True), 0)
    behind = ledger.take_in("behind", path_of([a, b], closed=True), 0)
    ledger.ask(behind)
    ledger.answer(70.0)
    assert [place.mover for place in (a, b, c)] == [None, None, None]
    ledger.ask(head)
    assert ledger.answer(71.0) == [head, behind]


def test_who_is_refused_by_the_chain_rule_keeps_nothing() -> None:
    ledger, _, old, new = two_before_one_slot()
    ledger.ask(old)
    ledger.answer(1.0)
    old.blocked_s = 69.0
    old.since_s = 1.0
    keeping = Keeping({old: None, new: None})
    keeping.look(40.0)
    wanted = old.wanted()
    assert wanted is not None
    assert wanted.kept_for is None


@pytest.mark.parametrize("last", ["", "c"])
def test_a_ring_that_ordinary_vehicles_fill_is_walked_once(last: str) -> None:
    """Each place counts as full though it has a free slot; the walk ends before one that is empty."""
    places = [Place(name, 9) for name in "abc"]
    ledger, path = Ledger(usual()), path_of(places, closed=True)
    cars = {name: ledger.take_in(name, path, at) for at, name in enumerate("abc") if name != last}
    ledger.keeping.is_too_full = lambda _: True
    walked, mover = ledger.keeping._way_of(cars["a"])
    assert [place.name for place in walked] == ["a", "b", "c"][: len(cars)]
    assert mover is cars["b" if last else "c"]
