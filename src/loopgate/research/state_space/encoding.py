"""A system as arrays, a configuration with the order in its FIFO states as a few 64-bit words."""

from typing import NamedTuple

import numpy as np

from loopgate.arrays import Flags, Ints, Words
from loopgate.model import Configuration, System

_WORD_BITS = 63
"""Bits of a word that are used: one less than there are, so that no sum overflows."""


class Arrays(NamedTuple):
    """A system for compiled code; robots are rows, positions columns, and only shared states are numbered.

    A robot's part of its word is its position and, above it, how many stand before it in its FIFO state: 0
    for the head, and 0 in every other state.
    """

    word: Ints
    """Which word of a configuration's each robot's part is in."""
    shift: Words
    mask: Words
    """`shift` and `mask`: lowest bit of the position, and the position's bits, shifted down."""
    line_shift: Words
    line_mask: Words
    """`line_shift` and `line_mask`: the same for the number of robots before it."""
    after: Ints
    """Next position, or -1."""
    state: Ints
    """Number of the shared state at a position, or -1 if it is private."""
    home: Flags
    """Whether a robot is at home at a position: in a private state of a closed path, or at an open path's
    end."""
    room: Ints
    fifo: Flags
    """`room` and `fifo`: capacity of each shared state, and whether it is left in order of arrival."""


class Encoding:
    """Translates configurations of a system to words and back.

    `words`: how many words a configuration takes; one does for most systems that can be explored.
    """

    def __init__(self, system: System) -> None:
        self.system = system
        robots, longest = len(system.robots), max(len(path) for path in system.paths)
        shared = {s: k for k, s in enumerate(s for s, private in enumerate(system.private) if not private)}
        queues = set(system.fifo_states)
        after = np.full((robots, longest), -1, np.int64)
        state = np.full((robots, longest), -1, np.int64)
        home = np.zeros((robots, longest), np.bool_)
        for i, path in enumerate(system.paths):
            goes_round = system.following[i][-1] >= 0
            for p, s in enumerate(path):
                state[i, p] = shared.get(s, -1)
                after[i, p] = system.following[i][p]
                home[i, p] = system.private[s] if goes_round else after[i, p] < 0
        self._places = _places(system)
        self.words = 1 + self._places[-1][0]
        word, low, bits, line_bits = np.ascontiguousarray(np.array(self._places).T)
        self.arrays = Arrays(
            word,
            low.astype(np.uint64),
            ((1 << bits) - 1).astype(np.uint64),
            (low + bits).astype(np.uint64),
            ((1 << line_bits) - 1).astype(np.uint64),
            after,
            state,
            home,
            np.array([system.room[s] for s in shared] or [1], np.int64),
            np.array([s in queues for s in shared] or [False], np.bool_),
        )

    def encode(self, configuration: Configuration) -> Words:
        """Return the words of a configuration. O(robots)."""
        before = dict[int, int]()
        for line in configuration.queues:
            before.update((robot, k) for k, robot in enumerate(line))
        found = [0] * self.words
        for robot, (position, (word, low, bits, _)) in enumerate(
            zip(configuration.positions, self._places, strict=True)
        ):
            found[word] += (position + (before.get(robot, 0) << bits)) << low
        return np.array(found, np.uint64)

    def decode(self, words: Words) -> Configuration:
        """Return the configuration behind words. O(robots * log robots)."""
        system = self.system
        values: list[int] = words.tolist()
        positions: list[int] = []
        before: list[int] = []
        for word, low, bits, line_bits in self._places:
            part = values[word] >> low
            positions.append(part & ((1 << bits) - 1))
            before.append(part >> bits & ((1 << line_bits) - 1))
        lines: dict[int, list[int]] = {s: [] for s in system.fifo_states}
        for robot, p in enumerate(positions):
            line = lines.get(system.paths[robot][p])
            if line is not None:
                line.append(robot)
        queues = tuple(tuple(sorted(line, key=before.__getitem__)) for line in lines.values())
        return Configuration(tuple(positions), queues)

    def positions(self, keys: Words, robot: int) -> Ints:
        """Return the positions of `robot` in configurations given by their words, one in a row."""
        arrays = self.arrays
        found: Ints = (keys[:, arrays.word[robot]] >> arrays.shift[robot] & arrays.mask[robot]).astype(
            np.int64
        )
        return found


def _places(system: System) -> list[tuple[int, int, int, int]]:
    """Return per robot its word, its lowest bit there, and how many bits its position and line take."""
    queues = set(system.fifo_states)
    found: list[tuple[int, int, int, int]] = []
    word = low = 0
    for path in system.paths:
        longest = max((min(system.room[s], len(system.visitors[s])) for s in path if s in queues), default=1)
        bits, line_bits = (len(path) - 1).bit_length(), (longest - 1).bit_length()
        if low + bits + line_bits > _WORD_BITS:
            word, low = word + 1, 0
        found.append((word, low, bits, line_bits))
        low += bits + line_bits
    return found
