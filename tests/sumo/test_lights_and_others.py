"""Runs with lights that are obeyed, and with ordinary traffic among gated vehicles."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from random import Random

import pytest

from loopgate.errors import RouteError
from loopgate.network import RoadNetwork
from loopgate.results.columns import EVENT, REASON
from loopgate.results.recorder import read_events
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario

pytestmark = pytest.mark.sumo

NETWORKS = Path(__file__).parents[2] / "networks"
GRID = NETWORKS / "grid5-priority.net.xml"
ACTUATED = Scenario(
    network=str(NETWORKS / "grid5-actuated.net.xml"),
    loops=30,
    vehicles=100,
    lights="obey",
    duration_s=400.0,
    seed=2,
)


def _trips(file: Path, *, every_s: float, duration_s: float, seed: int = 1) -> Path:
    """Write ordinary vehicles between random roads of the grid."""
    edges = sorted(RoadNetwork.open(GRID).edges)
    rng = Random(seed)
    lines = ["<routes>"]
    for number in range(int(duration_s / every_s)):
        start, end = rng.sample(edges, 2)
        lines.append(f'<trip id="o{number}" depart="{number * every_s:.1f}" from="{start}" to="{end}"/>')
    file.write_text("\n".join([*lines, "</routes>"]))
    return file


def test_lights_obeyed(tmp_path: Path) -> None:
    """Red refuses; next to nothing is held through a red; no collision, and more is driven than with `keep`.

    Under ``keep`` vehicles take their crossing and the slot beyond, and then wait for green.
    """
    obeyed = simulate(ACTUATED, tmp_path / "obey")
    kept = simulate(Scenario(**{**ACTUATED.to_dict(), "lights": "keep"}))
    assert obeyed["outcome"] == "done"  # whoever takes its crossing at a red may keep others for long
    assert (obeyed["collisions"], obeyed["teleports"], obeyed["audit"]) == (0, 0, "clean")
    assert obeyed["refusals"]["red"] > 100
    assert "red" not in kept["refusals"]
    lights = obeyed["at_lights"]
    assert lights["grants"] > 500
    assert lights["stood"] < 0.05 * lights["grants"]
    assert obeyed["km_per_h"] > kept["km_per_h"]
    assert obeyed["warnings"] == []
    events = read_events(tmp_path / "obey" / "events.parquet")
    assert "red" in set(events[events[EVENT] == "refuse"][REASON])


@pytest.mark.parametrize("gate", ["certified", "open"])
def test_lights_that_are_off_stay_off(tmp_path: Path, gate: str) -> None:
    """No plan of an additional file switches them on at a time: with or without it, all is the same."""
    red = f'<phase duration="90" state="{"r" * 20}"/>'
    plan = (
        '<WAUT id="w" refTime="0" startProg="0"><wautSwitch time="20" to="night"/></WAUT>'
        '<wautJunction wautID="w" junctionID="B2"/>'
    )
    told = []
    for name, more in (("with", plan), ("without", "")):
        file = tmp_path / f"{name}.add.xml"
        logic = f'<tlLogic id="B2" type="static" programID="night">{red}</tlLogic>'
        file.write_text(f"<additional>{logic}{more}</additional>")
        scenario = replace(ACTUATED, gate=gate, lights="off", stops=str(file), duration_s=80.0)
        simulate(scenario, tmp_path / name)
        told.append((tmp_path / name / "events.parquet").read_bytes())
    assert told[0] == told[1]


def test_lights_that_stay_red_are_no_deadlock() -> None:
    """The lights of this network wait for a player: the run goes on, and names vehicles that wait at red."""
    summary = simulate(Scenario(network="sumo:bs3d", loops=10, vehicles=30, lights="obey", duration_s=600.0))
    assert (summary["outcome"], summary["deadlocks"]) == ("starving", [])
    assert {sink["why"] for sink in summary["starving"]} == {"red"}
    assert "never get green" in summary["warnings"][-1]


def test_ordinary_traffic(tmp_path: Path) -> None:
    """Everybody gets round among ordinary vehicles, nobody collides, the summary says what it is worth."""
    traffic = _trips(tmp_path / "others.rou.xml", every_s=3.0, duration_s=600.0)
    scenario = Scenario(network=str(GRID), loops=30, vehicles=60, traffic=str(traffic), duration_s=600.0)
    summary = simulate(scenario, tmp_path / "run")
    assert summary["outcome"] == "done"
    assert (summary["collisions"], summary["teleports"], summary["audit"]) == (0, 0, "clean")
    assert summary["vehicles_without_a_lap"] == summary["overruns"] == summary["trespasses"] == 0
    assert summary["refusals"]["traffic"] > 100
    assert summary["others"]["vehicles"] > 150
    assert "SUMO's right of way" in summary["others"]["promise"]
    assert (summary["promise"], summary["promise_if"]) == ("", "")  # they may block others for good
    assert f"--traffic {traffic}" in summary["command"]


def test_ordinary_traffic_finds_room_in_circles_of_places(tmp_path: Path) -> None:
    """With so many on the grid a gate that leaves no room for others locks up after nine minutes."""
    traffic = _trips(tmp_path / "others.rou.xml", every_s=3.0, duration_s=700.0, seed=2)
    crowd = Scenario(
        network=str(GRID), loops=30, vehicles=260, seed=2, traffic=str(traffic), duration_s=700.0
    )
    summary = simulate(crowd)
    assert (summary["outcome"], summary["deadlocks"], summary["collisions"]) == ("done", [], 0)
    assert summary["collisions_by_others"] == 0
    assert summary["others"]["verdicts"] == []


def test_a_configuration_whose_vehicles_are_the_ordinary_traffic(tmp_path: Path) -> None:
    """Named as the network and as the traffic, it brings both; the loops are random."""
    _trips(tmp_path / "others.rou.xml", every_s=5.0, duration_s=300.0)
    config = tmp_path / "all.sumocfg"
    config.write_text(
        f'<configuration><net-file value="{GRID}"/><route-files value="others.rou.xml"/></configuration>'
    )
    summary = simulate(
        Scenario(network=str(config), traffic=str(config), loops=10, vehicles=20, duration_s=300.0)
    )
    assert (summary["outcome"], summary["vehicles"], summary["loops"]) == ("done", 20, 10)
    assert summary["others"]["vehicles"] > 40


def test_names_must_differ(tmp_path: Path) -> None:
    """SUMO would drop one of two vehicles of one name."""
    file = tmp_path / "t.rou.xml"
    file.write_text('<routes><trip id="v1" depart="0" from="A0A1" to="C0C1"/></routes>')
    with pytest.raises(RouteError, match="vehicle v1"):
        simulate(Scenario(network=str(GRID), loops=4, traffic=str(file), duration_s=60.0))
