"""What numbers in the tables of the drive stand for: reasons, what is to be done to vehicles, nobody."""

from __future__ import annotations

from typing import Final

from loopgate.gates import Reason

NOBODY: Final = -1

REASONS: Final = (None, *Reason)
"""Reasons by number; 0 is none."""


_NUMBERS: Final = {reason: number for number, reason in enumerate(REASONS)}


def number_of(reason: Reason) -> int:
    """Return the number of a reason."""
    return _NUMBERS[reason]


NOTHING: Final = 0
FREE: Final = number_of(Reason.FREE)
OCCUPIED: Final = number_of(Reason.OCCUPIED)
CROSSING: Final = number_of(Reason.CROSSING)
DEADLOCK: Final = number_of(Reason.DEADLOCK)
RESERVE: Final = number_of(Reason.RESERVE)
SERVICE: Final = number_of(Reason.SERVICE)
SPACING: Final = number_of(Reason.SPACING)
STOPPING: Final = number_of(Reason.STOP)
RED: Final = number_of(Reason.RED)
TRAFFIC: Final = number_of(Reason.TRAFFIC)

# What is to be done to a vehicle.
STOP: Final = 0
RELEASE: Final = 1
STEER: Final = 2
PIVOT: Final = 3
BRAKE: Final = 4
