"""What the README and the page about simulations of one's own show is what happens."""

from __future__ import annotations

import doctest
from pathlib import Path

import pytest

pytestmark = pytest.mark.sumo

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("page", ["README.md", "docs/attach.md"])
def test_the_python_lines_run_as_printed(page: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Paths in them are relative to the repository."""
    monkeypatch.chdir(ROOT)
    found = doctest.testfile(str(ROOT / page), module_relative=False)
    assert found.attempted >= 4
    assert found.failed == 0
