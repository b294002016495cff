"""The vehicles of a run, their loops, and their start positions."""
