"""Loops share parallel lanes in a run, and keep their own lanes where others do not work."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest
from made_networks import netgenerate

from loopgate import Scenario
from loopgate.abstraction.itinerary import Abstraction
from loopgate.abstraction.queue_survey import QueueSurvey, RefusedLoop, survey_queues
from loopgate.cli import inspect_queues
from loopgate.errors import LoopRefusal, RefusedLoopError
from loopgate.network import Loop, RoadNetwork, VehicleDemand, VehicleType, read_loops
from loopgate.network.vehicle_type import DEFAULT_TYPE
from loopgate.simulation import assembly
from loopgate.simulation.assembly import Assembly, assemble, read_vehicles
from loopgate.simulation.run import simulate

pytestmark = pytest.mark.sumo

Lanes = tuple[tuple[str, int], ...]
Some = Sequence[VehicleDemand]


@pytest.fixture(scope="module")
def block(tmp_path_factory: pytest.TempPathFactory) -> Scenario:
    """Return two loops round the same block, with two lanes all the way."""
    folder = tmp_path_factory.mktemp("block")
    network = netgenerate("--grid --grid.number=2 --grid.length=200 -L 2", folder / "b.net.xml")
    ways = "".join(f'<route id="{name}" edges="A0A1 A1B1 B1B0 B0A0"/>' for name in ("one", "other"))
    (folder / "b.rou.xml").write_text(f"<routes>{ways}</routes>", encoding="utf-8")
    routes = str(folder / "b.rou.xml")
    return Scenario(network=str(network), routes=routes, vehicles=40, abstraction="queues", duration_s=600.0)


def on(loop: Loop) -> list[int]:
    """Return the lanes of a loop, edge by edge."""
    return [span.lane for span in loop.roads]


def driven(found: Assembly) -> dict[str, Lanes]:
    """Return the lanes of each loop."""
    return {loop.id: tuple((span.edge, span.lane) for span in loop.roads) for loop in found.loops}


def test_they_share_under_every_gate(block: Scenario) -> None:
    """A lane each; with and without a gate the same, so that gates are compared on the same vehicles."""
    gated, open_ = (assemble(replace(block, gate=gate)) for gate in ("certified", "open"))
    assert driven(gated) == driven(open_)
    assert sorted({lane for _, lane in some} for some in driven(gated).values()) == [{0}, {1}]


def test_only_queues_share(block: Scenario) -> None:
    """On segments a vehicle may be on any lane, so its loop stays as it is read."""
    vehicles, _, _ = read_vehicles(replace(block, abstraction="segments"), RoadNetwork.open(block.network))
    assert len({tuple(span.lane for span in v.loop.roads) for v in vehicles}) == 1


def test_more_gets_round(block: Scenario, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Forty vehicles on two lanes get farther than on one, and the run is clean by positions."""
    wide = simulate(replace(block, positions=True), tmp_path / "wide")
    monkeypatch.setattr(assembly, "share_lanes", lambda _network, vehicles, _keeping: vehicles)
    narrow = simulate(block, tmp_path / "narrow")
    assert (wide["audit"], wide["clean"], wide["collisions"]) == ("clean", True, 0)
    assert wide["distance_km"] > 1.3 * narrow["distance_km"]


@pytest.mark.parametrize("refused", [["one"], ["other"], ["one", "other"]])
def test_lanes_that_do_not_work_are_not_used(
    block: Scenario, refused: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Loops whose chosen lanes cannot be cut keep the lanes on which they are read."""
    own = {v.loop.id: v.loop for v in read_vehicles(block, RoadNetwork.open(block.network), None)[0]}
    real = assembly._abstraction

    def refuses(scenario: Scenario, network: RoadNetwork, vehicles: Some, later: Some) -> Abstraction:
        found = real(scenario, network, vehicles, later)
        wrong = {way.loop.id for way in found.itineraries if way.loop.spans != own[way.loop.id].spans}
        if wrong := wrong & set(refused):
            raise RefusedLoopError(dict.fromkeys(wrong, LoopRefusal("is on the wrong lanes")))
        return found

    monkeypatch.setattr(assembly, "_abstraction", refuses)
    found = {loop.id: loop.spans for loop in assemble(block).loops}
    assert all(found[name] == own[name].spans for name in refused)


def test_loops_that_never_work_are_told(block: Scenario, monkeypatch: pytest.MonkeyPatch) -> None:
    """A loop that is refused on its own lanes, too, is an error that names it."""

    def refuses(*_parts: object) -> Abstraction:
        raise RefusedLoopError({"one": LoopRefusal("does not work")})

    monkeypatch.setattr(assembly, "_abstraction", refuses)
    with pytest.raises(RefusedLoopError, match="loop one does not work"):
        assemble(block)


def test_all_keep_their_lanes_where_the_lanes_of_another_are_in_the_way(
    block: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One loop is refused as long as the other is on chosen lanes: in a run and in `loopgate inspect`."""
    network = RoadNetwork.open(block.network)
    own = {v.loop.id: v.loop for v in read_vehicles(block, network, None)[0]}
    moved = {v.loop.id for v in read_vehicles(block, network)[0] if on(v.loop) != on(own[v.loop.id])}
    (other,) = moved
    (one,) = own.keys() - moved
    lay_out, survey = assembly._abstraction, survey_queues

    def refuses(scenario: Scenario, network: RoadNetwork, vehicles: Some, later: Some) -> Abstraction:
        found = lay_out(scenario, network, vehicles, later)
        if any(way.loop.id == other and on(way.loop) != on(own[other]) for way in found.itineraries):
            raise RefusedLoopError({one: LoopRefusal("has the other in its way")})
        return found

    def surveys(network: RoadNetwork, users: Sequence[tuple[Loop, VehicleType]]) -> QueueSurvey:
        found = survey(network, users)
        if all(loop.id != other or on(loop) == on(own[other]) for loop, _ in users):
            return found
        return replace(found, refused=(RefusedLoop(own[one], "has the other in its way", None),))

    monkeypatch.setattr(assembly, "_abstraction", refuses)
    assert {loop.id: loop.spans for loop in assemble(block).loops} == {k: v.spans for k, v in own.items()}
    monkeypatch.setattr(inspect_queues, "survey_queues", surveys)
    file = read_loops(network, block.routes)
    loops, found = inspect_queues._on_shared_lanes(
        network, file, list(own), list(own.values()), [DEFAULT_TYPE] * len(own)
    )
    assert loops == list(own.values())
    assert not found.refused
