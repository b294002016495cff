"""Runs as a notebook has them: one to be made or read, and many as one table."""
