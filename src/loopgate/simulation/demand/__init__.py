"""Which vehicles a run has: their loops, types, start positions and departures."""
