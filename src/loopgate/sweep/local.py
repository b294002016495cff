"""An executor of processes on this machine, each of which may die without harm to the others."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable
from concurrent.futures import Executor, Future
from typing import ParamSpec, TypeVar

from pebble import ProcessExpired, ProcessPool

from loopgate.machines import processors

P = ParamSpec("P")
T = TypeVar("T")

_RECYCLE_AFTER = 64  # calls; SUMO and the allocator give back less memory than they take


class LocalExecutor(Executor):
    """An executor that runs calls in `workers` separate processes, one call at a time in each.

    Unlike in `concurrent.futures.ProcessPoolExecutor`, the death of a worker fails only its own call
    (`pebble.ProcessExpired`); the next call gets a new process. A call that takes too long is ended with its
    process (`TimeoutError`). Workers end when this process ends, in whatever way.

    Parameters
    ----------
    workers
        Number of processes; default: the processors this process may use.
    timeout_s
        Longest wall time of a call [s]; a worker that takes longer is ended. Default: no limit.

    Examples
    --------
    >>> import math
    >>> from loopgate import LocalExecutor
    >>> with LocalExecutor(workers=1, timeout_s=60) as executor:
    ...     executor.submit(math.hypot, 3.0, 4.0).result()
    5.0
    """

    def __init__(self, workers: int | None = None, *, timeout_s: float | None = None) -> None:
        self.workers = workers or processors()
        self._timeout_s = timeout_s
        context = multiprocessing.get_context("spawn")
        self._pool = ProcessPool(self.workers, _RECYCLE_AFTER, _begin, context=context)

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Queue a function call; the function, its arguments and its result must be picklable.

        Raises `RuntimeError` after `shutdown`.
        """
        return self._pool.schedule(fn, args=args, kwargs=kwargs, timeout=self._timeout_s)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:  # noqa: FBT001, FBT002
        """Stop the worker processes when all submitted calls have ended; `wait` returns after that.

        With `cancel_futures` running calls are killed at once, and queued calls are cancelled.
        """
        if cancel_futures:
            self._pool.stop()  # type: ignore[no-untyped-call]  # pebble gives no type to it
        else:
            self._pool.close()  # type: ignore[no-untyped-call]  # as above
        if wait:
            self._pool.join()


def why_died(error: ProcessExpired) -> str:
    """Return how the process of a call ended, in words."""
    code = error.exitcode
    if code is None or code >= 0:
        return f"the worker process died (exit code {code})"
    name = signal.Signals(-code).name
    return f"the worker process died (signal {name}{'; out of memory?' if name == 'SIGKILL' else ''})"


def why_late(error: TimeoutError) -> str:
    """Return after how long the process of a call was ended, in words."""
    if error.args[:1] == ("Task timeout",):  # pebble's; the call itself may raise others
        return f"ended after {error.args[1]:g} s without a result (time limit)"
    return f"TimeoutError: {' '.join(str(error).split())}"


def _begin() -> None:
    """Prepare a worker process: what is sent to all processes of a sweep alike is the parent's to handle."""
    for name in ("SIGINT", "SIGHUP"):  # the last is none of Windows
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
