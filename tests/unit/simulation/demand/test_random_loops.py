"""Random loops for a run: those that work as queues, alone and together."""

from __future__ import annotations

import pytest

from loopgate.abstraction.queue_layout import QueueLayout, lay_out_queues, why_not
from loopgate.cache import Cache
from loopgate.errors import LoopRefusal, RefusedLoopError, RouteError
from loopgate.network import Loop, RoadNetwork, VehicleType, find_loops
from loopgate.network.vehicle_type import DEFAULT_TYPE
from loopgate.simulation.demand import allotment as module
from loopgate.simulation.demand.allotment import loops_for_queues, random_loops
from loopgate.simulation.scenario import Scenario

ALL_M = (100.0, 5000.0)


@pytest.fixture(scope="module")
def roads() -> RoadNetwork:
    return RoadNetwork.open("sumo:A10KW")


def test_all_that_work_are_found(roads: RoadNetwork) -> None:
    """Of the fourteen loops there are, those that work as queues, and a word on the others."""
    every = find_loops(roads, 40, length_m=ALL_M).loops
    working = {frozenset(loop.edges) for loop in every if not why_not(roads, loop)}
    found = random_loops(Scenario(network="n", loop_length_m=ALL_M), roads, 40)
    assert {frozenset(loop.edges) for loop in found.loops} == working
    assert 0 < len(working) < len(every) == 14
    assert f"besides {14 - len(working)} that do not work as queues, the last of which" in found.shortfall


@pytest.fixture(autouse=True)
def _nothing_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep nothing: tests that replace what finds loops must not be given what was found before."""
    monkeypatch.setattr(module, "_KEPT", Cache(0))


def test_turning_round_makes_more(roads: RoadNetwork) -> None:
    """The scenario says whether vehicles may."""
    scenario = Scenario(network="n", loop_length_m=ALL_M, u_turns=True)
    assert len(random_loops(scenario, roads, 40).loops) == 40


def test_a_loop_that_raises_is_dropped(roads: RoadNetwork, monkeypatch: pytest.MonkeyPatch) -> None:
    """An error about one generated loop does not end the run."""

    def raises(network: RoadNetwork, loop: Loop, kind: VehicleType) -> LoopRefusal | None:
        if "6272844#0" in loop.edges:
            msg = "state 6272844#0_0 follows itself"
            raise RouteError(msg)
        return why_not(network, loop, kind)

    monkeypatch.setattr(module, "why_not", raises)
    found = random_loops(Scenario(network="n", loop_length_m=ALL_M), roads, 40)
    assert found.loops
    assert all("6272844#0" not in loop.edges for loop in found.loops)


def test_what_does_not_work_beside_others_is_replaced(monkeypatch: pytest.MonkeyPatch) -> None:
    """A loop that the layout of all refuses makes way for another; the rest stays as it was."""
    network = RoadNetwork.open("sumo:bs3d")
    scenario = Scenario(network="n")
    before = random_loops(scenario, network, 8).loops

    def refuses(network: RoadNetwork, users: list[tuple[Loop, VehicleType]]) -> QueueLayout:
        third = next((loop.id for loop, _ in users if loop.id == "loop3"), None)
        if third is not None:
            raise RefusedLoopError({third: LoopRefusal("has no room")})
        return lay_out_queues(network, users)

    monkeypatch.setattr(module, "lay_out_queues", refuses)
    after = random_loops(scenario, network, 8)
    assert [loop.id for loop in after.loops] == [f"loop{k}" for k in (0, 1, 2, 4, 5, 6, 7, 8)]
    assert after.loops[:3] == before[:3]
    assert after.shortfall == ""


def test_an_end_to_replacing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where every newcomer is in the way of others the run goes on with fewer, or says why it cannot."""
    network = RoadNetwork.open("sumo:bs3d")

    def refuses(_: RoadNetwork, users: list[tuple[Loop, VehicleType]]) -> None:
        why = LoopRefusal("has no room beside the others")
        raise RefusedLoopError({users[-1][0].id: why})

    monkeypatch.setattr(module, "lay_out_queues", refuses)
    with pytest.raises(RouteError, match=r"found 0 of 8 .* the last of which has no room beside the others"):
        random_loops(Scenario(network="n"), network, 8)


def test_segments_keep_to_their_bound() -> None:
    """On segments loops are not asked whether they work as queues, but how much they share."""
    network = RoadNetwork.open("sumo:bs3d")
    scenario = Scenario(network="n", abstraction="segments", gate="algorithm2", max_shared=0.4)
    found = random_loops(scenario, network, 40)
    assert 0 < len(found.loops) < 40
    assert "that share too much" in found.shortfall


def test_loops_that_are_written_work_too(roads: RoadNetwork) -> None:
    """With others dropped, of which an error lists all."""
    every = find_loops(roads, 20, length_m=(200.0, 2000.0))
    with pytest.raises(RefusedLoopError, match=r"loop loop0 must .*; loop loop\d must") as error:
        lay_out_queues(roads, [(loop, DEFAULT_TYPE) for loop in every.loops])
    found = loops_for_queues(roads, 20, length_m=(200.0, 2000.0))
    assert len(found.loops) == len(every.loops) - len(error.value.refused)
    lay_out_queues(roads, [(loop, DEFAULT_TYPE) for loop in found.loops])
    assert "that do not work as queues" in found.shortfall
