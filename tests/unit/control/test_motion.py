"""The ledger's formulas of motion are those of the drive."""

from __future__ import annotations

from random import Random

from loopgate.control import motion
from loopgate.drive import motion as driven
from loopgate.drive import sense


def test_both_reckon_alike() -> None:
    """Braking distances, times to drive a distance freely and behind a vehicle that stands."""
    draw = Random(1)
    for _ in range(2_000):
        metres, room_m = draw.uniform(0.0, 300.0), draw.uniform(0.0, 400.0)
        speed, top = draw.uniform(0.0, 20.0), draw.uniform(3.0, 30.0)
        accel, decel, step_s = draw.uniform(0.5, 3.0), draw.uniform(1.0, 6.0), draw.choice((0.1, 0.5, 1.0))
        assert abs(motion.braking_m(speed, decel, step_s) - sense.braking_m(speed, decel, step_s)) < 1e-9
        assert abs(motion.time_s(metres, speed, accel, top) - driven.time_s(metres, speed, accel, top)) < 1e-9
        one, other = (f(metres, room_m, top, decel) for f in (motion.braking_time_s, driven.braking_time_s))
        assert one == other or abs(one - other) < 1e-9


def test_both_slow_down_alike() -> None:
    """The highest speed from which a vehicle still stops in some metres, by `safe_mps`, uncompiled."""
    draw, safe_mps = Random(2), getattr(sense.safe_mps, "py_func", sense.safe_mps)
    for _ in range(2_000):
        room_m, decel, step_s = draw.uniform(0.0, 300.0), draw.uniform(1.0, 6.0), draw.choice((0.1, 0.5, 1.0))
        assert abs(motion.safe_speed(room_m, decel, step_s) - safe_mps(room_m, decel, step_s)) < 1e-9
