"""`loopgate loops --cover` for shifts: what is left, longest shifts, depots."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from loopgate import Scenario, run
from loopgate.cli.main import cli
from loopgate.errors import LoopgateError

_RUN = CliRunner()
_GRID = "networks/grid5-priority.net.xml"
_CORNER = "-9,-9 209,-9 209,209 -9,209"


def made(*options: str) -> dict[str, list[dict[str, float]]]:
    done = _RUN.invoke(cli, ["loops", _GRID, "--cover", _CORNER, "--json", *options], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    data: dict[str, list[dict[str, float]]] = json.loads(done.stdout)
    return data


def covered(data: dict[str, list[dict[str, float]]]) -> float:
    return sum(cover["streets"] for cover in data["covers"])


@pytest.mark.usefixtures("hasty")
def test_driven_streets_are_left_out(tmp_path: Path) -> None:
    """One direction of a street does not stand for the other, but with --either-way it does."""
    (tmp_path / "driven").write_text("A0A1\nA0B0\n", encoding="utf-8")
    wish = ("--driven", str(tmp_path / "driven"))
    assert covered(made()) - covered(made(*wish)) == 2
    assert covered(made("--either-way")) - covered(made("--either-way", *wish)) == 4


def test_driven_streets_of_a_run(tmp_path: Path) -> None:
    """The streets that its vehicles visited."""
    ring = "networks/ring3.net.xml"
    ran = run(
        Scenario(network=ring, routes="routes/ring3.rou.xml", gate="open", duration_s=20), tmp_path / "run"
    )
    assert ran.streets is not None
    wish = ["loops", ring, "--cover", "all", "--driven", str(tmp_path / "run"), "--json"]
    data = json.loads(_RUN.invoke(cli, wish, catch_exceptions=False).stdout)
    assert covered(data) == (ran.streets["visits"] == 0).sum() > 0
    done = _RUN.invoke(cli, ["loops", _GRID, "--cover", "all", "--driven", str(tmp_path / "run")])
    assert isinstance(done.exception, LoopgateError)
    assert "the run was on another network" in str(done.exception)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--driven", "nosuch"], "--driven nosuch: no such file"),
        (["--driven", "-9,-9 999,-9 999,999 -9,999"], "every street to be covered was driven already"),
        (["--start", "A0A1,nosuch"], "no edge or street nosuch open to passenger in"),
    ],
)
def test_bad_wishes_are_one_line(options: list[str], says: str) -> None:
    """An error of the package, which the command line prints with exit code 2."""
    done = _RUN.invoke(cli, ["loops", _GRID, "--cover", _CORNER, *options])
    assert isinstance(done.exception, LoopgateError)
    assert says in str(done.exception).replace("'nosuch'", "nosuch")


@pytest.mark.parametrize(
    "options", [["--shift", "5"], ["--cover", "all", "--shift", "5", "--max-length", "900"]]
)
def test_options_that_do_not_go_together(options: list[str]) -> None:
    """Are refused before anything is read."""
    assert _RUN.invoke(cli, ["loops", _GRID, *options]).exit_code == 2


def test_no_loop_takes_longer_than_a_shift() -> None:
    """Two minutes where laps take 1.5 times as long as at the speed limits are 80 s."""
    short = made("--shift", "2", "--margin", "1.5")
    assert max(loop["lap_s"] for loop in short["loops"]) <= 80
    assert len(short["loops"]) > len(made("--shift", "20")["loops"]) == 1


def test_every_loop_passes_a_depot_and_is_not_too_long() -> None:
    """The nearer of two, also where the way to it costs another loop."""
    data = made("--start", "A0A1,C2C1", "--max-length", "900")
    assert all({"A0A1", "C2C1"} & set(loop["edges"]) for loop in data["loops"])  # type: ignore[call-overload]
    assert max(loop["length_m"] for loop in data["loops"]) <= 900
    assert data["warnings"] == []
