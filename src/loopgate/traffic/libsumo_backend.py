"""SUMO inside this process: fast, no window, one simulation at a time."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import libsumo

ERROR: tuple[type[Exception], ...] = (libsumo.TraCIException, libsumo.FatalTraCIError)
"""Errors that libsumo raises: on what it cannot do, and where it stops."""


_wrapped = libsumo.libsumo._libsumo  # noqa: SLF001  what is underneath has no other name

READS: Mapping[str, Callable[[str], Any]] = {
    name: getattr(_wrapped, f"vehicle_{name}", getattr(libsumo.vehicle, name))
    for name in ("getDistance", "getLaneID", "getLanePosition", "getSpeed")
}
"""Readings taken of every vehicle in every step, by the name of the function that the wrapper has for it.

Without that function where that can be had: it takes a third of the time.
"""


def start(options: Sequence[str]) -> Any:  # noqa: ANN401  libsumo has no types
    """Start SUMO with command-line `options` and return the libsumo module."""
    libsumo.start(["sumo", *options])
    return libsumo
