"""SUMO alone beside the breakdown study: vehicles keep to their loops, and are led round what stands."""

from __future__ import annotations

from pathlib import Path

import pytest
import standing_rerouted
from standing_rerouted import Way

from loopgate import Scenario

ROOT = Path(__file__).resolve().parents[2]
GRID = Scenario(
    network=str(ROOT / "networks/grid5-priority.net.xml"),
    routes=str(ROOT / "routes/grid5.rou.xml"),
    vehicles=60,
    seed=1,
    duration_s=900.0,
)


def test_what_is_to_be_passed_on_the_first_route() -> None:
    way = Way(("b", "c", "d", "a"), ("c", "a"))
    assert way.first(["d", "a", "b", "c", "d", "a"]) == ["a", "c"]  # then it ends at a
    assert way.first(["b", "c", "d", "a"]) == ["c"]
    assert way.first(["a", "b", "c", "d", "a"]) == ["c"]


def test_vehicles_keep_to_their_loops_and_go_round_what_stands(tmp_path: Path) -> None:
    """Nobody comes to the end of its route; and hardly anybody waits behind a vehicle that stands."""
    free = standing_rerouted.drive(GRID, tmp_path, "v1", (0.0, 0.0))
    stands = standing_rerouted.drive(GRID, tmp_path, "v1", (100.0, 900.0))
    assert free["km"] > 59 * 0.9 * 5  # at 5 m/s at least
    assert free["laps"] > 59 * 2
    assert free["starving"] == 0
    assert stands["km"] == pytest.approx(free["km"], rel=0.1)
    assert stands["starving"] < 6
