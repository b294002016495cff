"""Roads that a railway passes on the level: trains go first, whatever becomes of the other lights."""

import subprocess
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import pandas as pd
import pytest
import sumo

from loopgate import Scenario
from loopgate.simulation.run import simulate

pytestmark = pytest.mark.sumo

CORNERS = {"a": (0, 0), "b": (300, 0), "c": (300, 150), "d": (0, 150)}
RAILS = {"u": (150, -500), "y": (150, 0), "z": (150, 150), "v": (150, 600)}
ROADS = "ay yb bc cz zd da"
LOOP = f"<routes><route id='l' edges='{ROADS}'/>" + "".join(
    f"<vehicle id='v{k}' route='l' depart='0'/>" for k in range(12)
)
TRAIN = (
    '<vType id="t" vClass="rail" length="60"/>'
    '<flow id="t" type="t" begin="5" end="400" period="30"><route edges="uy yz zv"/></flow>'
)


def files(folder: Path) -> dict[str, Any]:
    """Make a ring of road that a railway passes twice, vehicles round it, and trains."""
    kinds = {"y": "rail_crossing", "z": "rail_crossing"}
    nodes = [
        f'<node id="{name}" x="{x}" y="{y}" type="{kinds.get(name, "priority")}"/>'
        for name, (x, y) in {**CORNERS, **RAILS}.items()
    ]
    edges = [f'<edge id="{one}" from="{one[0]}" to="{one[1]}" speed="13.9"/>' for one in ROADS.split()]
    edges += [
        f'<edge id="{one}" from="{one[0]}" to="{one[1]}" allow="rail" speed="27.8"/>'
        for one in ("uy", "yz", "zv")
    ]
    (folder / "n.nod.xml").write_text(f"<nodes>{''.join(nodes)}</nodes>")
    (folder / "n.edg.xml").write_text(f"<edges>{''.join(edges)}</edges>")
    tool = Path(sumo.SUMO_HOME) / "bin" / "netconvert"
    words = ["-n", "n.nod.xml", "-e", "n.edg.xml", "-o", "n.net.xml", "--no-warnings"]
    subprocess.run([str(tool), *words], cwd=folder, check=True, capture_output=True)
    (folder / "l.rou.xml").write_text(f"{LOOP}</routes>")
    (folder / "t.rou.xml").write_text(f"<routes>{TRAIN}</routes>")
    (folder / "both.rou.xml").write_text(
        f"{LOOP.replace('/><', ' repeat=' + repr('99') + '/><', 1)}{TRAIN}</routes>"
    )
    return {"network": str(folder / "n.net.xml"), "duration_s": 400.0, "positions": True}


def test_a_trip_that_cannot_wait_on_its_first_road_says_where_it_departs(tmp_path: Path) -> None:
    """On a single track with trains both ways nobody may wait: 300 m are not driven, and that is told."""
    at = {"a": (0, 0), "b": (300, 0), "c": (700, 0), "d": (900, 0), "e": (600, 300)}
    nodes = [f'<node id="{name}" x="{x}" y="{y}"/>' for name, (x, y) in at.items()]
    ends = [("ab", "a", "b"), ("ba", "b", "a"), ("bc", "b", "c"), ("cd", "c", "d"), ("eb", "e", "b")]
    edges = [f'<edge id="{e}" from="{u}" to="{v}" allow="rail" spreadType="center"/>' for e, u, v in ends]
    (tmp_path / "n.nod.xml").write_text(f"<nodes>{''.join(nodes)}</nodes>")
    (tmp_path / "n.edg.xml").write_text(f"<edges>{''.join(edges)}</edges>")
    tool = Path(sumo.SUMO_HOME) / "bin" / "netconvert"
    words = ["-n", "n.nod.xml", "-e", "n.edg.xml", "-o", "n.net.xml", "--no-warnings"]
    subprocess.run([str(tool), *words], cwd=tmp_path, check=True, capture_output=True)
    (tmp_path / "t.rou.xml").write_text(
        '<routes><vType id="train" vClass="rail" length="60"/><vehicle id="t" type="train" depart="0">'
        '<route edges="ab bc cd"/></vehicle><vehicle id="u" type="train" depart="0"><route edges="eb ba"/>'
        "</vehicle></routes>"
    )
    files = {"network": str(tmp_path / "n.net.xml"), "routes": str(tmp_path / "t.rou.xml")}
    made = simulate(Scenario(network=files["network"], routes=files["routes"], duration_s=120))
    said = [line for line in made["warnings"] if "1 vehicle departs on a later road" in line]
    assert len(said) == 1
    assert "t on bc and not on ab" in said[0]


@pytest.mark.parametrize(("gate", "lights"), [("certified", "off"), ("certified", "obey"), ("open", "off")])
def test_nobody_drives_before_a_train(tmp_path: Path, gate: str, lights: str) -> None:
    """Trains are ordinary traffic that brakes for nobody."""
    more = files(tmp_path)
    beside: dict[str, Any] = {"routes": str(tmp_path / "l.rou.xml"), "traffic": str(tmp_path / "t.rou.xml")}
    scenario = Scenario(**more, **beside, gate=gate, lights=lights, outputs="tripinfo")
    summary = simulate(scenario, tmp_path / "run")
    assert (summary["collisions"], summary["teleports"]) == (0, 0)
    assert summary["audit"] == ("clean" if gate == "certified" else "not gated")
    trips = ET.parse(tmp_path / "run" / "tripinfo.xml").getroot().iter("tripinfo")
    lost_s = [float(one.attrib["timeLoss"]) for one in trips if one.attrib["vType"] == "t"]
    assert len(lost_s) > 5
    assert max(lost_s) < 0.1
    assert summary["laps"] > 30


def test_gated_trains_pass_closed_roads(tmp_path: Path) -> None:
    """Trains have no light at a level crossing; the last of the road's is red when they come."""
    more = files(tmp_path)
    summary = simulate(
        Scenario(**more, routes=str(tmp_path / "both.rou.xml"), lights="obey"), tmp_path / "run"
    )
    assert (summary["collisions"], summary["audit"]) == (0, "clean")
    events = pd.read_parquet(tmp_path / "run" / "events.parquet")
    refused = events[(events["event"] == "refuse") & events["vehicle"].str.startswith("t.")]
    assert "red" not in set(refused["reason"])
