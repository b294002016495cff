"""Surroundings of vehicles under the gate: lights that they obey, ordinary traffic that they give way to."""
