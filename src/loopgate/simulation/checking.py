"""Hands a finished gated run to the audit."""

from collections.abc import Container, Sequence
from typing import Any

from loopgate.audit import audit_events, audit_positions, read_layout
from loopgate.model import Robot, RobotId, StateId
from loopgate.results.recorder import read_event_pieces
from loopgate.simulation import outcome
from loopgate.simulation.assembly import Assembly
from loopgate.simulation.outcome import Folder, Tally
from loopgate.simulation.scenario import Scenario

_ALWAYS = ("places", "capacities", "progress", "entries")
"""Checks for which the trace of a gated run is enough."""


def audit_run(
    scenario: Scenario,
    assembly: Assembly,
    tallies: Sequence[Tally],
    folder: Folder,
    departed: Container[str],
) -> tuple[list[str], dict[str, Any]]:
    """Audit a run from its folder; return the findings, and the figures for the summary.

    Where positions were recorded, bodies and crossings are checked too. `departed` are the vehicles that were
    not there from the beginning.
    """
    abstraction = assembly.abstraction
    if abstraction is None:
        return [], {}
    trace = folder / outcome.EVENTS
    laps = {tally.vehicle: tally.laps for tally in tallies}
    layout = read_layout(folder / outcome.LAYOUT)
    ways = {vehicle: layout.loops[body.loop].legs for vehicle, body in layout.vehicles.items()}
    joined = [
        Robot(
            RobotId(one.track.vehicle),
            tuple(StateId(leg.state) for leg in ways[one.track.vehicle]),
            closed=one.start.loop.closed,
            start=one.track.start_position,
        )
        for one in assembly.departures
        if one.track is not None and one.track.vehicle in departed
    ]
    room = abstraction.room if joined else {}
    found = audit_events(read_event_pieces(trace), abstraction.system, laps=laps, joined=joined, room=room)
    findings = [finding.text for finding in found]
    figures: dict[str, Any] = {"audited": list(_ALWAYS)}
    if scenario.positions:
        seen = audit_positions(folder / outcome.POSITIONS, layout, read_event_pieces(trace))
        findings += [finding.text for finding in seen.findings]
        figures = {"audited": [*_ALWAYS, "crossings", "bodies"], "positions": seen.figures}
    return findings, figures
