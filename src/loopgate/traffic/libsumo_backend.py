"""SUMO in this process: fast, without a window, one simulation at a time."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import libsumo

ERROR: tuple[type[Exception], ...] = (libsumo.TraCIException, libsumo.FatalTraCIError)
"""Errors that libsumo raises: on what it cannot do, and where it stops."""


_wrapped = libsumo.libsumo._libsumo  # noqa: SLF001  what is underneath has no other name

READS: Mapping[str, Callable[..., Any]] = {
    name: read
    for name, read in vars(_wrapped).items()
    if name.startswith(("vehicle_get", "trafficlight_get"))
}
"""Readings of vehicles and lights without the function that the wrapper has for each: a third of the time."""


def start(options: Sequence[str]) -> Any:  # noqa: ANN401  libsumo has no types
    """Start SUMO with command-line `options` and return the libsumo module."""
    libsumo.start(["sumo", *options])
    return libsumo
