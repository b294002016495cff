"""Networks that the project has never seen: a run works, with nothing but numbers given."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest
from made_networks import narrow_streets, netgenerate, roundabouts

from loopgate.abstraction.movements import narrow_lanes
from loopgate.errors import RouteError
from loopgate.network import RoadNetwork
from loopgate.simulation.drive import Drive
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario

pytestmark = pytest.mark.sumo

GRID = "--grid --grid.number=4 --grid.length=150"
MADE = {
    "spider": "--spider --spider.arm-number=6 --spider.circle-number=4",
    "spider-two-lanes": "--spider --spider.arm-number=6 --spider.circle-number=3 -L 2",
    "random": "--rand --rand.iterations=60 --seed=4",
    "random-three-lanes": "--rand --rand.iterations=60 --seed=9 -L 3 --rand.random-lanenumber",
    "random-lights-left-hand": "--rand --rand.iterations=60 --seed=12 -L 2 -j traffic_light --lefthand",
    "random-all-way-stop": "--rand --rand.iterations=80 --seed=3 -j allway_stop",
    "two-lanes-lights": f"{GRID} -L 2 -j traffic_light",
    "turn-lanes": f"{GRID} -L 2 --turn-lanes 1 --turn-lanes.length 40",
    "three-lanes": f"{GRID} -L 3",
    "left-hand": f"{GRID} --lefthand",
    "left-hand-turn-lanes": f"{GRID} -L 2 --turn-lanes 1 --lefthand",
    "no-internal-lanes": f"{GRID} -L 2 --no-internal-links",
}


def drive(net: Path, folder: Path, *, vehicles: int = 120) -> None:
    """Ten minutes: nobody collides, nobody locks up, the audit is clean, and every vehicle gets round."""
    scenario = Scenario(network=str(net), loops=40, vehicles=vehicles, duration_s=600, positions=True)
    summary = simulate(scenario, folder)
    assert (summary["outcome"], summary["deadlocks"]) == ("done", [])
    assert (summary["collisions"], summary["teleports"], summary["trespasses"]) == (0, 0, 0)
    assert summary["audit"] == "clean"
    laps = pd.read_parquet(folder / "vehicles.parquet")["laps"]
    assert len(laps) == vehicles
    assert laps.min() >= 1


@pytest.mark.parametrize("name", MADE)
def test_it_simply_works(name: str, tmp_path: Path) -> None:
    """120 vehicles on 40 loops."""
    drive(netgenerate(MADE[name], tmp_path / f"{name}.net.xml"), tmp_path / "run")


@pytest.mark.parametrize(("lanes", "options"), [(1, ""), (2, ""), (2, "--lefthand"), (3, "")])
def test_roundabouts_work(lanes: int, options: str, tmp_path: Path) -> None:
    """Nine of them; the rings hold nobody who waits, or few."""
    drive(roundabouts(tmp_path / "r.net.xml", lanes=lanes, options=options), tmp_path / "run", vehicles=50)


def test_left_turners_that_wait_for_each_other_on_the_junction(tmp_path: Path) -> None:
    """SUMO lets them stand at waiting points inside; nobody counts on one that may have to."""
    options = (
        "--spider --spider.arm-number=6 --spider.circle-number=2 --spider.space-radius=100 --seed=103294"
    )
    net = netgenerate(
        f"{options} -L 3 -j traffic_light --default.junctions.radius=8", tmp_path / "wide.net.xml"
    )
    scenario = Scenario(network=str(net), loops=40, vehicles=150, seed=294, duration_s=300, positions=True)
    summary = simulate(scenario, tmp_path / "run")
    assert summary["collisions"] == 0
    assert summary["audit"] == "clean"


def test_streets_too_narrow_for_two_work_and_nobody_meets_on_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """SUMO looks for no collisions between lanes of two edges, so the test does, after every step."""
    net = narrow_streets(tmp_path / "narrow.net.xml")
    network = RoadNetwork.open(net)
    pairs = narrow_lanes(network, [edge.lanes[0].id for edge in network.edges.values()])
    assert len(pairs) >= 10
    step, seen = Drive.step, set[str]()

    def look(self: Drive) -> None:
        step(self)
        on = {self._traffic.lane(driver.name)[0] for driver in self.vehicles}
        seen.update(on)
        assert not any(x in on and y in on for x, y in pairs)

    monkeypatch.setattr(Drive, "step", look)
    drive(net, tmp_path / "run", vehicles=24)
    assert seen >= {lane for pair in pairs for lane in pair}


def test_what_cannot_be_handled_is_said_in_one_line(tmp_path: Path) -> None:
    """A block of 20 m: no lane round it holds two vehicles."""
    net = netgenerate("--grid --grid.number=2 --grid.length=20", tmp_path / "tiny.net.xml")
    scenario = Scenario(network=str(net), loops=5, vehicles=10, loop_length_m=(20.0, 800.0))
    with pytest.raises(RouteError) as told:
        simulate(scenario)
    assert "found 0 of 5 loops" in str(told.value)
    assert "has fewer than two places in which two vehicles can queue" in str(told.value)
    assert "--max-shared" not in str(told.value)
    assert "\n" not in str(told.value)
