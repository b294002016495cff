"""Who is told to drive faster and slower."""

from __future__ import annotations

import numpy as np
import pytest

from loopgate.network.vehicle_type import DEFAULT_TYPE
from loopgate.simulation.fleet.spacing import Neighbours, advised_type


def of_one(times: list[float], lap_s: float) -> list[float]:
    """Return the leads on one loop."""
    count = len(times)
    return list(Neighbours(np.full(count, lap_s), np.zeros(count, dtype=np.int64)).leads(np.array(times)))


def test_evenly_spaced_vehicles_lead_nobody() -> None:
    """In any order, and wherever the loop begins."""
    assert of_one([70.0, 10.0, 40.0], 90.0) == pytest.approx([0.0, 0.0, 0.0])


def test_the_one_too_near_to_the_one_ahead_leads() -> None:
    """At 0, 30 and 40 of 60 s: half of gap behind less gap ahead (30, 10, 20 s), in spacings of 20 s."""
    assert of_one([0.0, 30.0, 40.0], 60.0) == pytest.approx([-0.25, 0.5, -0.25])


def test_two_on_a_loop() -> None:
    """At 0 and 10 of 60 s: the first is 20 s ahead of the middle, the second as much behind; spacing 30 s."""
    assert of_one([0.0, 10.0], 60.0) == pytest.approx([40 / 60, -40 / 60])


def test_one_alone_has_no_neighbours() -> None:
    """It drives as allowed."""
    assert of_one([17.0], 60.0) == pytest.approx([0.0])


def test_positions_may_lie_beyond_a_lap() -> None:
    """They are taken round the loop."""
    assert of_one([600.0, 90.0, 40.0], 60.0) == pytest.approx(of_one([0.0, 30.0, 40.0], 60.0))


def test_loops_do_not_mix() -> None:
    """Three on one loop and two on another with another lap, in any order: each as if alone on its own."""
    times = np.array([30.0, 0.0, 0.0, 10.0, 40.0])
    laps = np.array([60.0, 60.0, 50.0, 50.0, 60.0])
    found = Neighbours(laps, np.array([4, 4, 2, 2, 4])).leads(times).tolist()
    assert found[:2] + found[4:] == pytest.approx(of_one([30.0, 0.0, 40.0], 60.0))
    assert found[2:4] == pytest.approx(of_one([0.0, 10.0], 50.0))


def test_advised_types_drive_as_told() -> None:
    """As fast as the fastest advice from the start, so that gates reckon with that, and all alike."""
    kind = advised_type(DEFAULT_TYPE)
    assert kind.attributes == {"speedFactor": "1.1", "speedDev": "0"}
    assert kind.id == DEFAULT_TYPE.id
