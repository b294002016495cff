"""Vehicles that decide about their moves by radio messages in simulated time, without a central gate."""
