"""Makes a run folder from the FCD output of a finished SUMO simulation."""
