"""The simulation: vehicles on roads, the gate in the loop, deadlocks recognised."""
