"""`loopgate loops --cover`, by exit code and output."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from loopgate.cli.main import cli
from loopgate.errors import LoopgateError, RouteError
from loopgate.network import RoadNetwork, read_loops
from loopgate.network.cover.parts import search_bytes

pytestmark = pytest.mark.usefixtures("hasty")
_RUN = CliRunner()
_NET = "sumo:bs3d"
_GRID = "networks/grid5-priority.net.xml"
_SQUARE = "300,500 1300,500 1300,1500 300,1500"


def test_loops_that_cover_a_network(tmp_path: Path) -> None:
    """All that can be covered lies on some loop, inspect accepts them, and the figures are printed."""
    file, picture = tmp_path / "cover.rou.xml", tmp_path / "cover.svg"
    done = _RUN.invoke(
        cli, ["loops", _NET, "--cover", "all", "--count", "3", "-o", str(file), "--plot", str(picture)]
    )
    assert done.exit_code == 0, done.output
    assert "97 of 174 streets covered" in done.output
    assert "not covered: 56: only turning round leads on" in done.output
    assert "with 3 vehicles" in done.output
    assert picture.stat().st_size > 0
    loops = read_loops(RoadNetwork.open(_NET), file).loops
    assert len(loops) == 3
    assert len({edge for loop in loops for edge in loop.edges}) == 97
    assert _RUN.invoke(cli, ["inspect", _NET, "--routes", str(file)]).exit_code == 0


def test_vehicles_are_spread_over_loops(tmp_path: Path) -> None:
    """In proportion to laps, evenly round each; inspect finds a place for all."""
    file = tmp_path / "cover.rou.xml"
    wish = ["loops", _NET, "--cover", "all", "--count", "2", "--vehicles", "7", "--json", "-o", str(file)]
    data = json.loads(_RUN.invoke(cli, wish).stdout)
    numbers = [loop["vehicles"] for loop in data["loops"]]
    assert sorted(numbers) == [3, 4]
    read = read_loops(RoadNetwork.open(_NET), file)
    first = [vehicle for vehicle in read.vehicles if vehicle.loop.id == "loop0"]
    assert len(first) == numbers[0]
    assert len(read.vehicles) == 7
    assert first[0].depart_m is not None
    assert first[0].depart_m < 1.0
    assert _RUN.invoke(cli, ["inspect", _NET, "--routes", str(file)]).exit_code == 0


def test_as_many_vehicles_as_a_revisit_takes() -> None:
    """No street waits longer at the speeds allowed, and one vehicle fewer would not do."""
    wish = ["loops", _NET, "--cover", "all", "--revisit", "300", "--margin", "1", "--json"]
    data = json.loads(_RUN.invoke(cli, wish).stdout)
    assert max(data["intervals_s"].values()) <= 300
    (loop,) = data["loops"]
    assert (loop["vehicles"] - 1) * 300 < loop["lap_s"] <= loop["vehicles"] * 300


def test_heavy_streets_are_seen_more_often(tmp_path: Path) -> None:
    """A street of weight 3 within a third of the time, on a loop of its own."""
    (tmp_path / "weights").write_text("# a school\n-25363135#1 3\n", encoding="utf-8")
    wish = ["loops", _NET, "--cover", "all", "--revisit", "600", "--margin", "1", "--json"]
    data = json.loads(_RUN.invoke(cli, [*wish, "--weights", str(tmp_path / "weights")]).stdout)
    assert [cover["weight"] for cover in data["covers"]] == [3.0, 1.0]
    assert data["intervals_s"]["-25363135#1"] <= 200


def test_streets_from_a_file_and_in_a_polygon(tmp_path: Path) -> None:
    """Names, a netedit selection, a polygon, and a file with one come to what they name."""
    (tmp_path / "edges").write_text("edge:-25363135#1\n", encoding="utf-8")
    data = json.loads(_RUN.invoke(cli, ["loops", _NET, "--cover", str(tmp_path / "edges"), "--json"]).stdout)
    assert data["covers"][0]["streets"] == data["covers"][0]["covered"] == 1
    assert "-25363135#1" in data["loops"][0]["edges"]
    inside = json.loads(_RUN.invoke(cli, ["loops", _NET, "--cover", _SQUARE, "--json"]).stdout)
    poly = f'<additional><poly id="p" shape="{_SQUARE}"/></additional>'
    (tmp_path / "area.xml").write_text(poly, encoding="utf-8")
    same = json.loads(
        _RUN.invoke(cli, ["loops", _NET, "--cover", str(tmp_path / "area.xml"), "--json"]).stdout
    )
    assert same == inside
    assert 0 < inside["covers"][0]["streets"] < 174


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (
            ["--cover", "nowhere.txt"],
            "'nowhere.txt': no such file, and no edge or street nowhere.txt open to passenger in sumo:bs3d",
        ),
        (["--cover", "1,2 3,4"], "expected at least three corners"),
        (["--cover", "0,0 1e308,0 0,-1e308"], "expected at least three corners"),
        (["--cover", "0,0 0.1,0 0,0.1"], "no edge of sumo:bs3d open to passenger has its middle inside"),
        (
            ["--cover", "all", "--count", "4", "--vehicles", "3"],
            "3 are too few: each of the 4 loops needs one; take --count 3",
        ),
        (["--cover", "all", "--max-length", "5"], "its shortest closed walk is longer than asked for"),
        (["--cover", "all", "--start", "nosuch"], "no edge or street nosuch open to passenger in sumo:bs3d"),
        (["--cover", "all", "--vclass", "nosuch"], "vehicle class 'nosuch': SUMO has aircraft, army"),
    ],
)
def test_bad_wishes_are_one_line(options: list[str], says: str) -> None:
    """An error of the package, which the command line prints with exit code 2."""
    done = _RUN.invoke(cli, ["loops", _NET, *options])
    assert isinstance(done.exception, LoopgateError)
    assert says in str(done.exception)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--cover", "all", "--length", "4:9"], "--length belongs to random loops, not to --cover"),
        (["--revisit", "600"], "--revisit belongs to --cover"),
        (
            ["--cover", "all", "--revisit", "600", "--vehicles", "4"],
            "both set the number of vehicles; leave one out",
        ),
    ],
)
def test_options_that_do_not_go_together(options: list[str], says: str) -> None:
    """Are refused before anything is read."""
    done = _RUN.invoke(cli, ["loops", _NET, *options])
    assert done.exit_code == 2
    assert says in done.output


@pytest.mark.parametrize(
    "line", ["-25363135#1", "-25363135#1 0.5", "-25363135#1 nan", "-25363135#1 2 3", "x 2"]
)
def test_bad_weights_name_file_and_line(tmp_path: Path, line: str) -> None:
    """No weight, too small, no number, too many words, no such edge."""
    (tmp_path / "weights").write_text(line, encoding="utf-8")
    done = _RUN.invoke(cli, ["loops", _NET, "--cover", "all", "--weights", str(tmp_path / "weights")])
    assert isinstance(done.exception, LoopgateError)
    assert str(tmp_path / "weights") in str(done.exception)


def test_an_interruption_takes_the_best_so_far(monkeypatch: pytest.MonkeyPatch) -> None:
    """After the first plan Ctrl-C: loops are written all the same, and it is said."""

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("loopgate.network.cover.search._moved", interrupted)
    done = _RUN.invoke(cli, ["loops", _NET, "--cover", "all", "--count", "2"])
    assert done.exit_code == 0
    assert "interrupted: these are the best loops found so far" in done.stderr
    assert done.stdout.count("<route ") == 2


def test_what_takes_too_much_memory_is_refused_with_the_way_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Before anything is searched; in parts it goes on."""
    monkeypatch.setattr("loopgate.cli.cover_loops.MOST_BYTES", search_bytes(50))
    monkeypatch.setattr("loopgate.cli.cover_loops.MOST_STREETS", 40)
    monkeypatch.setattr("loopgate.cli.cover_loops.cover_streets", None)
    with pytest.raises(RouteError, match="--count 2 or more covers them part by part"):
        _RUN.invoke(cli, ["loops", _GRID, "--cover", "all"], catch_exceptions=False)
