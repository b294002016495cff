"""A deadlock is told for vehicles that never move again in SUMO's own positions, and for no others."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import libsumo
import pytest
import sumo
from made_networks import netgenerate

from loopgate import Scenario, attach, read_fcd, run
from loopgate.results.figures import summary_rows
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


def test_who_stands_by_itself_is_named_with_those_behind_it(tmp_path: Path) -> None:
    """A van at a stop that never ends, and a queue: by a run, positions alone, and an attached gate."""
    netgenerate("--grid --grid.number 2 --grid.length 200", tmp_path / "n.net.xml")
    way = '<route edges="A0A1 A1B1 B1B0"/>'
    (tmp_path / "d.rou.xml").write_text(
        f'<routes><vehicle id="van" depart="0">{way}<stop lane="A0A1_0" endPos="150" duration="100000"/>'
        f"</vehicle>"
        f'<flow id="f" begin="20" number="5" period="10">{way}</flow></routes>'
    )
    config = tmp_path / "d.sumocfg"
    config.write_text(
        '<configuration><net-file value="n.net.xml"/><route-files value="d.rou.xml"/><end value="600"/>'
        '<time-to-teleport value="-1"/></configuration>'
    )
    fcd = tmp_path / "fcd.xml"
    libsumo.start(["sumo", "-c", str(config), "--no-step-log", "--fcd-output", str(fcd)])
    try:
        with attach(libsumo) as gate:
            for _ in range(600):
                libsumo.simulationStep()
                gate.after_step()
            attached = gate.summary
    finally:
        libsumo.close()
    made = run(Scenario(network=str(config), gate="open"), tmp_path / "run").summary
    read = read_fcd(fcd, str(config), tmp_path / "read").summary
    for summary, why in ((made, "stop"), (attached, "stop"), (read, "no reason known")):
        (root,) = summary["roots"]
        named = {key: root[key] for key in ("vehicle", "lane", "why", "behind")}
        assert named == {"vehicle": "van", "lane": "A0A1_0", "why": why, "behind": 5}
        assert 10.0 <= root["since_s"] <= 50.0
        assert summary["deadlocks"] == []
    assert dict(summary_rows(made))["stands by itself"].startswith("van on A0A1_0 since ")
