"""All configurations that a system can reach, by number, with their moves; who can go on for ever."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from loopgate.model import Configuration, System
from loopgate.untimed.exploration import ExplorationLimitError
from loopgate.untimed.kernel_words import expand, index_of, keep_moving, new_slots, rehash, spread_back
from loopgate.untimed.words import WORD_BITS, Words, make_words, word_bits

__all__ = ["Moves", "Numbered", "why_not_numbered"]

_T = TypeVar("_T", bound=np.generic)

_CHUNK = 1 << 14
_FULLEST = 0.6
"""Share of the table's slots that may be taken."""
_MOST_ROBOTS = 63
_BYTES = 80
"""Memory per configuration with a handful of moves, in the worst moment [bytes]."""


class Moves:
    """Moves between numbered configurations.

    Parameters
    ----------
    first
        The moves out of configuration k are those from ``first[k]`` up to ``first[k + 1]``.
    targets, movers
        Where each move leads, and which robot makes it.
    resting
        The robots that stay for good in each configuration, as bits.
    robots
        How many robots there are.
    """

    def __init__(
        self,
        first: NDArray[np.int64],
        targets: NDArray[np.int32],
        movers: NDArray[np.int8],
        resting: NDArray[np.uint64],
        robots: int,
    ) -> None:
        self.first = first
        self.targets = targets
        self.movers = movers
        self.resting = resting
        self.robots = robots

    @property
    def count(self) -> int:
        """How many configurations there are."""
        return len(self.first) - 1

    def everyone(self) -> NDArray[np.bool_]:
        """Return whether, by these moves, every robot can go on for ever from each configuration.

        That is so iff a strongly connected set of configurations can be reached inside which every robot
        moves but for those that stay for good. O(configurations + moves).
        """
        count = self.count
        sources = self._sources()
        graph = csr_array(
            (np.ones(len(self.targets), np.int8), self.targets, self.first.astype(np.int32)),
            shape=(count, count),
        )
        components, of = connected_components(graph, directed=True, connection="strong")
        moving = np.zeros(components, np.uint64)
        within = of[sources] == of[self.targets]
        bits = np.uint64(1) << self.movers[within].astype(np.uint64)
        np.bitwise_or.at(moving, of[sources[within]], bits)
        np.bitwise_or.at(moving, of, self.resting)
        good: NDArray[np.bool_] = (moving == self._all)[of]
        spread_back(good, *self._backwards(sources))
        return good

    def somebody(self, allowed: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return whether, by these moves, somebody can move for ever within `allowed`, or all have finished.

        The largest part of `allowed` that can be kept: each configuration of it has a move to another.
        O(configurations + moves).
        """
        good = allowed.copy()
        done = self.resting == self._all
        keep_moving(good, done, self.first, self.targets, *self._backwards(self._sources()))
        return good

    @property
    def _all(self) -> np.uint64:
        return np.uint64((1 << self.robots) - 1)

    def _sources(self) -> NDArray[np.int32]:
        return np.repeat(np.arange(self.count, dtype=np.int32), np.diff(self.first))

    def _backwards(self, sources: NDArray[np.int32]) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
        order = np.argsort(self.targets, kind="stable")
        first = np.zeros(self.count + 1, np.int64)
        np.cumsum(np.bincount(self.targets, minlength=self.count), out=first[1:])
        return first, sources[order]


def why_not_numbered(system: System) -> str:
    """Return why `Numbered` cannot take `system`; empty if it can."""
    bits = word_bits(system)
    if bits > WORD_BITS:
        return f"its configurations need {bits} bits, and {WORD_BITS} are there"
    if len(system.robots) > _MOST_ROBOTS:
        return f"it has {len(system.robots)} robots, and {_MOST_ROBOTS} are the most"
    return ""


class Numbered:
    """The configurations that can be reached from the start without a gate, in breadth-first order.

    The same as `loopgate.theory.oracle.Oracle` finds, some hundred times as fast.

    Parameters
    ----------
    system
        A system for which `why_not_numbered` finds nothing.
    memory_gb
        The most memory to use [GB].
    limit
        The most configurations to find, if given.
    progress
        Called now and then with the number of configurations found.

    Attributes
    ----------
    moves
        All moves between them.
    locked
        Whether a configuration has a circular wait (Def. 3).
    live
        Whether every robot can go on for ever.

    Raises
    ------
    ExplorationLimitError
        If memory or limit do not suffice.
    """

    def __init__(
        self,
        system: System,
        *,
        memory_gb: float = 4.0,
        limit: int | None = None,
        progress: Callable[[int], None] = lambda _: None,
    ) -> None:
        self.words: Words = make_words(system)
        self._most = int(min(memory_gb * 1e9 / _BYTES, 2e9))
        self._limit = limit
        self._keys: NDArray[np.uint64]
        self._slots = new_slots(12)
        self.moves, self.locked = self._fill(system, progress)
        self.live = self.moves.everyone()

    @property
    def count(self) -> int:
        """How many configurations there are."""
        return len(self._keys)

    def number(self, configuration: Configuration) -> int:
        """Return the number of a configuration that can be reached.

        Raises
        ------
        KeyError
            If it cannot.
        """
        found = index_of(self._slots, self._keys, np.uint64(self.words.word(configuration)))
        if found < 0:
            msg = "the configuration cannot be reached from the start"
            raise KeyError(msg)
        return int(found)

    def configuration(self, number: int) -> Configuration:
        """Return the configuration of that number; the start is number 0."""
        return self.words.configuration(int(self._keys[number]))

    def somebody(self) -> NDArray[np.bool_]:
        """Return whether somebody can always move on, for ever, without any circular wait on the way."""
        return self.moves.somebody(~self.locked)

    def _fill(self, system: System, progress: Callable[[int], None]) -> tuple[Moves, NDArray[np.bool_]]:
        words, robots = self.words, len(system.robots)
        keys = np.zeros(_CHUNK, np.uint64)
        first = np.zeros(_CHUNK + 1, np.int64)
        locked = np.zeros(_CHUNK, np.bool_)
        resting = np.zeros(_CHUNK, np.uint64)
        targets, movers = np.zeros(_CHUNK, np.int32), np.zeros(_CHUNK, np.int8)
        keys[0] = words.word(system.initial)
        count, begin = 1, 0
        rehash(self._slots, keys, count)
        while begin < count:
            end = min(count, begin + _CHUNK)
            most = count + (end - begin) * robots
            keys = _grown(keys, most)
            first, locked, resting = _grown(first, end + 1), _grown(locked, end), _grown(resting, end)
            edges = int(first[begin]) + (end - begin) * robots
            targets, movers = _grown(targets, edges), _grown(movers, edges)
            if most > _FULLEST * self._slots.size:
                self._slots = new_slots(int(most / _FULLEST).bit_length() + 1)
                rehash(self._slots, keys, count)
            count = expand(
                begin, end, count, keys, self._slots, first, targets, movers, locked, resting,
                words.shift, words.mask, words.line_shift, words.line_mask,
                words.after, words.state, words.room, words.fifo,
            )  # fmt: skip
            begin = end
            self._check(count)
            progress(count)
        self._keys = keys[:count].copy()
        edges = int(first[count])
        moves = Moves(first[: count + 1], targets[:edges], movers[:edges], resting[:count], robots)
        return moves, locked[:count]

    def _check(self, count: int) -> None:
        if self._limit is not None and count > self._limit:
            msg = f"more than {self._limit} configurations; take a smaller system"
            raise ExplorationLimitError(msg)
        if count > self._most:
            msg = (
                f"more than {self._most} configurations, for which {_BYTES * self._most / 1e9:.1f} GB of "
                "memory are allowed; allow more or explore a smaller system"
            )
            raise ExplorationLimitError(msg)


def _grown(array: NDArray[_T], size: int) -> NDArray[_T]:
    """Return the array, or a copy of twice that size if it is shorter than `size`."""
    if len(array) >= size:
        return array
    larger = np.zeros(2 * size, array.dtype)
    larger[: len(array)] = array
    return larger
