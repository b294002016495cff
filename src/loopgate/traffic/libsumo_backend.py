"""Runs SUMO in this process with libsumo: fast, without a window, one simulation at a time."""

import os
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from itertools import islice, pairwise
from threading import Lock
from typing import Any

import libsumo

from loopgate.errors import SecondSimulationError

ERROR: tuple[type[Exception], ...] = (libsumo.TraCIException, libsumo.FatalTraCIError)
"""Errors that libsumo raises: for a refused call, and when it stops."""


_STDERR = 2
_ERROR_WORD = "Error: "
_MOST_REASONS, _LONGEST = 3, 600
_SOMEBODY = "a simulation that something else has started"

_wrapped = libsumo.libsumo._libsumo  # noqa: SLF001  what is underneath has no other name

_ACTS = tuple(
    f"vehicle_{name}" for name in ("insertStop", "replaceStop", "setStop", "setSpeed", "setSpeedMode")
)

READS: Mapping[str, Callable[..., Any]] = {
    name: read
    for name, read in vars(_wrapped).items()
    if name.startswith(("vehicle_get", "vehicle_is", "trafficlight_get", "simulation_get")) or name in _ACTS
}
"""Calls about vehicles, lights and time without the wrapper's own functions, in a third of the time."""


half_built: list[str] = []
"""SUMO's messages from starts at which it refused its input and left a part of it in this process.

Another simulation in this process could then crash, so `start_traffic` runs it in a separate SUMO. If SUMO
refuses its options, or removes its network itself, nothing is left."""

_claim = Lock()
_owner: list[str] = []
"""The network of the simulation that `start` has started."""


def start(options: Sequence[str]) -> Any:  # noqa: ANN401  libsumo has no types
    """Start SUMO with command-line `options` and return the libsumo module; `close` ends it.

    Raises `SecondSimulationError` if a simulation is under way in this process: libsumo has one at a time,
    and a second start would end or mix them.
    """
    refuse_second()
    if not _claim.acquire(blocking=False):
        refuse_second()
        raise SecondSimulationError(_SOMEBODY)
    said: list[str] = []
    try:
        with _hearing(said):
            libsumo.start(["sumo", *options])
    except BaseException as error:
        if said and isinstance(error, ERROR):
            error.args = (_reasons(said),)  # libsumo itself says "Process Error"
        if libsumo.isLoaded():
            half_built.append(str(error))
        with suppress(*ERROR):
            libsumo.close()  # a part of what it has read may be there
        _claim.release()
        raise
    _owner[:] = [_network(options)]
    return libsumo


@contextmanager
def _hearing(said: list[str]) -> Iterator[None]:
    """Append to `said` the reasons for which SUMO refuses its input; pass on all its other output.

    SUMO writes the reasons only to the error stream of the process: its log comes later, or not at all.
    """
    try:
        kept = os.dup(_STDERR)
    except OSError:  # there is no such stream
        yield
        return
    with tempfile.TemporaryFile() as heard:
        os.dup2(heard.fileno(), _STDERR)
        try:
            yield
        except ERROR:
            heard.seek(0)
            lines = heard.read().decode(errors="replace").splitlines()
            said += [line.removeprefix(_ERROR_WORD) for line in lines if line.startswith(_ERROR_WORD)]
            raise
        finally:
            os.dup2(kept, _STDERR)
            os.close(kept)
            heard.seek(0)
            if not said:
                with suppress(OSError):
                    os.write(_STDERR, heard.read())


def _reasons(said: Sequence[str]) -> str:
    return "; ".join(line[:_LONGEST] for line in islice(dict.fromkeys(said), _MOST_REASONS))


def close() -> None:
    """End the simulation that `start` has started."""
    try:
        libsumo.close()
    finally:
        _owner.clear()
        _claim.release()


def refuse_second() -> None:
    """Raise `SecondSimulationError` if a simulation is under way in this process."""
    if owner():
        raise SecondSimulationError(owner())
    if libsumo.isLoaded():
        raise SecondSimulationError(_SOMEBODY)


def owner() -> str:
    """Return a phrase for the simulation that `start` began, such as "a run of NAME"; empty if none runs."""
    return f"a run of {_owner[0]}" if _owner else ""


def _network(options: Sequence[str]) -> str:
    named = dict(pairwise(options))
    return named.get("--net-file") or named.get("--configuration-file") or "SUMO"
