"""Closed loops that cover given streets, by design: the longest as short as can be."""
