"""Sweeps over gates of a user's own: they travel, and their content tells runs apart."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from loopgate.errors import SweepError
from loopgate.gates.collision import CollisionGate
from loopgate.runs.results import read_results
from loopgate.sweep import Sweep, run_sweep

GATE = "from loopgate.gates.collision import CollisionGate\nclass Mine(CollisionGate):\n    {}\n"


class AtHand(CollisionGate):
    """A gate of this file."""


def points(folder: Path, **base: Any) -> dict[str, Any]:  # noqa: ANN401  scenario values
    """Return the keys of a sweep over two gates, by gate."""
    sweep = Sweep("s", {"network": "sumo:DRT", **base}, {"gate": ["open", "mine.py:Mine"]}, folder=folder)
    return {point.scenario["gate"]: point.key for point in sweep.points()}


def test_the_content_of_the_file_makes_the_run(tmp_path: Path) -> None:
    """Moved, it is the same run; changed, or with another option, it is another. Other gates are unmoved."""
    here, there = tmp_path / "here", tmp_path / "there"
    for folder in (here, there):
        folder.mkdir()
        (folder / "mine.py").write_text(GATE.format("x = 1"))
    before = points(here)
    assert points(there) == before
    (there / "mine.py").write_text(GATE.format("x = 2"))
    after = points(there)
    assert after["open"] == before["open"]
    assert after["mine.py:Mine"] != before["mine.py:Mine"]


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    """Before anything runs."""
    with pytest.raises(SweepError, match=r"gate mine\.py: there is no such file"):
        points(tmp_path)


def test_classes_are_named_by_their_files() -> None:
    """In the base, the grid and the includes alike."""
    sweep = Sweep(
        "s", {"network": "sumo:DRT"}, {"gate": ["open", AtHand]}, include=[{"gate": AtHand, "seed": 9}]
    )
    names = {Path(point.scenario["gate"]).name for point in sweep.points()}
    assert names == {"open", f"{Path(__file__).name}:AtHand"}


def test_what_stands_in_no_file_cannot_travel() -> None:
    """Workers are other processes."""
    with pytest.raises(SweepError, match="it stands in no Python file, so other processes cannot have it"):
        Sweep("s", {"network": "sumo:DRT"}, {"gate": [partial(CollisionGate)]})


def test_the_file_travels_with_the_run(
    fake_runner: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A worker elsewhere gets a copy of the file; the row says what was asked for."""
    (tmp_path / "mine.py").write_text(GATE.format("x = 1"))
    runner = tmp_path / "runner.py"
    runner.write_text(
        f"from loopgate.sweep.task import load_runner\nfake = load_runner({fake_runner!r})\n"
        "from pathlib import Path\n"
        "def run(scenario, out):\n"
        "    file, name = scenario['gate'].split(':')\n"
        "    assert name == 'Mine' and 'x = 1' in Path(file).read_text()\n"
        "    fake(scenario, out)\n"
    )
    base = {"network": "sumo:DRT", "vehicles": 5, "gate": "mine.py:Mine"}
    sweep = Sweep("s", base, {"seed": [1]}, folder=tmp_path)
    monkeypatch.setattr("loopgate.sweep.task.content_identity", lambda _: "elsewhere")
    with ThreadPoolExecutor(1) as pool:
        run_sweep(sweep, tmp_path / "r", executor=pool, runner=f"{runner}:run")
    row = read_results(tmp_path / "r").runs.iloc[0]
    assert (row["status"], row["error"], row["gate"]) == ("ok", "", "mine.py:Mine")
