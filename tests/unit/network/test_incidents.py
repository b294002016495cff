"""Files of closures and breakdowns."""

from __future__ import annotations

import math
from copy import copy
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import pytest

from loopgate.errors import RouteError, ScenarioError
from loopgate.network import RoadNetwork
from loopgate.network.cover.wishes import read_streets, read_weights
from loopgate.network.incidents import Breakdown, Closure, read_incidents

NETWORK = RoadNetwork.open(Path(__file__).resolve().parents[3] / "networks/ring3.net.xml")


def written(folder: Path, text: str) -> Path:
    """Return a file with this text."""
    file = folder / "incidents.toml"
    file.write_text(text, encoding="utf-8")
    return file


def test_what_is_written_is_read(tmp_path: Path) -> None:
    """An edge, a lane, a vehicle; times in seconds or with colons; without an end to the end."""
    file = written(
        tmp_path,
        '[[closures]]\nedge = "s1"\nfrom = 60\nto = "0:02:00"\n[[closures]]\nlane = "s2_0"\nfrom = 0\n'
        '[[breakdowns]]\nvehicle = "a"\nfrom = 5\nto = 6.5\n',
    )
    found = read_incidents(NETWORK, file, {"a", "b"})
    assert found.closures == (Closure("s1", "", 60.0, 120.0), Closure("s2", "s2_0", 0.0, math.inf))
    assert found.breakdowns == (Breakdown("a", 5.0, 6.5),)
    assert [one.edge for one in found.closed_at(119.0)] == ["s1", "s2"]
    assert [one.edge for one in found.closed_at(120.0)] == ["s2"]
    assert (found.broken_at(4.9), found.broken_at(5.0)) == ([], [Breakdown("a", 5.0, 6.5)])


def test_a_street_by_its_name_closes_all_its_edges(tmp_path: Path) -> None:
    """In any case of letters; a street under ``edge`` and a misspelt street are told."""
    network = copy(NETWORK)
    network.edges = MappingProxyType(
        {
            name: replace(edge, street="Long Lane" if name in {"s1", "s2"} else "")
            for name, edge in NETWORK.edges.items()
        }
    )
    file = written(tmp_path, '[[closures]]\nstreet = "long lane"\nfrom = 60\n')
    assert [one.edge for one in read_incidents(network, file, set()).closures] == ["s1", "s2"]
    file = written(tmp_path, '[[closures]]\nedge = "Long Lane"\nfrom = 60\n')
    with pytest.raises(ScenarioError, match='a street has this name: write street = "Long Lane"'):
        read_incidents(network, file, set())
    file = written(tmp_path, '[[closures]]\nstreet = "Long Line"\nfrom = 60\n')
    with pytest.raises(ScenarioError, match="did you mean 'Long Lane'"):
        read_incidents(network, file, set())
    assert read_streets(network, "long lane", "passenger", option="--avoid") == ("s1", "s2")
    assert len(read_streets(network, "s3, Long Lane", "passenger", option="--via", u_turns=True)) == 2
    names = tmp_path / "streets.txt"
    names.write_text("Long Lane\nedge:s3\njunction:j1\n", encoding="utf-8")
    assert read_streets(network, str(names), "passenger", option="--cover") == ("s1", "s2", "s3")
    names.write_text("# market days\nLong Lane 3\n", encoding="utf-8")
    assert read_weights(network, str(names)) == {"s1": 3.0, "s2": 3.0}
    names.write_text(names.read_text(encoding="utf-8") + "\ns1 3\ns1 5\n", encoding="utf-8")
    with pytest.raises(RouteError, match=r"s1 has the weight 3 already"):
        read_weights(network, str(names))
    with pytest.raises(
        RouteError, match=r"no edge or street Long Line open to passenger .* did you mean 'Long Lane'"
    ):
        read_streets(network, "Long Line", "passenger", option="--via")


def test_a_street_that_a_class_may_not_use_is_not_offered_for_itself() -> None:
    """The message says that it is closed; streets like it are meant only where they are open."""
    network = copy(NETWORK)
    lanes = tuple(replace(lane, allowed=frozenset({"pedestrian"})) for lane in NETWORK.edges["s1"].lanes)
    edges = {"s1": replace(NETWORK.edges["s1"], street="Steps", lanes=lanes)}
    network.edges = MappingProxyType({**NETWORK.edges, **edges})
    with pytest.raises(RouteError, match=r"'Steps': street Steps of .* is closed to bus") as error:
        read_streets(network, "Steps", "bus", option="--via")
    assert "did you mean" not in str(error.value)


def test_a_closure_begins_at_a_time_of_day(tmp_path: Path) -> None:
    """Two parts are hours and minutes, as on a clock."""
    file = written(tmp_path, '[[closures]]\nedge = "s1"\nfrom = "10:00"\nto = "11:30"\n')
    assert read_incidents(NETWORK, file, set()).closures == (Closure("s1", "", 36000.0, 41400.0),)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('[[closures]]\nedge = "nowhere"\nfrom = 0', "closures 1: edge is 'nowhere', which is no edge of"),
        ('[[closures]]\nlane = "s1_7"\nfrom = 0', "closures 1: lane is 's1_7', which is no lane of"),
        (
            '[[closures]]\nedge = "s1"\nlane = "s1_0"\nfrom = 0',
            "give the edge or the street that is closed, or one lane",
        ),
        ('[[closures]]\nedge = "s1"', "the key 'from' is missing; expected h:m, h:m:s or seconds"),
        ('[[closures]]\nedge = "s1"\nfrom = -60', "from is -60; expected h:m, h:m:s or seconds, from 0 on"),
        (
            "[[breakdowns]]\nfrom = 9",
            "the key 'vehicle' is missing; expected the name of a vehicle on a loop",
        ),
        ('[[closures]]\nedge = "s1"\nfrom = "10.00 h"', "from is '10.00 h'; expected h:m, h:m:s or seconds"),
        ('[[closures]]\nedge = "s1"\nfrom = 9\nto = 3', "it ends at 3 s, but begins at 9 s"),
        ('[[closures]]\nedge = "s1"\nfrom = 9\nwhy = "works"', "why"),
        ('[[breakdowns]]\nvehicle = "c"\nfrom = 9', "expected the name of a vehicle on a loop, as a, b"),
        ("closures = 3", "expected tables [[closures]]"),
        ('[[closed]]\nedge = "s1"', "closed"),
        ("[[", "not a TOML file"),
    ],
)
def test_whatever_is_wrong_is_said(tmp_path: Path, text: str, said: str) -> None:
    """In one line, which names the file and the entry."""
    file = written(tmp_path, text)
    with pytest.raises(ScenarioError) as error:
        read_incidents(NETWORK, file, {"a", "b"})
    assert said in str(error.value)
    assert str(file) in str(error.value)
    assert "\n" not in str(error.value)
