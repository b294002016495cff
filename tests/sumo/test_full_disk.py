"""Runs on a disk that is full before they are done."""

from __future__ import annotations

from pathlib import Path

import pytest
from limits import no_file_beyond

from loopgate.errors import ResultsError
from loopgate.results.recorder import read_events
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario

pytestmark = pytest.mark.sumo

ROOT = Path(__file__).parents[2]
RING = Scenario.from_dict(
    {
        "network": str(ROOT / "networks" / "ring3.net.xml"),
        "routes": str(ROOT / "routes" / "ring3.rou.xml"),
        "duration_s": 20_000.0,
    }
)


def configured(folder: Path, routes: str) -> str:
    """Write a configuration with these trips or flows on a grid; return where it is."""
    (folder / "t.rou.xml").write_text(f"<routes>{routes}</routes>")
    network = ROOT / "networks" / "grid5-priority.net.xml"
    (folder / "t.sumocfg").write_text(
        f'<configuration><net-file value="{network}"/><route-files value="t.rou.xml"/></configuration>'
    )
    return str(folder / "t.sumocfg")


def test_events_up_to_a_full_disk_are_left(tmp_path: Path) -> None:
    """One line that names the file; SUMO is ended, so that the next run begins."""
    with no_file_beyond(60_000), pytest.raises(ResultsError, match=r"out/events\.parquet: cannot be written"):
        simulate(RING, tmp_path / "out")
    assert len(read_events(tmp_path / "out" / "events.parquet"))
    assert not (tmp_path / "out" / "summary.json").exists()
    simulate(Scenario.from_dict(RING.to_dict() | {"duration_s": 10.0}), tmp_path / "out")


def test_sumo_is_ended_before_it_finds_no_room_for_positions(tmp_path: Path) -> None:
    """It would end the process; events and positions up to then are whole."""
    scenario = Scenario.from_dict(RING.to_dict() | {"positions": True})
    with no_file_beyond(3_000_000), pytest.raises(ResultsError, match=r"positions\.csv\.gz: cannot go on"):
        simulate(scenario, tmp_path / "out")
    assert len(read_events(tmp_path / "out" / "events.parquet"))


def test_a_configuration_as_it_is_ends_before_that_too(tmp_path: Path) -> None:
    """Its own vehicles, recorded as SUMO has them."""
    flow = '<flow id="f" begin="0" end="20000" period="3" from="A0B0" to="C0D0"/>'
    network = configured(tmp_path, flow)
    scenario = Scenario(network=network, gate="open", duration_s=20_000.0, positions=True)
    with no_file_beyond(3_000_000), pytest.raises(ResultsError, match=r"positions\.csv\.gz: cannot go on"):
        simulate(scenario, tmp_path / "out")


def test_trips_that_sumo_could_not_write_are_missed(tmp_path: Path) -> None:
    """SUMO itself does not say so; vehicles would be missing from the results."""
    trips = "".join(f'<trip id="t{k}" depart="{k}" from="A0B0" to="C0D0"/>' for k in range(100))
    scenario = Scenario(network=configured(tmp_path, trips), gate="open")
    with no_file_beyond(12_000), pytest.raises(ResultsError, match=r"tripinfo\.xml: SUMO could not write"):
        simulate(scenario, tmp_path / "out")
