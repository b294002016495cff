"""Looks ahead: copies of this process drive on, and tell which vehicles stand for good."""

from __future__ import annotations

import json
import os
import signal
import stat
import warnings
from collections.abc import Callable, Collection, Mapping
from collections.abc import Set as AbstractSet
from contextlib import suppress
from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from select import select
from time import perf_counter
from typing import Any, Final

from loopgate.traffic.base import Traffic

__all__ = ["CREEPS_MPS", "Ahead", "Future", "SimulatedAhead"]

CREEPS_MPS: Final = 0.04
"""A vehicle that is slower than this between two looks stands [m/s]: it only moves up to its leader."""

_FOR_S, _SHORT_S, _ENOUGH_S = 3600.0, 1200.0, 600.0
"""How far the future is looked at, at most and at least; how much has to be known [s].

Drivers have closed up by some metres after half an hour. The least is enough where other code may change what
comes, and where the run ends: a jam that grows costs more the farther the look."""

_ALONE_S, _MOVES_M = 300.0, 1.0
"""For how long vehicles are left alone [s]; those drive on that come farther than the second in it [m]."""

_MANY, _OFTEN_S, _DOUBLINGS = 20, 20.0, 3
"""After so many tries that leave nobody the next are rarer: first interval [s], how often it doubles."""

_GIVES_UP: Final = 3
"""After so many copies that failed no more are made."""

_EVERY_S: Final = 5.0
"""A copy looks at the odometers at this interval [s]."""

_FROZEN_S: Final = 300.0
"""The future is known if no vehicle has moved at all for so long [s]: the road stays as it is."""

_ROUNDING_M: Final = 1e-6

_SILENT_S, _MOST_BYTES = 60.0, 1 << 16
"""A copy that has said nothing for so long hangs [s, by the clock]."""

_LONGEST_PATH: Final = 1024


@dataclass(frozen=True, slots=True)
class Future:
    """What is known of the time until `until_s` [s].

    `moves_s` says when each vehicle moves last in that time, or is gone [s]. A vehicle that creeps by
    centimetres does not move. Of vehicles that it leaves out nothing is known.
    """

    until_s: float = -inf
    moves_s: Mapping[str, float] = field(default_factory=dict)

    def stays(self, vehicle: str, now_s: float) -> bool:
        """Return whether a vehicle does not move from now on."""
        return self.moves_s.get(vehicle, inf) <= now_s


class Ahead:
    """Tells a deadlock detector what comes."""

    def __init__(self) -> None:
        self.future = Future()
        """What is known of the time to come."""

    def knows(self, now_s: float) -> bool:
        """Return whether enough is known of what comes to tell who stands for good."""
        return self.future.until_s - now_s >= _ENOUGH_S

    def look(self, *, ends: bool) -> None:
        """Learn more of the future, if that is possible.

        `ends`: whether anything stands that goes on by itself.
        """

    def left_alone(
        self,
        vehicles: Collection[str],
        core: AbstractSet[str],  # noqa: ARG002  for those who can try
    ) -> Collection[str]:
        """Return those of some vehicles that stand on if all others are gone: they wait for each other.

        `core`: those that may wait for each other; without them nobody does.
        """
        return vehicles


class SimulatedAhead(Ahead):
    """Looks ahead in a running simulation: a copy of this process (``fork``) drives on.

    What the copy sees comes, since the copy has all of the simulation, with its random numbers. What it
    writes to files that are open goes nowhere. If the copy fails, nothing is known.

    Parameters
    ----------
    traffic
        The simulation, in this process.
    step
        Drives on by one step, as the run itself does.
    ends
        Whether something that keeps vehicles standing ends by itself, as closures and breakdowns do.
    end_s
        When the run ends [s].
    shared
        Whether other code may interfere.
    """

    def __init__(
        self,
        traffic: Traffic,
        step: Callable[[], object],
        *,
        ends: bool = False,
        end_s: float = inf,
        shared: bool = False,
    ) -> None:
        super().__init__()
        self._traffic, self._step, self._ends = traffic, step, ends
        self._most_s, self._end_s = _SHORT_S if shared else _FOR_S, end_s
        self._lost = 0
        """How many copies in a row have failed."""
        self._failed, self._try_s = 0, -inf
        """How often nobody was left alone of late, and when to try again [s]."""
        self.took_s = 0.0
        """Wall time of all looks so far [s]."""

    @staticmethod
    def works(traffic: Traffic) -> bool:
        """Return whether a copy of this process has a copy of the simulation."""
        return traffic.in_this_process and hasattr(os, "fork")

    def look(self, *, ends: bool) -> None:
        """Let a copy drive on until the run ends, for an hour at most, or until nothing moves any more."""
        if self._lost < _GIVES_UP:
            found = self._in_a_copy(lambda alive: self._drive_on(alive, ends=ends or self._ends))
            self._lost = self._lost + 1 if found is None else 0
            self.future = self.future if found is None else Future(*found)

    def _in_a_copy(self, work: Callable[[Callable[[], object]], object]) -> Any | None:  # noqa: ANN401  JSON
        began = perf_counter()
        try:
            return _in_a_copy(work)
        finally:
            self.took_s += perf_counter() - began

    def _drive_on(self, alive: Callable[[], object], *, ends: bool) -> tuple[float, dict[str, float]]:
        """Drive on; return when that ended [s], and when each vehicle moved last, or was gone [s]."""
        begin_s = changed_s = then_s = self._traffic.now_s
        for_s = min(self._most_s, max(_SHORT_S, self._end_s - begin_s + _ENOUGH_S))
        at_m = self._odometers()
        moves_s = dict.fromkeys(at_m, begin_s)
        while then_s - begin_s < for_s and (ends or then_s - changed_s < _FROZEN_S):
            while (now := self._traffic.now_s) - then_s < _EVERY_S:
                self._step()
            alive()
            before_m, at_m = at_m, self._odometers()
            least_m = CREEPS_MPS * (now - then_s)
            moved = [one for one, metres in at_m.items() if metres - before_m.get(one, -inf) > least_m]
            moves_s |= dict.fromkeys((*moved, *(before_m.keys() - at_m.keys())), now)
            same = before_m.keys() == at_m.keys()
            if not same or any(metres - before_m[one] > _ROUNDING_M for one, metres in at_m.items()):
                changed_s = now
            then_s = now
        return (begin_s + for_s if then_s - changed_s >= _FROZEN_S else then_s), moves_s

    def left_alone(self, vehicles: Collection[str], core: AbstractSet[str]) -> Collection[str]:
        """Let a copy drive on without the others, and without those that then go on.

        In a jam that does not close for long the tries become rarer: each takes as long as five minutes do.
        """
        now = self._traffic.now_s
        if now < self._try_s:
            return ()
        found = self._in_a_copy(lambda alive: self._stand_on(vehicles, core, alive))
        self._failed = 0 if found is None or found else self._failed + 1
        rarer = min(self._failed - _MANY - 1, _DOUBLINGS)
        self._try_s = now + (_OFTEN_S * 2.0**rarer if rarer >= 0 else 0.0)
        return vehicles if found is None else found

    def _stand_on(
        self,
        vehicles: Collection[str],
        core: AbstractSet[str],
        alive: Callable[[], object],
    ) -> list[str]:
        """Take all others away, and drive on; take away, too, whoever drives; return who is left."""
        traffic, left = self._traffic, set(vehicles)
        here_m = self._odometers()
        until_s, next_s = traffic.now_s + _ALONE_S, traffic.now_s
        for one in traffic.outside():
            traffic.take_out(one)
        while left and traffic.now_s < until_s:
            at_m = self._odometers()
            left &= at_m.keys()
            if traffic.now_s >= next_s:
                next_s += _EVERY_S
                alive()
                left -= {one for one in left if at_m[one] - here_m[one] > _MOVES_M}
                if left.isdisjoint(core):
                    return []
            for one in at_m.keys() - left:
                traffic.take_out(one)
            traffic.step()
        return sorted(left)

    def _odometers(self) -> dict[str, float]:
        vehicles = self._traffic.vehicles()
        return dict(zip(vehicles, self._traffic.odometers(vehicles), strict=True))


def _in_a_copy(work: Callable[[Callable[[], object]], object]) -> Any | None:  # noqa: ANN401  what JSON holds
    """Return what some work gives in a copy of this process; None if it fails, or says nothing for long.

    The work calls what it is given from time to time.
    """
    read, write = os.pipe()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # threads: the copy needs none of them
        try:
            copy = os.fork()
        except OSError:  # there is no memory for a copy
            copy = -1
    if not copy:
        with suppress(BaseException):
            _on_its_own(write)
            os.write(write, json.dumps(work(lambda: os.write(write, b" "))).encode())
        os._exit(0)
    os.close(write)
    with os.fdopen(read, "rb", buffering=0) as pipe:
        if copy < 0:
            return None
        said = b""
        try:
            while select([pipe], [], [], _SILENT_S)[0] and (more := pipe.read(_MOST_BYTES)):
                said += more
        finally:
            with suppress(ProcessLookupError):
                os.kill(copy, signal.SIGKILL)  # Ctrl-C, or a copy that hangs
            os.waitpid(copy, 0)
    try:
        return json.loads(said)
    except ValueError:
        return None


def _on_its_own(only: int) -> None:
    """Let all that this process writes go nowhere, but for one file; let it read its files by itself.

    A file that both processes have open has one position: what the copy reads, the run would miss.
    """
    nowhere = os.open(os.devnull, os.O_RDWR)
    for name in (int(one.name) for one in Path("/dev/fd").iterdir()):
        if name not in (only, nowhere):
            own = nowhere
            with suppress(OSError):  # a file that has been deleted since, or the list of files itself
                own = _anew(name) or nowhere
            with suppress(OSError):
                os.dup2(own, name)


def _anew(name: int) -> int:
    """Open once more, at the same position, a file that is open for reading only; 0 for anything else."""
    import fcntl  # noqa: PLC0415  Windows, where no process is copied, has none

    reads = fcntl.fcntl(name, fcntl.F_GETFL) & os.O_ACCMODE == os.O_RDONLY
    if not reads or not stat.S_ISREG(os.fstat(name).st_mode):
        return 0
    asks = getattr(fcntl, "F_GETPATH", None)  # macOS
    if asks is None:
        path = str(Path(f"/dev/fd/{name}").readlink())
    else:
        path = os.fsdecode(fcntl.fcntl(name, asks, bytes(_LONGEST_PATH)).rstrip(b"\0"))
    again = os.open(path, os.O_RDONLY)
    os.lseek(again, os.lseek(name, 0, os.SEEK_CUR), os.SEEK_SET)
    return again
