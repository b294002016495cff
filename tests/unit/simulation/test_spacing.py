"""Who is told to drive faster and slower."""

from __future__ import annotations

import numpy as np
import pytest

from loopgate.network.vehicle_type import DEFAULT_TYPE
from loopgate.simulation.spacing import advised_type, lead


def test_evenly_spaced_vehicles_lead_nobody() -> None:
    """In any order, and wherever the loop begins."""
    assert lead(np.array([70.0, 10.0, 40.0]), 90.0) == pytest.approx([0.0, 0.0, 0.0])


def test_the_one_too_near_to_the_one_ahead_leads() -> None:
    """At 0, 30 and 40 of 60 s: half of gap behind less gap ahead (30, 10, 20 s), in spacings of 20 s."""
    assert lead(np.array([0.0, 30.0, 40.0]), 60.0) == pytest.approx([-0.25, 0.5, -0.25])


def test_two_on_a_loop() -> None:
    """At 0 and 10 of 60 s: the first is 20 s ahead of the middle, the second as much behind; spacing 30 s."""
    assert lead(np.array([0.0, 10.0]), 60.0) == pytest.approx([40 / 60, -40 / 60])


def test_one_alone_has_no_neighbours() -> None:
    """It drives as allowed."""
    assert lead(np.array([17.0]), 60.0) == pytest.approx([0.0])


def test_positions_may_lie_beyond_a_lap() -> None:
    """They are taken round the loop."""
    assert lead(np.array([600.0, 90.0, 40.0]), 60.0) == pytest.approx(lead(np.array([0.0, 30.0, 40.0]), 60.0))


def test_advised_types_drive_as_told() -> None:
    """As fast as the fastest advice from the start, so that gates reckon with that, and all alike."""
    kind = advised_type(DEFAULT_TYPE)
    assert kind.attributes == {"speedFactor": "1.1", "speedDev": "0"}
    assert kind.id == DEFAULT_TYPE.id
