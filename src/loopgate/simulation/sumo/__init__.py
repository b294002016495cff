"""Starts SUMO: its input files, its options, and the disk space that it needs."""
