"""Vehicles that lend their crossing at a red light, in drawn systems: nobody touches, nobody is stuck."""

from __future__ import annotations

from types import ModuleType

import pytest
from lent_crossings import look

from loopgate.control import crossings, lending
from loopgate.control.places import Vehicle


@pytest.mark.parametrize("draws", [60, pytest.param(150, marks=pytest.mark.slow)])
def test_nobody_touches_and_nobody_is_stuck(draws: int) -> None:
    found = look(range(draws))
    assert (found["touch"], found["stuck"], found["trespasses"]) == (0, 0, 0)
    assert found["lent"] > 1000 / 150 * draws
    assert found["arrived"] > 2000 / 150 * draws


@pytest.mark.parametrize("draws", [40, pytest.param(100, marks=pytest.mark.slow)])
def test_nobody_is_stuck_where_vehicles_come_while_others_leave(draws: int) -> None:
    """Two places for two lie between crossings; who comes may stand on its crossing until others are out."""
    found = look(range(draws), between=2)
    assert (found["touch"], found["stuck"], found["trespasses"]) == (0, 0, 0)
    assert found["follows out"] > 1.5 * draws
    assert found["lent"] > 5 * draws


def test_not_all_that_leave_do_so_surely(monkeypatch: pytest.MonkeyPatch) -> None:
    """If those count that lend, or come behind one that does, some are stuck."""
    monkeypatch.setattr(Vehicle, "surely_leaves", lambda one, body: body is not one.bodies[-1])
    assert any(look([seed], between=2)["stuck"] for seed in range(40))


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
    assert any(look([seed])[wrong] for seed in seeds)


def test_a_vehicle_that_is_not_held_would_touch_another(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its light opens while others with a grant are on their way."""
    monkeypatch.setattr("fake_traffic.FakeTraffic.stand", lambda *_, **__: None)
    assert any(look([seed])["touch"] for seed in range(60))
