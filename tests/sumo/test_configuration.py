"""A SUMO configuration under a gate and without: its detectors, outputs, seed, step and options count."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from loopgate import run
from loopgate.analysis.rows import run_row
from loopgate.errors import TrafficError
from loopgate.network import RoadNetwork, write_loops
from loopgate.simulation.demand.allotment import random_loops
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario

pytestmark = pytest.mark.sumo

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("gate", ["certified", "open"])
def test_a_configuration_is_honoured(tmp_path: Path, gate: str) -> None:
    """Alike with and without a gate, so that like is compared with like; what is left out is said."""
    shutil.copy(ROOT / "networks" / "grid5-priority.net.xml", tmp_path / "n.net.xml")
    shutil.copy(ROOT / "routes" / "grid5.rou.xml", tmp_path / "r.rou.xml")
    (tmp_path / "d.add.xml").write_text(
        '<additional><e1Detector id="d" lane="A0A1_0" pos="50" freq="60" file="d.xml"/></additional>'
    )
    config = tmp_path / "c.sumocfg"
    config.write_text(
        '<configuration><net-file value="n.net.xml"/><route-files value="r.rou.xml"/>'
        '<additional-files value="d.add.xml"/><begin value="100"/><end value="160"/>'
        '<step-length value="0.5"/>'
        '<tripinfo-output value="t.xml"/><lateral-resolution value="0.8"/><seed value="9"/>'
        '<time-to-teleport value="300"/></configuration>'
    )
    given = {"network": str(config), "gate": gate, "vehicles": 20, "outputs": "fcd", "sumo": "--scale 1"}
    summary = simulate(Scenario.from_dict(given), tmp_path / "run")
    assert summary["seed"] == 9
    assert summary["duration_s"] == pytest.approx(60.0)
    assert summary["collisions"] == 0
    assert summary["distance_km"] > 1.0
    assert "<interval" in (tmp_path / "d.xml").read_text()
    assert (tmp_path / "t.xml").is_file()
    assert (tmp_path / "run" / "fcd.xml.gz").stat().st_size > 1000
    assert [line for line in summary["warnings"] if "time-to-teleport 300 is not taken over" in line]


@pytest.mark.parametrize("gate", ["certified", "open"])
def test_outputs_of_the_user_change_no_figure(tmp_path: Path, gate: str) -> None:
    """Names, formats and shares are the user's business; figures are of all vehicles. Each is said."""
    grid = ROOT / "networks" / "grid5-priority.net.xml"
    (tmp_path / "r.rou.xml").write_text(
        '<routes><flow id="f" begin="08:00:00" end="08:01:40" period="00:00:10" from="A0A1" to="E4D4"/>'
        "</routes>"
    )
    options = {
        "output-prefix": "mine_",
        "output-suffix": "_mine",
        "output.format": "parquet",
        "human-readable-time": "true",
        "device.tripinfo.probability": "0.3",
        "tripinfo-output": "t.xml",
        "fcd-output.geo": "true",
        "output.column-separator": ",",
        "device.fcd.period": "10",
    }
    found = {}
    for name, said in (("plain", {}), ("mine", options)):
        words = "".join(f'<{option} value="{value}"/>' for option, value in said.items())
        config = tmp_path / f"{name}.sumocfg"
        config.write_text(
            f'<configuration><net-file value="{grid}"/><route-files value="r.rou.xml"/>'
            f'<begin value="08:00:00"/>{words}</configuration>'
        )
        scenario = Scenario(network=str(config), gate=gate, duration_s=150.0, positions=True)
        found[name] = simulate(scenario, tmp_path / name)
    for figure in ("trips", "arrived", "mean_delay_s", "distance_km", "audit"):
        assert found["mine"][figure] == found["plain"][figure]
    assert found["mine"]["trips"] == 10
    for option, value in options.items():
        told = [line for line in found["mine"]["warnings"] if f"{option} {value} is not taken over" in line]
        assert len(told) == 1
        assert told[0].startswith(f"{tmp_path}/mine.sumocfg: ")
    assert (tmp_path / "mine" / "tripinfo.xml").read_text().count("<tripinfo ") == 10


def test_a_run_that_begins_in_the_morning_has_the_figures_of_one_at_midnight(tmp_path: Path) -> None:
    """No street has been idle since midnight, laps are counted, and so is how long a deadlock took."""
    grid, found, seen = ROOT / "networks" / "grid5-priority.net.xml", list[list[Any]](), list[list[float]]()
    routes = str(ROOT / "routes" / "grid5.rou.xml")
    few: dict[str, Any] = {"routes": routes, "vehicles": 30}
    loops = random_loops(Scenario(network=str(grid), loops_seed=2), RoadNetwork.open(grid), 40).loops
    write_loops(loops, tmp_path / "loops.rou.xml")
    crowd: dict[str, Any] = {"routes": str(tmp_path / "loops.rou.xml"), "vehicles": 240, "seed": 2}
    crowd["abstraction"] = "segments"  # they lock up after two minutes
    runs = ((0, "certified", few), (25200, "certified", few), (0, "open", crowd), (25200, "open", crowd))
    for begin, gate, given in runs:
        config = tmp_path / f"{begin}.sumocfg"
        text = f'<configuration><net-file value="{grid}"/><begin value="{begin}"/></configuration>'
        config.write_text(text)
        scenario = Scenario.from_dict(
            {
                "network": str(config),
                "traffic": "",
                "gate": gate,
                "duration_s": 300,
                "warmup_s": 30,
                "revisit_s": 150,
                **given,
            }
        )
        one = run(scenario)
        assert one.summary["begins_s"] == begin
        row, _ = run_row(scenario=one.scenario, summary=one.summary, events=one.events, edges=one.edges)
        points = json.loads(one.figures["seen"].to_json())["datasets"].values()
        within = sorted(point["y"] for some in points for point in some if "y" in point)
        figures = ("idleness_s", "worst_idleness_s", "laps", "distance_km", "unvisited_edges", "watch")
        told = ("lap_mean_s", "lapless_vehicles", "first_deadlock_s", "observed_s")
        found.append([one.summary[name] for name in figures] + [row[name] for name in told])
        seen.append(within)
    assert found[0] == found[1]
    assert found[2] == found[3]
    assert found[2][-2] is not None
    assert seen[0] == pytest.approx(seen[1], abs=1e-6)
    assert seen[2] == pytest.approx(seen[3], abs=1e-6)


def test_an_option_that_sumo_does_not_know_is_named() -> None:
    """SUMO itself only says that it could not parse its command line."""
    grid = str(ROOT / "networks" / "grid5-priority.net.xml")
    with pytest.raises(TrafficError, match="does not take the options --nonsense 2; 'sumo --help' lists all"):
        simulate(Scenario(network=grid, gate="open", loops=3, duration_s=5, sumo="--nonsense 2"))


@pytest.mark.parametrize("gate", ["certified", "open"])
def test_a_later_begin_goes_before_that_of_the_configuration(tmp_path: Path, gate: str) -> None:
    """The run ends where the configuration ends; what departs before it begins is not there."""
    (tmp_path / "t.rou.xml").write_text(
        '<routes><route id="r" edges="A0A1 A1A2 A2A3"/><vehicle id="early" route="r" depart="10"/>'
        '<vehicle id="late" route="r" depart="130"/></routes>'
    )
    config = tmp_path / "t.sumocfg"
    config.write_text(
        f'<configuration><input><net-file value="{Path("networks/grid5-priority.net.xml").resolve()}"/>'
        '<route-files value="t.rou.xml"/></input><time><begin value="0"/><end value="300"/></time>'
        "</configuration>"
    )
    scenario = Scenario.from_dict({"network": str(config), "gate": gate, "begin_s": 120.0})
    made = run(scenario, tmp_path / "run")
    assert scenario.duration_s == 180.0
    assert made.summary["begins_s"] == 120.0
    assert made.vehicles["vehicle"].tolist() == ["late"]
