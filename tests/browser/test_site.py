"""The documentation as a site, in a browser: nothing is wider than the page, named wrongly or fetched."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path

import pytest
from chromium import MISSING, Tab, open_browser  # in analysis/

ROOT = Path(__file__).parents[2]
PAGES = ("index", "start", "gates", "any-traffic", "standing", "notebooks/first-run", "reference/commands")
AXE = "axe.run().then(found => found.violations.map(v => [v.impact, v.id, v.nodes[0].html.slice(0, 120)]))"


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of the site."""
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(folder)]
    subprocess.run(command, cwd=ROOT, check=True, env={**os.environ, "NO_MKDOCS_2_WARNING": "1"})
    return folder


@pytest.fixture(scope="module")
def tab() -> Iterator[Tab]:
    """Return a tab of Chromium."""
    try:
        with open_browser() as opened:
            yield opened
    except RuntimeError as error:
        if str(error) != MISSING:
            raise
        pytest.skip(MISSING)


@pytest.mark.parametrize("width", [1280, 375])
@pytest.mark.parametrize("page", PAGES)
def test_a_page_fits_and_can_be_read_by_a_screen_reader(site: Path, tab: Tab, page: str, width: int) -> None:
    """The console stays quiet, each picture is there, and axe finds nothing."""
    before = len(tab.noise)
    tab.size(width, 900)
    tab.open(site / f"{page}.html")
    assert tab.value("document.documentElement.scrollWidth <= innerWidth")
    assert tab.value("[...document.images].filter(i => !i.naturalWidth).map(i => i.src)") == []
    tab.call("Runtime.evaluate", expression=(files("axe_core_python") / "axe.min.js").read_text() + ";0")
    assert tab.value(AXE) == []
    assert tab.noise[before:] == []


@pytest.mark.parametrize("page", PAGES)
def test_a_page_in_the_dark_has_contrast(site: Path, tab: Tab, page: str) -> None:
    """The dark colours come with the system's setting."""
    tab.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark"}])
    try:
        tab.size(1280, 900)
        tab.open(site / f"{page}.html")
        assert tab.value("document.body.getAttribute('data-md-color-scheme')") == "slate"
        tab.call("Runtime.evaluate", expression=(files("axe_core_python") / "axe.min.js").read_text() + ";0")
        assert tab.value(AXE) == []
    finally:
        tab.call("Emulation.setEmulatedMedia", features=[])


def test_the_search_finds_a_term(site: Path, tab: Tab) -> None:
    """Without a network: the index comes with the site."""
    tab.size(1280, 900)
    tab.open(site / "index.html")
    tab.value("document.querySelector('.md-search__input').focus()")
    tab.call("Input.insertText", text="idleness")
    found = 0
    for _ in range(100):
        found = tab.value("document.querySelectorAll('.md-search-result__item').length")
        if found:
            break
        time.sleep(0.1)
    assert found > 3
    assert [url for url in tab.requests if not url.startswith("file:")] == []


QUESTIONS = {
    "gridlock in roundabout": "troubleshooting",
    "vehicles teleporting waited too long jam": "troubleshooting",
    "constant number of vehicles": "tutorial",
    "bus bunching headway": "stops",
    "cyclical bus route with stops every round": "stops",
    "keep clear intersection blocked": "troubleshooting",
    "deadlock left turn": "concepts",
    "vehicles never leave driving in circles": "troubleshooting",
    "fleet of shuttles timetable": "stops",
    "closed street rerouter detour": "standing",
}
"""What strangers asked in public threads about SUMO, and the page that answers."""


def test_a_stranger_finds_the_page_that_answers(site: Path, tab: Tab) -> None:
    """In the words of threads, among the first three; pages that have every word come behind."""
    tab.size(1280, 900)
    items = "[...document.querySelectorAll('.md-search-result__item')].slice(0, 3)"
    links = f"{items}.map(i => i.querySelector('a').href)"
    for words, page in QUESTIONS.items():
        tab.open(site / "index.html")
        tab.value("document.querySelector('.md-search__input').focus()")
        tab.call("Input.insertText", text=words)
        found: list[str] = []
        for _ in range(100):
            time.sleep(0.1)
            before, found = found, tab.value(links)
            if found and found == before:
                break
        assert any(f"/{page}.html" in link for link in found), (words, found)
