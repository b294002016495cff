"""`loopgate loops --cover` for cities: sides of the street, districts with depots."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from loopgate.cli.main import cli
from loopgate.errors import LoopgateError

_RUN = CliRunner()
_GRID = "networks/grid5-priority.net.xml"
_CORNER = "-9,-9 209,-9 209,209 -9,209"


@pytest.fixture
def districts(tmp_path: Path) -> str:
    """Return a file with two districts, the left and the right column of blocks."""
    file = tmp_path / "districts.xml"
    file.write_text(
        '<additional><poly id="west end" shape="-9,-9 109,-9 109,209 -9,209"/>'
        '<poly id="east" shape="290,-9 409,-9 409,209 290,209"/></additional>',
        encoding="utf-8",
    )
    return str(file)


def made(*options: str) -> dict[str, list[dict[str, Any]]]:
    done = _RUN.invoke(cli, ["loops", _GRID, "--json", *options], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    data: dict[str, list[dict[str, Any]]] = json.loads(done.stdout)
    return data


def driven(data: dict[str, list[dict[str, Any]]]) -> set[str]:
    return {edge for loop in data["loops"] for edge in loop["edges"]}


def test_both_sides_of_a_street_are_driven_where_asked_for() -> None:
    """With one direction enough elsewhere; without the option one direction is not driven."""
    sides = {"A0B0", "B0A0", "B1C1", "C1B1"}
    either = made("--cover", _CORNER, "--either-way")
    assert not sides <= driven(either)
    both = made("--cover", _CORNER, "--either-way", "--both-sides", "A0B0,B0A0,B1C1")
    assert sides <= driven(both)
    assert either["covers"][0]["least_in_all"] < both["covers"][0]["least_in_all"]


def test_a_driven_side_does_not_stand_for_the_other_where_both_are_asked_for(tmp_path: Path) -> None:
    """Else it does."""
    (tmp_path / "driven").write_text("A0B0\n", encoding="utf-8")
    wish = ("--cover", _CORNER, "--either-way", "--driven", str(tmp_path / "driven"))
    left, both = made(*wish), made(*wish, "--both-sides", "A0B0")
    assert both["covers"][0]["streets"] - left["covers"][0]["streets"] == 1


def test_each_district_has_loops_through_its_own_depot(districts: str) -> None:
    """They bear its name."""
    data = made("--cover", "all", "--by-district", districts, "--start", "A0A1,E0E1", "--count", "4")
    assert [cover["district"] for cover in data["covers"]] == ["west end", "east"]
    for name, depot in (("west_end", "A0A1"), ("east", "E0E1")):
        loops = [loop for loop in data["loops"] if loop["id"].startswith(f"{name}.")]
        assert loops
        assert all(depot in loop["edges"] for loop in loops)
    assert len(data["loops"]) == 4


def test_streets_outside_of_all_districts_are_told(districts: str) -> None:
    """Their number; the grid has 80 streets in all."""
    done = _RUN.invoke(cli, ["loops", _GRID, "--cover", "all", "--by-district", districts, "--json"])
    data = json.loads(done.stdout)
    inside = sum(cover["streets"] for cover in data["covers"])
    assert f"{80 - inside} streets in no district: not covered" in done.stderr


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--start", "A0A1"], "no depot of --start lies in east"),
        (["--cover", "C2C3,C3C2"], "no street to be covered lies in any district"),
    ],
)
def test_bad_districts_are_one_line(districts: str, options: list[str], says: str) -> None:
    """An error of the package, which the command line prints with exit code 2."""
    done = _RUN.invoke(cli, ["loops", _GRID, "--cover", "all", "--by-district", districts, *options])
    assert isinstance(done.exception, LoopgateError)
    assert says in str(done.exception)


@pytest.mark.parametrize("options", [["--cover", "all", "--both-sides", "A0A1"], ["--by-district", "x.xml"]])
def test_options_that_do_not_go_together(options: list[str]) -> None:
    """Are refused before anything is read."""
    assert _RUN.invoke(cli, ["loops", _GRID, *options]).exit_code == 2
