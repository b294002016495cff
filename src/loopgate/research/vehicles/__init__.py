"""Explores the protocol of `loopgate.vehicles` with messages in every order, late or lost."""
