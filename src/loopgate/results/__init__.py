"""The files of a run: their columns, their writers and readers."""
