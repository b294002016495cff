"""A SUMO configuration under a gate and without: its detectors, outputs, seed, step and options count."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from loopgate.errors import TrafficError
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario

pytestmark = pytest.mark.sumo

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("gate", ["certified", "open"])
def test_a_configuration_is_honoured(tmp_path: Path, gate: str) -> None:
    """Alike with and without a gate, so that like is compared with like; what is left out is said."""
    shutil.copy(ROOT / "networks" / "grid5-priority.net.xml", tmp_path / "n.net.xml")
    shutil.copy(ROOT / "routes" / "grid5.rou.xml", tmp_path / "r.rou.xml")
    (tmp_path / "d.add.xml").write_text(
        '<additional><e1Detector id="d" lane="A0A1_0" pos="50" freq="60" file="d.xml"/></additional>'
    )
    config = tmp_path / "c.sumocfg"
    config.write_text(
        '<configuration><net-file value="n.net.xml"/><route-files value="r.rou.xml"/>'
        '<additional-files value="d.add.xml"/><begin value="100"/><end value="160"/>'
        '<step-length value="0.5"/>'
        '<tripinfo-output value="t.xml"/><lateral-resolution value="0.8"/><seed value="9"/>'
        '<time-to-teleport value="300"/></configuration>'
    )
    given = {"network": str(config), "gate": gate, "vehicles": 20, "fcd": True, "sumo": "--scale 1"}
    summary = simulate(Scenario.from_dict(given), tmp_path / "run")
    assert summary["seed"] == 9
    assert summary["duration_s"] == pytest.approx(60.0)
    assert summary["collisions"] == 0
    assert summary["distance_km"] > 1.0
    assert "<interval" in (tmp_path / "d.xml").read_text()
    assert (tmp_path / "t.xml").is_file()
    assert (tmp_path / "run" / "fcd.xml.gz").stat().st_size > 1000
    assert [line for line in summary["warnings"] if "time-to-teleport 300 is not taken over" in line]


def test_an_option_that_sumo_does_not_know_is_named() -> None:
    """SUMO itself only says that it could not parse its command line."""
    grid = str(ROOT / "networks" / "grid5-priority.net.xml")
    with pytest.raises(TrafficError, match="does not take the options --nonsense 2; 'sumo --help' lists all"):
        simulate(Scenario(network=grid, gate="open", loops=3, duration_s=5, sumo="--nonsense 2"))
