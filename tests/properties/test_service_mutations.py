"""The cases of the service can fail: each part of it is broken on purpose, and each time a case notices."""

from __future__ import annotations

from collections.abc import Callable
from math import inf
from typing import Any, Final

import pytest
from keeping_cases import CASES

from loopgate.control import keeping, rules
from loopgate.control.chain import full_before
from loopgate.control.keeping import Keeping
from loopgate.control.places import Vehicle
from loopgate.control.pressure import PressureOrder
from loopgate.control.refusal import Refusal
from loopgate.simulation.asked_gate import Negotiated

LOOK: Final = Keeping.look
KEPT: Final = keeping.kept

Patch = Callable[[pytest.MonkeyPatch], None]


def _put(where: object, name: str, instead: object) -> Patch:
    """Return what puts something else in the place of a part."""
    return lambda patch: patch.setattr(where, name, instead)


def _afterwards(spoil: Callable[[Keeping], None]) -> Patch:
    """Return what spoils all that is kept, each time it has been said."""

    def look(self: Keeping, now_s: float) -> None:
        LOOK(self, now_s)
        spoil(self)

    return _put(Keeping, "look", look)


def _free_places(keeps: Keeping) -> None:
    for place in keeps._places:
        place.mover, place.barred = None, False


def _open_circles(keeps: Keeping) -> None:
    for place in keeps._places:
        place.barred = False


def _forget_circles(keeps: Keeping) -> None:
    keeps._turned.clear()


def _no_movers(keeps: Keeping) -> None:
    for mover in keeps._named_s:
        mover.mover = False


def _free_ways(keeps: Keeping) -> None:
    for movement in keeps._movements:
        movement.kept_for = None


def _bar(keeps: Keeping) -> None:
    for place in keeps._places:
        place.barred = place.mover is not None


def _one_slot_for_all(vehicle: Vehicle, now_s: float) -> Refusal | None:
    """Leave the mover the last slot only, whether there is room behind the vehicle or not."""
    wanted, here = vehicle.wanted(), vehicle.leg.place
    mover = None if wanted is None else wanted.mover
    if wanted is None or mover in (None, vehicle) or wanted.barred or len(here.line) >= here.slots:
        return KEPT(vehicle, now_s)
    return Refusal("service") if wanted.slots - len(wanted.bodies) <= 1 else None


def _rule(instead: Callable[[Vehicle, float], Refusal | None]) -> Patch:
    return _put(rules, "kept", instead)


def _as_it_says(self: Any, vehicles: list[Vehicle], now_s: float) -> list[Vehicle]:  # noqa: ANN401  private
    """Ask the negotiation about all vehicles."""
    ready = {self._request(one, one.wanted()): one for one in vehicles}
    return [ready[request] for request in self._negotiation.order(list(ready), self, now_s)]


def _reserved(self: PressureOrder, vehicle: Vehicle, now_s: float) -> bool:
    """Hold movers as all others."""
    before, vehicle.mover = vehicle.mover, False
    goes = GOES(self, vehicle, now_s)
    vehicle.mover = before
    return goes


GOES: Final = PressureOrder._goes

MUTATIONS: Final[dict[str, Patch]] = {
    "nothing": _put(keeping, "GIVES_WAY_S", keeping.GIVES_WAY_S),
    "nobody is served": _put(Keeping, "_serve", lambda *_: None),
    "the one served is to move, whatever is before it": _put(keeping, "next_mover", lambda one: one),
    "a mover is the first of the last place, circle or not": _put(
        keeping, "next_mover", lambda one: full_before(one)[-1].line[0]
    ),
    "any vehicle may enter": _afterwards(_free_places),
    "no vehicle may enter": _afterwards(_bar),
    "circles are open": _afterwards(_open_circles),
    "circles are forgotten": _afterwards(_forget_circles),
    "vehicles with room behind them leave no slot more": _rule(_one_slot_for_all),
    "nothing is kept": _rule(lambda *_: None),
    "ways are not cleared": _put(Keeping, "_clear_way", lambda *_: None),
    "ways are free again": _afterwards(_free_ways),
    "no way is kept through red": _put(keeping, "_THROUGH_RED_S", inf),
    "every way is kept through red": _put(keeping, "_THROUGH_RED_S", 0.0),
    "the reserve holds movers": _put(PressureOrder, "_goes", _reserved),
    "the negotiation holds movers": _put(Negotiated, "order", _as_it_says),
    "there are no movers": _afterwards(_no_movers),
}
"""By name: what breaks a part."""


def first_to_notice(mutation: str) -> str:
    """Return the first case that fails, if any."""
    with pytest.MonkeyPatch.context() as patch:
        MUTATIONS[mutation](patch)
        for case in CASES:
            try:
                case()
            except AssertionError:
                return case.__name__
    return ""


@pytest.mark.parametrize("mutation", [name for name in MUTATIONS if name != "nothing"])
def test_a_broken_part_is_noticed(mutation: str) -> None:
    """By some case."""
    assert first_to_notice(mutation)


def test_nothing_is_noticed_where_nothing_is_broken() -> None:
    """So each case that fails above fails for the part that was broken."""
    assert not first_to_notice("nothing")
