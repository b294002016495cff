"""The files that a run leaves behind: their columns, and how they are written and read."""
