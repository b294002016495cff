"""The project's small networks under gates, with real simulations."""

from __future__ import annotations

from pathlib import Path

import pytest

from loopgate.simulation.run import run
from loopgate.simulation.scenario import Scenario

pytestmark = pytest.mark.sumo

ROOT = Path(__file__).resolve().parents[2]


def small(network: str, gate: str, duration_s: float) -> Scenario:
    """One vehicle on each loop of a small network."""
    return Scenario(
        network=str(ROOT / "networks" / f"{network}.net.xml"),
        routes=str(ROOT / "routes" / f"{network}.rou.xml"),
        gate=gate,
        duration_s=duration_s,
    )


@pytest.mark.parametrize("network", ["ring3", "order2"])
def test_vehicles_of_a_type_of_their_own_drive_under_sumo(network: str) -> None:
    """The route file's vehicle type reaches SUMO, and everyone gets round without a gate."""
    summary = run(small(network, "open", 300))
    assert summary["outcome"] == "done"
    assert summary["laps"] > summary["vehicles"]
    assert (summary["collisions"], summary["teleports"]) == (0, 0)
