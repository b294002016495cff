"""What every command does in a terminal: progress, tables, JSON, Ctrl-C, opening pages, numbers."""

import ctypes
import json
import math
import os
import signal
import sys
import threading
import time
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, redirect_stdout, suppress
from math import isnan
from pathlib import Path
from threading import Timer
from types import FrameType
from typing import IO, Any, Protocol

import click

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


_STDOUT, _STDERR = 1, 2

_to: list[IO[str]] = []
"""Where JSON goes while all else that is printed goes to stderr."""


def print_json(
    data: Any,  # noqa: ANN401  any JSON value
    *,
    indent: int | None = None,
    default: Callable[[Any], Any] | None = None,
) -> None:
    """Print data as JSON; takes the options of `json.dumps`."""
    click.echo(json.dumps(data, indent=indent, default=default), file=_to[-1] if _to else None)


@contextmanager
def only_json(*, wanted: bool) -> Iterator[None]:
    """Send all output but that of `print_json` to stderr, if `wanted`.

    SUMO prints by the file descriptor, in this process and in others, whatever Python's stream is.
    """
    if not wanted:
        yield
        return
    with ExitStack() as stack:
        _to.append(stack.enter_context(_apart()))
        stack.callback(_to.pop)
        stack.enter_context(redirect_stdout(sys.stderr))
        yield


@contextmanager
def _apart() -> Iterator[IO[str]]:
    """Yield a stream to where stdout leads, and let its file descriptor lead to stderr meanwhile."""
    sys.stdout.flush()
    kept = os.dup(_STDOUT)
    os.dup2(_STDERR, _STDOUT)
    try:
        with open(kept, "w", encoding="utf-8", closefd=False) as stream:
            yield stream
    finally:
        with suppress(OSError, AttributeError, TypeError):
            ctypes.CDLL(None).fflush(None)  # what SUMO has printed so far waits in the C library
        os.dup2(kept, _STDOUT)
        os.close(kept)


def open_page(page: Path) -> None:
    """Open a page in the user's browser; where there is none, say on stderr which file to open."""
    if not webbrowser.open(page.resolve().as_uri()):
        click.echo(f"loopgate: no browser found; open {page} in one", err=True)


_LONGEST_M = 1e6


class FiniteRange(click.FloatRange):
    """A range of numbers without `nan`; the range of click includes it."""

    def convert(self, value: float, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return the number; fail if it is out of range or not a number."""
        number: float = super().convert(value, param, ctx)
        if isnan(number):
            self.fail(f"{value} is not in the range {self._describe_range()}.", param, ctx)
        return number


_OF_DAY = {"begin_s", "first_s"}


class Time(click.ParamType[float]):
    """A time: seconds, ``h:m:s`` as in SUMO, or with units, as ``2h30min``; a begin may be ``9:30``."""

    name = "time"

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return the time [s]; fail if it is none."""
        # Needs the room of networks, and help should not.
        from loopgate.network.clock import time_of_day, with_units

        text = str(value).strip()
        with suppress(ValueError):
            return float(text)
        begins = param is not None and param.name in _OF_DAY
        try:
            return time_of_day(text) if begins else with_units(text)
        except ValueError:
            ways = "h:m, h:m:s or seconds" if begins else "seconds, h:m:s, 10min or 1.5h"
            self.fail(f"{text!r} is no time; write {ways}", param, ctx)


class _LengthRange(click.ParamType[tuple[float, float]]):
    name = "MIN:MAX"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[float, float]:
        if isinstance(value, tuple):
            return value
        low, _, high = str(value).partition(":")
        try:
            found = float(low), float(high)
        except ValueError:
            self.fail(f"{value!r} is no range of lengths; write two numbers, like 400:2000", param, ctx)
        if not 0.0 < found[0] <= found[1] <= _LONGEST_M:
            self.fail(f"{value!r}: expected 0 < shortest <= longest <= {_LONGEST_M:g}", param, ctx)
        return found


LENGTH_RANGE = _LengthRange()
"""Shortest and longest length [m], written ``400:2000``."""


_QUICK_S = 2.0
_SPARSE_S = 15.0
_WIDEST = 30
"""So many letters of what is done fit beside a bar and two times on 80 columns."""


class Report(Protocol):
    """A function that takes how much is done."""

    def __call__(self, done: int, total: int | None = None, more: str = "") -> None:
        """Take note that `done` of `total` units (None: unknown) are done; `more` is said besides."""
        ...


@contextmanager
def show_progress(what: str, *, total: int | None = None) -> Iterator[Report]:
    """Show how far the work inside the ``with`` block is, on stderr.

    Nothing is shown before two seconds have passed. Where stderr is no terminal, a line is written every
    fifteen seconds.
    """
    if sys.stderr.isatty():
        with _live(what, total) as report:
            yield report
    else:
        yield _Sparse(what, total)


@contextmanager
def _live(what: str, total: int | None) -> Iterator[Report]:
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(bar_width=14),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        console=Console(stderr=True),
        transient=True,
    )
    task = bar.add_task(_short(what), total=total)
    # By a clock of its own: there may be much to prepare, or to compile, before the first report.
    start = Timer(_QUICK_S, bar.start)
    start.daemon = True
    start.start()

    def report(done: int, total: int | None = None, more: str = "") -> None:
        bar.update(task, completed=done, total=total, description=_short(what + more))

    try:
        yield report
    finally:
        start.cancel()
        start.join()
        bar.stop()


class _Sparse:
    def __init__(self, what: str, total: int | None) -> None:
        self._what = what
        self._total = total
        self._began = self._last = time.monotonic()
        self._first: int | None = None

    def __call__(self, done: int, total: int | None = None, more: str = "") -> None:
        total = self._total if total is None else total
        if self._first is None:
            self._first = done  # what was there before says nothing of the pace
        if time.monotonic() - self._last > _SPARSE_S:
            self._last = time.monotonic()
            of = "" if total is None else f" of {total}"
            pace = (self._last - self._began) / (done - self._first) if done > self._first else None
            left = "" if total is None or pace is None else f", {_span((total - done) * pace)} left"
            sys.stderr.write(f"{_short(self._what, 2 * _WIDEST - 15)}: {done}{of}{left}{more}\n")
            sys.stderr.flush()


def _span(seconds: float) -> str:
    """Return a time in words: under two minutes in seconds, then in minutes."""
    return f"{seconds:.0f} s" if seconds < 120 else f"{seconds / 60:.0f} min"  # noqa: PLR2004  two minutes


def _short(what: str, most: int = _WIDEST) -> str:
    """Return the text; if it is too long, without its middle."""
    if len(what) <= most:
        return what
    return f"{what[: most // 2 - 2]}...{what[-(most - most // 2 - 1) :]}"


def without_way_out(error: Exception) -> str:
    """Return why nobody is gated, where all drive by SUMO's rules anyway."""
    return str(error).removesuffix("; or --gate open")
