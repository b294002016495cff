"""SUMO itself refuses and accepts the vehicles and types that loopgate does."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
import sumo

from loopgate.errors import RouteError
from loopgate.network import RoadNetwork, read_loops

GRID = Path("networks/grid5-priority.net.xml")
WAY = '<route id="r" edges="A0A1 A1A2"/>'
Q = '<vehicle id="q" depart="0" route="r"/>'
FLOW = '<flow id="q" begin="0" end="9" number="2" route="r"/>'


@pytest.mark.parametrize(
    ("inside", "accepts"),
    [
        (Q, True),
        (2 * Q, False),
        (f'{Q}<trip id="q" depart="1" from="A0A1" to="A1A2"/>', False),
        (f"{Q}{FLOW}", True),
        (2 * FLOW, False),
        (f'{FLOW}<vehicle id="q.1" depart="90" route="r"/>', False),
        (f'{FLOW}<vehicle id="q.2" depart="90" route="r"/>', True),
        ('<vehicle id="a&lt;b" depart="0" route="r"/>', False),
        ('<vehicle id="q" route="r"/>', False),
        ('<vehicle id="q" depart="-5" route="r"/>', False),
        ('<vehicle id="q" depart="0" route="r" color="pink"/>', False),
        ('<vehicle id="q" depart="0" route="r" color="0.5,1,0"/>', True),
        ('<vehicle id="q" depart="0" route="r" color=" 0, 1,0"/>', True),
        ('<vehicle id="q" depart="0" route="r" color="0 ,1,0"/>', False),
        (f'<vType id="DEFAULT_VEHTYPE" length="7"/>{Q}', True),
        (2 * '<vType id="DEFAULT_VEHTYPE" length="7"/>' + Q, False),
        (f'<vType id="c"/><vTypeDistribution id="c"><vType id="d"/></vTypeDistribution>{Q}', False),
        ('<vehicle id="q" depart="0" route="r"><stop lane="A0A1_0" duration="-5"/></vehicle>', False),
        (
            '<vehicle id="q" depart="0" route="r"><stop lane="A0A1_0" duration="-5" until="9"/></vehicle>',
            True,
        ),
    ],
)
def test_sumo_agrees(tmp_path: Path, inside: str, accepts: bool) -> None:  # noqa: FBT001  a case
    """On each file."""
    file = tmp_path / "x.rou.xml"
    file.write_text(f"<routes>{WAY}{inside}</routes>", encoding="utf-8")
    command = [Path(sumo.SUMO_HOME) / "bin" / "sumo", "-n", GRID, "-r", file, "-e", "100"]
    done = subprocess.run([*map(str, command), "--no-step-log"], check=False, capture_output=True)
    assert (done.returncode == 0) is accepts
    if accepts:
        assert read_loops(RoadNetwork.open(GRID), file, once=True).vehicles
        return
    with pytest.raises(RouteError):
        read_loops(RoadNetwork.open(GRID), file, once=True)
