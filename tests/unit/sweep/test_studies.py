"""The sweeps of the studies can be read, and each consists of runs."""

from __future__ import annotations

from pathlib import Path

import pytest

from loopgate.sweep import read_sweep

STUDIES = sorted((Path(__file__).resolve().parents[3] / "analysis").glob("*.toml"))


@pytest.mark.parametrize("file", STUDIES, ids=lambda file: file.stem)
def test_a_study_expands_to_runs(file: Path) -> None:
    """A key said twice, an unknown key or an empty grid is found before anybody starts the study."""
    assert read_sweep(file).points()
