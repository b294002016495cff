"""The README's animation: ``make animation``, from two runs of the demo, drawn by their replay in Chromium.

On the left SUMO's own rules lock up, on the right the same vehicles move on under loopgate. The runs stay in
``out/animation``, and are not made again while they are there.
"""

from __future__ import annotations

import dataclasses
import io
import sys
from pathlib import Path

import headline
from chromium import CHROMIUM, MISSING, Tab, open_browser
from PIL import Image

from loopgate.cli.terminal import show_progress
from loopgate.replay import make_replay
from loopgate.simulation.run import simulate

OUT = headline.ROOT / "out" / "animation"
FILE = headline.ROOT / "docs" / "images" / "lock-up.gif"
SIZE = (900, 420)
FROM_S, TO_S, EVERY_S = 900, 1500, 3
FRAME_MS, LAST_MS = 70, 2500
COLOURS = 48
MARGIN_M = 190

READY = "new Promise(done => { const look = () => window.replay ? done() : setTimeout(look, 50); look(); })"
BARE = f"""
window.replay.play(false);
for (const name of ["header", "footer"]) document.querySelector(name).style.display = "none";
const [run] = window.replay.runs, xs = [], ys = [];
run.moveTo(run.frameAt(run.last_s));
for (const vehicle of run.circles[0][0]) {{ xs.push(run.px[vehicle]); ys.push(run.py[vehicle]); }}
const [view] = window.replay.views, wide = Math.max(...xs) - Math.min(...xs) + 20 * {MARGIN_M};
view.x = (Math.max(...xs) + Math.min(...xs)) / 2;
view.y = (Math.max(...ys) + Math.min(...ys)) / 2;
view.scale = {SIZE[0] / 2} / wide;
view.fitted = false;
"""
SHOW = """
window.replay.seek({now});
window.replay.draw(0);
document.querySelectorAll(".caption h2").forEach((title, k) => {{
  title.textContent = `${{document.getElementById("clock").textContent}}  ${{window.replay.runs[k].name}}`;
}});
new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))
"""


def _demo(gate: str) -> Path:
    """Run the demo under `gate` as far as it is shown; return the run's folder."""
    folder = OUT / gate
    if not (folder / "summary.json").exists():
        scenario = dataclasses.replace(headline.BERLIN, gate=gate, duration_s=TO_S + 5.0)
        with show_progress(f"Berlin under {gate}", total=round(scenario.duration_s)) as report:
            simulate(scenario, folder, tick=lambda now, _: report(round(now)), overwrite=True)
    return folder


def photograph(tab: Tab) -> list[Image.Image]:
    """Return what the replay shows from moment to moment."""
    pictures = []
    moments = range(FROM_S, TO_S + 1, EVERY_S)
    with show_progress("pictures", total=len(moments)) as report:
        for number, now in enumerate(moments):
            tab.value(SHOW.format(now=now))
            pictures.append(Image.open(io.BytesIO(tab.picture())).convert("RGB"))
            report(number + 1)
    return pictures


def main() -> None:
    """Run, draw, write."""
    if CHROMIUM is None:
        sys.exit(f"animation: {MISSING}")
    page = make_replay(*(_demo(gate) for gate in headline.GATES)).write(OUT / "both.html")
    with open_browser() as tab:
        tab.size(*SIZE)
        tab.open(page)
        tab.value(READY)
        tab.value(BARE)
        pictures = photograph(tab)
        vivid = tab.value("[...window.replay.colours.states, window.replay.colours.taken]")
    # One palette for all, without dither: what does not change from picture to picture costs nothing then.
    sample = pictures[-1].copy()
    for number, colour in enumerate(vivid):  # small things keep their colours among so much grey
        sample.paste(colour, (0, 40 * number, SIZE[0] // 2, 40 * number + 40))
    palette = sample.quantize(COLOURS)
    plain = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    times = [FRAME_MS] * (len(plain) - 1) + [LAST_MS]
    plain[0].save(FILE, save_all=True, append_images=plain[1:], duration=times, loop=0, optimize=True)
    print(f"{FILE.relative_to(headline.ROOT)}: {len(plain)} pictures, {FILE.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
