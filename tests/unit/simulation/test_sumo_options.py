"""What configurations and own words tell SUMO: passed on, said to be left out, or refused by name."""

from __future__ import annotations

from pathlib import Path

import pytest

from loopgate.errors import ScenarioError
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.sumo_options import sumo_options


def configuration(folder: Path, *options: str) -> str:
    """Write a configuration with options like ``seed=3``; return its name."""
    file = folder / "city.sumocfg"
    lines = "".join(f'<{name} value="{value}"/>' for name, value in (one.split("=") for one in options))
    file.write_text(f'<configuration><net-file value="n.net.xml"/>{lines}</configuration>', encoding="utf-8")
    return str(file)


def test_seed_step_and_duration_come_from_the_configuration(tmp_path: Path) -> None:
    """Unless the scenario has its own, and then that is said."""
    name = configuration(tmp_path, "seed=7", "step-length=0.5", "begin=1:00:00", "end=5400")
    scenario = Scenario.from_dict({"network": name})
    assert (scenario.seed, scenario.step_s, scenario.duration_s) == (7, 0.5, 1800.0)
    said = sumo_options(scenario)
    assert said.begin_s == 3600.0
    assert said.notes == ()
    own = Scenario.from_dict({"network": name, "seed": 2})
    assert sumo_options(own).notes == (f"{name}: seed 7 is not taken over: the run has 2",)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (("end=abc",), "city.sumocfg: end is 'abc'; expected seconds or h:m:s"),
        (("step-length=fast",), "city.sumocfg: step-length is 'fast'"),
        (("begin=100", "end=50"), "city.sumocfg: end is 50 s, before the run begins, at 100 s"),
        (("step-length=2",), "city.sumocfg: step-length: step_s is 2.0; expected at most 1 under a gate"),
        (("end=1e12",), "city.sumocfg: end: duration_s is 1000000000000.0"),
        (("seed=-1",), "city.sumocfg: seed: seed is -1"),
    ],
)
def test_a_wrong_option_is_named_with_its_file(tmp_path: Path, options: tuple[str, ...], says: str) -> None:
    """Not only the key of a scenario that it sets."""
    name = configuration(tmp_path, *options)
    with pytest.raises(ScenarioError) as error:
        Scenario.from_dict({"network": name})
    assert says in str(error.value)


def test_a_key_of_the_scenario_is_not_laid_to_the_configuration(tmp_path: Path) -> None:
    """Nor is an end that the begin of the scenario comes before."""
    name = configuration(tmp_path, "step-length=0.5", "begin=100", "end=50")
    with pytest.raises(ScenarioError) as error:
        Scenario.from_dict({"network": name, "step_s": 2.0, "begin_s": 0.0}, source="mine")
    assert str(error.value).startswith("mine: step_s is 2.0")
    assert Scenario.from_dict({"network": name, "begin_s": 0.0}).duration_s == 50.0


def test_all_else_is_passed_on(tmp_path: Path) -> None:
    """SUMO reads the configuration itself; what the run sets instead is said with the reason."""
    name = configuration(tmp_path, "tripinfo-output=t.xml", "time-to-teleport=300")
    said = sumo_options(Scenario.from_dict({"network": name, "sumo": "--scale 2 --fcd-output=f.xml"}))
    assert said.arguments == ("--configuration-file", name, "--scale", "2", "--fcd-output=f.xml")
    (note,) = said.notes
    assert "time-to-teleport 300 is not taken over: a gridlock would be hidden" in note


def test_under_a_gate_no_lane_is_shared_side_by_side(tmp_path: Path) -> None:
    """A configuration is driven without, with a warning; own words are refused; ``open`` has it."""
    name = configuration(tmp_path, "lateral-resolution=0.8")
    said = sumo_options(Scenario(network=name))
    assert said.arguments[-2:] == ("--lateral-resolution", "-1")
    (note,) = said.notes
    assert "lateral-resolution 0.8 is not taken over: vehicles pass each other within a lane" in note
    assert sumo_options(Scenario(network=name, gate="open")).arguments == ("--configuration-file", name)
    with pytest.raises(ScenarioError, match=r"sumo: lateral-resolution 0\.8 does not go with a gate"):
        sumo_options(Scenario(network="sumo:DRT", sumo="--lateral-resolution 0.8"))


@pytest.mark.parametrize(
    ("option", "reason"),
    [
        ("step-method.ballistic=true", "overshoot"),
        ("mesosim=true", "mesoscopic"),
        ("lanechange.duration=3", "between lanes"),
        ("random=true", "--seed"),
        ("device.bluelight.probability=0.1", "make room"),
    ],
)
def test_what_no_gate_can_work_with_is_refused(tmp_path: Path, option: str, reason: str) -> None:
    """By name and with the reason, from a configuration and from own words; ``open`` takes it."""
    name = configuration(tmp_path, option)
    with pytest.raises(ScenarioError, match=f"{option.partition('=')[0]} .*{reason}"):
        sumo_options(Scenario.from_dict({"network": name}))
    assert sumo_options(Scenario.from_dict({"network": name, "gate": "open"})).arguments
    off = configuration(tmp_path, f"{option.partition('=')[0]}=0")
    assert sumo_options(Scenario.from_dict({"network": off})).arguments


@pytest.mark.parametrize(("awareness", "refused"), [("0", True), ("0.5", True), ("1", False)])
def test_drivers_who_see_badly_are_refused(tmp_path: Path, awareness: str, *, refused: bool) -> None:
    """The worst is 0, which is off for other options."""
    name = configuration(tmp_path, f"device.driverstate.initialAwareness={awareness}")
    if not refused:
        assert sumo_options(Scenario.from_dict({"network": name})).arguments
        return
    with pytest.raises(ScenarioError, match=r"initialAwareness .* misjudge"):
        sumo_options(Scenario.from_dict({"network": name}))


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ("-e 5", "long names"),
        ("--net-file x.net.xml", "NETWORK"),
        ("--seed 3", "see --seed"),
        ("--collision.action=none", "collisions are counted"),
        ("--fcd-output 'f.xml", "cannot be read"),
    ],
)
def test_own_words_that_are_the_runs_to_say(words: str, reason: str) -> None:
    """Refused when the scenario is made, with the way out."""
    with pytest.raises(ScenarioError, match=reason):
        Scenario(network="sumo:DRT", sumo=words)


def test_positions_are_the_only_floating_car_data() -> None:
    """SUMO writes these to one file only."""
    for other in ({"outputs": "fcd"}, {"sumo": "--fcd-output f.xml"}):
        with pytest.raises(ScenarioError, match="one file only"):
            Scenario.from_dict({"network": "sumo:DRT", "positions": True, **other})


def test_vehicles_of_additional_files_are_not_overlooked(tmp_path: Path) -> None:
    """Beside a route file they are ordinary traffic, and have to be named as that; else they are gated."""
    (tmp_path / "more.add.xml").write_text('<additional><flow id="f"/></additional>', encoding="utf-8")
    name = configuration(tmp_path, "additional-files=more.add.xml")
    with pytest.raises(ScenarioError, match="flow f: beside the vehicles of --routes"):
        sumo_options(Scenario.from_dict({"network": name, "routes": "x.rou.xml"}))
    for more in ({"traffic": name, "routes": "x.rou.xml"}, {}, {"routes": name}):
        assert sumo_options(Scenario.from_dict({"network": name, **more})).additional_files


def test_options_of_a_configuration_of_traffic_are_said_to_be_left(tmp_path: Path) -> None:
    """Only its vehicles and additional files are taken."""
    name = configuration(tmp_path, "lateral-resolution=0.8", "end=7")
    (note,) = sumo_options(Scenario(network="sumo:DRT", traffic=name)).notes
    assert note.endswith("not lateral-resolution")
