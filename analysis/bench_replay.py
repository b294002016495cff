"""How smoothly replays move: frames per second in Chromium without a graphics card. ``make bench-replay``.

A made grid is run for two minutes with 400 and with 2,000 vehicles, and its replay is played at ten times the
speed of life: all of it in view or one vehicle followed, alone or beside another. *late* is the time between
frames that one in a hundred exceeds, *script* the median time that a frame's own calls take, *raster* that in
which the browser then fills the pixels, taken by asking for one of them.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pandas as pd
from chromium import CHROMIUM, MISSING, Tab, open_browser
from made_networks import netgenerate

from loopgate.cli.terminal import show_progress
from loopgate.replay import make_replay
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario

OUT = Path(__file__).resolve().parent.parent / "out" / "bench"
VEHICLES = (400, 2000)
DURATION_S = 120.0
WINDOW = (1280, 800)
PLAYED_MS = 5000
SINGLE = 60

READY = "new Promise(done => { const look = () => window.replay ? done() : setTimeout(look, 50); look(); })"
VIEWS = {
    "all": "window.replay.choose(null, -1); window.replay.fit()",
    "one followed": "window.replay.choose(window.replay.runs[0], 0)",
}
PLAYED = f"""(async () => {{
  const replay = window.replay;
  replay.seek(20);
  replay.play(true);
  await new Promise(done => setTimeout(done, 500));
  const before = replay.frames, since = performance.now(), gaps = [];
  for (let last = since, now; last < since + {PLAYED_MS}; last = now) {{
    now = await new Promise(done => requestAnimationFrame(done));
    gaps.push(now - last);
  }}
  const rate = (replay.frames - before) / (performance.now() - since) * 1000;
  replay.play(false);
  return [rate, gaps.sort((a, b) => a - b)[Math.floor(0.99 * gaps.length)]];
}})()"""
SINGLE_FRAMES = f"""(async () => {{
  const replay = window.replay, script = [], raster = [];
  const pixel = () => replay.panels.forEach(({{ painter }}) => painter.context.getImageData(0, 0, 1, 1));
  for (let k = 0; k < {SINGLE}; k++) {{
    replay.time = 30 + 0.37 * k;
    pixel();
    const begin = performance.now();
    replay.draw(begin);
    const drawn = performance.now();
    pixel();
    script.push(drawn - begin);
    raster.push(performance.now() - drawn);
    await new Promise(done => requestAnimationFrame(done));
  }}
  const median = (values) => values.sort((a, b) => a - b)[values.length >> 1];
  return [median(script), median(raster)];
}})()"""


def drive(vehicles: int) -> Path:
    """Make a run with so many vehicles, where there is none yet; return its folder."""
    folder, grid = OUT / f"replay-{vehicles}", OUT / "replay.net.xml"
    if not (folder / "summary.json").is_file():
        OUT.mkdir(parents=True, exist_ok=True)
        netgenerate("--grid --grid.number 20 --grid.length 200 --no-turnarounds true", grid)
        scenario = Scenario(
            network=str(grid),
            loops=200,
            vehicles=vehicles,
            duration_s=DURATION_S,
            lights="off",
        )
        with show_progress(f"{vehicles} vehicles on a grid", total=round(DURATION_S)) as report:
            simulate(scenario, folder, tick=lambda now, _: report(round(now)), overwrite=True)
    return folder


def measure(tab: Tab, runs: int, vehicles: int) -> list[dict[str, Any]]:
    """Return a row for each view of a page with so many runs."""
    folder = drive(vehicles)
    page = make_replay(*[folder] * runs).write(folder / f"replay-{runs}.html")
    tab.size(*WINDOW)
    tab.open(page)
    tab.value(READY)
    rows = []
    for view, show in VIEWS.items():
        tab.value(show)
        rate, late = tab.value(PLAYED)
        script, raster = tab.value(SINGLE_FRAMES)
        rows.append(
            {
                "runs": runs,
                "vehicles": vehicles,
                "view": view,
                "fps": round(rate, 1),
                "late_ms": round(late, 1),
                "script_ms": round(script, 2),
                "raster_ms": round(raster, 2),
                "page_mb": round(page.stat().st_size / 1e6, 2),
            }
        )
    return rows


def main() -> None:
    """Run, open, measure, print."""
    if CHROMIUM is None:
        sys.exit(f"bench_replay: {MISSING}")
    rows = []
    for vehicles in VEHICLES:
        for runs in (1, 2):
            with open_browser() as tab:
                rows += measure(tab, runs, vehicles)
    print(pd.DataFrame(rows).to_string(index=False))


if __name__ == "__main__":
    main()
