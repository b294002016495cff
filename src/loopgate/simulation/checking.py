"""Hands a finished gated run to the audit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from loopgate.audit import audit_events, audit_positions, read_layout
from loopgate.model import System
from loopgate.results.recorder import read_event_pieces
from loopgate.simulation import outcome
from loopgate.simulation.outcome import Folder, Tally
from loopgate.simulation.scenario import Scenario

__all__ = ["audit_run"]

_ALWAYS = ("places", "capacities", "progress", "entries")
"""What the trace of every gated run shows."""


def audit_run(
    scenario: Scenario, system: System, tallies: Sequence[Tally], folder: Folder
) -> tuple[list[str], dict[str, Any]]:
    """Audit a run from its folder; return the findings, and the figures for the summary.

    Where positions were recorded, bodies and crossings are checked too.
    """
    trace = folder / outcome.EVENTS
    laps = {tally.vehicle: tally.laps for tally in tallies}
    findings = [finding.text for finding in audit_events(read_event_pieces(trace), system, laps=laps)]
    figures: dict[str, Any] = {"audited": list(_ALWAYS)}
    if scenario.positions:
        layout = read_layout(folder / outcome.LAYOUT)
        found = audit_positions(folder / outcome.POSITIONS, layout, read_event_pieces(trace))
        findings += [finding.text for finding in found.findings]
        figures = {"audited": [*_ALWAYS, "crossings", "bodies"], "positions": found.figures}
    return findings, figures
