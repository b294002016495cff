"""Sweep files: what they expand to, and how they are refused."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from loopgate.errors import SweepError
from loopgate.sweep import Sweep, read_sweep


def points(text: str, folder: Path) -> list[dict[str, object]]:
    file = folder / "sweep.toml"
    file.write_text(text, encoding="utf-8")
    return [dict(point.scenario) for point in read_sweep(file).points()]


def test_a_grid_is_every_combination_in_order(tmp_path: Path) -> None:
    """The last axis runs fastest; a range includes both ends."""
    text = '[base]\nnetwork = "sumo:DRT"\n[grid]\nvehicles = [5, 9]\nseed = { from = 0, to = 1 }'
    assert points(text, tmp_path) == [
        {"network": "sumo:DRT", "vehicles": n, "seed": s} for n in (5, 9) for s in (0, 1)
    ]


def test_times_are_written_as_for_a_run(tmp_path: Path) -> None:
    """With units, and the begin as a time of day; rows have seconds. What is no time is left to the run."""
    text = """
    [base]
    network = "sumo:DRT"
    duration_s = "1h30min"
    warmup = "soon"
    [grid]
    begin_s = ["0:10", 60]
    [[exclude]]
    begin_s = "0:01"
    """
    known = {"network": "sumo:DRT", "duration_s": 5400.0, "warmup": "soon"}
    assert points(text, tmp_path) == [{**known, "begin_s": 600.0}]


def test_exclude_leaves_out_and_include_adds(tmp_path: Path) -> None:
    """An exclude needs all its keys; an include runs over the axes it does not set."""
    text = """
    [grid]
    vehicles = [5, 9]
    gate = ["a", "b"]
    [[exclude]]
    vehicles = [9, 10]
    gate = "b"
    [[include]]
    vehicles = 20
    duration_s = 7
    """
    found = [tuple(p.values()) for p in points(text, tmp_path)]
    assert found == [(5, "a"), (5, "b"), (9, "a"), (20, "a", 7), (20, "b", 7)]


def test_without_a_grid_the_includes_are_the_runs(tmp_path: Path) -> None:
    """The base alone is a run only if nothing else is asked for."""
    assert points("[base]\nseed = 1\n[[include]]\nvehicles = 5", tmp_path) == [{"seed": 1, "vehicles": 5}]
    assert points("[base]\nseed = 1", tmp_path) == [{"seed": 1}]


def test_an_include_that_is_in_the_grid_already_is_one_run(tmp_path: Path) -> None:
    """Equal scenarios are one run, also when a number is written 5.0."""
    text = "[grid]\nvehicles = [5]\n[[include]]\nvehicles = 5.0"
    assert len(points(text, tmp_path)) == 1


def test_the_key_follows_the_content_of_files_and_not_their_place(tmp_path: Path) -> None:
    """Another place, the same run; another content, another run."""
    (tmp_path / "a").mkdir()
    for name, content in (("a/n.net.xml", "<net/>"), ("m.net.xml", "<net/>"), ("k.net.xml", "<net></net>")):
        (tmp_path / name).write_text(content, encoding="utf-8")
    keys = [
        Sweep("s", {"network": name}, {"seed": [1]}, folder=tmp_path).points()[0].key
        for name in ("a/n.net.xml", "m.net.xml", "k.net.xml")
    ]
    assert keys[0] == keys[1] != keys[2]


def test_the_key_is_stable() -> None:
    """Rows made by earlier versions are found again: this key must never change."""
    point = Sweep("s", {"vehicles": 5, "gate": "open"}, {"seed": [1], "rho_m": [1.25]}).points()[0]
    assert point.key == "c46e58f2b81d1b5f"


def test_the_base_can_come_from_a_scenario_file(tmp_path: Path) -> None:
    """The base goes above the scenario; paths in the scenario are relative to it."""
    (tmp_path / "s").mkdir()
    (tmp_path / "s" / "n.net.xml").write_text("<net/>", encoding="utf-8")
    (tmp_path / "s" / "base.toml").write_text(
        'network = "n.net.xml"\nseed = 1\nvehicles = 3', encoding="utf-8"
    )
    text = 'scenario = "s/base.toml"\n[base]\nvehicles = 4\n[grid]\ngate = ["a"]'
    assert points(text, tmp_path) == [
        {"network": str(tmp_path / "s" / "n.net.xml"), "seed": 1, "vehicles": 4, "gate": "a"}
    ]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("grid = 3", "grid is 3; expected a table"),
        ("[grid]\nvehicles = 3", "grid: vehicles is 3; expected a list of values, or a range"),
        ("[grid]\nseed = { from = 1 }", "a range is { from = 0, to = 4 }"),
        ("[grd]\nseed = [1]", "unknown key 'grd'; known are base, exclude"),
        ('network = "n.net.xml"', r"network is a key of a scenario; write it below \[base\]"),
        ("seed = [1, 2]", r"seed is a key of a scenario; write it below \[grid\]"),
        ("[grid]\nseed = []", "the sweep has no runs"),
        ("[grid]\nseed = [1]\n[[exclude]]\nseeds = 1", "exclude names seeds, which is no axis"),
        ('[base]\nnetwork = "no.net.xml"\n[grid]\nseed = [1]', "network no.net.xml: there is no such file"),
        ("[grid", "sweep.toml: not a TOML file"),
        ("[include]\nseed = 1\n[grid]\nseed = [1]", r"write it as \[\[include\]\]"),
        ('scenario = "no.toml"', "no.toml: cannot read the file"),
    ],
)
def test_what_means_nothing_is_refused(text: str, message: str, tmp_path: Path) -> None:
    """The error names the file or the sweep, and what was expected."""
    with pytest.raises(SweepError, match=message):
        points(text, tmp_path)


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        ({"grid": {"vehicles": 5}}, "grid: vehicles is 5; expected a list of values"),
        ({"grid": {"gate": "open"}}, "grid: gate is 'open'; expected a list of values"),
        ({"grid": None}, "grid is None; expected a table of scenario keys"),
        ({"base": None}, "base is None; expected a table of scenario keys"),
        ({"include": {"seed": 3}}, "include is {'seed': 3}; expected a list of tables"),
        ({"exclude": [5]}, "exclude is 5; expected a table of scenario keys"),
        ({"name": None}, "name is None; expected the name of a folder"),
        ({"folder": None}, "folder is None; expected a path"),
    ],
)
def test_what_python_is_given_is_checked(parts: dict[str, Any], message: str) -> None:
    """A text is no list of values: `open` would be four gates of one letter."""
    whole: dict[str, Any] = {"name": "x", "base": {"network": "sumo:DRT"}, "grid": {"seed": [1]}, **parts}
    with pytest.raises(SweepError, match=re.escape(message)):
        Sweep(**whole)


def test_python_may_give_arrays_ranges_and_paths(tmp_path: Path) -> None:
    """An array has the keys of a list; a network's path is the file whose content counts."""
    (tmp_path / "n.net.xml").write_text("<net/>", encoding="utf-8")
    base = {"network": "n.net.xml"}

    def keys(seeds: Any, network: Any = "n.net.xml") -> list[str]:  # noqa: ANN401  whatever users give
        sweep = Sweep("x", {**base, "network": network}, {"seed": seeds}, folder=str(tmp_path))  # type: ignore[arg-type]
        return [point.key for point in sweep.points()]

    asked = keys([1, 2, 3])
    for seeds in (np.arange(1, 4), range(1, 4), (1, 2, 3), {"from": 1, "to": 3}):
        assert keys(seeds) == asked
    assert keys([1, 2, 3], Path("n.net.xml")) == asked


def test_table_called_scenario_is_told_of_base(tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text('[scenario]\nnetwork = "n.net.xml"\n', encoding="utf-8")
    with pytest.raises(SweepError, match=r"expected the name of a scenario file; .* below \[base\]"):
        read_sweep(tmp_path / "s.toml")


def test_file_of_incidents_is_part_of_the_key(tmp_path: Path) -> None:
    (tmp_path / "n.net.xml").write_text("<net/>", encoding="utf-8")
    (tmp_path / "s.toml").write_text(
        '[base]\nnetwork = "n.net.xml"\nvehicles = 3\nincidents = "i.toml"\n', encoding="utf-8"
    )
    (tmp_path / "i.toml").write_text('[[closures]]\nedge = "A0A1"\nfrom = 1\nto = 9\n', encoding="utf-8")
    (before,) = read_sweep(tmp_path / "s.toml").points()
    (tmp_path / "i.toml").write_text('[[closures]]\nedge = "A0A1"\nfrom = 1\nto = 8\n', encoding="utf-8")
    (after,) = read_sweep(tmp_path / "s.toml").points()
    assert before.files["incidents"] == tmp_path / "i.toml"
    assert before.key != after.key
