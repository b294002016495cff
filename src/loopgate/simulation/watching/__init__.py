"""Looks at a run as it goes: deadlocks, collisions and who erred, standing, where everybody is."""
