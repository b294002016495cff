"""What the README shows is what happens."""

from __future__ import annotations

import doctest
from pathlib import Path

import pytest

pytestmark = pytest.mark.sumo

ROOT = Path(__file__).resolve().parents[2]


def test_the_python_lines_run_as_printed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Paths in them are relative to the repository."""
    monkeypatch.chdir(ROOT)
    found = doctest.testfile(str(ROOT / "README.md"), module_relative=False)
    assert found.attempted >= 4
    assert found.failed == 0
