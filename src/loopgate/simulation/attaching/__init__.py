"""The front door for simulations of somebody else's: a gate over some of their vehicles."""
