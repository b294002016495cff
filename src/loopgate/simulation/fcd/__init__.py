"""Runs that are read from the FCD output of a finished SUMO simulation."""
