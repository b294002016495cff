"""Runs scenarios in SUMO: places the vehicles, drives them under a gate, and writes the results."""
