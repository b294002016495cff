"""Puts vehicles under a gate in a simulation that its owner starts and steps."""
