"""What is read from FCD output is what the run itself knew."""

from __future__ import annotations

from pathlib import Path

import pytest

from loopgate import Scenario, read_fcd, run

pytestmark = pytest.mark.sumo


def test_figures_of_fcd_output_are_those_of_the_run(tmp_path: Path) -> None:
    """Distance, time standing, visits and idleness of each street."""
    network = "networks/order2.net.xml"
    scenario = Scenario(
        network=network, routes="routes/order2.rou.xml", gate="open", duration_s=100, fcd=True
    )
    made = run(scenario, tmp_path / "made")
    read = read_fcd(tmp_path / "made" / "fcd.xml.gz", network, tmp_path / "read")
    assert read.summary["distance_km"] == pytest.approx(made.summary["distance_km"], rel=0.01)
    assert read.summary["stood_s"] == pytest.approx(made.summary["stood_s"], abs=10.0)
    visits = made.edges.set_index("edge")["visits"]
    again = read.edges.set_index("edge")["visits"].reindex(visits.index, fill_value=0)
    assert (again - visits).abs().sum() <= 1  # FCD output lacks the end of the last step
    assert read.replay().title == "order2: SUMO's own rules"
