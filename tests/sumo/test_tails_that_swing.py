"""A long vehicle turns sharply, and its tail swings over a lane to which others change lanes."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest
import sumo

from loopgate.audit import read_layout
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario

pytestmark = pytest.mark.sumo

NODES = """<nodes><node id="J" x="0" y="0" type="priority"/><node id="N" x="0" y="48"/>
<node id="W" x="-80" y="40"/><node id="E" x="80" y="0"/></nodes>"""
EDGES = """<edges><edge id="in" from="N" to="J"/><edge id="out" from="J" to="N" numLanes="2"/>
<edge id="from_w" from="W" to="J"/><edge id="to_w" from="J" to="W"/>
<edge id="from_e" from="E" to="J"/><edge id="to_e" from="J" to="E"/></edges>"""
WAYS = """<connections><connection from="from_e" to="out" fromLane="0" toLane="0"/>
<connection from="from_w" to="out" fromLane="0" toLane="1"/>
<connection from="from_e" to="to_w" fromLane="0" toLane="0"/>
<connection from="from_w" to="to_e" fromLane="0" toLane="0"/>
<connection from="in" to="to_w" fromLane="0" toLane="0"/>
<connection from="out" to="in" fromLane="1" toLane="0"/>
</connections>"""
VEHICLES = """<routes><vType id="truck" length="12"/>
<vehicle id="truck" type="truck" depart="0"><route edges="in to_w"/></vehicle>
<vehicle id="car" depart="0"><route edges="from_e out in"/></vehicle></routes>"""


def test_who_changes_lanes_where_a_road_begins_is_in_the_way_of_tails_that_swing_there(
    tmp_path: Path,
) -> None:
    """The road has no space for a place before the change: the car is still on the movement that led there.

    The audit draws both bodies by itself, and finds no pair that the layout lacks.
    """
    for name, text in (("n.nod", NODES), ("n.edg", EDGES), ("n.con", WAYS), ("r.rou", VEHICLES)):
        (tmp_path / f"{name}.xml").write_text(text)
    tool = Path(sumo.SUMO_HOME) / "bin" / "netconvert"
    files = "-n n.nod.xml -e n.edg.xml -x n.con.xml -o net.net.xml"
    environment = {**os.environ, "SUMO_HOME": sumo.SUMO_HOME}
    subprocess.run(
        [str(tool), *files.split()], check=True, cwd=tmp_path, env=environment, capture_output=True
    )
    network, routes = str(tmp_path / "net.net.xml"), str(tmp_path / "r.rou.xml")
    summary = simulate(
        Scenario(network=network, routes=routes, duration_s=60.0, positions=True), tmp_path / "out"
    )
    layout = read_layout(tmp_path / "out" / "layout.json")
    crossings = {
        movement
        for loop in layout.loops.values()
        for leg in loop.legs
        for movement, foes in leg.crossings
        if {"in_0>to_w_0", "from_e_0>out_0"} <= {movement, *foes}
    }
    assert crossings == {"in_0>to_w_0", "from_e_0>out_0"}
    assert summary["audit"] == "clean"
