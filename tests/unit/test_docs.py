"""The pages under docs/ name what there is."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import pictures  # in analysis/
import pytest

from loopgate.gates import Reason, gate_names
from loopgate.results import columns
from loopgate.simulation.scenario import Scenario

DOCS = Path(__file__).resolve().parents[2] / "docs"


def coded(page: str) -> set[str]:
    """Return what a page sets in code, in its words."""
    text = re.sub(
        r"^```.*?^```$", "", (DOCS / page).read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE
    )
    return set(re.findall(r"`([^`]+)`", text))


@pytest.mark.parametrize("table", ["EVENT_COLUMNS", "VEHICLE_COLUMNS", "EDGE_COLUMNS"])
def test_every_column_is_explained(table: str) -> None:
    """A column that is added has to be written up."""
    assert set(getattr(columns, table)) <= coded("formats.md")


def test_every_scenario_key_is_explained() -> None:
    """So has a key."""
    assert {field.name for field in dataclasses.fields(Scenario)} <= coded("formats.md")


def test_every_event_is_explained() -> None:
    """So has an event."""
    assert {str(e) for e in columns.Event} <= coded("formats.md")


def test_every_gate_and_reason_is_explained() -> None:
    """So have the gates of this package and their reasons."""
    assert set(gate_names()) | {str(r) for r in Reason} <= coded("gates.md")


@pytest.mark.parametrize("name", sorted(pictures.PICTURES))
def test_pictures_are_those_that_their_script_draws(name: str, tmp_path: Path) -> None:
    """`make pictures` changes nothing."""
    pictures.PICTURES[name]().write(tmp_path / name)
    assert (tmp_path / name).read_bytes() == (DOCS / "images" / name).read_bytes()


def test_links_lead_somewhere() -> None:
    """Pages that are linked exist."""
    for page in DOCS.rglob("*.md"):
        for target in re.findall(r"\]\(([^)#]+)\)", page.read_text(encoding="utf-8")):
            assert "://" in target or (page.parent / target).exists(), f"{page.name}: {target}"
