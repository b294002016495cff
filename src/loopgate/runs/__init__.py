"""Runs in a notebook: make or read a run, and read many runs as one table."""
