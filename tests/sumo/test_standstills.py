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
from loopgate.network import RoadNetwork
from loopgate.results.figures import summary_rows
from loopgate.simulation.fcd.frames import read_frames
from loopgate.simulation.loop_run import standstill_text
from loopgate.simulation.run import simulate
from loopgate.simulation.watching.road_waits import RoadWaits, SimulatedRoad
from loopgate.traffic import libsumo_backend
from loopgate.traffic.sumo import SumoTraffic

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
    said: dict[float, str] = {}
    made = simulate(
        Scenario(network=str(config), gate="open"),
        tmp_path / "run",
        tick=lambda now_s, course: said.update({now_s: standstill_text(course)}),
    )
    read = read_fcd(fcd, str(config), tmp_path / "read").summary
    for summary, why in ((made, "stop"), (attached, "stop"), (read, "no reason known")):
        (root,) = summary["roots"]
        named = {key: root[key] for key in ("vehicle", "lane", "why", "behind")}
        assert named == {"vehicle": "van", "lane": "A0A1_0", "why": why, "behind": 5}
        assert 10.0 <= root["since_s"] <= 50.0
        assert summary["deadlocks"] == []
    assert dict(summary_rows(made))["stands by itself"].startswith("van on A0A1_0 since ")
    told_s, text = next((now_s, text) for now_s, text in said.items() if text)
    assert 300.0 < told_s <= 420.0
    assert re.fullmatch(r"van stands since \d+ s \(stop\), 5 behind it", text)


def test_who_must_change_lanes_and_cannot_says_so(tmp_path: Path) -> None:
    """Behind a van that turns left a queue stands on the left lane; one on the right lane wants into it."""
    files = {
        "n.nod.xml": "<nodes>"
        + "".join(
            f'<node id="{name}" x="{x}" y="{y}"/>'
            for name, x, y in (("a", 0, 0), ("b", 100, 0), ("c", 200, 0), ("d", 100, 100))
        )
        + "</nodes>",
        "n.edg.xml": '<edges><edge id="ab" from="a" to="b" numLanes="2"/><edge id="bc" from="b" to="c"/>'
        '<edge id="bd" from="b" to="d"/></edges>',
        "n.con.xml": '<connections><connection from="ab" to="bc" fromLane="0" toLane="0"/>'
        '<connection from="ab" to="bd" fromLane="1" toLane="0"/></connections>',
        "d.rou.xml": '<routes><route id="left" edges="ab bd"/>'
        '<vehicle id="van" route="left" depart="0" departLane="1">'
        '<stop lane="bd_0" endPos="10" duration="100000"/></vehicle>'
        '<flow id="q" route="left" begin="1" number="12" period="4" departLane="1"/>'
        '<vehicle id="late" route="left" depart="120" departLane="0" departPos="5"/></routes>',
    }
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    binary = Path(sumo.SUMO_HOME) / "bin" / "netconvert"
    words = ["-n", "n.nod.xml", "-e", "n.edg.xml", "-x", "n.con.xml", "-o", "n.net.xml"]
    subprocess.run([binary, *words], check=True, capture_output=True, cwd=tmp_path)
    words = ["-n", str(tmp_path / "n.net.xml"), "-r", str(tmp_path / "d.rou.xml"), "--no-step-log"]
    libsumo.start(["sumo", *words, "--time-to-teleport", "-1"])
    try:
        traffic = SumoTraffic(libsumo, libsumo_backend.ERROR, reads=libsumo_backend.READS)
        for _ in range(300):
            libsumo.simulationStep()
        assert traffic.lane("late")[0] == "ab_0"
        assert traffic.speed("late") < 0.1
        assert traffic.lane_wish("late") == (1, False)
        assert traffic.lane_wish("van") == (0, False)
        assert any(traffic.lane_wish(f"q.{number}") == (0, True) for number in range(12))
        road = RoadWaits(RoadNetwork.open(tmp_path / "n.net.xml"), SimulatedRoad(traffic))
        road.look()
        assert road.cause("late") == "lane change"
        assert all(any(one.startswith("q.") for one in some) for some in road.of("late", 0.0))
    finally:
        libsumo.close()
