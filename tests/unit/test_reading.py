"""Reading files: every fault of theirs is one line, and values are shown on one."""

import codecs
from pathlib import Path

import pytest

from loopgate import Scenario
from loopgate.errors import LoopgateError, ResultsError, ScenarioError, SystemFileError, SystemModelError
from loopgate.network import RoadNetwork, VehicleDemand
from loopgate.network.cover.wishes import read_streets, read_weights
from loopgate.network.route_lanes import make_route
from loopgate.network.vehicle_type import DEFAULT_TYPE
from loopgate.reading import is_file, is_plain, read_json, read_object, read_toml, refusing, shown
from loopgate.simulation.demand.apart import choose_gated


def test_whatever_is_raised_becomes_the_readers_error() -> None:
    """Errors of the package get the name of the file; those of the reader stay as they are."""
    for problem in (
        KeyError("x"),
        RecursionError("deep"),
        MemoryError(),
        OSError("odd"),
        UnicodeError("bad"),
    ):
        with pytest.raises(ResultsError, match=r"^f\.x: no readable table \(") as error, _reading(problem):
            pass
        assert error.value.__cause__ is problem
    with pytest.raises(ResultsError, match=r"^f\.x: robot r: no$"), _reading(SystemModelError("robot r: no")):
        pass
    with pytest.raises(ResultsError, match=r"^as it is$"), _reading(ResultsError("as it is")):
        pass
    missing = FileNotFoundError(2, "No such file")
    with (
        pytest.raises(ResultsError, match=r"^f\.x: cannot read the table \(No such file\)$"),
        _reading(missing),
    ):
        pass


class _reading:  # noqa: N801  used like a function
    """Raises a problem inside `refusing`."""

    def __init__(self, problem: Exception) -> None:
        self._problem = problem

    def __enter__(self) -> None:
        with refusing("f.x", "table", ResultsError):
            raise self._problem

    def __exit__(self, *exception: object) -> None:
        raise AssertionError


@pytest.mark.parametrize("content", [b"\xff", b"[" * 10**5, b"9" * 5000, b"", b"{"])
def test_what_is_no_json(tmp_path: Path, content: bytes) -> None:
    """No text, nested without end, a number of five thousand digits."""
    (tmp_path / "f").write_bytes(content)
    with pytest.raises(SystemFileError, match=r"f: not a JSON file \("):
        read_json(tmp_path / "f", "system file", SystemFileError)


def test_objects_only(tmp_path: Path) -> None:
    """A list where an object is expected is shown."""
    (tmp_path / "f").write_text("[1]")
    with pytest.raises(ResultsError, match=r"f: no summary: it holds \[1\]; expected a JSON object"):
        read_object(tmp_path / "f", "summary", ResultsError)


def test_files_that_are_too_large_are_not_read(tmp_path: Path) -> None:
    """TOML of megabytes would take minutes."""
    with (tmp_path / "f").open("wb") as file:
        file.truncate(4_000_001)
    with pytest.raises(SystemFileError, match="larger than 4 MB, which no scenario should be"):
        read_toml(tmp_path / "f", "scenario", SystemFileError)


def test_values_are_shown_on_one_line() -> None:
    """Long ones are cut; what Python cannot write is named by its type."""
    assert shown("a\nb") == r"'a\nb'"
    assert len(shown("x" * 1000)) == 80
    assert shown(10**5000) == "a value of type int too long to be shown"
    deep: list[object] = []
    for _ in range(100_000):
        deep = [deep]
    assert "list" in shown(deep)


def test_names_of_files() -> None:
    """What cannot be the name of a file is the name of none."""
    assert not any(is_file(name) for name in ("x" * 5000, "\x00", "/no/where"))
    assert is_file(__file__)
    assert is_plain("Straße 4")
    assert not any(map(is_plain, ("\x00", "a\nb", "\u2028", "\ud800")))


def test_errors_are_one_line_whatever_is_in_them() -> None:
    """Line ends become spaces, control characters are spelled out, lists without end are cut."""
    assert str(LoopgateError("a\nb\x00\ud800")) == r"a b\x00\ud800"
    assert len(str(LoopgateError("x" * 10**6))) < 2000


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-be-bom"])
def test_byte_order_marks_are_no_text(tmp_path: Path, encoding: str) -> None:
    """Editors write them; every text file that a person writes is read without."""

    def write(name: str, text: str) -> Path:
        file = tmp_path / name
        mark = codecs.BOM_UTF16_BE if encoding == "utf-16-be-bom" else b""
        file.write_bytes(mark + text.replace("\n", "\r\n").encode(encoding.removesuffix("-bom")))
        return file

    assert read_toml(write("a.toml", "a = 1\n"), "scenario", ScenarioError) == {"a": 1}
    assert read_json(write("a.json", "[1]\n"), "system", ScenarioError) == [1]
    network = RoadNetwork.open("networks/grid5-priority.net.xml")
    streets = str(write("streets.txt", "A0A1\nA1A2\n"))
    assert read_streets(network, streets, "passenger", option="--cover") == ("A0A1", "A1A2")
    assert read_weights(network, str(write("weights.txt", "A0A1 2\n"))) == {"A0A1": 2.0}
    way = make_route(network, "a", ("A0A1", "A1A2"), vclass="passenger")
    mine = [VehicleDemand("late", way, DEFAULT_TYPE)]
    who = str(write("who.txt", "late\n"))
    assert choose_gated(Scenario(network="n", loops=1, who=who), mine) == (mine, [], ())


def test_a_file_that_another_names_is_named(tmp_path: Path) -> None:
    """The configuration is there; what it names is not."""
    file = tmp_path / "c.sumocfg"
    with (
        pytest.raises(ResultsError, match=r"c\.sumocfg: .*no\.rou\.xml: cannot read the route file"),
        refusing(file, "route file", ResultsError),
    ):
        (tmp_path / "no.rou.xml").read_bytes()
