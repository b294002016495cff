"""What is kept for a vehicle that is served, and what it takes for that to be enough."""

from __future__ import annotations

from collections.abc import Callable
from math import inf
from random import Random

import pytest
from by_hand import AFTER_S, by_hand
from crossed_roads import CrossedRoads, small_grid
from keeping_cases import CASES, two_before_one_slot

from builders import system
from loopgate.errors import UnsafeStartError
from loopgate.gates import make_gate
from loopgate.negotiation.pressure import Pressure

FOR_S = 400
LONG_S = 300.0
"""On this grid nobody waits for half as long while all assumptions hold."""


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.__name__)
def test_the_service(case: Callable[[], None]) -> None:
    """As the case says."""
    case()


def test_where_all_assumptions_hold_every_vehicle_goes_on() -> None:
    """So what the tests below see comes from the assumption that they break."""
    world = small_grid(AFTER_S)
    world.drive(FOR_S)
    assert max(world.longest_s) < LONG_S / 2
    assert min(world.moves) > 0


def test_without_service_the_negotiation_decides_that_some_never_go() -> None:
    world = small_grid(inf)
    world.drive(FOR_S)
    assert max(world.longest_s) > LONG_S


def test_a_vehicle_that_does_not_clear_its_crossing_keeps_others_for_good() -> None:
    """Broken: a vehicle with a grant drives on."""
    world = small_grid(AFTER_S, rests={1})
    world.drive(FOR_S)
    assert max(world.longest_s) > LONG_S


@pytest.mark.parametrize("reason", ["red", "traffic"])
def test_what_never_ends_outside_keeps_a_vehicle_for_good(reason: str) -> None:
    """Broken: lights turn green again and again, and ordinary traffic gives way."""
    world = small_grid(AFTER_S)
    world.hand.withhold(reason, world.vehicles[5].name)
    world.drive(FOR_S)
    assert max(world.longest_s) > LONG_S


def test_nothing_is_kept_for_a_vehicle_that_waits_for_something_that_stands() -> None:
    """It could not use it, for as long as that stands: the next one goes."""
    hand = two_before_one_slot()
    hand.withhold()
    hand.breaks_down("a")
    told = [one for now_s in range(31, 45) for one in hand.decide(float(now_s))]
    assert ("d", "granted") in told


def test_where_places_are_crowded_nobody_is_served_and_the_gate_says_so() -> None:
    """Broken: (S). Five turn in a ring of six slots; one that wants to drive through never can."""
    left = {f"l{k}": "l0 l1 l2" for k in range(3)}
    right = {f"r{k}": "r0 r1 r2" for k in range(5)}
    starts = {"l0": 1, "l1": 2, "l2": 2, "r1": 0, "r2": 1, "r3": 1, "r4": 2}
    places = ("l0", "l1", "l2", "r0", "r1", "r2")
    robots = system(
        {**left, **right, "through": "l0 l1 r0 r1"},
        starts=starts,
        capacity=dict.fromkeys(places, 2),
        fifo=places,
    )
    with pytest.raises(UnsafeStartError, match="not everyone can go on"):
        make_gate("certified", robots)
    world = CrossedRoads(robots, 1, serve_after_s=AFTER_S, gate="certified:promise=somebody")
    world.drive(FOR_S)
    before = list(world.moves)
    world.drive(FOR_S)
    through = len(robots.robots) - 1
    assert world.moves[through] == before[through]
    assert sum(world.moves) > sum(before)


def test_the_reserve_yields_though_nothing_else_changes() -> None:
    """A third of 10 s after its request the vehicle goes, though nobody has moved in the meantime."""
    reserve = Pressure(Random(0), crowded=0.01, patience=10.0)
    paths = {"a": "p s", "b": "s p", "c": "s p"}
    hand = by_hand(paths, {"p": 3, "s": 3}, negotiation=reserve, serve_after_s=inf)
    hand.asks("a", 0.0)
    assert hand.decide(0.0) == [("a", "reserve")]
    assert hand.decide(3.0) == []
    assert hand.decide(4.0) == [("a", "granted")]
