"""The vehicles for which one waits."""

from __future__ import annotations

from functools import partial

from loopgate.control.blocking import ahead, blockers
from loopgate.control.chain import ChainGate
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


def test_a_vehicle_waits_for_whom_its_gate_names() -> None:
    """For whatever reason; one that is alone and refused by a known one can never move again."""
    gate, path = Named(), path_of([Place("a", 9), Place("b", 9)], closed=True)
    for reason, others, waits in (("mine", 1, True), ("mine", 0, False), ("deadlock", 0, True)):
        gate.reason = reason
        ledger = Ledger([], gate)
        one, *found = (ledger.take_in(f"v{number}", path, number) for number in range(1 + others))
        ledger.ask(one)
        assert ledger.answer() == []
        assert blockers(one, ledger.vehicles.values(), gate) == ([found] if waits else [])
        path = path_of([Place("a", 9), Place("b", 9)], closed=True)


class Named(ChainGate):
    """A gate that refuses everybody for a reason, and names every vehicle but the first."""

    reason = ""

    def allows(self, _vehicle: Vehicle, _now_s: float) -> Refusal | None:
        return Refusal(self.reason)

    def blockers(self, _vehicle: Vehicle) -> list[str]:
        return ["v1", "v2"]
