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

_MOVES_M = 2.5
"""Drivers creep up to their leaders for minutes; so much is no move [m]."""


@pytest.fixture(scope="module", params=["priority", "allway_stop", "right_before_left", "traffic_light"])
def crowded(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write a configuration: a block of one-lane streets, with more trips than it can hold."""
    folder = tmp_path_factory.mktemp(request.param)
    options = "--grid --grid.number 2 --grid.length 80 --grid.attach-length 80 --tls.allred.time 0"
    netgenerate(f"{options} --default-junction-type {request.param}", folder / "n.net.xml")
    ends = [
        (f"{side}{near}", f"{far}{other}")
        for side, near, *others in (
            ("bottom0", "A0", "A1left1", "B1top1", "A1top0"),
            ("left1", "A1", "B0right0", "B0bottom1", "B1top1"),
            ("top1", "B1", "A0left0", "A0bottom0", "B0bottom1"),
            ("right0", "B0", "A1top0", "A1left1", "A0left0"),
        )
        for far, other in ((one[:2], one[2:]) for one in others)
    ]
    flows = "".join(
        f'<flow id="f{k}" begin="0" end="300" vehsPerHour="220" from="{a}" to="{b}" departSpeed="max"/>'
        for k, (a, b) in enumerate(ends)
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
    at: dict[str, tuple[str, float]] = {}
    last: dict[str, float] = {}
    names: set[str] = set()
    for time_s, vehicles in read_frames(fcd):
        names = {one.vehicle for one in vehicles}
        for one in vehicles:
            lane, pos_m = at.get(one.vehicle, ("", 0.0))
            if lane != one.lane or one.pos_m - pos_m > _MOVES_M:
                at[one.vehicle], last[one.vehicle] = (one.lane, one.pos_m), time_s
    return {vehicle: last[vehicle] for vehicle in names}


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
    assert not [one for one in made["warnings"] if re.search("teleport", one)]
    for summary in (made, read):
        if not stands:
            assert summary["outcome"] == "done"
            continue
        assert summary["outcome"] == "deadlock"
        found = summary["deadlocks"][0]
        assert set(found["vehicles"]) <= stands.keys()
        last_s = max(stands[vehicle] for vehicle in found["vehicles"])
        assert last_s - 2.0 <= found["closed_at_s"] <= max(stands.values()) + 12.0
        assert found["noticed_at_s"] - found["closed_at_s"] <= 60.0
