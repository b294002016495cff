"""Tells whether a run is clean, and words a warning for each kind of finding."""

from collections.abc import Mapping
from typing import Any

from loopgate.gates import Reason
from loopgate.reading import counted, listed

_MOST_SINKS = 5


def is_clean(summary: Mapping[str, Any]) -> bool:
    """Return whether a gated run had no collision, overrun or trespass, and no finding of the audit."""
    counted = (summary[name] for name in ("collisions", "overruns", "trespasses"))
    return summary["audit"] == "clean" and not any(counted)


def _starved(sink: Mapping[str, Any], promise: str) -> str:
    """Say which vehicle stood, why, when, and how many vehicles starved behind it."""
    others = [vehicle for vehicle in sink["vehicles"] if vehicle != sink["behind"]]
    time = f"from {sink['noticed_s']:g} s to {sink['until_s']:g} s"
    time += f", when the promise that {promise} can go on did not hold" if promise else ""
    if not sink["behind"]:
        return f"{counted(len(others), 'vehicle')} starved at gates ({sink['why']}): {time}"
    stood = f"{sink['behind']} stood on lane {sink['lane']} ({sink['why']})"
    behind = f", and {counted(len(others), 'vehicle')} starved behind it" if others else ""
    return f"{stood}{behind}: {time}"


def warnings_of(summary: Mapping[str, Any]) -> list[str]:
    """Return warnings about vehicles that broke a refusal, strayed or starved."""
    lines = []
    if summary["overruns"]:
        lines.append(
            f"{summary['overruns']} held vehicles could not brake for their line, or did not, and were "
            "stopped as hard as possible: the events 'overrun' name them and the places"
        )
    if summary["trespasses"]:
        lines.append(
            f"{summary['trespasses']} vehicles entered a state without a grant: the events "
            "'enter' with the reason 'not granted' name them and the places"
        )
    if summary["strays"]:
        lines.append(
            f"SUMO took {summary['strays']} vehicles to a lane outside their loop; they were led back: "
            "the events 'stray' name them and the places"
        )
    sinks = sorted(summary["starving"], key=lambda sink: -len(sink["vehicles"]))
    lines += [_starved(sink, summary["promise"]) for sink in sinks[:_MOST_SINKS]]
    if len(sinks) > _MOST_SINKS:
        lines.append(f"vehicles starved at {len(sinks) - _MOST_SINKS} more places: the summary lists all")
    if no_way := summary.get("standing", {}).get("no_way_round"):
        lines.append(
            f"vehicles on {listed(no_way)} had no way round what stood, or must stop on their loop: "
            "they waited before it"
        )
    if faults := summary["refusals"].get(Reason.FAULT.value):
        lines.append(
            f"{faults} moves were refused because the witness failed the gate's own check; this is a "
            "fault of loopgate: please report it with the scenario"
        )
    return lines
