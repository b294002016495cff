"""Meanings of numbers in the tables of the drive: reasons, what is to be done to vehicles, nobody."""

from __future__ import annotations

from typing import Final

from loopgate.gates import Reason
from loopgate.kernel_cache import constant

NOBODY: Final = constant(-1)

REASONS: Final = (None, *Reason)
"""Reasons by number; 0 is none."""


_NUMBERS: Final = {reason: number for number, reason in enumerate(REASONS)}


def number_of(reason: Reason) -> int:
    """Return the number of a reason."""
    return _NUMBERS[reason]


NOTHING: Final = constant(0)
FREE: Final = constant(number_of(Reason.FREE))
OCCUPIED: Final = constant(number_of(Reason.OCCUPIED))
CROSSING: Final = constant(number_of(Reason.CROSSING))
DEADLOCK: Final = constant(number_of(Reason.DEADLOCK))
RESERVE: Final = constant(number_of(Reason.RESERVE))
SERVICE: Final = constant(number_of(Reason.SERVICE))
SPACING: Final = constant(number_of(Reason.SPACING))
STOPPING: Final = constant(number_of(Reason.STOP))
RED: Final = constant(number_of(Reason.RED))
TRAFFIC: Final = constant(number_of(Reason.TRAFFIC))

# What is to be done to a vehicle.
STOP: Final = constant(0)
RELEASE: Final = constant(1)
STEER: Final = constant(2)
PIVOT: Final = constant(3)
BRAKE: Final = constant(4)
HEED: Final = constant(5)
HEEDLESS: Final = constant(6)
