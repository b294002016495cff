"""The pictures of docs/gallery.md: ``make pictures``. Pages in Chromium, figures and maps from short runs.

The runs stay in ``out/gallery``, and are not made again while they are there. What is simulated is small: it
shows what the pages look like, and measures nothing.
"""

from __future__ import annotations

import io
import subprocess
import sys
from pathlib import Path
from typing import Any

from chromium import CHROMIUM, MISSING, Tab, open_browser
from PIL import Image

from loopgate import Scenario, Sweep, plots, read_results, read_run, run_sweep, write_report
from loopgate.analysis import (
    add_series,
    compute_fundamental,
    compute_mean,
    compute_paired,
    compute_survival,
    compute_time_space,
)
from loopgate.replay import make_replay
from loopgate.simulation.run import simulate

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "out" / "gallery"
IMAGES = ROOT / "docs" / "images"
GRID = ROOT / "networks" / "grid5-priority.net.xml"
PAGE = (1100, 760)
SHOWN_PX = 760
COLOURS = 48
READY = "new Promise(done => { const look = () => window.replay ? done() : setTimeout(look, 50); look(); })"
DRAWN = "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))"
CLOSURE = '[[closures]]\nstreet = "Station Avenue"\nfrom = "10:00"\nto = "10:30"\n'
NETCONVERT = (
    *("--output.street-names", "--keep-edges.by-vclass", "passenger", "--remove-edges.isolated"),
    *("--geometry.remove", "--junctions.join", "--roundabouts.guess", "--no-turnarounds"),
    *("--tls.guess-signals", "--tls.discard-simple", "--tls.join", "--tls.default-type", "actuated"),
)


def command(*words: str) -> None:
    """Run a command where the runs are kept."""
    subprocess.run(words, check=True, cwd=OUT, capture_output=True)


def keep(picture: bytes, name: str) -> None:
    """Keep a picture as small as it is shown, with as few colours as it needs."""
    with Image.open(io.BytesIO(picture)) as image:
        small = image.convert("RGB")
        small.thumbnail((SHOWN_PX, SHOWN_PX), Image.Resampling.LANCZOS)
        small.quantize(COLOURS).save(IMAGES / name, optimize=True)


def town() -> Path:
    """Run two bus lines in a town, one of whose streets is closed for half an hour; return the folder."""
    folder = OUT / "buses"
    if not (folder / "summary.json").exists():
        command(
            "netconvert", "--osm-files", str(ROOT / "networks/town.osm"), *NETCONVERT, "-o", "town.net.xml"
        )
        lines = (
            "--via",
            "Main Street,Avenue A",
            "--via",
            "Avenue B,5th Street",
            "--stops",
            "Main Street,Avenue B",
        )
        timetable = ("--every", "2min", "--first", "9:30", "--length", "1500:4000", "-o", "lines.rou.xml")
        command("loopgate", "loops", "town.net.xml", "--vclass", "bus", *lines, *timetable)
        (OUT / "closed.toml").write_text(CLOSURE, encoding="utf-8")
        files = (
            "--routes",
            "lines.rou.xml",
            "--stops",
            "lines.add.xml",
            "--move-stops",
            "--incidents",
            "closed.toml",
        )
        time = ("--begin", "9:30", "--duration", "2h")
        command("loopgate", "run", "town.net.xml", *files, *time, "-o", folder.name)
    return folder


def grid(gate: str) -> Path:
    """Run 180 vehicles on a grid for ten minutes; return the folder."""
    folder = OUT / gate
    if not (folder / "summary.json").exists():
        routes = str(ROOT / "routes" / "grid5.rou.xml")
        run = Scenario(
            network=str(GRID), routes=routes, vehicles=180, duration_s=600, gate=gate, on_deadlock="continue"
        )
        simulate(run, folder, overwrite=True)
    return folder


def photograph(tab: Tab) -> None:
    """Keep the top of a report, a figure of it, and a replay."""
    report = OUT / "report.html"
    write_report(read_results(town()), report)
    tab.size(*PAGE)
    tab.open(report)
    keep(tab.picture(), "gallery-report.png")
    tab.size(PAGE[0], 560)
    tab.value("document.getElementById('map').scrollIntoView()")
    keep(tab.picture(), "gallery-report-figures.png")
    tab.size(*PAGE)
    tab.open(make_replay(grid("open"), grid("certified")).write(OUT / "replay.html"))
    tab.value(READY)
    tab.value("window.replay.play(false); window.replay.seek(540); window.replay.draw(0)")
    tab.value(DRAWN)
    keep(tab.picture(), "gallery-replay.png")


def draw_figures() -> None:
    """Draw what a sweep and a run give, by one call each."""
    base = {"network": str(GRID), "loops": 12, "duration_s": 300, "on_deadlock": "continue"}
    grid_of: dict[str, list[Any]] = {
        "vehicles": [40, 100, 160, 220],
        "gate": ["open", "certified"],
        "seed": [1, 2, 3],
    }
    run_sweep(Sweep("gallery", base, grid_of), OUT / "sweep")
    runs = add_series(read_results(OUT / "sweep").runs)
    by = ["series", "vehicles"]
    one = read_run(town())
    points = compute_time_space(
        events=one.events, vehicles=one.vehicles, loops=one.loops, loop=str(one.loops["loop"].iloc[0])
    )
    figures = {
        "throughput": plots.plot_mean(compute_mean(runs=runs, by=by), single=runs),
        "fundamental": plots.plot_fundamental(compute_fundamental(runs=runs, by=by)),
        "paired": plots.plot_paired(compute_paired(runs=runs, baseline="open")),
        "survival": plots.plot_survival(compute_survival(runs=runs.query("vehicles > 100"), by=by)),
        "time-space": plots.plot_time_space(points, clock=True),
    }
    for name, figure in figures.items():
        file = OUT / f"{name}.png"
        figure.save(str(file), scale_factor=2)
        keep(file.read_bytes(), f"gallery-{name}.png")


def draw_map() -> None:
    """Draw loops that together cover a town."""
    command(
        "loopgate", "loops", "town.net.xml", "--cover", "all", "--count", "4", "-o", "patrol.rou.xml",
        "--picture", "patrol.png",
    )  # fmt: skip
    keep((OUT / "patrol.png").read_bytes(), "gallery-patrol.png")


def main() -> None:
    """Run, draw, write."""
    if CHROMIUM is None:
        sys.exit(f"gallery: {MISSING}")
    OUT.mkdir(parents=True, exist_ok=True)
    with open_browser() as tab:
        photograph(tab)
    draw_figures()
    draw_map()
    for file in sorted(IMAGES.glob("gallery-*.png")):
        print(f"{file.relative_to(ROOT)}: {file.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
