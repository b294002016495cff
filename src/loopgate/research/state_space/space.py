"""All configurations that a system can reach, their moves, and which are live."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from loopgate.arrays import Flags, Ints, Small, Words
from loopgate.errors import LoopgateError
from loopgate.gates.deadlocks import homes_decide_liveness
from loopgate.model import Configuration, System
from loopgate.research.state_space.encoding import Encoding
from loopgate.research.state_space.kernels import expand, find, keep_moving, new_slots, rehash, spread_back


@dataclass(frozen=True, slots=True, eq=False)
class MoveTable:
    """Moves between numbered configurations."""

    first: Ints
    """The moves out of configuration k are those from ``first[k]`` up to ``first[k + 1]``."""
    targets: Small
    movers: NDArray[np.int16]
    """`targets` and `movers`: where each move leads, and which robot makes it."""
    rests: NDArray[np.int16]
    """How many robots stay for good in each configuration."""
    robots: int

    @property
    def done(self) -> Flags:
        """Whether all robots stay for good."""
        return np.asarray(self.rests == self.robots)

    @property
    def sources(self) -> Small:
        """Where each move begins."""
        return np.repeat(np.arange(len(self.rests), dtype=np.int32), np.diff(self.first))

    def only(self, which: Flags) -> MoveTable:
        """Return some of the moves."""
        first = np.concatenate([[0], np.cumsum(which)])[self.first]
        return MoveTable(first, self.targets[which], self.movers[which], self.rests, self.robots)

    def leading_to(self, good: Flags) -> Flags:
        """Return from where something good can be reached. O(moves) per sweep; few sweeps do."""
        found = good.copy()
        _sweep(lambda backwards: spread_back(found, self.first, self.targets, backwards))
        return found

    def everyone(self) -> Flags:
        """Return whether every robot can go on for ever from each configuration.

        That is so iff a strongly connected set of configurations can be reached inside which every robot
        moves but for those that stay for good. O(configurations + moves).
        """
        count = len(self.rests)
        graph = csr_array(
            (np.ones(len(self.targets), np.int8), self.targets, self.first.astype(np.int32)),
            shape=(count, count),
        )
        components, of = connected_components(graph, directed=True, connection="strong")
        sources = self.sources
        within = of[sources] == of[self.targets]
        moving = np.zeros((components, self.robots), np.bool_)
        moving[of[sources[within]], self.movers[within]] = True
        return self.leading_to(moving.sum(axis=1)[of] + self.rests == self.robots)

    def somebody(self, allowed: Flags) -> Flags:
        """Return whether some robot can move for ever within `allowed`, or all have come to their ends.

        The largest part of `allowed` that can be kept: each configuration of it has a move to another.
        O(moves) per sweep; few sweeps do.
        """
        good, done = allowed.copy(), self.done
        _sweep(lambda backwards: keep_moving(good, done, self.first, self.targets, backwards))
        return good


def _sweep(once: Callable[[bool], bool]) -> None:
    """Sweep down and up in turn until a sweep changes nothing."""
    backwards = True
    while once(backwards):
        backwards = not backwards


_T = TypeVar("_T", bound=np.generic)

_CHUNK = 1 << 17
"""Most moves to look for at once."""
_FULLEST = 0.7
"""Share of the table's slots that may be taken."""
_GB = 1e9
_MOST = (1 << 31) - 1
"""Most configurations and moves: they have 32-bit numbers."""


class ExplorationLimitError(LoopgateError):
    """A system with more configurations than the memory or the user's limit allows."""


class StateSpace:
    """All configurations reachable from the start without a gate, numbered in breadth-first order.

    O(robots) table look-ups for each configuration; at most 32 bytes for each configuration and 10 for each
    move. Raises `ExplorationLimitError` if the memory or the limit is too small.

    Parameters
    ----------
    limit
        Largest number of configurations to find.
    progress
        Called at times with the number of configurations found so far.

    Attributes
    ----------
    keys
        Each configuration encoded as a row of machine words; the start is row 0.
    moves
        All moves between configurations.
    locked
        For each configuration, whether it has a circular wait (Def. 3).
    """

    def __init__(
        self,
        system: System,
        *,
        memory_gb: float = 4.0,
        limit: int | None = None,
        progress: Callable[[int], None] = lambda _: None,
    ) -> None:
        self.system = system
        self.encoding = Encoding(system)
        self._memory_gb = memory_gb
        self._limit = limit
        self._slots = new_slots(12)
        self._fill(progress)

    @property
    def count(self) -> int:
        """The number of configurations."""
        return len(self.keys)

    def number(self, configuration: Configuration) -> int:
        """Return the number of a reachable configuration.

        Raises `KeyError` if the configuration cannot be reached.
        """
        found = find(self._slots, self.keys, self.encoding.encode(configuration))
        if found < 0:
            msg = "the configuration cannot be reached from the start"
            raise KeyError(msg)
        return int(found)

    def configuration(self, number: int) -> Configuration:
        """Return the configuration with a number."""
        return self.encoding.decode(self.keys[number])

    @cached_property
    def live(self) -> Flags:
        """For each configuration, whether every robot can go on for ever."""
        if homes_decide_liveness(self.system):
            return self.moves.leading_to(self._home)
        return self.moves.everyone()

    @cached_property
    def somebody(self) -> Flags:
        """For each configuration, whether some robot can move for ever without a circular wait."""
        return self.moves.somebody(~self.locked)

    def keeping(self, promise: str) -> Flags:
        """Return which configurations keep a promise: `live` for ``everyone``, else `somebody`."""
        return self.live if promise == "everyone" else self.somebody

    def _fill(self, progress: Callable[[int], None]) -> None:
        encoding, robots = self.encoding, len(self.system.robots)
        chunk = max(1, _CHUNK // robots)
        keys = np.zeros((chunk, encoding.words), np.uint64)
        first = np.zeros(chunk + 1, np.int64)
        locked, home, rests = np.zeros(chunk, np.bool_), np.zeros(chunk, np.bool_), np.zeros(chunk, np.int16)
        targets, movers = np.zeros(chunk, np.int32), np.zeros(chunk, np.int16)
        keys[0] = encoding.encode(self.system.initial)
        count, begin = 1, 0
        rehash(self._slots, keys, count)
        while begin < count:
            end = min(count, begin + chunk)
            most, edges = count + (end - begin) * robots, int(first[begin]) + (end - begin) * robots
            self._check(count, most, edges)
            if most > _FULLEST * self._slots.size:
                self._slots = new_slots(int(most / _FULLEST).bit_length())
                rehash(self._slots, keys, count)
            keys, first = _grown(keys, most), _grown(first, end + 1)
            locked, home, rests = _grown(locked, end), _grown(home, end), _grown(rests, end)
            targets, movers = _grown(targets, edges), _grown(movers, edges)
            count = expand(
                begin, end, count, keys, self._slots, first, targets, movers, locked, home, rests,
                encoding.arrays,
            )  # fmt: skip
            begin = end
            progress(count)
        self._check(count, count, 0)
        edges = int(first[count])
        self.keys: Words = keys[:count]
        self.locked: Flags = locked[:count]
        self._home = home[:count]
        self.moves = MoveTable(first[: count + 1], targets[:edges], movers[:edges], rests[:count], robots)

    def _check(self, count: int, most: int, edges: int) -> None:
        if self._limit is not None and count > self._limit:
            msg = f"more than {self._limit} configurations; take a smaller system"
            raise ExplorationLimitError(msg)
        # What is there twice while the list of targets grows, or what a gate lets come about.
        later = max(4 * edges, 10 * most + edges)
        needed_gb = (most * (8 * self.encoding.words + 24) + 6 * edges + later) / _GB
        if needed_gb > self._memory_gb or max(most, edges) > _MOST:
            msg = (
                f"more than {count} configurations: they need {needed_gb:.1f} GB of memory, and "
                f"{self._memory_gb:g} GB are allowed; allow more or explore a smaller system"
            )
            raise ExplorationLimitError(msg)


def _grown(array: NDArray[_T], size: int) -> NDArray[_T]:
    """Return the array, or a longer copy if it is shorter than `size`; memory is taken as it is touched."""
    if len(array) >= size:
        return array
    larger = np.zeros((size + size // 2, *array.shape[1:]), array.dtype)
    larger[: len(array)] = array
    return larger
