"""Types for the names of robots and states, so that type checkers keep them apart."""

from typing import NewType

RobotId = NewType("RobotId", str)
"""Name of a robot (on the road: of a vehicle)."""

StateId = NewType("StateId", str)
"""Name of a discrete state (on the road: of a segment or of a place where vehicles may wait)."""
