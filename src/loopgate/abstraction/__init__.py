"""From loops on roads to a system of robots and states."""
