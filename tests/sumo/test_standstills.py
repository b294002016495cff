"""A deadlock is told for vehicles that never move again in SUMO's own positions, and for no others."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest
import sumo
from made_networks import netgenerate

from loopgate import Scenario, read_fcd, run
from loopgate.simulation.fcd.frames import read_frames

pytestmark = pytest.mark.sumo

_CREEPS_MPS = 0.05
"""Drivers creep up to their leaders for minutes, some millimetres a second; that is no move [m/s]."""


KINDS = ("priority 1", "allway_stop 1", "right_before_left 2 --lefthand", "traffic_light 2")


@pytest.fixture(scope="module", params=KINDS)
def crowded(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write a configuration: a block of streets, with more vehicles round it than it can hold."""
    kind, lanes, *side = request.param.split()
    folder = tmp_path_factory.mktemp(kind)
    options = "--grid --grid.number 2 --grid.length 80 --grid.attach-length 80 --tls.allred.time 0"
    options += f" --default-junction-type {kind} --default.lanenumber {lanes} {' '.join(side)}"
    netgenerate(options, folder / "n.net.xml")
    ways = (
        "bottom0A0 A0A1 A1B1 B1B0 B0right0",
        "left1A1 A1B1 B1B0 B0A0 A0left0",
        "top1B1 B1B0 B0A0 A0A1 A1top0",
        "right0B0 B0A0 A0A1 A1B1 B1right1",
    )
    flows = "".join(
        f'<flow id="f{k}" begin="0" end="300" vehsPerHour="{600 * int(lanes)}" departSpeed="max">'
        f'<route edges="{way}"/></flow>'
        for k, way in enumerate(ways)
    )
    (folder / "d.rou.xml").write_text(f"<routes>{flows}</routes>")
    config = folder / "d.sumocfg"
    config.write_text(
        '<configuration><net-file value="n.net.xml"/><route-files value="d.rou.xml"/><end value="900"/>'
        '<time-to-teleport value="-1"/></configuration>'
    )
    return config


def standing_for_good(fcd: Path) -> dict[str, float]:
    """Return the vehicles that are there at the end, and when each moved last [s]."""
    last: dict[str, float] = {}
    names: set[str] = set()
    for time_s, vehicles in read_frames(fcd):
        names = {one.vehicle for one in vehicles}
        last |= {one.vehicle: time_s for one in vehicles if one.speed_mps > _CREEPS_MPS}
    return {vehicle: last.get(vehicle, 0.0) for vehicle in names}


def test_a_standstill_is_told_within_a_minute_and_names_only_who_stands_for_good(
    crowded: Path, tmp_path: Path
) -> None:
    """By a run, and by the positions of SUMO alone."""
    fcd = tmp_path / "fcd.xml"
    binary = Path(sumo.SUMO_HOME) / "bin" / "sumo"
    words = ["-c", str(crowded), "--seed", "1", "--fcd-output", str(fcd), "--no-step-log"]
    subprocess.run([binary, *words], check=True, capture_output=True)
    stands = standing_for_good(fcd)
    made = run(Scenario(network=str(crowded), gate="open", seed=1), tmp_path / "run").summary
    read = read_fcd(fcd, str(crowded), tmp_path / "read").summary
    assert len(stands) > 50
    assert not [one for one in made["warnings"] if re.search("teleport", one)]
    for summary in (made, read):
        assert summary["outcome"] == "deadlock"
        found = summary["deadlocks"][0]
        assert set(found["vehicles"]) <= stands.keys()
        last_s = max(stands[vehicle] for vehicle in found["vehicles"])
        assert last_s - 2.0 <= found["closed_at_s"] <= max(stands.values()) + 12.0
        assert found["noticed_at_s"] - found["closed_at_s"] <= 60.0
