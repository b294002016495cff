"""An executor of fresh processes on this machine that survives the death of any of them."""

import multiprocessing
import os
import queue
import signal
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Executor, Future
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from typing import Any, ParamSpec, TypeVar

from loopgate.errors import LoopgateError
from loopgate.machines import processors

P = ParamSpec("P")
T = TypeVar("T")

_Job = tuple[Future[Any], Callable[..., Any], tuple[Any, ...], dict[str, Any]]
_RECYCLE_AFTER = 64  # calls; SUMO and the allocator give back less memory than they take


class WorkerDiedError(LoopgateError):
    """The process that ran a call ended without an answer."""


class WorkerStartError(LoopgateError):
    """A worker process could not even begin: that is no call's fault."""


class TimeLimitError(LoopgateError):
    """A call took longer than the executor allows; its process was ended."""


class LocalExecutor(Executor):
    """An executor that runs calls in `workers` separate processes, one call at a time in each.

    Unlike in `concurrent.futures.ProcessPoolExecutor`, the death of a worker fails only its own call; the
    next call gets a new process. Workers end when this process ends, in whatever way.

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
        self._jobs: queue.Queue[_Job | None] = queue.Queue()
        self._stop = threading.Event()
        self._lanes = [_Lane(self._jobs, self._stop, timeout_s) for _ in range(self.workers)]
        for lane in self._lanes:
            lane.start()

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Queue a function call; the function, its arguments and its result must be picklable.

        Raises `RuntimeError` after `shutdown`.
        """
        if self._stop.is_set():
            msg = "cannot schedule new calls after shutdown"
            raise RuntimeError(msg)
        future: Future[T] = Future()
        self._jobs.put((future, fn, args, kwargs))
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:  # noqa: FBT001, FBT002
        """Stop the worker processes when all submitted calls have ended; `wait` returns after that.

        With `cancel_futures` running calls are killed at once, and queued calls are cancelled.
        """
        if cancel_futures:
            self._stop.set()
            while True:
                try:
                    job = self._jobs.get_nowait()
                except queue.Empty:
                    break
                if job is not None:
                    job[0].cancel()
            for lane in self._lanes:
                lane.kill()
        for _ in self._lanes:
            self._jobs.put(None)
        if wait:
            for lane in self._lanes:
                lane.join()
        self._stop.set()


class _Lane(threading.Thread):
    """A thread that owns one worker process and feeds it."""

    def __init__(
        self, jobs: queue.Queue[_Job | None], stop: threading.Event, timeout_s: float | None
    ) -> None:
        super().__init__(daemon=True)
        self._jobs = jobs
        self._stopping = stop
        self._timeout_s = timeout_s
        self._process: SpawnProcess | None = None
        self._pipe: Connection | None = None
        self._calls = 0

    def run(self) -> None:
        """Feed the worker until there is no more work."""
        while (job := self._jobs.get()) is not None:
            future, function, args, kwargs = job
            if not future.set_running_or_notify_cancel():
                continue
            try:
                answer, error = self._ask(function, args, kwargs)
            except Exception as problem:  # noqa: BLE001 - whatever went wrong belongs to this call
                self.kill()
                answer, error = None, problem
            if error is None:
                future.set_result(answer)
            else:
                future.set_exception(error)
        self._retire()

    def kill(self) -> None:
        """End the worker at once."""
        if self._process is not None and self._process.is_alive():
            self._process.kill()

    def _ask(
        self, function: Callable[..., Any], args: tuple[Any, ...], kwargs: dict[str, Any]
    ) -> tuple[Any, BaseException | None]:
        if self._stopping.is_set():
            return None, WorkerDiedError("the executor was shut down")
        if self._calls >= _RECYCLE_AFTER or self._process is None or not self._process.is_alive():
            self._retire()
            self._start()
            if self._stopping.is_set():  # while it started, when there was nobody to kill yet
                self.kill()
                return None, WorkerDiedError("the executor was shut down")
        assert self._pipe is not None  # noqa: S101 - for the type checker; _start has set it
        assert self._process is not None  # noqa: S101 - as above
        self._calls += 1
        try:
            self._pipe.send((function, args, kwargs))
            if not self._pipe.poll(self._timeout_s):
                self.kill()
                self._process.join()
                return None, TimeLimitError(
                    f"ended after {self._timeout_s:g} s without a result (time limit)"
                )
            answer, error, is_spoiled = self._pipe.recv()
        except (EOFError, ConnectionError):
            self._process.join()
            return None, WorkerDiedError(f"the worker process died ({_cause(self._process.exitcode)})")
        if is_spoiled:
            self._retire()
        return answer, error

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=_work, args=(theirs,), daemon=True)
        self._process.start()
        theirs.close()
        self._calls = 0
        try:
            self._pipe.recv()
        except (EOFError, ConnectionError) as error:
            self._process.join()
            msg = (
                f"a worker process ended before it began ({_cause(self._process.exitcode)}); a script that "
                "sweeps must do so below: if __name__ == '__main__'"
            )
            raise WorkerStartError(msg) from error

    def _retire(self) -> None:
        if self._pipe is not None:
            self._pipe.close()
        if self._process is not None:
            self._process.join()
        self._process = self._pipe = None


def _work(pipe: Connection) -> None:
    """Answer calls until the other end of the pipe is closed (in the worker process)."""
    # Sent to all processes of a sweep alike, they are the parent's to handle.
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):  # the last is none of Windows
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    try:
        pipe.send("ready")
        while True:
            function, args, kwargs = pipe.recv()
            try:
                answer: tuple[Any, BaseException | None] = function(*args, **kwargs), None
            except Exception as error:  # noqa: BLE001 - it travels to the caller
                answer = None, error
            pipe.send((*answer, _is_spoiled()))
    except (EOFError, ConnectionError):
        return


def _is_spoiled() -> bool:
    """Return whether a refused input left remains in this process, so that no other run may use it."""
    backend = sys.modules.get("loopgate.traffic.libsumo_backend")
    return backend is not None and bool(backend.half_built)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _cause(exitcode: int | None) -> str:
    if exitcode is not None and exitcode < 0:
        name = signal.Signals(-exitcode).name
        hint = "; out of memory?" if name == "SIGKILL" else ""
        return f"signal {name}{hint}"
    return f"exit code {exitcode}"
