"""What a process keeps: by content, a few results, and never an error."""

from __future__ import annotations

import gc
import shutil
from collections import OrderedDict
from contextlib import suppress
from pathlib import Path

import pytest

from loopgate.cache import Cache, frozen_objects, without_collection
from loopgate.errors import NetworkError
from loopgate.network import RoadNetwork, find_loops, read_loops, road, write_loops

NETWORKS = Path(__file__).parents[2] / "networks"


@pytest.fixture
def readings(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the files that are parsed from now on, with nothing kept so far."""
    read, files = road._parse, list[str]()

    def noting(file: Path) -> object:
        files.append(file.name)
        return read(file)

    monkeypatch.setattr(road, "_parse", noting)
    monkeypatch.setattr(road, "_KEPT", Cache(2))
    return files


def test_the_oldest_goes_first_and_errors_are_not_kept() -> None:
    """What was asked for again counts as new; a failure is tried again."""
    kept: Cache[int] = Cache(2)
    made = []

    def make(key: int) -> int:
        made.append(key)
        return 1 // key

    for key in (1, 2, 1, 3, 1, 2):
        kept.get(key, lambda key=key: make(key))  # type: ignore[misc]
    assert made == [1, 2, 3, 2]
    for _ in range(2):
        with pytest.raises(ZeroDivisionError):
            kept.get(0, lambda: make(0))
    assert made == [1, 2, 3, 2, 0, 0]


def test_a_sweep_over_several_networks_reads_each_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Run after run, in whatever order they come."""
    monkeypatch.setattr(road._KEPT, "_results", OrderedDict())
    names = [f"{name}.net.xml" for name in ("ring3", "order2", "grid5-priority", "grid5-all-way-stop")]
    edges = [[RoadNetwork.open(str(NETWORKS / name)).edges for name in names] for _ in range(2)]
    assert all(one is other for one, other in zip(*edges, strict=True))


def test_the_collector_rests_only_meanwhile() -> None:
    """Also where what is done fails."""
    seen = []
    with suppress(KeyError), without_collection():
        seen.append(gc.isenabled())
        raise KeyError
    assert [*seen, gc.isenabled()] == [False, True]


def test_a_network_is_read_once_wherever_it_lies(readings: list[str], tmp_path: Path) -> None:
    """A copy of the file has the same roads, under its own name."""
    here, there = NETWORKS / "ring3.net.xml", tmp_path / "copy.net.xml"
    shutil.copy(here, there)
    one, other = RoadNetwork.open(here), RoadNetwork.open(there)
    assert readings == ["ring3.net.xml"]
    assert (one.file, other.file) == (here, there)
    assert (one.name, other.name) == (str(here), str(there))
    assert other.edges is one.edges


def test_a_network_that_changes_is_read_again(readings: list[str], tmp_path: Path) -> None:
    """The name says nothing; what is found broken is refused each time."""
    file = tmp_path / "n.net.xml"
    for name in ("ring3", "order2"):
        shutil.copy(NETWORKS / f"{name}.net.xml", file)
        assert (
            RoadNetwork.open(file).edges.keys() == RoadNetwork.open(NETWORKS / f"{name}.net.xml").edges.keys()
        )
    assert readings == ["n.net.xml", "n.net.xml"]
    file.write_text("<net/>")
    for _ in range(2):
        with pytest.raises(NetworkError, match=r"n\.net\.xml: not a SUMO network"):
            RoadNetwork.open(file)


def test_loops_of_a_file_that_changes_are_read_again(tmp_path: Path) -> None:
    """Loops belong to the content of their file and of the network."""
    network = RoadNetwork.open("sumo:bs3d")
    loops = find_loops(network, 3).loops
    file = tmp_path / "r.rou.xml"
    write_loops(loops[:1], file)
    assert read_loops(network, file) is read_loops(network, file)
    write_loops(loops, file)
    assert len(read_loops(network, file).loops) == 3


def test_what_exists_is_passed_over_by_the_collector_only_meanwhile() -> None:
    before = gc.get_freeze_count()
    with frozen_objects():
        inside = gc.get_freeze_count()
        with frozen_objects():  # as in a run in an owner's own simulation
            assert gc.get_freeze_count() == inside
        assert gc.get_freeze_count() == inside > before
    assert gc.get_freeze_count() == before
