"""The linear programme that bounds what rules can reach, on one junction by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest
from limit import HEADWAY_S, SPACE_M, limit_km

SPEED_MPS, LOOP_M = 10.0, 1000.0
PASS_S = HEADWAY_S["human"] + SPACE_M / SPEED_MPS


def loop(name: str, foe: str) -> Any:  # noqa: ANN401  as much of an itinerary as is looked at
    """Return a loop of two legs that passes one junction once in a lap, across another one's way."""
    way = SimpleNamespace(id=name, speed_mps=SPEED_MPS, foes=frozenset({foe}))
    legs = [
        SimpleNamespace(state=f"{name}0", crossings=(way,)),
        SimpleNamespace(state=f"{name}1", crossings=()),
    ]
    return SimpleNamespace(loop=SimpleNamespace(id=name, length_m=LOOP_M), legs=legs)


@pytest.mark.parametrize(
    ("vehicles", "km_per_h"),
    [
        (10, 2 * 10 * SPEED_MPS * 3.6),  # few: all drive as if alone
        (100, LOOP_M * 3.6 / PASS_S),  # many: one at a time passes the junction, of both loops together
    ],
)
def test_two_loops_that_cross(vehicles: int, km_per_h: float) -> None:
    """Either speed or the junction binds, and the two loops share it."""
    every = [loop("a", "b")] * vehicles + [loop("b", "a")] * vehicles
    found = limit_km({"a": SPEED_MPS, "b": SPEED_MPS}, cast("Any", every))
    assert found == pytest.approx(km_per_h)
