"""Progress on stderr: a live line on a terminal, otherwise a line now and then; nothing for quick work."""

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Timer
from typing import Protocol

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
