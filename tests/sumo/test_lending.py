"""A vehicle at a red light inside a joined crossing lets others over the rest of it first."""

from __future__ import annotations

import subprocess
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
import sumo

from loopgate import Scenario
from loopgate.control.lending import Lending
from loopgate.results.figures import FIGURES, summary_rows
from loopgate.simulation.run import simulate

pytestmark = pytest.mark.sumo

NODES = """<nodes>
<node id="w" x="0" y="0"/><node id="j" x="200" y="0" type="traffic_light"/>
<node id="l" x="218" y="0"/><node id="m" x="232" y="0"/><node id="n" x="246" y="0"/>
<node id="k" x="264" y="0" type="traffic_light" tlType="actuated"/><node id="e" x="464" y="0"/>
<node id="nj" x="200" y="200"/><node id="sj" x="200" y="-200"/>
<node id="nk" x="264" y="200"/><node id="sk" x="264" y="-200"/>
</nodes>"""
ON = ("w", "j", "l", "m", "n", "k", "e")
WAYS = (*pairwise(ON), ("nj", "j"), ("j", "sj"), ("nk", "k"), ("k", "sk"))
EDGES = "".join(f'<edge id="{a}{b}" from="{a}" to="{b}"/>' for a, b in WAYS)
FLOWS = f"""<routes>
<route id="on" edges="{" ".join(f"{a}{b}" for a, b in pairwise(ON))}"/>
<route id="first" edges="njj jsj"/><route id="second" edges="nkk ksk"/>
<flow id="on" route="on" end="600" period="6"/>
<flow id="first" route="first" end="600" period="8"/>
<flow id="second" route="second" end="600" period="4"/></routes>"""


@pytest.fixture(scope="module")
def crossings(tmp_path_factory: pytest.TempPathFactory) -> Scenario:
    """Return two lights on a street; no vehicle waits between, so their junctions are one crossing."""
    folder = tmp_path_factory.mktemp("two")
    for name, text in (("nod", NODES), ("edg", f"<edges>{EDGES}</edges>"), ("rou", FLOWS)):
        (folder / f"n.{name}.xml").write_text(text, encoding="utf-8")
    tool = Path(sumo.SUMO_HOME) / "bin" / "netconvert"
    words = ["--node-files", "n.nod.xml", "--edge-files", "n.edg.xml", "-o", "n.net.xml", "--no-turnarounds"]
    subprocess.run([str(tool), *words], cwd=folder, check=True, capture_output=True)
    network, routes = str(folder / "n.net.xml"), str(folder / "n.rou.xml")
    return Scenario(network=network, routes=routes, lights="obey", duration_s=900.0, positions=True)


def test_others_use_the_green_that_would_pass_unused(
    crossings: Scenario, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Those who cross at the second light: they no longer wait for whoever stands before it."""
    lends = simulate(crossings, tmp_path / "lends")
    monkeypatch.setattr(Lending, "look", lambda *_: None)
    keeps = simulate(crossings, tmp_path / "keeps")
    for made in (lends, keeps):
        assert (made["clean"], made["audit"], made["collisions"]) == (True, "clean", 0)
        assert made["at_lights"]["stood"] > 20
    lent, by_name = lends["at_lights"]["lent"], dict(summary_rows(lends))
    assert 0 < lent <= lends["at_lights"]["stood"]
    assert keeps["at_lights"]["lent"] == 0
    assert f", {lent} times others went over the crossing first" in by_name["lights"]
    assert set(lends) <= {key for figure in FIGURES for key in figure.keys.split()}
    assert delay_s(tmp_path / "lends", "second") < 0.6 * delay_s(tmp_path / "keeps", "second")


def delay_s(folder: Path, flow: str) -> float:
    """Return the mean delay of the trips of a flow that have arrived [s]."""
    trips = [one.attrib for one in ET.parse(folder / "tripinfo.xml").iter("tripinfo")]
    lost_s = [float(one["timeLoss"]) + float(one["departDelay"]) for one in trips if flow in one["id"]]
    return sum(lost_s) / len(lost_s)
