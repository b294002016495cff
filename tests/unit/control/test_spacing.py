"""How far vehicles are ahead on their loops, and what follows from it."""

from __future__ import annotations

from random import Random
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from loopgate.abstraction.itinerary import Track
from loopgate.control.ledger import Ledger
from loopgate.control.places import Place, path_of
from loopgate.control.rules import usual
from loopgate.control.spacing import Ring, Spacing
from loopgate.traffic.base import Traffic


class Told:
    """A simulation that remembers advice."""

    now_s = 10.0

    def __init__(self) -> None:
        self.factors: dict[str, float] = {}

    def advise(self, vehicle: str, speed_factor: float) -> None:
        self.factors[vehicle] = speed_factor


def on_a_ring(fronts_m: list[float], *, advises: bool = False) -> tuple[Ledger, Spacing, Ring, Told]:
    """Return vehicles on a loop of two roads of 100 m, of which the second takes twice as long."""
    ring, told = Ring([0.0, 100.0, 200.0], [0.0, 10.0, 30.0]), Told()
    spacing = Spacing(cast("Traffic", told), {"loop": ring}, advises=advises)
    ledger = Ledger(usual(outside=[spacing.holds]))
    path = path_of([Place("a", 9), Place("b", 9)], closed=True)
    for number, front_m in enumerate(fronts_m):
        vehicle = ledger.take_in(f"v{number}", path, 0 if front_m % 200.0 < 100.0 else 1, lap_m=200.0)
        vehicle.front_m = front_m
        spacing.take_in(vehicle, cast("Track", SimpleNamespace(loop="loop")))
    return ledger, spacing, ring, told


@pytest.mark.parametrize("vehicles", [1, 2, 3, 7])
def test_leads_are_those_of_sorted_times(vehicles: int) -> None:
    """Half the difference of the gaps behind and ahead, in units of even spacing."""
    draw = Random(vehicles)
    for _ in range(50):
        fronts_m = [draw.uniform(0.0, 200.0) + 200.0 * draw.randrange(3) for _ in range(vehicles)]
        ledger, _, ring, _ = on_a_ring(fronts_m)
        at_s = np.interp(np.array(fronts_m) % 200.0, [0.0, 100.0, 200.0], [0.0, 10.0, 30.0])
        order = np.argsort(at_s)
        ahead_s = np.empty(vehicles)
        ahead_s[order] = np.diff(np.append(at_s[order], at_s[order[0]] + 30.0))
        behind_s = np.empty(vehicles)
        behind_s[order] = np.roll(ahead_s[order], 1)
        ours = [ring.lead(vehicle) for vehicle in ledger.vehicles.values()]
        assert ours == pytest.approx(((behind_s - ahead_s) * vehicles / 60.0).tolist(), abs=1e-9)


def test_one_that_is_ahead_waits_unless_another_waits_behind_it() -> None:
    ledger, spacing, ring, _ = on_a_ring([95.0, 120.0, 180.0])
    first, _, last = ledger.vehicles.values()
    lead = ring.lead(first)
    assert lead > 0.2
    assert spacing.is_behind(last) == (ring.lead(last) < 0.0)
    ledger.ask(first)
    assert ledger.answer(1.0) == []
    assert first.reason == "spacing"
    assert ledger.answer(48.0 * lead - 1.0) == []
    assert ledger.answer(48.0 * lead + 1.0) == [first]
    ledger, spacing, _, _ = on_a_ring([95.0, 120.0, 180.0])
    first = ledger.vehicles["v0"]
    ledger.ask(first)
    assert ledger.answer(1.0) == []
    ledger.take_in("behind", path_of([first.leg.place, Place("b", 9)], closed=True), 0)
    assert ledger.answer(2.0) == [first]


def test_one_that_is_no_longer_ahead_goes_on_at_once() -> None:
    """What it is held for is looked at in every step."""
    ledger, _, _, _ = on_a_ring([95.0, 120.0, 180.0])
    first, second, _ = ledger.vehicles.values()
    ledger.ask(first)
    assert ledger.answer(1.0) == []
    assert ledger.answer(2.0) == []
    second.front_m = 175.0  # the gap before the first is now as long as the others
    assert ledger.answer(3.0) == [first]


def test_advice_slows_down_vehicles_that_are_ahead() -> None:
    ledger, spacing, ring, told = on_a_ring([95.0, 120.0, 180.0], advises=True)
    spacing.look()
    for vehicle in ledger.vehicles.values():
        factor = told.factors.get(vehicle.name, 1.1)
        assert factor == pytest.approx(min(1.1, max(0.8, 1.0 - ring.lead(vehicle) / 2.0)), abs=0.005)
    assert min(told.factors.values()) < 1.0
    spacing.forget(ledger.vehicles["v0"])
    assert len(ring.vehicles) == 2


def test_however_far_one_is_ahead_it_waits_for_24_seconds_a_vehicle() -> None:
    ledger, _, ring, _ = on_a_ring([95.0, 96.0])
    first, second = ledger.vehicles.values()
    second.front_m = 90.0
    ring.lead = lambda *_: 5.0  # type: ignore[method-assign]
    ledger.ask(first)
    for at_s in (1.0, 47.9):
        first.leg.place.line[:] = [first]
        assert ledger.answer(at_s) == []
    assert ledger.answer(48.0) == [first]
