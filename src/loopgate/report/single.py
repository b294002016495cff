"""Items of a single run: causes of waiting, a loop over time, stuck vehicles."""

import json
from pathlib import Path
from typing import Any

import pandas as pd

from loopgate import plots
from loopgate.analysis import columns as a
from loopgate.analysis import (
    compute_blocked,
    compute_causes,
    compute_messages,
    compute_promises,
    compute_rarest,
    compute_seen_within,
    compute_starving,
    compute_stuck,
    compute_time_space,
)
from loopgate.report.items import Content
from loopgate.results import columns as run
from loopgate.runs.run import Run, read_run

_MOST_POINTS = 6000
_STREETS = f'run.streets["{run.EDGE}"]'


def add_single_run(content: Content, folder: Path) -> str:
    """Add the items from the events of a run; return the line that loads it."""
    one = read_run(folder)
    content.known |= {
        "run.events": one.events,
        "run.vehicles": one.vehicles,
        "run.loops": one.loops,
    }
    times = [float(table[run.TIME].max()) for table in (one.events, one.flow) if len(table)]
    end_s = max(times, default=0.0)
    begin_s = max(0.0, end_s - float(one.summary["duration_s"]))
    if end_s > begin_s:
        options: dict[str, Any] = {"begin_s": begin_s, "end_s": end_s}
        of = {"events": "run.events"}
        causes = content.table("causes", "Waits by cause", compute_causes, of, **options)
        if len(causes):
            content.figure(
                "causes",
                "Why vehicles wait",
                "All waits for the gate, by the reason of the refusal.",
                plots.plot_ranked(causes, of=run.REASON, value=a.WAIT, label="vehicle-seconds"),
            )
        _add_watch(content, one, options)
    _add_standing(content, one)
    _add_loop(content, one.vehicles, one.loops)
    of = {"vehicles": "run.vehicles", "events": "run.events"}
    content.table("stuck", "Vehicles that are stuck", compute_stuck, of, end_s=end_s)
    return f"\nrun = read_run({json.dumps(str(folder), ensure_ascii=False)})"


def _add_standing(content: Content, one: Run) -> None:
    """Add the places in which something stood, and the vehicles that starved."""
    content.known["run.summary"] = one.summary
    of = {"summary": "run.summary"}
    content.table("blocked", "What stood, and since when nobody was let in", compute_blocked, of)
    content.table("starving", "Vehicles that starved, and behind which vehicle", compute_starving, of)
    content.table("messages", "Messages by which vehicles decided", compute_messages, of)


def _add_watch(content: Content, one: Run, period: dict[str, Any]) -> None:
    """Add the unseen streets, the streets on no loop in view, and the revisit intervals."""
    streets = one.streets
    if streets is None or not (streets[run.VISITS] > 0).any():
        return
    content.known |= {"run.streets": streets, _STREETS: streets[run.EDGE]}
    if one.scenario.get("revisit_s"):
        content.table("promises", "Promises, by street", compute_promises, {"streets": "run.streets"})
    content.table("rarest", "Streets that went unseen longest", compute_rarest, {"streets": "run.streets"})
    of, since_s = {"events": "run.events", "streets": _STREETS}, float(one.summary.get(run.BEGINS, 0.0))
    seen = content.table(
        "seen-within", "Seen within", compute_seen_within, of, listed=False, **period, since_s=since_s
    )
    never = int((streets[run.VISITS] == 0).sum())
    caption = "Broad and strong where a street went unseen for long."
    if never:
        caption += f" {never} of {len(streets)} were never seen: dashed."
    content.drop("idleness-map")
    content.figure("unwatched", "Which roads go unwatched", caption, plots.plot_unwatched(streets), "rarest")
    content.figure(
        "seen-within",
        "How soon streets are seen again",
        "The share of all streets, also never seen streets, that was seen within this time.",
        plots.plot_seen_within({"": seen}, bound_s=one.scenario.get("revisit_s") or None),
    )


def _add_loop(content: Content, vehicles: pd.DataFrame, loops: pd.DataFrame) -> None:
    """Add the loop with the most standing, over time."""
    driven = vehicles[vehicles[run.LOOP].isin(loops[run.LOOP])]
    if driven.empty or run.STOOD not in driven:
        return
    loop = str(driven.groupby(run.LOOP)[run.STOOD].sum().idxmax())
    points = content.table(
        "time-space",
        f"Loop {loop} over time",
        compute_time_space,
        {"events": "run.events", "vehicles": "run.vehicles", "loops": "run.loops"},
        listed=False,
        loop=loop,
    )
    if 0 < len(points) <= _MOST_POINTS:
        content.figure(
            "time-space",
            f"Loop {loop}: its vehicles over time",
            "The loop on which vehicles stood longest. A line per vehicle and lap, straight between "
            "the beginnings of two edges; the flatter, the slower.",
            plots.plot_time_space(points),
        )
