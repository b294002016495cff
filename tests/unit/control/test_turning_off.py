"""The ledger by hand: vehicles that go on by other paths, and vehicles that are granted nothing."""

from __future__ import annotations

from loopgate.control.driving import may_turn_off, turn_off
from loopgate.control.ledger import Ledger
from loopgate.control.places import Leg, Make, Place, joined, path_of
from loopgate.control.rules import usual

CAR = Make(5.0, 2.0, 4.0, 10.0, 1.0)


def drawn(*places: Place, from_m: float = 0.0) -> list[Leg]:
    """Return a closed path on which each place is a hundred metres long."""
    legs = [Leg(p, n, from_m + 100.0 * n, from_m + 100.0 * n + 100.0) for n, p in enumerate(places)]
    return joined(legs, closed=True)


def test_a_vehicle_goes_on_by_another_path_from_its_place() -> None:
    a, b, c = (Place(name, 2) for name in "abc")
    ledger, own, other = Ledger(usual()), drawn(a, b), drawn(c, a, from_m=50.0)
    car = ledger.take_in("car", own, 0, CAR, 200.0)
    car.front_m = 98.0
    ledger.ask(car)
    assert may_turn_off(ledger, car, other[1])
    assert turn_off(ledger, car, other[1], CAR, 250.0) == 150.0
    assert (car.front_m, car.line_m, car.left_m()) == (248.0, 250.0, 2.0)
    assert (car.bodies, a.bodies[0].begin_m, a.bodies[0].out_m) == (a.bodies, 150.0, 255.0)
    assert car.asks  # it is so near to its line that it asks again, for the place on its new path
    assert ledger.answer() == [car]
    assert (car.leg.place, car.granted, b.line) == (c, 2, [])
    assert not may_turn_off(ledger, car, other[1])  # it is under way between two places


def test_nobody_closes_a_circle_of_full_places_by_another_path() -> None:
    a, b, c = (Place(name, 2) for name in "abc")
    ledger, away, back = Ledger(usual()), path_of([a, c], closed=True), path_of([a, b], closed=True)
    first, second = (ledger.take_in(name, away, 0) for name in ("first", "second"))
    for name in ("third", "fourth"):
        ledger.take_in(name, path_of([b, a], closed=True), 0)
    assert not may_turn_off(ledger, first, back[0])
    assert may_turn_off(ledger, second, back[0])  # it is not first in line
    ledger.leave(second)
    assert may_turn_off(ledger, first, back[0])


def test_a_withheld_vehicle_is_granted_nothing_and_nothing_is_kept_for_it() -> None:
    a, b, c = (Place(name, 1) for name in "abc")
    ledger = Ledger(usual())
    stands = ledger.take_in("stands", path_of([a, c], closed=False), 0)
    other = ledger.take_in("other", path_of([b, c], closed=False), 0)
    stands.withheld = "stop"
    ledger.ask(stands)
    assert ledger.answer(0.0) == []
    assert stands.reason == "stop"
    ledger.ask(other)
    blocker = ledger.take_in("blocker", path_of([c, Place("d", 1)], closed=False), 0)
    ledger.answer(1.0)
    ledger.answer(200.0)
    assert c.kept_for is other  # though the other asked later
    ledger.leave(blocker)
    assert ledger.answer(201.0) == [other]
    ledger.leave(other)
    stands.withheld = ""
    assert ledger.answer(202.0) == [stands]
