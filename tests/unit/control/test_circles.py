"""Circles of ways by hand: where long vehicles keep metres ahead, and where vehicles stand on stretches."""

from __future__ import annotations

from loopgate.control.circles import Circles
from loopgate.control.ledger import Ledger
from loopgate.control.parking import come_back
from loopgate.control.places import ChangeStretch, Leg, Make, Place, Vehicle, path_of
from loopgate.control.rules import usual

CAR, BUS = Make(5.0, 2.0, 4.0, 10.0, 1.0, 0.0), Make(18.0, 2.0, 4.0, 10.0, 1.0, 0.0)
"""Their lengths are 5 and 18 m, without gaps."""
CAR_M = 5.0


def place(name: str, room_m: float = 40.0) -> Place:
    """Return a place with slots for cars, and at least two."""
    return Place(name, 2, room_m, CAR_M)


def ledger_of(*places: Place) -> Ledger:
    """Return a ledger that knows the circles of ways, without lights."""
    ledger = Ledger(usual(lit=False))
    ledger.circles = Circles(places)
    ledger.answer()
    return ledger


def put(ledger: Ledger, path: list[Leg], number: int, make: Make = CAR) -> list[Vehicle]:
    """Put vehicles into the first place of a path."""
    made = ledger.made
    return [ledger.take_in(f"v{made + k}", path, 0, make) for k in range(number)]


def test_a_long_vehicle_keeps_metres_only_where_it_is_if_there_is_no_circle() -> None:
    a, b, away = place("a"), place("b"), Place("away", 9)
    ledger = ledger_of(a, b)
    (bus,) = put(ledger, path_of([a, b, away], closed=False), 1, BUS)
    ledger.answer()
    assert (a.slots, b.slots) == (5, 8)
    cars = put(ledger, path_of([b, away], closed=False), 6)
    assert not b.is_full()
    assert not bus.finds_room(b)  # three slots and more than half of the fourth
    ledger.ask(bus)
    assert ledger.answer() == []
    assert bus.reason == "occupied"
    for car in cars[:2]:
        ledger.leave(car)
    assert ledger.why_not(bus) == ""
    ledger.grant(bus)
    assert b.slots == 5


def test_a_long_vehicle_keeps_its_metres_while_it_is_parked() -> None:
    """It comes back into its place without asking for them, also if the place lies in no circle any more."""
    a, b, away = place("a"), place("b"), Place("away", 9)
    ledger = ledger_of(a, b)
    (bus,) = put(ledger, path_of([a, b, away], closed=False), 1, BUS)
    back = put(ledger, path_of([b, a, away], closed=False), 2)
    put(ledger, path_of([a, b, away], closed=False), 1)
    ledger.answer()
    assert (a.circled, a.slots) == (True, 5)
    assert ledger.step_aside(bus)
    for car in back:
        ledger.leave(car)
    ledger.answer(100.0)
    assert (a.circled, a.slots) == (False, 5)


def test_a_way_that_closes_a_circle_waits_until_there_is_room_for_it() -> None:
    """The buses go from a to b, many cars from b to a: then buses keep metres in b, too."""
    a, b, away = place("a"), place("b"), Place("away", 9)
    ledger = ledger_of(a, b)
    there, back = path_of([a, b, away], closed=False), path_of([b, a, away], closed=False)
    put(ledger, there, 1, BUS)
    cars = put(ledger, path_of([b, away], closed=False), 6)
    ledger.answer()
    assert b.slots == 8
    assert not ledger.fits(back[0], CAR_M)  # with the metres of the bus there are five slots in b
    assert (b.slots, b.circled) == (8, False)
    for car in cars[:2]:
        ledger.leave(car)
    assert ledger.fits(back[0], CAR_M)
    put(ledger, back, 1)
    assert (b.slots, b.circled, a.circled) == (5, True, True)


def test_places_that_too_few_vehicles_come_to_lie_in_no_circle() -> None:
    """Two slots at least, for one car and one bus: both are roomy until a second car comes."""
    a, b, away = place("a"), place("b"), Place("away", 9)
    ledger = ledger_of(a, b)
    put(ledger, path_of([b, away], closed=False), 1)
    ledger.answer()
    assert (a.circled, b.circled) == (False, False)
    put(ledger, path_of([a, b, away], closed=False), 1, BUS)
    assert not b.circled
    (last,) = put(ledger, path_of([b, a, away], closed=False), 1)
    assert (a.circled, b.circled) == (True, True)
    ledger.leave(last)
    ledger.answer(100.0)
    assert (a.circled, b.circled) == (False, False)


def test_vehicles_stand_on_a_stretch_while_nobody_comes_to_change_lanes() -> None:
    """Two lanes: 15 m between the places before and behind."""
    before = [place("e_0/1", 15.0), place("e_1/1", 15.0)]
    stretch, away = ChangeStretch(), Place("away", 9)
    behind = [Place(f"e_{k}/2", 2, 15.0, CAR_M, overhang_m=15.0) for k in range(2)]
    stretch.before, stretch.behind = before, behind
    for one in behind:
        one.stretch = stretch
    ledger = ledger_of(*before, *behind)
    assert [one.slots for one in behind] == [6, 6]
    turns = path_of([before[0], behind[1], away], closed=False)
    turns[0].change = turns[0].nears = stretch
    (changes,) = put(ledger, turns, 1)
    assert [one.slots for one in behind] == [3, 3]
    assert ledger.step_aside(changes)
    assert [one.slots for one in behind] == [6, 6]
    come_back(ledger, changes)
    changes.beside = False
    assert [one.slots for one in behind] == [3, 3]
    ledger.ask(changes)
    assert ledger.answer()[0] is changes
    assert [one.slots for one in behind] == [6, 6]


def test_who_changes_lanes_waits_for_all_behind_the_stretch() -> None:
    """So there is a link to the place that it leaves to its side: who stands there leads back to it."""
    before, stretch, away = place("e_0/1", 10.0), ChangeStretch(), Place("away", 9)
    behind = [Place(f"e_{k}/2", 2, 10.0, CAR_M, overhang_m=5.0) for k in range(2)]
    round_ = place("round", 10.0)
    stretch.before, stretch.behind = [before], behind
    for one in behind:
        one.stretch = stretch
    ledger = ledger_of(before, round_, *behind)
    put(ledger, path_of([behind[0], round_, away], closed=False), 2)
    turns = path_of([round_, before, behind[1], away], closed=False)
    turns[1].change = turns[1].nears = turns[0].nears = stretch
    put(ledger, turns, 2)
    ledger.answer()
    assert [one.circled for one in (before, round_, *behind)] == [True, True, True, False]
