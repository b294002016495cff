"""Who goes first among the vehicles that may go: strategies by name."""
