"""Signals: SIGTERM and SIGHUP end a command as Ctrl-C does."""

import math
import signal
import threading
import time
from types import FrameType

EXIT_INTERRUPTED = 130
"""Whichever signal it was: what is left behind is the same."""

_SAME_S = 1.0
"""One event may arrive twice, sent to the process and to its group, as timeout(1) does."""


class _Interrupt:
    """A signal handler that raises `KeyboardInterrupt`, once for one event."""

    def __init__(self) -> None:
        self._last_s = -math.inf

    def __call__(self, number: int, frame: FrameType | None) -> None:
        del number, frame
        now = time.monotonic()
        before, self._last_s = self._last_s, now
        if now - before > _SAME_S:
            raise KeyboardInterrupt


def listen() -> None:
    """Let SIGINT, SIGTERM and SIGHUP raise `KeyboardInterrupt`, except where they are ignored (nohup)."""
    if threading.current_thread() is not threading.main_thread():
        return  # handlers are the main thread's
    handler = _Interrupt()
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, handler)
