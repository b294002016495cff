"""The pages under docs/ name what there is."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Sequence
from pathlib import Path

import docs_pages  # in analysis/
import pictures
import pytest

from loopgate.gates import Reason, gate_names
from loopgate.results import columns
from loopgate.results.figures import FIGURES
from loopgate.results.row_schema import ROW_SCHEMA
from loopgate.simulation.scenario import Scenario

DOCS = Path(__file__).resolve().parents[2] / "docs"


def coded(page: str) -> set[str]:
    """Return what a page sets in code, in its words."""
    text = re.sub(
        r"^```.*?^```$", "", (DOCS / page).read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE
    )
    return set(re.findall(r"`([^`]+)`", text))


def explained(page: str) -> set[str]:
    """Return what a page made from the code has a row for."""
    return set(re.findall(r"^\| `([^`]+)` \|", page, re.MULTILINE))


@pytest.mark.parametrize(
    "names", [columns.EVENT_COLUMNS, columns.VEHICLE_COLUMNS, columns.EDGE_COLUMNS, ROW_SCHEMA.names]
)
def test_every_column_has_a_row(names: Sequence[str]) -> None:
    """In the reference, which is made from the constants that spell them."""
    assert set(names) <= explained(docs_pages.column_names())


def test_every_figure_has_words() -> None:
    """Also those that have no row for a person; two share the words of another."""
    silent = [figure.keys for figure in FIGURES if not figure.means]
    known = {key for figure in FIGURES if figure.means for key in figure.keys.split()}
    assert set(silent) <= known


def test_every_row_says_what_its_column_means() -> None:
    """The comment beside the constant, on whichever line it is."""
    rows = re.findall(r"^\| `([^`]+)` \|(.*)\|$", docs_pages.column_names(), re.MULTILINE)
    assert [name for name, meaning in rows if not meaning.strip()] == []


def test_every_scenario_key_is_explained() -> None:
    """A key that is added needs a docstring: the reference is made of it."""
    said = dict(re.findall(r"^\| `(\w+)` \|[^|]*\| (.*) \|$", docs_pages.scenario_keys(), re.MULTILINE))
    assert {name for name, meaning in said.items() if meaning} == {
        f.name for f in dataclasses.fields(Scenario)
    }


def test_every_event_is_explained() -> None:
    """So does a kind of event."""
    said = dict(re.findall(r"^\| `(\w+)` \| (The .*|SUMO .*) \|$", docs_pages.column_names(), re.MULTILINE))
    assert {str(event) for event in columns.Event} <= set(said)


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
    made = set(docs_pages.pages())
    for page in DOCS.rglob("*.md"):
        for target in re.findall(r"\]\(([^)#]+)\)", page.read_text(encoding="utf-8")):
            assert "://" in target or target in made or (page.parent / target).exists(), (
                f"{page.name}: {target}"
            )


def test_names_to_be_mended_are_in_the_code() -> None:
    """A name that is mended leaves the list."""
    contributing = (DOCS.parent / "CONTRIBUTING.md").read_text(encoding="utf-8")
    listed = contributing.partition("## Names in the code")[2].partition("\n## ")[0]
    names = {
        name
        for row in re.findall(r"^\| (`.*?) \|", listed, re.MULTILINE)
        for name in re.findall(r"`(\w+)`", row)
    }
    assert len(names) > 3
    source = DOCS.parent / "src" / "loopgate"
    text = "\n".join(file.read_text(encoding="utf-8") for file in source.rglob("*.py"))
    known = set(re.findall(r"^class (\w+)", text, re.MULTILINE)) | {
        file.stem for file in source.rglob("*.py")
    }
    assert names - known - {folder.name for folder in source.rglob("*") if folder.is_dir()} == set()
