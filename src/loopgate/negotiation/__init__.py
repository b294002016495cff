"""Negotiations decide which of the vehicles that may go goes first: strategies by name."""
