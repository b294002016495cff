"""Make the pictures of the README and of docs/, and renew the README's first table: ``make readme``.

The hour in Berlin is simulated twice (`headline`); what comes out goes into the table, the picture and its
text. It is simulated twice more in steps of half a second, for the sentence about these. All else is drawn
without simulating. Look at the difference before you commit it.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import demo
import headline
import pandas as pd
from PIL import Image

from loopgate.abstraction.queue_survey import survey_queues
from loopgate.network import RoadNetwork, generate_loops
from loopgate.network.vehicle_type import DEFAULT_TYPE
from loopgate.report.queue_map import draw_queues

ROOT = Path(__file__).resolve().parent.parent
IMAGES = ROOT / "docs" / "images"
README = ROOT / "README.md"
DPI = 85
COLOURS = 224


def draw_berlin_queues(file: Path) -> None:
    """Draw what ``loopgate inspect`` shows of the loops that ``loopgate loops sumo:DRT --count 40`` makes."""
    network = RoadNetwork.open("sumo:DRT")
    loops = generate_loops(network, 40)
    found = survey_queues(network, [(loop, DEFAULT_TYPE) for loop in loops])
    title = f"sumo:DRT: {len(found.loops)} loops, {len(found.places)} places for {found.holds} vehicles"
    draw_queues(network, found, file, title=title, dpi=DPI)


def shrink(file: Path) -> None:
    """Keep as many colours of a picture as it needs: a repository remembers every version of it."""
    with Image.open(file) as image:
        if image.mode != "P":
            image.convert("RGB").quantize(COLOURS).save(file, optimize=True)


def table_row(row: Mapping[Any, Any]) -> str:
    """Return a row of the README's first table."""
    wait = f"{row['wait']} s" if row["wait"] != "-" else ""
    first = "never" if row["deadlock"] == "never" else f"at {row['deadlock']} s"
    cells = (
        row["rule"],
        row["km"],
        row["laps"],
        row["lapless"],
        row["still"],
        first,
        row["collisions"],
        wait,
        f"{row['stood']} s",
    )
    return "| " + " | ".join(map(str, cells)).rstrip() + " |"


def renew(text: str, table: pd.DataFrame) -> str:
    """Return the README with the rows of `table` in its first table and in the text of its first picture."""
    rows = {str(row["rule"]): row for row in table.to_dict("records")}
    for rule, row in rows.items():
        text, changed = re.subn(
            rf"^\| {re.escape(rule)} \|.*$", table_row(row), text, count=1, flags=re.MULTILINE
        )
        if not changed:
            msg = f"{README}: no row '{rule}' in its first table"
            raise RuntimeError(msg)
    still = rows[headline.GATES["open"]]["still"]
    ours = rows[headline.GATES["certified"]]["still"] or "none"
    return re.sub(
        r"\d+ of 400 vehicles stand still for good under SUMO's own rules, \w+ under loopgate",
        f"{still} of 400 vehicles stand still for good under SUMO's own rules, {ours} under loopgate",
        text,
        count=1,
    )


def in_small_steps(rows: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the sentence about the hour in steps of half a second, from the rows by gate."""
    open_, ours = rows["open"], rows["certified"]
    locks = "does not lock up" if open_["deadlock"] == "never" else f"locks up at {open_['deadlock']} s"
    stands = "and never locks up" if ours["deadlock"] == "never" else f"and locks up at {ours['deadlock']} s"
    return (
        f"In steps of 0.5 s SUMO {locks} with seed {headline.BERLIN.seed}: it drives {open_['km']} km with "
        f"{open_['collisions']} collisions. Loopgate drives {ours['km']} km with {ours['collisions']}, "
        f"{stands}; the longest wait is {ours['wait']} s."
    )


def main() -> None:
    """Draw, simulate, write."""
    demo.draw("small", IMAGES / "order2.png", dpi=DPI)
    draw_berlin_queues(IMAGES / "queues.png")
    table, picture = headline.headline()
    (IMAGES / "berlin.png").write_bytes(picture.read_bytes())
    for file in sorted(IMAGES.glob("*.png")):
        shrink(file)
    text = renew(README.read_text(encoding="utf-8"), table)
    fine = {gate: row for gate, (row, _) in zip(headline.GATES, headline.drive(0.5), strict=True)}
    text = re.sub(r"In steps of 0\.5 s SUMO .* the longest wait is [\d-]+ s\.", in_small_steps(fine), text)
    README.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
