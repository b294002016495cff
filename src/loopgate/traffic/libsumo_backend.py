"""SUMO inside this process: fast, no window, one simulation at a time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import libsumo

__all__ = ["ERROR", "start"]

ERROR: type[Exception] = libsumo.TraCIException
"""What libsumo raises."""


def start(options: Sequence[str]) -> Any:  # noqa: ANN401  libsumo has no types
    """Start SUMO with command-line `options` and return the libsumo module."""
    libsumo.start(["sumo", *options])
    return libsumo
