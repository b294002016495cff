"""Observes a run: deadlocks, collisions with verdicts, standing vehicles, positions."""
