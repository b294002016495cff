"""SUMO as a process of its own over a socket: slower, and the way to see it in sumo-gui."""

import io
import os
import socket
import subprocess
import sys
from collections.abc import Sequence
from contextlib import redirect_stdout
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, Any

import sumo
import traci

from loopgate.errors import TrafficError

_GUI_DELAY_MS = "20"
"""Pause per step, so that there is something to see; sumo-gui has a knob for it."""

_LOOKS = Path(__file__).with_name("gui.xml")
"""How the window looks: quiet roads, vehicles that can be seen from afar."""

_TRIES, _BETWEEN_TRIES_S = 600, 0.1
"""How long SUMO may take to read a large network: a minute."""

_LAST_WORDS_S = 10.0
"""How long SUMO may take to end once it has hung up."""

ERROR: tuple[type[Exception], ...] = (traci.main.TraCIException, traci.main.FatalTraCIError)
"""Errors that traci raises: on what SUMO cannot do, and where it stops.

Not by their names in ``traci.exceptions``: libsumo puts a class of its own there when it is imported.
"""


def check_display() -> None:
    """Raise `TrafficError` if there is no display for sumo-gui to open."""
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        msg = (
            "there is no display for sumo-gui: neither DISPLAY nor WAYLAND_DISPLAY is set; leave out --gui, "
            "or log in with one (ssh -X)"
        )
        raise TrafficError(msg)


def start(options: Sequence[str], *, gui: bool) -> Any:  # noqa: ANN401  traci has no types
    """Start ``sumo`` or ``sumo-gui`` with command-line `options` and return the connection.

    Raises `TrafficError` if there is no such program, or it ends before it answers.
    """
    os.environ.setdefault("SUMO_HOME", sumo.SUMO_HOME)
    binary = Path(sumo.SUMO_HOME) / "bin" / ("sumo-gui" if gui else "sumo")
    looks = ["--gui-settings-file", str(_LOOKS)]
    more = ["--start", "--quit-on-end", "--delay", _GUI_DELAY_MS, *looks] if gui else []
    port = _free_port()
    command = [str(binary), *options, *more, "--remote-port", str(port)]
    with TemporaryFile() as words:
        try:
            # In a session of its own: what interrupts this process and its group must not end SUMO under it.
            process = subprocess.Popen(  # noqa: S603  SUMO's own program
                command, stderr=words, start_new_session=True
            )
        except OSError as error:
            msg = f"{binary}: cannot be started ({error.strerror or error}); it comes with eclipse-sumo"
            raise TrafficError(msg) from error
        try:
            with redirect_stdout(io.StringIO()):  # where traci tells of every try
                running = traci.connect(
                    port, numRetries=_TRIES, proc=process, waitBetweenRetries=_BETWEEN_TRIES_S
                )
            running.getVersion()  # SUMO lets one connect before it has read its input
        except BaseException as error:
            _end(process, _LAST_WORDS_S if isinstance(error, ERROR) else 0.0)
            if not isinstance(error, ERROR):
                raise
            where = f"; can it open the display {os.environ.get('DISPLAY', '')}?" if gui else ""
            msg = _first_error(words) or f"{binary.name} ended before it answered{where}"
            raise TrafficError(msg) from error
    return running


def _end(process: subprocess.Popen[bytes], after_s: float) -> None:
    """Wait until SUMO has ended by itself, and told why; else end it."""
    try:
        process.wait(after_s)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _first_error(words: IO[bytes]) -> str:
    words.seek(0)
    lines = words.read().decode("utf-8", errors="replace").splitlines()
    return next((line.removeprefix("Error: ") for line in lines if line.startswith("Error")), "")


def _free_port() -> int:
    with socket.socket() as one:
        one.bind(("localhost", 0))
        return int(one.getsockname()[1])
