"""The report in a real browser: quiet, offline, labelled, in any light; what is clicked does its work."""

import gzip
import re
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest
from chromium import CHROMIUM, MISSING, Tab, open_browser

from loopgate.report.page import write_report
from loopgate.runs.results import read_results
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario
from loopgate.sweep import Sweep, run_sweep
from loopgate.sweep.task import load_runner

pytestmark = [
    pytest.mark.skipif(CHROMIUM is None, reason=MISSING),
    pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning"),
]

RUNNER = f"{Path(__file__).parents[1] / 'unit' / 'sweep' / 'fake_runner.py'}:run"
FULL: dict[str, Any] = {"vehicles": [10, 40, 80], "gate": ["open", "certified"], "seed": [1, 2, 3]}
AXE = "axe.run().then(found => found.violations.map(v => [v.impact, v.id, v.nodes[0].html.slice(0, 120)]))"
ALONE = """[...document.querySelectorAll('.tables')].filter(h => h.offsetHeight &&
    getComputedStyle(h.nextElementSibling).page !== 'auto').map(h => h.textContent)"""  # a new page follows
ROWS = "[...document.querySelectorAll('#throughput-table tbody tr')].map(r => r.cells[2].textContent)"


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Make the page of a sweep and that of a single run."""
    folder = tmp_path_factory.mktemp("report")
    sweep = Sweep("made", {"network": "sumo:DRT", "duration_s": 400}, FULL, [])
    with ThreadPoolExecutor(1) as pool:
        run_sweep(sweep, folder / "sweep", executor=pool, runner=RUNNER)
    (folder / "run").mkdir()
    load_runner(RUNNER)({"vehicles": 80, "gate": "certified", "seed": 9, "duration_s": 900}, folder / "run")
    return {
        name: write_report(read_results(folder / name), folder / f"{name}.html").page
        for name in ("sweep", "run")
    }


REAL: dict[str, dict[str, Any]] = {
    "one": {"network": "sumo:DRT", "loops": 4, "vehicles": 12, "duration_s": 300},
    "watch": {"network": "sumo:DRT", "loops": 4, "vehicles": 12, "duration_s": 300, "revisit_s": 200.0},
}
"""Single runs in which hundreds of streets are on no loop."""

GRID: dict[str, Any] = {"vehicles": [10, 60], "gate": ["open", "certified"], "seed": [1, 2, 3]}
ROADS: dict[str, Any] = {"network": "networks/grid5-priority.net.xml", "loops": 12, "duration_s": 120}


@pytest.fixture(scope="module")
def real_pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Simulate one run, one watch and one sweep of two gates, and make their pages."""
    folder = tmp_path_factory.mktemp("real")
    for name, settings in REAL.items():
        simulate(Scenario(**settings), folder / name)
    base = {**ROADS, "network": str(Path(ROADS["network"]).resolve()), "on_deadlock": "continue"}
    with ThreadPoolExecutor(1) as pool:
        run_sweep(Sweep("real", base, GRID, []), folder / "sweep", executor=pool)
    return {
        name: write_report(read_results(folder / name), folder / f"{name}.html").page
        for name in (*REAL, "sweep")
    }


@pytest.fixture(scope="module")
def browser() -> Iterator[Tab]:
    """Start a browser for all tests of the module."""
    with open_browser() as tab:
        yield tab


def opened(tab: Tab, page: Path, width: int = 1280, scheme: str = "light") -> Tab:
    """Open a page and draw all its figures."""
    tab.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
    tab.size(width, 900)
    tab.events.clear()
    tab.open(page)
    tab.value("document.drawn().then(() => 0)")
    return tab


@pytest.mark.parametrize("name", ["sweep", "run"])
@pytest.mark.parametrize(("width", "scheme"), [(1280, "light"), (375, "light"), (1280, "dark")])
def test_in_any_light(browser: Tab, pages: dict[str, Path], name: str, width: int, scheme: str) -> None:
    """Quiet console, one request (the page), nothing cut off, nothing that a reader with aids would miss."""
    tab = opened(browser, pages[name], width, scheme)
    noisy = {"Runtime.exceptionThrown", "Runtime.consoleAPICalled", "Log.entryAdded"}
    assert [event for event in tab.events if event["method"] in noisy] == []
    asked = [e["params"]["request"]["url"] for e in tab.events if e["method"] == "Network.requestWillBeSent"]
    assert [url for url in asked if not url.startswith(("data:", "blob:"))] == [pages[name].as_uri()]
    assert tab.value("document.documentElement.scrollWidth") <= width
    drawn = tab.value(
        "[...document.querySelectorAll('.chart')].map(c => c.querySelectorAll('svg path').length)"
    )
    assert len(drawn) > (8 if name == "sweep" else 4)
    assert min(drawn) > 3
    dark = tab.value("getComputedStyle(document.body).backgroundColor")
    assert dark == ("rgb(22, 24, 28)" if scheme == "dark" else "rgb(255, 255, 255)")
    tab.call("Runtime.evaluate", expression=(files("axe_core_python") / "axe.min.js").read_text() + ";0")
    tab.value("document.querySelectorAll('details').forEach(part => { part.open = true; })")
    assert [fault for fault in tab.value(AXE) if fault[0] in {"serious", "critical"}] == []


MARKS = (
    "Object.fromEntries([...document.querySelectorAll('[data-figure]')].map(box => [box.dataset.figure,"
    " box.querySelectorAll('svg .role-mark path, svg .role-mark line, svg .role-mark text').length]))"
)
OVERLAPPING = (
    "[...document.querySelectorAll('[data-figure] .role-axis-label')].flatMap(axis => {"
    " const boxes = [...axis.querySelectorAll('text')].filter(t => getComputedStyle(t).opacity !== '0')"
    ".map(t => [t.getBoundingClientRect(), t.textContent]); const both = [];"
    " boxes.forEach(([a, one], k) => boxes.slice(k + 1).forEach(([b, other]) => {"
    " if (a.left < b.right + 2 && b.left < a.right + 2 && a.top < b.bottom - 2 && b.top < a.bottom - 2)"
    " both.push([axis.closest('[data-figure]').dataset.figure, one, other]); })); return both; })"
)
"""Labels of an axis that are nearer than two pixels to each other."""
TORN = (
    "[...document.querySelectorAll('.role-legend-symbol path[stroke-dasharray]')]"
    ".filter(path => /[AZ]/i.test(path.getAttribute('d'))).length"
)
"""Markers of legends with a dashed edge; lines may be dashed."""
EXPECTED = {
    "one": {"over-time", "movements", "unwatched", "seen-within"},
    "watch": {"unwatched", "seen-within"},
    "sweep": {"throughput", "speed", "fundamental-diagram", "map"},
}
"""Figures that every report of a single run, and of a sweep of two gates, has."""


@pytest.mark.sumo
@pytest.mark.parametrize("name", ["one", "watch", "sweep"])
@pytest.mark.parametrize(
    ("width", "scheme", "media"),
    [(1280, "light", ""), (375, "light", ""), (1280, "dark", ""), (375, "dark", ""), (700, "dark", "print")],
)
def test_every_figure_of_a_real_run_is_drawn(
    browser: Tab, real_pages: dict[str, Path], name: str, width: int, scheme: str, media: str
) -> None:
    """Marks in every figure, nothing on the console, nothing cut off: on screens and on paper."""
    tab = opened(browser, real_pages[name], width, scheme)
    try:
        if media:
            tab.value("dispatchEvent(new Event('beforeprint'))")
            tab.call("Emulation.setEmulatedMedia", media=media)
        marks = tab.value(MARKS)
        assert marks.keys() >= EXPECTED[name]
        assert [figure for figure, count in marks.items() if not count] == []
        assert tab.value(OVERLAPPING) == []
        assert tab.value(TORN) == 0
        assert tab.noise == []
        assert tab.value("document.documentElement.scrollWidth") <= width
        if media:
            assert tab.value(BROKEN) == []
            broader = "[...document.querySelectorAll('.scroll table')].filter(t => t.offsetWidth > 1010)"
            assert tab.value(f"{broader}.map(t => t.id)") == []
            assert tab.value(ALONE) == []
        assert tab.value(f"[...document.querySelectorAll('p.first')].every(p => p.offsetWidth <= {width})")
        if name != "sweep":
            assert marks["unwatched"] > 300
            bare = "document.querySelectorAll('#unwatched path[stroke-dasharray]').length"
            assert tab.value(bare) > 100
    finally:
        tab.call("Emulation.setEmulatedMedia", media="", features=[])


@pytest.mark.sumo
def test_a_watch_begins_with_its_promises(browser: Tab, real_pages: dict[str, Path]) -> None:
    """Kept and broken in words, streets by name, the map; nothing of throughput in words or figures."""
    tab = opened(browser, real_pages["watch"])
    text = tab.value("document.body.innerText")
    assert "vehicle-km/h" not in text.partition("What was run")[0]
    parts = [
        "Promised: every street is seen again within 200 s.",
        "Ernst-Lau-Straße",
        "Which roads go unwatched",
    ]
    assert sorted(parts, key=text.index) == parts
    shown = tab.value("[...document.querySelectorAll('[data-figure]')].map(box => box.dataset.figure)")
    assert shown[:2] == ["unwatched", "seen-within"]
    assert not {"over-time", "so-far", "throughput", "laps"} & set(shown)


def test_a_series_is_switched_off_in_all_figures(browser: Tab, pages: dict[str, Path]) -> None:
    """By keyboard too: the box is an ordinary one. What is left fills the figure."""
    tab = opened(browser, pages["sweep"])
    points = "document.querySelectorAll('#throughput .mark-symbol.role-mark path').length"
    before = tab.value(points)
    tab.value("document.querySelector('input[data-series^=SUMO]').focus()")
    for kind in ("keyDown", "keyUp"):
        tab.call("Input.dispatchKeyEvent", type=kind, key=" ", code="Space", text=" " * (kind == "keyDown"))
    after = tab.value(f"new Promise(done => setTimeout(() => done({points}), 300))")
    assert 0 < after <= before / 2


def test_tables_sort_by_number_and_copy_as_plain_numbers(browser: Tab, pages: dict[str, Path]) -> None:
    """Thin spaces and percent signs are for the eye: what is copied can be pasted into a sheet."""
    tab = opened(browser, pages["sweep"])
    tab.value("document.querySelectorAll('details').forEach(part => { part.open = true; })")
    heading = "document.querySelectorAll('#throughput-table th > button')[3]"
    values = (
        "[...document.querySelectorAll('#throughput-table tbody tr')].map(r => Number(r.cells[3].dataset.v))"
    )
    for order in ("ascending", "descending"):
        tab.value(f"{heading}.click()")
        assert tab.value(f"{heading}.parentElement.getAttribute('aria-sort')") == order
        shown = tab.value(values)
        assert shown == sorted(shown, reverse=order == "descending")
    catch = (
        "Object.defineProperty(navigator, 'clipboard', {value: {writeText: t => { document.copied = t; }}})"
    )
    tab.value(f"{catch}; document.querySelector('[data-copy=deadlocks-table]').click()")
    copied = tab.value("document.copied")
    lines = [line.split("\t") for line in copied.splitlines()]
    assert lines[0][:3] == ["series", "vehicles", "runs"]
    assert all(re.fullmatch(r"[\d.e-]+", value) for line in lines[1:] for value in line[1:])


def test_the_data_of_a_figure_is_downloaded(browser: Tab, pages: dict[str, Path]) -> None:
    """CSV with all digits, byte for byte the file beside the page; Parquet as Parquet."""
    tab = opened(browser, pages["sweep"])
    text = tab.value("csv('throughput')")
    beside = pages["sweep"].with_name("sweep-files") / "throughput.csv"
    assert text == beside.read_text(encoding="utf-8")
    assert tab.value("String.fromCharCode(...bytes(page.tables.throughput.parquet).slice(0, 4))") == "PAR1"
    button = "document.querySelector('#throughput [data-kind=csv]')"
    tab.value(
        "(() => { HTMLAnchorElement.prototype.click = function () { document.saved = this.download; }; "
        f"{button}.click(); }})()"
    )
    assert tab.value("new Promise(done => setTimeout(() => done(document.saved), 300))") == "throughput.csv"


def test_a_point_says_its_numbers(browser: Tab, pages: dict[str, Path]) -> None:
    """Under the pointer: the series, the vehicles and the mean."""
    tab = opened(browser, pages["sweep"])
    tab.value("document.querySelector('#throughput').scrollIntoView()")
    box = tab.value(
        "(() => { const b = [...document.querySelectorAll('#throughput .mark-symbol.role-mark path')].at(-1)"
        ".getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]; })()"
    )
    tab.call("Input.dispatchMouseEvent", type="mouseMoved", x=box[0] - 2, y=box[1])
    tab.call("Input.dispatchMouseEvent", type="mouseMoved", x=box[0], y=box[1])
    said = tab.value("document.querySelector('#vg-tooltip-element')?.textContent ?? ''")
    assert re.search(r"series.*vehicles.*mean", said)


BROKEN = (
    "[...document.querySelectorAll('td.n, th')].flatMap(cell => { const words = []; for (const text of"
    " cell.querySelector('button')?.childNodes ?? cell.childNodes) for (const {0: word, index} of"
    " (text.textContent ?? '').matchAll(cell.tagName === 'TD' ? /.+/gs : /\\S+/g)) {"
    " const range = document.createRange(); range.setStart(text, index);"
    " range.setEnd(text, index + word.length);"
    " if (new Set([...range.getClientRects()].map(r => Math.round(r.top))).size > 1) words.push(word); }"
    " return words; })"
)
"""Numbers that are broken over two lines, and words of headings that are."""


def test_it_prints(browser: Tab, pages: dict[str, Path]) -> None:
    """On paper, whatever the screen has: dark on light, tables whole and open, figures not cut."""
    tab = opened(browser, pages["sweep"], width=700, scheme="dark")
    tab.value("dispatchEvent(new Event('beforeprint'))")
    dark = {"name": "prefers-color-scheme", "value": "dark"}
    tab.call("Emulation.setEmulatedMedia", media="print", features=[dark])
    try:
        assert tab.value("getComputedStyle(document.body).color") == "rgb(26, 26, 26)"
        assert tab.value("getComputedStyle(document.querySelector('.chart text')).fill") == "rgb(26, 26, 26)"
        assert tab.value("[...document.querySelectorAll('details')].every(part => part.open)")
        cut = (
            "[...document.querySelectorAll('%s')].filter(e => e.getBoundingClientRect().right > "
            "e.parentElement.getBoundingClientRect().right + 1).map(e => e.outerHTML.slice(0, 80))"
        )
        assert tab.value(cut % ".chart svg") == []
        assert tab.value(cut % ".scroll table") == []
        hidden = "[...document.querySelectorAll('.scroll')].filter(e => e.scrollHeight > e.clientHeight + 1)"
        assert tab.value(f"{hidden}.length") == 0
        assert tab.value(BROKEN) == []
        boxes = "[...document.querySelectorAll('th button')].map(b => getComputedStyle(b).display)"
        assert set(tab.value(boxes)) == {"contents"}  # a box is left out where a table goes on
        assert tab.call("Page.printToPDF")["data"].startswith("JVBERi0")
    finally:
        tab.call("Emulation.setEmulatedMedia", media="", features=[])


def test_a_map_is_light(browser: Tab, pages: dict[str, Path]) -> None:
    """One element for an edge: a district has thousands, and whoever reads with aids goes through all."""
    tab = opened(browser, pages["sweep"])
    parts = tab.value("document.querySelectorAll('#idleness-map svg *').length")
    assert parts < 100 + tab.value("document.querySelectorAll('#idleness-map .role-mark path').length")


def test_the_page_is_small(pages: dict[str, Path]) -> None:
    """Under 3 MB with the library, which is about 0.9 MB of it."""
    assert all(page.stat().st_size < 3_000_000 for page in pages.values())
    assert len(gzip.compress(pages["sweep"].read_bytes())) < 600_000
