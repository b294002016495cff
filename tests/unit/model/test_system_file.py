"""The system file: what is written is read back, and what is wrong is named."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from builders import robot
from loopgate.errors import SystemFileError, SystemModelError
from loopgate.model import System, read_system, system_from_dict, system_to_dict, write_system
from loopgate.research.theory.random_systems import Shape, random_system


def test_the_documented_example_reads(tmp_path: Path) -> None:
    """Closed, start and capacity have defaults."""
    file = tmp_path / "two.json"
    file.write_text(
        '{"robots": [{"id": "r1", "path": ["s1", "s3"], "closed": true, "start": 0},'
        ' {"id": "r2", "path": ["s2", "s3"]}], "capacity": {"s3": 2}, "note": "two"}'
    )
    s = read_system(file)
    assert s.robots == (robot("r1", "s1 s3"), robot("r2", "s2 s3"))
    assert s.room[s.states.index(s.robots[0].path[1])] == 2


SHAPES = [
    Shape(robots=3, states=4, path=(2, 4)),
    Shape(robots=4, states=5, path=(2, 3), capacity=(1, 3), fifo=0.5),
]


@given(
    seed=st.integers(0, 10**6),
    shape=st.sampled_from(SHAPES),
)
def test_a_system_survives_its_file(seed: int, shape: Shape) -> None:
    """Robots, capacities and FIFO states are the same after writing and reading."""
    s = random_system(shape, seed)
    again = system_from_dict(json.loads(json.dumps(system_to_dict(s))))
    assert again.robots == s.robots
    assert dict(again.capacity) == dict(s.capacity)
    assert again.fifo == s.fifo
    assert again.initial == s.initial


def test_a_note_is_kept_for_people(tmp_path: Path) -> None:
    """The note stands in the file and is no part of the system."""
    file = tmp_path / "s.json"
    write_system(System([robot("r1", "a b")]), file, note="why")
    assert json.loads(file.read_text())["note"] == "why"
    assert read_system(file).robots == (robot("r1", "a b"),)


R1 = {"id": "r1", "path": ["a", "b"]}


@pytest.mark.parametrize(
    ("data", "says"),
    [
        ([], "the system is []; expected a JSON object"),
        ({}, "the key 'robots' is missing"),
        ({"robots": {}}, "robots is {}; expected a JSON list"),
        ({"robots": [R1], "colour": 1}, "unknown key 'colour'"),
        ({"robots": [{**R1, "speed": 3}]}, "robot r1: unknown key 'speed'"),
        ({"robots": [{"id": "r1"}]}, "robot r1: the key 'path' is missing"),
        ({"robots": [{"path": ["a"]}]}, "robot number 1: the key 'id' is missing"),
        ({"robots": [{**R1, "path": []}]}, "robot r1: its path is empty"),
        ({"robots": [{**R1, "path": "ab"}]}, "robot r1: its path is 'ab'; expected a JSON list"),
        ({"robots": [{**R1, "path": ["a", 3]}]}, "robot r1: a state is 3"),
        ({"robots": [{**R1, "start": 7}]}, "robot r1: start 7"),
        ({"robots": [{**R1, "start": True}]}, "robot r1: its start is True; expected a whole number"),
        ({"robots": [{**R1, "closed": 1}]}, "robot r1: closed is 1; expected true or false"),
        ({"robots": [{**R1, "id": 4}]}, "robot number 1: its id is 4"),
        ({"robots": [R1], "capacity": {"a": 1.5}}, "state a: its capacity is 1.5"),
        ({"robots": [R1], "capacity": {"q": 2}}, "state q: a capacity is given"),
        ({"robots": [R1], "fifo": [1]}, "fifo: an entry is 1"),
        ({"robots": [R1, {"id": "r2", "path": ["a", "c"]}]}, "state a: robots r1, r2 start in it"),
    ],
)
def test_a_bad_file_is_refused(data: object, says: str, tmp_path: Path) -> None:
    """The error names the file, and the robot or state, in one line."""
    file = tmp_path / "bad.json"
    file.write_text(json.dumps(data))
    with pytest.raises(SystemFileError) as caught:
        read_system(file)
    text = str(caught.value)
    assert text.startswith(f"{file}: ")
    assert says in text
    assert "\n" not in text
    with pytest.raises(SystemModelError):
        system_from_dict(data)


@pytest.mark.parametrize(
    "content", [b"<net/>", b"\xff\xfe{", b"[" * 10**5], ids=["markup", "no UTF-8", "nested too deeply"]
)
def test_what_is_no_json_is_refused(content: bytes, tmp_path: Path) -> None:
    """Neither text of another kind nor absurd nesting ends in a traceback."""
    file = tmp_path / "bad.json"
    file.write_bytes(content)
    with pytest.raises(SystemFileError, match="not a JSON file"):
        read_system(file)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    """The operating system's reason is passed on."""
    with pytest.raises(SystemFileError, match=r"none\.json: cannot read the system file \(No such file"):
        read_system(tmp_path / "none.json")
