"""Vehicles and posts that decide by messages, in simulated time: decisions, radio, controllers."""
