"""The vehicles for which one waits."""

from __future__ import annotations

from functools import partial

from loopgate.control.blocking import ahead, blockers
from loopgate.control.ledger import Ledger
from loopgate.control.places import Place, Vehicle, path_of
from loopgate.control.refusal import Refusal
from loopgate.control.rules import usual


def test_a_vehicle_waits_for_those_in_the_full_place() -> None:
    """And the vehicle behind it for it; one that asks for nothing waits for nobody."""
    here, full, out = Place("here", 3), Place("full", 2), Place("out", 9)
    ledger = Ledger(usual())
    there = [ledger.take_in(name, path_of([full, out], closed=True), 0) for name in ("b", "a")]
    path = path_of([here, full, out], closed=True)
    first, second = ledger.take_in("first", path, 0), ledger.take_in("second", path, 0)
    every = ledger.vehicles.values()
    assert blockers(first, every, ledger.gate) == []
    ledger.ask(first)
    assert ledger.answer() == []
    assert first.reason == "occupied"
    assert blockers(first, every, ledger.gate) == [there]
    assert ahead(first, every, ledger.gate) == there
    assert ahead(second, every, ledger.gate) == [first]


def _refuse(reason: str, _vehicle: Vehicle, _now_s: float) -> Refusal:
    """Refuse whatever is asked."""
    return Refusal(reason)


def test_a_vehicle_refused_for_the_sake_of_all_waits_for_any_other() -> None:
    """Not where no vehicle lifts the refusal."""
    for reason, waits in (("reserve", True), ("red", False), ("a rule of mine", False)):
        ledger = Ledger([partial(_refuse, reason)])
        path = path_of([Place("a", 9), Place("b", 9)], closed=True)
        one, other = ledger.take_in("one", path, 0), ledger.take_in("other", path, 1)
        ledger.ask(one)
        ledger.answer()
        assert blockers(one, ledger.vehicles.values(), ledger.gate) == ([[other]] if waits else [])
