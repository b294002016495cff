"""Which vehicles there are, on which ways, and where they begin."""
