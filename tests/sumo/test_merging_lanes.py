"""Lanes that merge into one: SUMO finds one of them best, and the gate keeps vehicles to theirs."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest
import sumo
from made_networks import netgenerate

from loopgate.abstraction.parting import Partings
from loopgate.network import RoadNetwork
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario

pytestmark = pytest.mark.sumo

TYPES = {
    "bus": 'vClass="bus" length="12"',
    "truck": 'vClass="truck" length="10"',
    "car": "",
    "sublane": 'laneChangeModel="SL2015"',
}
SUBLANES = '<processing><lateral-resolution value="0.8"/></processing>'


def merging(folder: Path, lanes: int, types: tuple[str, ...], more: str = "") -> str:
    """Write a road whose lanes all lead onto the one lane behind it, with eight vehicles on each lane."""
    ways = "".join(f'<connection from="ab" to="bc" fromLane="{lane}" toLane="0"/>' for lane in range(lanes))
    ends = "".join(f'<node id="{name}" x="{at}" y="0"/>' for name, at in (("a", 0), ("b", 300), ("c", 450)))
    (folder / "n.nod.xml").write_text(f"<nodes>{ends}</nodes>")
    (folder / "n.edg.xml").write_text(
        f'<edges><edge id="ab" from="a" to="b" numLanes="{lanes}" speed="13.9"/>'
        '<edge id="bc" from="b" to="c" numLanes="1" speed="13.9"/></edges>'
    )
    (folder / "n.con.xml").write_text(f"<connections>{ways}</connections>")
    tool = Path(sumo.SUMO_HOME) / "bin" / "netconvert"
    files = "-n n.nod.xml -e n.edg.xml -x n.con.xml -o net.net.xml --no-turnarounds"
    environment = {**os.environ, "SUMO_HOME": sumo.SUMO_HOME}
    subprocess.run([str(tool), *files.split()], check=True, cwd=folder, env=environment, capture_output=True)
    kinds = "".join(f'<vType id="{name}" {TYPES[name]}/>' for name in types)
    vehicles = "".join(
        f'<vehicle id="v{row * lanes + lane}" type="{types[(row + lane) % len(types)]}" depart="{6 * row}" '
        f'departLane="{lane}"><route edges="ab bc"/></vehicle>'
        for row in range(8)
        for lane in range(lanes)
    )
    (folder / "r.rou.xml").write_text(f"<routes>{kinds}{vehicles}</routes>")
    (folder / "c.sumocfg").write_text(
        '<configuration><input><net-file value="net.net.xml"/><route-files value="r.rou.xml"/></input>'
        f"{more}</configuration>"
    )
    return str(folder / "c.sumocfg")


@pytest.mark.parametrize(("lanes", "types"), [(2, ("car",)), (3, ("bus",)), (3, ("truck", "car"))])
def test_all_pass_where_lanes_merge_though_the_configuration_has_sublanes(
    tmp_path: Path, lanes: int, types: tuple[str, ...]
) -> None:
    """With sublanes a vehicle with a grant made way for the one beside it, which the gate held, for good."""
    network = merging(tmp_path, lanes, types, SUBLANES)
    summary = simulate(Scenario(network=network, duration_s=400.0, positions=True), tmp_path / "run")
    assert (summary["deadlocks"], summary["roots"], summary["audit"]) == ([], [], "clean")
    assert summary["unfinished"] == summary["collisions"] == 0
    assert any("lateral-resolution 0.8 is not taken over" in line for line in summary["warnings"])


def test_types_with_the_model_for_sublanes_are_ordinary(tmp_path: Path) -> None:
    """It does the same without sublanes; the reason is told."""
    network = merging(tmp_path, 2, ("sublane", "car"))
    summary = simulate(Scenario(network=network, duration_s=400.0), tmp_path / "run")
    assert (summary["vehicles"], summary["others"]["vehicles"], summary["deadlocks"]) == (8, 8, [])
    assert summary["unfinished"] == summary["collisions"] == 0
    assert any("vType sublane: laneChangeModel SL2015" in line for line in summary["warnings"])


def test_two_ways_out_of_a_lane_past_points_to_wait_at_are_apart_only_up_to_there(tmp_path: Path) -> None:
    """SUMO lets a driver past such a point follow nobody on the other way: both lead left, a lane apart."""
    roads = RoadNetwork.open(
        netgenerate("--grid --grid.number=3 --grid.length=200 -L 3", tmp_path / "wide.net.xml")
    )
    lefts = [c for c in roads.connections if c.from_id == "A0B0_2" and c.direction == "l"]
    first_m = min(roads.lanes[c.via[0]].length_m for c in lefts)
    assert [len(c.via) for c in lefts] == [2, 2]
    assert Partings(roads).parted_m(*(c.via[0] for c in lefts)) == first_m
