"""Which refused vehicles are slowed early, and when their crossings and lights let them go."""

from __future__ import annotations

from collections.abc import Callable
from math import inf

import pytest
from fake_traffic import FakeTraffic

from loopgate.abstraction.itinerary import Crossing, DrawnLeg
from loopgate.control.brakes import Brakes
from loopgate.control.layout import Layout
from loopgate.control.ledger import Ledger
from loopgate.control.motion import braking_m, safe_speed
from loopgate.control.places import Make
from loopgate.control.rolling import (
    AHEAD_S,
    MOST_S,
    Rolling,
    best_speed,
    free_in_s,
    may_be_slowed,
)
from loopgate.control.rules import usual
from loopgate.model import StateId

SHARED = (2.0, 9.0)
"""What both movements use, in metres behind the line."""
TOP = 13.9
MAKE = Make(5.0, 2.6, 4.5, TOP, 1.0)


class Told(FakeTraffic):
    """Takes note of what vehicles are told to keep to."""

    def __init__(self) -> None:
        super().__init__({})
        self.limits: dict[str, float | None] = {}

    def keep_to(self, vehicle: str, speed_mps: float | None) -> None:
        """Note a limit."""
        self.limits[vehicle] = speed_mps


class Scene:
    """`b` crosses, so many metres behind its line at 50 m; `a` is refused for it, so many before its own."""

    def __init__(self, left_m: float, speed: float, inside_m: float, b_speed: float = 5.0) -> None:
        ways = []
        for name, foe in ("ab", "ba"):
            over = Crossing(name, frozenset({foe}), {foe: SHARED}, TOP, 0.0)
            legs = (
                DrawnLeg(StateId(f"p{name}"), 0.0, 50.0, (over,)),
                DrawnLeg(StateId(f"q{name}"), 70.0, 170.0),
            )
            ways.append(legs)
        layout = Layout(dict.fromkeys(("pa", "qa", "pb", "qb"), 3), ways)
        self.ledger = Ledger(usual())
        self.path = layout.path(ways[0])
        self.a = self.ledger.take_in("a", self.path, 0, MAKE, 1000.0)
        self.b = self.ledger.take_in("b", layout.path(ways[1]), 0, MAKE, 1000.0)
        self.b.front_m = 49.0
        self.ledger.ask(self.b)
        assert self.ledger.answer(0.0) == [self.b]
        self.a.front_m = 49.0
        self.ledger.ask(self.a)
        assert self.ledger.answer(1.0) == []
        assert self.a.reason == "crossing"
        self.b.front_m, self.b.speed = 50.0 + inside_m, b_speed
        self.a.front_m, self.a.speed, self.a.held = 50.0 - left_m, speed, True
        self.traffic = Told()
        self.brakes = Brakes(self.traffic, [])
        self.brakes.holds(self.a)
        self.rolling = Rolling(self.traffic, self.brakes)


@pytest.mark.parametrize("inside_m", [0.0, 1.0, 2.0, 4.0, 6.0])
@pytest.mark.parametrize("step_s", [1.0, 0.5])
def test_the_way_is_free_the_sooner_the_farther_the_other_is(inside_m: float, step_s: float) -> None:
    """Fronts and speeds are as before after the prediction."""
    scene = Scene(7.5, 0.0, inside_m)
    before = [(one.front_m, one.speed) for one in (scene.a, scene.b)]
    sooner = free_in_s(scene.a, 1.0, step_s)
    assert [(one.front_m, one.speed) for one in (scene.a, scene.b)] == before
    scene.b.front_m -= 1.0
    assert 1 <= sooner <= free_in_s(scene.a, 1.0, step_s) <= AHEAD_S + 1


def test_a_vehicle_that_stands_in_the_way_is_not_predicted_to_be_gone() -> None:
    """It is held before the end of the place behind, which it has a grant for."""
    scene = Scene(7.5, 0.0, 1.0, b_speed=0.0)
    scene.b.line_m = scene.b.front_m + 0.1
    assert free_in_s(scene.a, 1.0, 1.0) == AHEAD_S + 1


@pytest.mark.parametrize("speed", [0.0, 2.0, 5.0, 8.0])
@pytest.mark.parametrize("free_s", [1, 2, 3, 4])
@pytest.mark.parametrize("step_s", [1.0, 0.5])
def test_a_slowed_vehicle_can_always_stop_before_its_line(speed: float, free_s: int, step_s: float) -> None:
    """It never goes faster than that."""
    for left_m in (1.0, 4.0, 7.5, 12.0, 20.0, 30.0):
        if braking_m(speed, 4.5, step_s) > left_m:
            continue
        limit = best_speed(left_m, speed, MAKE, free_s, step_s)
        assert limit == inf or limit <= max(safe_speed(left_m, 4.5, step_s), speed - 4.5 * step_s)
        assert limit == inf or limit <= speed + 2.6 * step_s
        if free_s == 1:
            assert limit == inf


def test_a_vehicle_that_would_come_to_its_line_too_early_hangs_back() -> None:
    """It stands 7.5 m before its line. Granted in one second it goes at once, in three seconds later."""
    limits = [best_speed(7.5, 0.0, MAKE, free_s, 1.0) for free_s in (1, 3)]
    assert limits[0] == inf
    assert limits[1] < 1.0


def _older(scene: Scene) -> None:
    scene.a.since_s -= MOST_S + 1.0


def _full(scene: Scene) -> None:
    for name in "cd":
        scene.ledger.take_in(name, scene.path, 0, MAKE, 1000.0)


def _for_a_slot(scene: Scene) -> None:
    scene.a.reason = "occupied"


def _let_go(scene: Scene) -> None:
    scene.ledger.withdraw(scene.a)


def _at_its_line(scene: Scene) -> None:
    scene.a.front_m = scene.a.line_m - 0.5


def _too_late(scene: Scene) -> None:
    scene.a.speed = TOP


def _before_a_stop(scene: Scene) -> None:
    scene.a.stop_m = scene.a.line_m - 1.0


def _in_two_places(scene: Scene) -> None:
    scene.a.bodies[0] = scene.b.bodies[0]
    scene.a.front_m = scene.a.bodies[0].begin_m - 1.0


CHANGES: list[Callable[[Scene], None]] = [
    *(_older, _full, _for_a_slot, _let_go, _at_its_line, _too_late, _before_a_stop, _in_two_places)
]


@pytest.mark.parametrize("change", CHANGES)
def test_a_vehicle_is_slowed_only_where_it_delays_nobody_and_waits_for_its_crossing(
    change: Callable[[Scene], None],
) -> None:
    """Each change alone keeps it from being slowed."""
    scene = Scene(7.5, 0.0, 1.0)
    now_s = scene.ledger.now_s
    assert may_be_slowed(scene.a, now_s, 1.0)
    change(scene)
    assert not may_be_slowed(scene.a, now_s, 1.0)


def test_a_limit_holds_for_a_step() -> None:
    """It is lifted before anything else is done in the next step, and not for a vehicle that has left."""
    scene = Scene(7.5, 0.0, 0.0, b_speed=0.0)
    scene.rolling.look()
    limit = scene.traffic.limits.pop("a")
    assert limit is not None
    assert limit < 1.0
    scene.rolling.lift()
    assert scene.traffic.limits.pop("a") is None
    scene.rolling.look()
    scene.traffic.limits.clear()
    scene.rolling.forget(scene.a)
    scene.rolling.lift()
    assert scene.traffic.limits == {}


def test_nobody_is_slowed_who_does_not_brake_for_a_line() -> None:
    """A vehicle that cannot be stopped at its line is braked, and no limit may undo that."""
    scene = Scene(7.5, 0.0, 1.0)
    scene.brakes.forget(scene.a)
    scene.rolling.look()
    assert not scene.traffic.limits
