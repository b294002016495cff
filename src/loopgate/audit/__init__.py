"""The audit: re-checks a finished run from its trace, without the code that made it."""

from loopgate.audit.trace_audit import Finding, audit_events

__all__ = ["Finding", "audit_events"]
