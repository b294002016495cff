"""Pictures and tables of networks, runs and sweeps."""
