"""What docs/sweeps.md shows is what there is."""

import tomllib
from pathlib import Path

import pytest

import loopgate
import loopgate.analysis
from loopgate.sweep import read_sweep

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "sweeps.md").read_text(encoding="utf-8")


def test_the_sweep_shown_is_the_one_that_is_there() -> None:
    """The block in the page and the file in analysis/ say the same, and it is 18 runs."""
    shown = PAGE.split('```toml title="analysis/first_sweep.toml"\n')[1].split("```")[0]
    file = ROOT / "analysis" / "first_sweep.toml"
    assert tomllib.loads(shown) == tomllib.loads(file.read_text(encoding="utf-8"))
    assert len(read_sweep(file).points()) == 18


@pytest.mark.parametrize(("name", "runs"), [("sweep_grid.toml", 105), ("sweep_drt.toml", 30)])
def test_the_sweeps_in_analysis_are_valid(name: str, runs: int) -> None:
    """Their networks are there, their keys known to a scenario."""
    points = read_sweep(ROOT / "analysis" / name).points()
    assert len(points) == runs
    loopgate.Scenario.from_dict(points[0].scenario)


def test_every_function_is_explained() -> None:
    """A function that is added to the analysis has to be written up."""
    named = {word for word in PAGE.split("`") if word.startswith("compute_") and word.isidentifier()}
    assert named == {name for name in loopgate.analysis.__all__ if name.startswith("compute_")}
