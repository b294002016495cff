"""SUMO as a process of its own over a socket: slower, and the way to see it in sumo-gui."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import sumo
import traci

__all__ = ["ERROR", "start"]

_GUI_DELAY_MS = "20"
"""Pause per step, so that there is something to see; sumo-gui has a knob for it."""

ERROR: tuple[type[Exception], ...] = (traci.exceptions.TraCIException, traci.exceptions.FatalTraCIError)
"""What traci raises: on what SUMO cannot do, and where it stops."""


def start(options: Sequence[str], *, gui: bool) -> Any:  # noqa: ANN401  traci has no types
    """Start ``sumo`` or ``sumo-gui`` with command-line `options` and return the connection."""
    os.environ.setdefault("SUMO_HOME", sumo.SUMO_HOME)
    binary = Path(sumo.SUMO_HOME) / "bin" / ("sumo-gui" if gui else "sumo")
    more = ["--start", "--quit-on-end", "--delay", _GUI_DELAY_MS] if gui else []
    label = f"loopgate-{os.getpid()}"
    traci.start([str(binary), *options, *more], label=label, numRetries=60)
    return traci.getConnection(label)
