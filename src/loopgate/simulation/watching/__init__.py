"""Observes a run: deadlocks, starvation, collisions, distances, positions and trips."""
