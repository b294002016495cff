"""The project's own networks are what their sources say, and their loops close."""

import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

pytestmark = pytest.mark.sumo

ROOT = Path(__file__).resolve().parents[2]
NETWORKS = sorted((ROOT / "networks").glob("*.net.xml"))


def test_a_rebuild_shows_no_difference() -> None:
    """Every built network is, byte for byte, what its sources give."""
    done = subprocess.run(
        [sys.executable, ROOT / "networks" / "build.py", "--check"],
        check=False,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count("no difference") == len(NETWORKS)


@pytest.mark.parametrize("network", ["ring3", "order2"])
def test_the_loops_close(network: str) -> None:
    """Each edge of a loop connects to the next, the last to the first, and no edge belongs to no loop."""
    net = ET.parse(ROOT / "networks" / f"{network}.net.xml")
    joined = {(c.get("from"), c.get("to")) for c in net.iter("connection")}
    driven: set[str] = set()
    for route in ET.parse(ROOT / "routes" / f"{network}.rou.xml").iter("route"):
        edges = str(route.get("edges")).split()
        assert [pair for pair in zip(edges, edges[1:] + edges[:1], strict=True) if pair not in joined] == []
        driven.update(edges)
    assert driven == {e.get("id") for e in net.iter("edge") if e.get("function") != "internal"}


@pytest.mark.parametrize(
    ("variant", "junction_type"),
    [
        ("priority", "priority"),
        ("right-before-left", "right_before_left"),
        ("all-way-stop", "allway_stop"),
        ("actuated", "traffic_light"),
    ],
)
def test_the_grids_differ_in_right_of_way_alone(variant: str, junction_type: str) -> None:
    """Each grid has 25 junctions of its kind and 80 one-lane edges."""
    net = ET.parse(ROOT / "networks" / f"grid5-{variant}.net.xml")
    kinds = [j.get("type") for j in net.iter("junction") if j.get("type") != "internal"]
    assert kinds == [junction_type] * 25
    edges = [e for e in net.iter("edge") if e.get("function") != "internal"]
    assert [len(e.findall("lane")) for e in edges] == [1] * 80
    lights = [logic.get("type") for logic in net.iter("tlLogic")]
    assert lights == (["actuated"] * 25 if variant == "actuated" else [])
