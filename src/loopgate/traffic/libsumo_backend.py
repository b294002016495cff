"""SUMO inside this process: fast, no window, one simulation at a time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import libsumo

ERROR: tuple[type[Exception], ...] = (libsumo.TraCIException, libsumo.FatalTraCIError)
"""Errors that libsumo raises: on what it cannot do, and where it stops."""


_wrapped = libsumo.libsumo._libsumo  # noqa: SLF001  what is underneath has no other name

ODOMETER: Callable[[str], float] = getattr(_wrapped, "vehicle_getDistance", libsumo.vehicle.getDistance)
"""Returns how far a vehicle has driven [m], without the Python function around it where that can be had.

Every vehicle is asked in every step, and the function around it takes a third of the time.
"""


def start(options: Sequence[str]) -> Any:  # noqa: ANN401  libsumo has no types
    """Start SUMO with command-line `options` and return the libsumo module."""
    libsumo.start(["sumo", *options])
    return libsumo
