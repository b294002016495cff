"""The demo: ``make demo``.

First the headline, 400 vehicles in south-east Berlin under SUMO's own rules and under ours (`headline`).
Then the paper's method: the same vehicles under three gates. In the city twelve loops share at most 40 % of
their length each; on ``networks/order2.net.xml`` they share so much that vehicles lock up unless somebody
looks ahead.
Prints two tables, draws the maps, writes a report on Berlin, leaves the run folders; all in ``out/demo``.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import headline
import pandas as pd
from frame_table import frame_table
from rich.console import Console
from side_by_side import side_by_side

from loopgate.report.base_map import DPI
from loopgate.report.network_map import draw_map
from loopgate.report.page import write_report
from loopgate.runs.results import read_results
from loopgate.simulation.assembly import assemble
from loopgate.simulation.scenario import Scenario

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "out" / "demo"
GATES = ("open", "collision", "algorithm2")
PAPER: Any = {"abstraction": "segments", "negotiation": "random"}
SCENARIOS = {
    "city": Scenario(network="sumo:DRT", routes=str(ROOT / "routes" / "drt.rou.xml"), **PAPER),
    "small": Scenario(
        network=str(ROOT / "networks" / "order2.net.xml"),
        routes=str(ROOT / "routes" / "order2.rou.xml"),
        **PAPER,
    ),
}

HEADINGS = {
    "where": "network",
    "gate": "gate",
    "outcome": "outcome",
    "first_deadlock_s": "at [s]",
    "collisions": "collisions",
    "teleports": "teleports",
    "laps": "laps",
    "distance_km": "km",
    "mean_speed_mps": "m/s",
    "hold_s": "held [s]",
}


def drive() -> list[dict[str, Any]]:
    """Run each scenario under each gate; return their rows."""
    runs = {
        OUT / name / gate: dataclasses.replace(scenario, gate=gate)
        for name, scenario in SCENARIOS.items()
        for gate in GATES
    }
    summaries = side_by_side("the paper's method, one hour each", runs)
    return [_row(scenario, summary) for scenario, summary in zip(runs.values(), summaries, strict=True)]


def _row(scenario: Scenario, summary: dict[str, Any]) -> dict[str, Any]:
    deadlocks = summary["deadlocks"]
    return {
        **summary,
        "where": Path(scenario.network).name.removesuffix(".net.xml"),
        "first_deadlock_s": float(deadlocks[0]["closed_at_s"]) if deadlocks else float("nan"),
    }


def draw(name: str, file: Path, *, dpi: int = DPI) -> Path:
    """Draw the loops, zones and starting places of scenario `name` to `file`, which is returned."""
    assembly = assemble(SCENARIOS[name])
    states = assembly.abstraction
    if states is None:
        msg = "one vehicle per loop always has states"
        raise RuntimeError(msg)
    itineraries = {itinerary.loop.id: itinerary for itinerary in states.itineraries}
    draw_map(
        assembly.network,
        assembly.loops,
        [itineraries[loop.id] for loop in assembly.loops],
        file,
        starts_m=states.starts_m,
        title=f"{Path(SCENARIOS[name].network).name}: {len(assembly.loops)} loops",
        dpi=dpi,
    )
    return file


def main() -> None:
    """Run, draw, print."""
    table, picture = headline.headline()
    console = Console(highlight=False)
    wide = Console(highlight=False, width=max(console.width, 110))
    wide.print(frame_table(table, headline.HEADINGS, title=headline.TITLE))
    page = OUT / "berlin.html"
    write_report(read_results(OUT / "berlin"), page)
    console.print(f"picture: {picture.relative_to(ROOT)}, report: {page.relative_to(ROOT)}")
    rows = drive()
    files = [draw(name, OUT / f"{name}.png") for name in SCENARIOS]
    wide.print(
        frame_table(pd.DataFrame(rows), HEADINGS, title="One hour, the same loops and seed per network")
    )
    for row in rows:
        for deadlock in row["deadlocks"][:1]:
            circle = " -> ".join([*deadlock["vehicles"], deadlock["vehicles"][0]])
            console.print(f"{row['where']}, {row['gate']}: deadlock, each waits for the next: {circle}")
    maps = ", ".join(str(file.relative_to(ROOT)) for file in files)
    console.print(f"maps: {maps}; run folders beside them")


if __name__ == "__main__":
    main()
