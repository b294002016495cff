"""Scenarios: from files, from mappings, and what is wrong with them."""

import shlex
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest

from loopgate.errors import ScenarioError
from loopgate.simulation.scenario import Scenario, read_scenario


def test_a_written_scenario_is_read_back(tmp_path: Path) -> None:
    """The copy in a run folder repeats the run."""
    scenario = Scenario(network="sumo:DRT", loops=12, max_shared=0.4, gate="collision", seed=7)
    scenario.write(tmp_path / "scenario.toml")
    assert read_scenario(tmp_path / "scenario.toml") == scenario


def test_units_may_be_left_out() -> None:
    """`duration` is `duration_s`, `loop_length` may be written as a range."""
    scenario = Scenario.from_dict({"network": "n", "duration": 60, "loop_length": "400:900"})
    assert (scenario.duration_s, scenario.loop_length_m) == (60.0, (400.0, 900.0))


def test_a_watch_is_held_evenly_spaced_unless_said_otherwise() -> None:
    """Where a gate can hold vehicles, and somebody wants streets to be seen."""
    watch = Scenario(network="n", revisit_s=600.0)
    assert watch.rule_for_spacing == "hold"
    assert replace(watch, gate="open").rule_for_spacing == "none"
    assert replace(watch, spacing="none").rule_for_spacing == "none"
    assert Scenario(network="n").rule_for_spacing == "none"


def test_paths_are_relative_to_the_file(tmp_path: Path) -> None:
    """A scenario can be moved together with its network."""
    (tmp_path / "s.toml").write_text(
        'network = "a.net.xml"\nroutes = "b.rou.xml"\ntraffic = "c.rou.xml"\n'
        'revisit = 60\nweights = "w"\ndistricts = "d.xml"'
    )
    scenario = read_scenario(tmp_path / "s.toml")
    assert (scenario.weights, scenario.districts) == (str(tmp_path / "w"), str(tmp_path / "d.xml"))
    assert scenario.traffic == str(tmp_path / "c.rou.xml")
    assert (scenario.network, scenario.routes) == (str(tmp_path / "a.net.xml"), str(tmp_path / "b.rou.xml"))


@pytest.mark.parametrize(
    ("data", "words"),
    [
        ({}, "'network' is missing"),
        ({"network": "n", "gaet": "x"}, "unknown key 'gaet'"),
        ({"network": "n", "vehicles": "many"}, "expected a whole number"),
        ({"network": "n", "vehicles": -1}, "vehicles is -1; expected a whole number from 0 to 1000000"),
        ({"network": "n", "duration": 0}, "duration_s is 0; expected a number from 1 to 1e+08"),
        ({"network": "n", "max_shared": 1.5}, "max_shared is 1.5; expected a number from 0 to 1"),
        (
            {"network": "n", "loop_length": "9:3"},
            "loop_length_m is '9:3'; expected two numbers, shortest and longest",
        ),
        (
            {"network": "n", "abstraction": "cells"},
            "abstraction is 'cells'; expected one of segments, queues",
        ),
        ({"network": "n", "traffic": "t", "abstraction": "segments"}, "on abstraction queues only"),
        ({"network": "n", "gate": "open", "spacing": "hold"}, "hold works under a gate only"),
        ({"network": "n", "weights": "w"}, "give revisit_s too"),
        ({"network": "n", "starts": "here"}, "starts is 'here'; expected one of random, even"),
        ({"network": "n", "gate": "collision", "on_deadlock": "teleport"}, "with gate open only"),
    ],
)
def test_what_is_wrong_is_said(data: dict[str, object], words: str) -> None:
    """One line with the source, the key, what was found and what is expected."""
    with pytest.raises(ScenarioError) as error:
        Scenario.from_dict(data, source="mine.toml")
    assert str(error.value).startswith("mine.toml: ")
    assert words in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(("text", "words"), [(None, "cannot read"), ("a = = b", "not a TOML file")])
def test_unreadable_files(tmp_path: Path, text: str | None, words: str) -> None:
    """Missing and malformed files are named."""
    file = tmp_path / "s.toml"
    if text is not None:
        file.write_text(text)
    with pytest.raises(ScenarioError, match=words):
        read_scenario(file)


def test_the_command_repeats_the_run() -> None:
    """Only what differs from the defaults is spelled out."""
    command = Scenario(network="sumo:DRT", loops=12, loop_length_m=(400.0, 3000.0), seed=2).command("out")
    assert command == "loopgate run sumo:DRT --loops 12 --length 400:3000 --seed 2 -o out"


@pytest.mark.parametrize(
    "name", ["$(touch run).net.xml", "a b'c.net.xml", "-x;reboot.net.xml", "`id`&.net.xml"]
)
def test_a_name_in_the_command_is_a_name_to_the_shell(name: str) -> None:
    """Whoever pastes the command runs nothing but it, and the words are the names again."""
    made = Scenario(network=name, routes=name, sumo="--tls.actuated.jam-threshold 10", gate="certified")
    words = shlex.split(made.command(name))
    command = f"printf '%s\\n' {made.command(name)}"
    said = subprocess.run(["/bin/sh", "-c", command], capture_output=True, text=True, check=True)
    assert said.stdout.splitlines() == words
    assert words[2].removeprefix("./") == words[words.index("--routes") + 1] == words[-1] == name


def test_times_in_files_are_written_as_on_the_command_line() -> None:
    """Also a time of day, at which the run begins."""
    data = {"network": "sumo:DRT", "duration": "10min", "warmup_s": "0:01:00", "begin": "9:30"}
    scenario = Scenario.from_dict(data)
    assert (scenario.duration_s, scenario.warmup_s, scenario.begin_s) == (600.0, 60.0, 34200.0)
    with pytest.raises(ScenarioError, match="duration_s is 'soon'; expected a number"):
        Scenario.from_dict({"network": "sumo:DRT", "duration": "soon"})


def test_files_may_be_paths() -> None:
    """As scripts have them; the scenario has them as texts."""
    files = {"network": Path("a") / "n.net.xml", "routes": Path("r.rou.xml")}
    asked = Scenario(network="a/n.net.xml", routes="r.rou.xml")
    assert Scenario(**files) == asked  # type: ignore[arg-type]  # a text to the type checker
    assert Scenario.from_dict(files) == asked
