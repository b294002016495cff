"""The drive: tables of vehicles, legs, states and movements, and what is done with them in each step."""
