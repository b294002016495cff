"""Loops that lead round what stands keep to the lanes on which vehicles wait."""

from __future__ import annotations

from pathlib import Path

import pytest
from made_networks import netgenerate

from loopgate.network import RoadNetwork, generate_loops
from loopgate.simulation.demand.detours import Detours

pytestmark = pytest.mark.sumo


def test_a_loop_turns_off_from_the_lane_of_its_own_loop(tmp_path: Path) -> None:
    """On roads of three lanes: else vehicles that wait on the lane for their turn would have no way round."""
    roads = RoadNetwork.open(netgenerate("--grid --grid.number=4 --grid.length=120 -L 3", tmp_path / "n.xml"))
    finder, looked_at = Detours(roads, "passenger"), 0
    for mine in generate_loops(roads, 15, length_m=(500.0, 1500.0), seed=1):
        own = {c.from_edge: c.from_lane for c in mine.movements}
        for number, edge in enumerate(mine.edges):
            found, before = finder.around(mine, {edge}), mine.edges[number - 1]
            if found is None or before not in found.edges:
                continue
            at = found.edges.index(before)
            onward = found.edges[(at + 1) % len(found.edges)]
            if any(c.from_lane == own[before] for c in roads.between(before, onward, "passenger")):
                looked_at += 1
                assert found.movements[at].from_lane == own[before]
    assert looked_at > 20
