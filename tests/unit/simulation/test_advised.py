"""Vehicles that are told how fast to drive."""

from __future__ import annotations

from loopgate.network.vehicle_type import DEFAULT_TYPE
from loopgate.simulation.drivers import advised_type


def test_advised_types_drive_as_told() -> None:
    """As fast as the fastest advice from the start, so that gates reckon with that, and all alike."""
    kind = advised_type(DEFAULT_TYPE)
    assert kind.attributes == {"speedFactor": "1.1", "speedDev": "0"}
    assert kind.id == DEFAULT_TYPE.id
