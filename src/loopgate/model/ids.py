"""Types of the identifiers, so that a robot is never taken for a state."""

from typing import NewType

RobotId = NewType("RobotId", str)
"""Name of a robot (on the road: of a vehicle)."""

StateId = NewType("StateId", str)
"""Name of a discrete state (on the road: of a segment or of a place where vehicles may wait)."""
