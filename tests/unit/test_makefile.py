"""The targets of the Makefile."""

from __future__ import annotations

import re
from pathlib import Path

TEXT = (Path(__file__).resolve().parents[2] / "Makefile").read_text(encoding="utf-8")


def test_each_target_is_there_once() -> None:
    """Of two of one name make runs the last, with no more than a warning."""
    targets = re.findall(r"^([a-z-]+):", TEXT, re.MULTILINE)
    assert len(targets) == len(set(targets))


def test_no_target_is_taken_for_a_file() -> None:
    """All are phony: a folder of the same name would keep one from being made."""
    targets = set(re.findall(r"^([a-z-]+):", TEXT, re.MULTILINE))
    phony = re.search(r"^\.PHONY: (.*)$", TEXT, re.MULTILINE)
    assert phony is not None
    assert set(phony[1].split()) == targets
