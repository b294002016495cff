"""Audits a finished gated run."""

from collections.abc import Collection, Container, Mapping, Sequence
from typing import Any

from loopgate.audit import audit_events, audit_positions, read_layout
from loopgate.audit.layout import LoopLeg
from loopgate.model import Robot, RobotId, StateId
from loopgate.results.recorder import read_event_pieces
from loopgate.simulation import run_folder
from loopgate.simulation.assembly import Assembly
from loopgate.simulation.run_folder import Folder, Tally
from loopgate.simulation.scenario import Scenario

_ALWAYS = ("places", "capacities", "progress", "entries")
"""Checks that need only the events of a gated run."""


def audit_run(
    scenario: Scenario,
    assembly: Assembly,
    tallies: Sequence[Tally],
    folder: Folder,
    departed: Container[str],
    turned: Collection[str] = (),
) -> tuple[list[str], dict[str, Any]]:
    """Audit a run from its folder; return the findings, and figures for ``summary.json``.

    Where positions were recorded, bodies and crossings are checked too. `departed`: the vehicles that
    departed during the run. `turned`: the vehicles that changed to another path.
    """
    abstraction = assembly.abstraction
    if abstraction is None:
        return [], {}
    trace = folder / run_folder.EVENTS
    laps = {tally.vehicle: tally.laps for tally in tallies}
    layout = read_layout(folder / run_folder.LAYOUT)
    ways = {vehicle: layout.loops[body.loop].legs for vehicle, body in layout.vehicles.items()}
    joined = [
        Robot(
            RobotId(one.vehicle),
            tuple(StateId(leg.state) for leg in ways[one.vehicle]),
            closed=one.loop.closed and one.vehicle not in turned,
            start=one.track.position,
        )
        for one in assembly.departures
        if one.track.legs and one.vehicle in departed
    ]
    joined += _turned(assembly, ways, turned)
    laps = {vehicle: count for vehicle, count in laps.items() if vehicle not in turned}
    room = abstraction.room if joined else {}
    found = audit_events(read_event_pieces(trace), abstraction.system, laps=laps, joined=joined, room=room)
    findings = [finding.text for finding in found]
    figures: dict[str, Any] = {"audited": list(_ALWAYS)}
    if scenario.positions:
        seen = audit_positions(folder / run_folder.POSITIONS, layout, read_event_pieces(trace))
        findings += [finding.text for finding in seen.findings]
        figures = {"audited": [*_ALWAYS, "crossings", "bodies"], "positions": seen.figures}
    return findings, figures


def _turned(
    assembly: Assembly, ways: Mapping[str, Sequence[LoopLeg]], turned: Collection[str]
) -> list[Robot]:
    """Return each vehicle that left its loop for another, with all that it drove as one open path."""
    return [
        Robot(
            RobotId(start.vehicle),
            tuple(StateId(leg.state) for leg in ways[start.vehicle]),
            closed=False,
            start=start.track.position,
        )
        for start in assembly.starts
        if start.vehicle in turned and start.loop.closed
    ]
