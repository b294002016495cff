"""What is surely known of a vehicle from its own figures."""

from typing import Any

import pytest

from loopgate.control.places import Make

CAR: dict[str, Any] = {"length_m": 5.0, "accel": 2.6, "decel": 4.5, "top": 13.9, "haste": 1.0}


@pytest.mark.parametrize(
    ("its_own", "surely"),
    [
        ({}, 7.0),
        ({"pace": 0.8}, 7.0),
        ({"pace": 0.4}, 3.5),
        ({"own_top": 3.0}, 2.1),
        ({"accel": 6.0}, 5.75),
        ({"accel": 40.0}, 0.1),
    ],
)
def test_speed_that_a_vehicle_surely_keeps_at_a_limit(its_own: dict[str, float], surely: float) -> None:
    """At 10 m/s: 0.7 of what it wants; 6 m/s2 dawdled by half lose 3 m/s, 1.25 more than is in the 0.7."""
    assert Make(**{**CAR, **its_own}).surely(10.0) == pytest.approx(surely)


@pytest.mark.parametrize(("dawdles", "weak", "sure"), [(0.0, 1.3, 2.6), (0.5, 1.3, 2.6), (0.75, 0.65, 1.3)])
def test_acceleration_that_a_vehicle_surely_has(dawdles: float, weak: float, sure: float) -> None:
    """A driver who dawdles by SUMO's default uses half of it at least."""
    car = Make(**CAR, dawdles=dawdles)
    assert (car.weak_accel, car.sure_accel) == pytest.approx((weak, sure))


def test_nothing_is_foreseen_of_a_driver_who_may_not_accelerate_at_all() -> None:
    """SUMO's sigma of 1."""
    assert Make(**CAR, dawdles=0.9).foreseen
    assert not Make(**CAR, dawdles=1.0).foreseen


def test_another_top_speed_changes_nothing_else() -> None:
    """As for a vehicle that is led to another path."""
    car = Make(**CAR, pace=0.7, own_top=9.0, dawdles=0.6, foreseen=False, brakes_late=True)
    other = car.with_top(20.0)
    assert (other.top, other.foreseen, other.brakes_late) == (20.0, False, True)
    assert other.with_top(car.top).figures == car.figures
