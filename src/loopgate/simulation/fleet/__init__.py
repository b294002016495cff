"""Vehicles under the gate: they come and go, stop, park, and keep apart on their loops."""
