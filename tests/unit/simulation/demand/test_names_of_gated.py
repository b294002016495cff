"""A file of names says which vehicles that drive once are gated."""

from pathlib import Path

import pytest

from loopgate.errors import ScenarioError
from loopgate.network import RoadNetwork, VehicleDemand
from loopgate.network.route_lanes import make_route
from loopgate.network.vehicle_type import DEFAULT_TYPE
from loopgate.simulation.demand.apart import choose_gated
from loopgate.simulation.scenario import Scenario


@pytest.fixture(scope="module")
def vehicles() -> list[VehicleDemand]:
    network = RoadNetwork.open("networks/grid5-priority.net.xml")
    way = make_route(network, "way", ("A0A1", "A1A2"), vclass="passenger")
    return [VehicleDemand(name, way, DEFAULT_TYPE) for name in ("one", "two")]


def test_names_of_no_vehicle_are_told(vehicles: list[VehicleDemand], tmp_path: Path) -> None:
    """Of vehicles that depart after the end of a shorter run, or misspelt: the run goes on without them."""
    file = tmp_path / "who.txt"
    file.write_text("two\nthree\nfour\n", encoding="utf-8")
    mine, ordinary, lines = choose_gated(Scenario(network="n", who=str(file)), vehicles)
    assert [[v.id for v in some] for some in (mine, ordinary)] == [["two"], ["one"]]
    nobody = "no vehicle that drives once and departs during the run"
    assert lines == (f"gated: {file}: 2 of 3 names stand for {nobody}: three, four",)


@pytest.mark.parametrize(("names", "why"), [("three\n", "'three' is no vehicle"), ("# none\n", "no names")])
def test_a_file_that_names_none_is_refused(
    vehicles: list[VehicleDemand], tmp_path: Path, names: str, why: str
) -> None:
    """Else nobody would be gated."""
    file = tmp_path / "who.txt"
    file.write_text(names, encoding="utf-8")
    with pytest.raises(ScenarioError, match=why):
        choose_gated(Scenario(network="n", who=str(file)), vehicles)
