"""How far and how long vehicles drive, beside what many small steps give."""

from __future__ import annotations

from math import inf, sqrt
from random import Random

import pytest

from loopgate.control.places import braking_m, braking_time_s, safe_speed, time_s


@pytest.mark.parametrize(
    ("distance_m", "room_m", "top"), [(10.0, 12.0, 10.0), (10.0, 60.0, 10.0), (5.0, 5.5, 3.0)]
)
def test_the_time_behind_a_standing_vehicle(distance_m: float, room_m: float, top: float) -> None:
    """Driven in small steps at the speed from which a second and the brakes are enough, it takes as long."""
    decel, step_s = 4.5, 1e-4
    driven_m, took_s = 0.0, 0.0
    while driven_m < distance_m:
        gap_m = room_m - driven_m
        driven_m += min(top, sqrt(decel**2 + 2 * decel * gap_m) - decel) * step_s
        took_s += step_s
    assert braking_time_s(distance_m, room_m, top, decel) == pytest.approx(took_s, abs=0.01)


def test_without_room_it_never_gets_there() -> None:
    """It would stop before; and with nobody before it, nothing slows it down."""
    assert braking_time_s(10.0, 10.0, 10.0, 4.5) == inf
    assert braking_time_s(10.0, inf, 10.0, 4.5) == 0.0


def stepped_m(speed: float, decel: float, step_s: float) -> float:
    """Return how far a vehicle drives that brakes in each step."""
    driven_m = 0.0
    while speed > 0.0:
        speed = max(0.0, speed - decel * step_s)
        driven_m += speed * step_s
    return driven_m


def drawn(seed: int) -> list[tuple[float, float, float]]:
    """Return speeds, decelerations and steps."""
    draw = Random(seed)
    steps = (0.1, 0.5, 1.0)
    return [(draw.uniform(0.0, 40.0), draw.uniform(1.0, 6.0), draw.choice(steps)) for _ in range(500)]


def test_a_vehicle_brakes_step_by_step() -> None:
    """Braking is as long as the steps of SUMO make it."""
    for speed, decel, step_s in drawn(1):
        assert braking_m(speed, decel, step_s) == pytest.approx(stepped_m(speed, decel, step_s), abs=1e-9)


def test_a_safe_speed_is_the_highest_from_which_a_vehicle_still_stops() -> None:
    """A step at that speed and then the brakes take all the room there is, and a little faster more."""
    for room_m, decel, step_s in drawn(2):
        speed = safe_speed(room_m, decel, step_s)
        assert speed * step_s + braking_m(speed, decel, step_s) == pytest.approx(room_m, abs=1e-6)
        faster = speed + 0.01
        assert faster * step_s + braking_m(faster, decel, step_s) > room_m


def test_the_time_to_drive_a_distance() -> None:
    """Gaining speed up to a top speed, beside small steps."""
    draw = Random(3)
    for _ in range(20):
        distance_m, speed, top = draw.uniform(1.0, 100.0), draw.uniform(0.0, 15.0), draw.uniform(3.0, 20.0)
        accel, step_s = draw.uniform(0.5, 3.0), 1e-3
        now, driven_m, took_s = min(speed, top), 0.0, 0.0
        while driven_m < distance_m:
            now = min(top, now + accel * step_s)
            driven_m += now * step_s
            took_s += step_s
        assert time_s(distance_m, speed, accel, top) == pytest.approx(took_s, abs=0.01)
    assert time_s(0.0, 3.0, 1.0, 10.0) == time_s(-5.0, 3.0, 1.0, 10.0) == 0.0
