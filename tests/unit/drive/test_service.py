"""Whoever has waited long enough for a grant is served; and what it takes for that to be enough."""

import math
from collections.abc import Callable
from random import Random

import pytest
from books import Books
from little_roads import LittleRoads, Unfair
from service_cases import CASES, books, two_who_want_one_slot
from small_roads import one_way_grid, road_system

from builders import system
from loopgate.errors import UnsafeStartError
from loopgate.gates import Reason, make_gate
from loopgate.negotiation.pressure import Pressure

FOR_S = 400
LONG_S = 300.0
"""On this grid nobody waits for half as long while all assumptions hold."""


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.__name__)
def test_the_service_of_the_drive(case: Callable[[], None]) -> None:
    """As the case says."""
    case()


def new_grid(**options: object) -> LittleRoads:
    """Return a small grid with hardly a slot free; two vehicles are never let go by the negotiation."""
    robots = road_system(one_way_grid(), 13, 2, seed=5)
    given: dict[str, object] = {"serve_after_s": 20.0, "negotiation": Unfair({3, 8}), **options}
    return LittleRoads(robots, 1, **given)  # type: ignore[arg-type]  # as above


def grid(**options: object) -> LittleRoads:
    """Drive it for a while."""
    world = new_grid(**options)
    world.drive(FOR_S)
    return world


def test_where_all_assumptions_hold_everyone_goes_on() -> None:
    """So what the tests below see comes from the one that they break."""
    world = grid()
    assert max(world.longest_s) < LONG_S
    assert min(world.moves) > 0


def test_without_service_the_negotiation_decides_who_never_goes() -> None:
    """It never lets two go, and all wait behind them."""
    world = grid(serve_after_s=math.inf)
    assert max(world.longest_s) > LONG_S


def test_a_vehicle_that_does_not_clear_its_crossing_keeps_others_for_good() -> None:
    """Broken: who has a grant drives on."""
    world = grid(rests={1})
    assert max(world.longest_s) > LONG_S


@pytest.mark.parametrize("reason", [Reason.RED, Reason.TRAFFIC])
def test_what_never_ends_outside_keeps_a_vehicle_for_good(reason: Reason) -> None:
    """Broken: lights turn green again and again, and ordinary traffic gives way."""
    world = new_grid()
    world.books.withhold(reason, 5)
    world.drive(FOR_S)
    assert max(world.longest_s) > LONG_S


def test_nothing_is_kept_for_one_that_waits_for_what_stands() -> None:
    """It could not use it, for as long as that stands: the next one goes."""
    book, (a, _, d, _) = two_who_want_one_slot()
    book.withhold(Reason.STOP, a)
    told = [one for now_s in range(31, 45) for one in book.decide(float(now_s))]
    assert (d, True, "free") in told


def test_where_places_are_crowded_nobody_is_served_and_the_gate_says_so() -> None:
    """Broken: (S). Five residents turn in a ring of six slots; whoever wants to drive through never can."""
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
    world = LittleRoads(robots, 1, serve_after_s=20.0, gate="certified:promise=somebody")
    world.drive(FOR_S)
    before = list(world.moves)
    world.drive(FOR_S)
    through = len(robots.robots) - 1
    assert world.moves[through] == before[through]
    assert sum(world.moves) > sum(before)


def test_the_reserve_yields_though_nothing_else_changes() -> None:
    """A third of 10 s after its request the vehicle goes, though nobody has moved in the meantime."""
    reserve = Pressure(Random(0), crowded=0.01, patience=10.0)
    book: Books = books({"a": "p s", "b": "s p"}, {"p": 3, "s": 3}, negotiation=reserve)
    book.run["serve_after_s"] = math.inf
    book.asks(0, 0.0)
    assert book.decide(0.0) == [(0, False, "reserve")]
    assert book.decide(1.0) == [(0, True, "free")]
