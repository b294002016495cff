"""Vehicles that lend their crossing at a red light, in drawn systems: nobody touches, nobody is stuck."""

from __future__ import annotations

from types import ModuleType

import pytest
from lent_crossings import look

from loopgate.control import crossings, lending


def test_nobody_touches_and_nobody_is_stuck() -> None:
    found = look(range(150))
    assert (found["touch"], found["stuck"], found["trespasses"]) == (0, 0, 0)
    assert found["lent"] > 1000
    assert found["arrived"] > 2000


RULES = [
    (lending, "is_unsettled", lambda *_, **__: False, range(40), "touch"),
    (lending, "_find_those_behind", lambda *_: None, range(40), "stuck"),
    (crossings, "comes_behind", lambda *_: False, range(20), "stuck"),
]


@pytest.mark.parametrize("case", RULES, ids=lambda case: str(case[1]))
def test_each_rule_is_needed(
    case: tuple[ModuleType, str, object, range, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without it, vehicles touch or are stuck."""
    module, rule, broken, seeds, wrong = case
    monkeypatch.setattr(module, rule, broken)
    assert look(seeds)[wrong] > 0


def test_a_vehicle_that_is_not_held_would_touch_another(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its light opens while others with a grant are on their way."""
    monkeypatch.setattr("fake_traffic.FakeTraffic.stand", lambda *_, **__: None)
    assert look(range(60))["touch"] > 0
