"""Networks that the project has never seen: a run works, with nothing but numbers given."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest
import sumo

from loopgate.simulation.run import run
from loopgate.simulation.scenario import Scenario

pytestmark = pytest.mark.sumo

MADE = {
    "spider": "--spider --spider.arm-number=6 --spider.circle-number=4",
    "random": "--rand --rand.iterations=60 --seed=4",
    "two-lanes-lights": "--grid --grid.number=4 --grid.length=120 -L 2 -j traffic_light",
    "left-hand": "--grid --grid.number=4 --grid.length=120 --lefthand",
}


@pytest.mark.parametrize("name", MADE)
def test_it_simply_works(name: str, tmp_path: Path) -> None:
    """120 vehicles, ten minutes: nobody collides, nobody locks up, the audit is clean."""
    net = tmp_path / f"{name}.net.xml"
    tool = Path(sumo.SUMO_HOME) / "bin" / "netgenerate"
    environment = {**os.environ, "SUMO_HOME": sumo.SUMO_HOME}
    command = [str(tool), *MADE[name].split(), "-o", str(net)]
    subprocess.run(command, check=True, capture_output=True, env=environment)
    summary = run(Scenario(network=str(net), loops=40, vehicles=120, duration_s=600))
    assert (summary["outcome"], summary["collisions"], summary["teleports"]) == ("done", 0, 0)
    assert summary["audit"] == "clean"
    assert summary["laps"] >= 120
