"""The replay in a real browser: quiet, offline, and all that can be clicked or pressed does what it says."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from chromium import CHROMIUM, MISSING, Tab, open_browser

from loopgate.replay import make_replay
from loopgate.runs.run import read_run
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario

pytestmark = [
    pytest.mark.sumo,
    pytest.mark.skipif(CHROMIUM is None, reason=MISSING),
    pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning"),
]

ROADS: dict[str, Any] = {
    "network": "networks/order2.net.xml",
    "routes": "routes/order2.rou.xml",
    "abstraction": "segments",
    "negotiation": "random",
    "duration_s": 600,
    "on_deadlock": "continue",
    "positions": True,
}
READY = "new Promise(done => { const look = () => window.replay ? done() : setTimeout(look, 20); look(); })"
DRAWN = "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))"
RED = (
    "(() => { const c = document.querySelector('.panel canvas');"
    "const p = c.getContext('2d').getImageData(0, 0, c.width, c.height).data; let n = 0;"
    "for (let i = 0; i < p.length; i += 4) if (p[i] > 190 && p[i + 1] < 30 && p[i + 2] < 60) n++;"
    "return n; })()"
)


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Make two runs, one of which locks up, and their pages: one run, both."""
    folder = tmp_path_factory.mktemp("replay")
    for gate in ("collision", "certified"):
        simulate(Scenario(gate=gate, **ROADS), folder / gate)
    return {
        "one": make_replay(folder / "certified").write(folder / "one.html"),
        "both": make_replay(folder / "collision", folder / "certified").write(folder / "both.html"),
    }


@pytest.fixture(scope="module")
def browser() -> Iterator[Tab]:
    """Start a browser for all tests of the module."""
    with open_browser() as tab:
        yield tab


def ready(tab: Tab, page: Path, width: int = 1280, height: int = 800) -> Tab:
    """Open a page, wait until it plays, and stop it at its beginning."""
    tab.events.clear()
    tab.size(width, height)
    tab.open(page)
    tab.value(READY)
    tab.value("window.replay.play(false); window.replay.seek(0)")
    tab.value(DRAWN)
    return tab


def keep(tab: Tab, file: Path) -> None:
    """Keep what is seen, to be looked at."""
    file.write_bytes(tab.picture())


def deadlock(tab: Tab) -> None:
    """Go to ten seconds after the first deadlock."""
    tab.key("d")
    tab.key("ArrowRight", shift=True)
    tab.value(DRAWN)


@pytest.mark.parametrize("name", ["one", "both"])
def test_it_begins_by_itself(browser: Tab, pages: dict[str, Path], name: str) -> None:
    """Untouched, as a reader opens it: the clock reads a time and goes on, and vehicles are on the map."""
    browser.size(1280, 800)
    browser.open(pages[name])
    browser.value(READY)
    seen = []
    for _ in range(2):
        browser.value("new Promise(done => setTimeout(done, 700))")
        seen.append(browser.value("document.getElementById('clock').textContent"))
    assert all(re.fullmatch(r"\d+:\d\d", clock) for clock in seen)
    assert seen[0] < seen[1]
    counts = browser.value(
        "[...document.querySelectorAll('.caption p:first-of-type')].map(p => p.textContent)"
    )
    assert all(
        sum(map(int, re.findall(r"\d+(?= (?:driving|held|standing|in))", text))) == 5 for text in counts
    )


def test_it_stands_still_for_who_asks_for_it(browser: Tab, pages: dict[str, Path]) -> None:
    """With motion reduced it waits for Play, showing its first moment."""
    media = "Emulation.setEmulatedMedia"
    browser.call(media, features=[{"name": "prefers-reduced-motion", "value": "reduce"}])
    try:
        browser.open(pages["one"])
        browser.value(READY)
        browser.value("new Promise(done => setTimeout(done, 300))")
        assert browser.value("window.replay.time === window.replay.first && !window.replay.playing")
        assert re.fullmatch(r"\d+:\d\d", browser.value("document.getElementById('clock').textContent"))
    finally:
        browser.call(media, features=[])


def test_keys_before_the_first_frame_lose_no_map(browser: Tab, pages: dict[str, Path]) -> None:
    """A map that was not yet fitted, as in a frame not yet seen, is not zoomed to nowhere."""
    tab = ready(browser, pages["one"])
    tab.value(
        "(() => { const [view] = window.replay.views; view.scale = 0;"
        "for (const key of ['+', '-']) document.dispatchEvent(new KeyboardEvent('keydown', {key}));"
        "view.pan(9, 9); })()"
    )
    tab.value(DRAWN)
    assert tab.value("(([{x, y, scale}]) => [x, y, scale].every(v => v > 0 || v < 0))(window.replay.views)")


@pytest.mark.parametrize("name", ["one", "both"])
@pytest.mark.parametrize("width", [1280, 375])
def test_quiet_offline_and_within_the_window(
    browser: Tab, pages: dict[str, Path], name: str, width: int
) -> None:
    """Nothing on the console, no request but the page, no sideways scrolling; every run has a map."""
    tab = ready(browser, pages[name], width)
    tab.value("window.replay.play(true); new Promise(done => setTimeout(done, 300))")
    keep(tab, pages[name].with_name(f"{name}-{width}.png"))
    assert tab.noise == []
    assert tab.requests == [pages[name].as_uri()]
    assert tab.value("document.documentElement.scrollWidth") <= width
    assert tab.value("document.querySelectorAll('.panel canvas').length") == (2 if name == "both" else 1)
    assert min(tab.value("[...document.querySelectorAll('.panel')].map(p => p.clientHeight)")) > 100


def test_what_it_unpacks_is_what_was_packed(browser: Tab, pages: dict[str, Path]) -> None:
    """Vehicles, steps and books: places hold at most what they have room for, all the time."""
    tab = ready(browser, pages["one"])
    assert tab.value("window.replay.runs[0].vehicles.length") == 5
    assert tab.value("window.replay.runs[0].frames") == 601
    over = (
        "(() => { const run = window.replay.runs[0]; let most = 0;"
        "run.places.forEach(({room}, k) => { for (let f = 0; f < run.frames; f++)"
        " most = Math.max(most, run.visits.count(k, f) - (room || 1)); }); return most; })()"
    )
    assert tab.value(over) == 0
    assert tab.value("window.replay.runs[0].lapOf.length") > 20


def test_a_deadlock_is_drawn_and_told(browser: Tab, pages: dict[str, Path]) -> None:
    """D goes there; the caption says it, and red is on the map where it was not before."""
    tab = ready(browser, pages["both"])
    assert tab.value(RED) == 0
    deadlock(tab)
    keep(tab, pages["both"].with_name("deadlock.png"))
    assert tab.value(RED) > 100
    assert "Deadlock of 3" in tab.value("document.querySelector('.alarm').textContent")
    assert tab.value("document.querySelectorAll('.alarm')[1].textContent") == ""


def test_closed_streets_and_vehicles_that_stand_are_drawn_and_told(browser: Tab, tmp_path: Path) -> None:
    """Dashed in red while they last, in the caption until when; a vehicle that waits there says so too."""
    (tmp_path / "incidents.toml").write_text(
        '[[closures]]\nedge = "C2C1"\nfrom = 60\nto = 160\n'
        '[[breakdowns]]\nvehicle = "y"\nfrom = 60\nto = 170\n'
    )
    (tmp_path / "loop.rou.xml").write_text(
        '<routes><route id="a" edges="B2C2 C2C1 C1B1 B1B2">'
        '<stop lane="C2C1_0" endPos="40" duration="5"/></route>'
        '<vehicle id="x" route="a" depart="0"/><vehicle id="y" route="a" depart="0"/></routes>'
    )
    routes, incidents = str(tmp_path / "loop.rou.xml"), str(tmp_path / "incidents.toml")
    grid = "networks/grid5-priority.net.xml"
    simulate(Scenario(network=grid, routes=routes, incidents=incidents, duration_s=200.0), tmp_path / "run")
    tab = ready(browser, make_replay(tmp_path / "run").write(tmp_path / "page.html"))
    alarm = "document.querySelector('.alarm').textContent"
    assert tab.value(alarm) == ""
    tab.value("window.replay.seek(140)")
    tab.value(DRAWN)
    keep(tab, tmp_path / "blocked.png")
    told = tab.value(alarm)
    assert "C2C1_0 is closed until 2:40" in told
    assert "y stands on" in told
    assert "(breakdown) until 2:50" in told
    assert tab.value(RED) > 50
    tab.value("window.replay.choose(window.replay.runs[0], 0)")
    tab.value(DRAWN)
    about = tab.value("document.getElementById('about').innerText")
    assert "is closed until 2:40" in about or "y stands on" in about
    tab.value("window.replay.seek(190)")
    tab.value(DRAWN)
    assert tab.value(alarm) == ""


def test_a_click_tells_why_a_vehicle_waits(browser: Tab, pages: dict[str, Path]) -> None:
    """Clicked on the map: followed, its reason, and the circle that its chain closes; then the next in it."""
    tab = ready(browser, pages["both"])
    deadlock(tab)
    where = (
        "(() => { const p = window.replay.panels[0], v = p.run.circles[0][0][0];"
        "const [x, y] = p.painter.middle(v), box = p.canvas.getBoundingClientRect();"
        "return [box.left + p.view.left(x, box.width), box.top + p.view.top(y, box.height),"
        " p.run.vehicles[v]]; })()"
    )
    left, top, name = tab.value(where)
    tab.click(left, top)
    tab.value(DRAWN)
    told = tab.value("document.getElementById('about').innerText")
    keep(tab, pages["both"].with_name("clicked.png"))
    assert told.startswith(name)
    assert "in a deadlock of 3" in told
    assert tab.value("document.querySelectorAll('#about li').length") == 3
    assert tab.value("window.replay.views[0].followed !== null")
    tab.value("document.querySelector('#about li button').click()")
    tab.value(DRAWN)
    other = tab.value("document.getElementById('about').innerText")
    assert not other.startswith(name)
    tab.key("Escape")
    tab.value(DRAWN)
    assert tab.value("document.getElementById('about').hidden")


def test_one_that_drives_tells_where_it_goes(browser: Tab, pages: dict[str, Path]) -> None:
    """The place that it has got and the one behind that, as its loop has them."""
    tab = ready(browser, pages["one"])
    tab.value("window.replay.seek(101)")
    tab.value(DRAWN)
    tab.value(
        "(() => { const [run] = window.replay.runs; window.replay.choose(run,"
        " run.state.findIndex((state, k) => state === 0 && !run.refusals.count(k, run.frame))); })()"
    )
    tab.value(DRAWN)
    told = tab.value("document.getElementById('about').innerText")
    here, then = told.split("It drives to ")[1].split(", then to ")
    steps = tab.value(
        "window.replay.runs[0].after.flatMap(([places]) => places.map((p, k) =>"
        " [p, places[(k + 1) % places.length]].map(one => window.replay.runs[0].places[one].name)))"
    )
    assert [here, then.strip()] in steps


def test_a_refused_vehicle_names_the_one_in_its_way(browser: Tab, pages: dict[str, Path]) -> None:
    """Wherever a place is full, the one told to be waited for is in it; r leads from refusal to refusal."""
    tab = ready(browser, pages["both"])
    seen = 0
    for _ in range(12):
        tab.key("Escape")
        tab.key("r")
        tab.value(DRAWN)
        full, holders = tab.value(
            "(() => { const {run, vehicle} = window.replay.chosen;"
            "const row = run.refusals.rows(vehicle, run.frame).pop();"
            "const rows = run.visits.rows(run.links[run.refusals.what[row]].to, run.frame);"
            "return [run.refusals.why[row] === run.occupied,"
            " rows.map(r => run.vehicles[run.visits.whose[r]])]; })()"
        )
        told = tab.value("document.getElementById('about').innerText")
        assert "It wants to go to" in told
        if full:
            seen += 1
            assert "the next place is full" in told
            assert tab.value("document.querySelector('#about li button').textContent") in holders
    assert seen > 3


def test_a_notebook_shows_the_same(browser: Tab, pages: dict[str, Path]) -> None:
    """In a frame of the notebook's page, as quiet as alone."""
    notebook = pages["one"].with_name("notebook.html")
    frame = read_run(pages["one"].with_name("certified")).replay()._repr_html_()
    notebook.write_text(f"<!doctype html><meta charset=utf-8><body>{frame}", encoding="utf-8")
    browser.events.clear()
    browser.open(notebook)
    browser.value(READY.replace("window.replay", "frames[0].replay"))
    assert browser.value("frames[0].replay.runs[0].frames") == 601
    assert browser.noise == []


def test_keys(browser: Tab, pages: dict[str, Path]) -> None:
    """A walk over all keys; the clock and the slider go along."""
    tab = ready(browser, pages["both"])
    first = tab.value("window.replay.time")
    tab.key("ArrowRight")
    assert tab.value("window.replay.time") == first + 1
    tab.key("ArrowRight", shift=True)
    tab.key("ArrowLeft")
    assert tab.value("window.replay.time") == first + 10
    tab.key("l")
    assert tab.value("window.replay.time") > first + 10
    assert tab.value("window.replay.chosen !== null")
    tab.key("n")
    tab.key("Escape")
    assert tab.value("window.replay.chosen") is None
    tab.key("]")
    assert tab.value("window.replay.speed") == 20
    tab.key("[")
    scale = tab.value("window.replay.views[0].scale")
    tab.key("+")
    assert tab.value("window.replay.views[0].scale") > scale
    tab.key("0")
    tab.value(DRAWN)
    assert tab.value("window.replay.views[0].scale") == scale
    tab.key(" ")
    assert tab.value("document.getElementById('play').textContent") == "Pause"
    tab.key(" ")
    tab.key("?")
    assert tab.value("document.getElementById('help').open")
    tab.value("document.getElementById('help').close()")
    tab.value(DRAWN)
    shown, slid = tab.value(
        "[document.getElementById('clock').textContent, document.getElementById('time').value]"
    )
    minutes, seconds = shown.split(":")
    assert 60 * int(minutes) + int(seconds) == pytest.approx(first + float(slid), abs=1)


def test_every_control_is_reached_and_named(browser: Tab, pages: dict[str, Path]) -> None:
    """By Tab alone, in the order in which they stand; each has a name."""
    tab = ready(browser, pages["both"])
    tab.value("document.activeElement.blur()")
    reached = []
    for _ in range(10):
        tab.key("Tab")
        reached.append(tab.value("document.activeElement.id"))
    named = ["time", "play", "speed", "refusal", "deadlock", "lap", "vehicle", "fit", "save", "keys"]
    assert reached == named
    unnamed = (
        "[...document.querySelectorAll('button, input, select, canvas')].filter(e =>"
        " !(e.ariaLabel || e.textContent.trim() || e.labels?.length)).map(e => e.outerHTML)"
    )
    assert tab.value(unnamed) == []


def test_a_vehicle_is_found_by_name(browser: Tab, pages: dict[str, Path]) -> None:
    """Typed into its field; one that does not exist chooses nobody."""
    tab = ready(browser, pages["one"])
    pick = (
        "(name => { const field = document.getElementById('vehicle');"
        "field.value = name; field.dispatchEvent(new Event('change')); })"
    )
    name = tab.value("window.replay.runs[0].vehicles[2]")
    tab.value(f"{pick}({name!r})")
    assert tab.value("window.replay.chosen.vehicle") == 2
    tab.value(f"{pick}('nobody')")
    assert tab.value("window.replay.chosen") is None


@pytest.mark.parametrize(("name", "least"), [("one", 20), ("both", 15)])
def test_it_moves_smoothly(browser: Tab, pages: dict[str, Path], name: str, least: int) -> None:
    """On a busy machine without a graphics card still many frames a second."""
    tab = ready(browser, pages[name])
    frames = "(() => window.replay.frames)()"
    before = tab.value(frames)
    tab.value("window.replay.play(true); new Promise(done => setTimeout(done, 2000))")
    assert (tab.value(frames) - before) / 2 > least
