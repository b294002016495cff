"""The gate over some vehicles of a simulation that its owner starts and steps."""
