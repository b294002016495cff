"""Vehicles on closed loops in a SUMO road network that never collide and never lock up."""
