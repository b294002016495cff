"""How long a vehicle takes behind one that stands."""

import math

import pytest

from loopgate.simulation.sight import _braking_time_s


@pytest.mark.parametrize(
    ("distance", "room", "top"), [(10.0, 12.0, 10.0), (10.0, 60.0, 10.0), (5.0, 5.5, 3.0)]
)
def test_the_time_behind_a_standing_vehicle(distance: float, room: float, top: float) -> None:
    """Driven in small steps at the speed from which a second and the brakes are enough, it takes as long."""
    decel, step_s = 4.5, 1e-4
    driven, time_s = 0.0, 0.0
    while driven < distance:
        gap = room - driven
        driven += min(top, math.sqrt(decel**2 + 2 * decel * gap) - decel) * step_s
        time_s += step_s
    assert _braking_time_s(distance, room, top, decel) == pytest.approx(time_s, abs=0.01)


def test_without_room_it_never_gets_there() -> None:
    """It would stop before; and with nobody before it, nothing slows it down."""
    assert _braking_time_s(10.0, 10.0, 10.0, 4.5) == math.inf
    assert _braking_time_s(10.0, math.inf, 10.0, 4.5) == 0.0
