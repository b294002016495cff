"""The project's small networks under gates, with real simulations."""

from __future__ import annotations

from pathlib import Path

import pytest
from made_networks import netgenerate

from loopgate.abstraction.queue_layout import lay_out_queues
from loopgate.errors import RefusedLoopError
from loopgate.network import RoadNetwork
from loopgate.network.vehicle_type import type_of_class
from loopgate.simulation.demand.allotment import random_loops
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario

pytestmark = pytest.mark.sumo

ROOT = Path(__file__).resolve().parents[2]


def small(network: str, gate: str, duration_s: float, seed: int = 1) -> Scenario:
    """One vehicle on each loop of a small network."""
    return Scenario(
        network=str(ROOT / "networks" / f"{network}.net.xml"),
        routes=str(ROOT / "routes" / f"{network}.rou.xml"),
        gate=gate,
        abstraction="segments",
        negotiation="random",
        duration_s=duration_s,
        seed=seed,
    )


@pytest.mark.parametrize("network", ["ring3", "order2"])
def test_vehicles_of_a_type_of_their_own_drive_under_sumo(network: str) -> None:
    """The route file's vehicle type reaches SUMO, and everyone gets round without a gate."""
    summary = simulate(small(network, "open", 300))
    assert summary["outcome"] == "done"
    assert summary["laps"] > summary["vehicles"]
    assert (summary["collisions"], summary["teleports"]) == (0, 0)


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("network", ["ring3", "order2"])
def test_algorithm2_keeps_them_going(network: str, seed: int) -> None:
    """No collision, no deadlock, no vehicle that could not brake, and everyone gets round."""
    summary = simulate(small(network, "algorithm2", 1800, seed))
    assert (summary["outcome"], summary["audit"]) == ("done", "clean")
    assert (summary["collisions"], summary["teleports"], summary["overruns"]) == (0, 0, 0)
    assert summary["laps"] >= 20 * summary["vehicles"]


@pytest.mark.parametrize(
    ("network", "gate", "fewest"),
    [("ring3", "collision", 3), ("order2", "collision", 4), ("order2", "one-step", 4)],
)
def test_gates_without_foresight_lock_up(network: str, gate: str, fewest: int) -> None:
    """In most seeds the situation comes about that the network is drawn for; nobody collides even then."""
    summaries = [simulate(small(network, gate, 1800, seed)) for seed in range(1, 6)]
    assert sum(s["outcome"] == "deadlock" for s in summaries) >= fewest
    assert [s["collisions"] for s in summaries] == [0] * 5


def test_one_step_is_enough_for_a_plain_circle() -> None:
    """ring3 has no deadlock of higher order."""
    assert simulate(small("ring3", "one-step", 1800))["outcome"] == "done"


def test_random_loops_work_for_the_types_that_drive_on_them(tmp_path: Path) -> None:
    """Cars can drive on all that are made for cars; trailers of 16.5 m need longer places."""
    blocks = "--grid --grid.number 4 --grid.length 90 --lefthand --default.lanenumber 2"
    lanes = "--turn-lanes 1 --turn-lanes.length 30 --default-junction-type traffic_light"
    roads = RoadNetwork.open(netgenerate(f"{blocks} {lanes}", tmp_path / "n.net.xml"))
    trailer = type_of_class("trailer", "types")
    cars = random_loops(Scenario(network="n"), roads, 12)
    with pytest.raises(RefusedLoopError):
        lay_out_queues(roads, [(loop, trailer) for loop in cars.loops])
    found = random_loops(Scenario(network="n", types="passenger=3,trailer=1"), roads, 12)
    assert len(found.loops) == 12
    lay_out_queues(roads, [(loop, trailer) for loop in found.loops])
