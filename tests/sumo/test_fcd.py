"""What is read from FCD output is what the run itself knew."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree as ET

import pandas as pd
import pytest
from made_networks import netgenerate

from loopgate import Scenario, read_fcd, run
from loopgate.errors import ResultsError
from loopgate.results.figures import summary_rows

pytestmark = pytest.mark.sumo


def test_figures_of_fcd_output_are_those_of_the_run(tmp_path: Path) -> None:
    """Distance, time standing, visits and idleness of each street."""
    network = "networks/order2.net.xml"
    scenario = Scenario(
        network=network, routes="routes/order2.rou.xml", gate="open", duration_s=100, outputs="fcd"
    )
    made = run(scenario, tmp_path / "made")
    read = read_fcd(tmp_path / "made" / "fcd.xml.gz", network, tmp_path / "read")
    assert read.summary["distance_km"] == pytest.approx(made.summary["distance_km"], rel=0.01)
    assert read.summary["stood_s"] == pytest.approx(made.summary["stood_s"], abs=10.0)
    visits = made.edges.set_index("edge")["visits"]
    again = read.edges.set_index("edge")["visits"].reindex(visits.index, fill_value=0)
    assert (again - visits).abs().sum() <= 1  # FCD output lacks the end of the last step
    assert read.replay().title == "order2: SUMO's own rules"


@pytest.fixture(scope="module")
def driven(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write a configuration with trips on a grid near Berlin, which ends while some are under way."""
    folder = tmp_path_factory.mktemp("driven")
    net = netgenerate("--grid --grid.number=2 --grid.length=80 --grid.attach-length=150", folder / "n.xml")
    where = (
        '<location netOffset="-390000,-5820000" convBoundary="0,0,380,380" origBoundary="13,52,14,53" '
        'projParameter="+proj=utm +zone=33 +ellps=WGS84 +datum=WGS84 +units=m +no_defs"/>'
    )
    net.write_text(re.sub("<location [^>]*/>", where, net.read_text()))
    ends = [
        ("bottom0A0", "A1top0"),
        ("left0A0", "B0right0"),
        ("right1B1", "A1left1"),
        ("top1B1", "B0bottom1"),
    ]
    flows = "".join(
        f'<flow id="f{k}" begin="08:00:00" end="08:04:00" period="9" from="{a}" to="{b}" departSpeed="max"/>'
        for k, (a, b) in enumerate(ends)
    )
    (folder / "d.rou.xml").write_text(f"<routes>{flows}</routes>")
    config = folder / "d.sumocfg"
    config.write_text(
        f'<configuration><net-file value="{net.name}"/><route-files value="d.rou.xml"/>'
        '<begin value="08:00:00"/><end value="08:05:00"/></configuration>'
    )
    return config


@pytest.mark.parametrize(
    "options",
    [(), ("--human-readable-time",), ("--fcd-output.geo",), ("--device.fcd.period", "5")],
    ids=["plain", "clock times", "degrees", "every five seconds"],
)
def test_fcd_output_of_any_kind_is_read(driven: Path, tmp_path: Path, options: tuple[str, ...]) -> None:
    """What was driven is what SUMO says of the trips, and nobody is off its lane."""
    file, trips = tmp_path / "fcd.xml", tmp_path / "trips.xml"
    outputs = [
        "--fcd-output",
        str(file),
        "--tripinfo-output",
        str(trips),
        "--tripinfo-output.write-unfinished",
    ]
    sumo = Path(sys.executable).parent / "sumo"
    subprocess.run([sumo, "-c", driven, *outputs, *options, "--no-step-log", "-W"], check=True)
    made = read_fcd(file, str(driven), tmp_path / "read")
    driven_m = sum(float(one.get("routeLength", "")) for one in ET.parse(trips).getroot())
    assert made.summary["distance_km"] * 1000.0 == pytest.approx(driven_m, rel=0.005)
    assert made.summary["begins_s"] == 28800.0
    assert made.summary["collisions"] is made.summary["teleports"] is None
    assert dict(summary_rows(made.summary))["collisions, teleports"] == "not known"
    seen = pd.read_csv(tmp_path / "read" / "positions.csv.gz", sep=";")
    first = seen[seen["vehicle_lane"] == "bottom0A0_0"].iloc[0]
    assert first["vehicle_y"] == pytest.approx(first["vehicle_pos"], abs=0.2)


def test_fcd_output_as_a_table_is_refused_by_name(tmp_path: Path) -> None:
    (tmp_path / "fcd.csv").write_text("timestep_time;vehicle_id\n0.00;a\n")
    with pytest.raises(ResultsError, match=r"only FCD output as XML is read; .*--fcd-output fcd.xml.gz"):
        read_fcd(tmp_path / "fcd.csv", "networks/order2.net.xml")
