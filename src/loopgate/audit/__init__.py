"""The audit: re-checks a finished run from its trace and recorded positions, not by the code that made it."""

from loopgate.audit.crossing_audit import PositionAudit, audit_positions
from loopgate.audit.layout import Layout, read_layout, write_layout
from loopgate.audit.trace_audit import Finding, audit_events

__all__ = [
    "Finding",
    "Layout",
    "PositionAudit",
    "audit_events",
    "audit_positions",
    "read_layout",
    "write_layout",
]
