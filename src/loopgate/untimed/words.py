"""A system as arrays, a configuration with the order in its FIFO states as one 64-bit word."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from loopgate.model import Configuration, System

__all__ = ["WORD_BITS", "Words", "make_words", "word_bits"]

WORD_BITS = 63
"""Bits of a word that may be used: one less than there are, so that a word and one never overflows."""


@dataclass(frozen=True, slots=True, eq=False)
class Words:
    """A system as arrays; robots are rows, positions columns, and only shared states are numbered.

    A robot's part of the word is its position and, above it, how many stand before it in its FIFO state: 0
    for the head, and 0 in every other state.

    Attributes
    ----------
    system
        The system itself.
    shift, mask
        Lowest bit of each robot's position in the word, and the position's bits, shifted down.
    line_shift, line_mask
        The same for the number of robots before it.
    after
        Next position, or -1.
    state
        Number of the shared state at a position, or -1 if it is private.
    room, fifo
        Capacity of each shared state, and whether it is left in order of arrival (1) or not (0).
    """

    system: System
    shift: NDArray[np.uint64]
    mask: NDArray[np.uint64]
    line_shift: NDArray[np.uint64]
    line_mask: NDArray[np.uint64]
    after: NDArray[np.int64]
    state: NDArray[np.int64]
    room: NDArray[np.int64]
    fifo: NDArray[np.int64]

    def word(self, configuration: Configuration) -> int:
        """Return the configuration's word. O(robots)."""
        shift: list[int] = self.shift.tolist()
        line_shift: list[int] = self.line_shift.tolist()
        found = sum(p << s for p, s in zip(configuration.positions, shift, strict=True))
        for line in configuration.queues:
            for before, robot in enumerate(line):
                found += before << line_shift[robot]
        return found

    def configuration(self, word: int) -> Configuration:
        """Return the configuration behind a word. O(robots * log robots)."""
        system = self.system
        positions = tuple(word >> s & m for s, m in zip(self.shift.tolist(), self.mask.tolist(), strict=True))
        before = [
            word >> s & m for s, m in zip(self.line_shift.tolist(), self.line_mask.tolist(), strict=True)
        ]
        lines: dict[int, list[int]] = {s: [] for s in system.fifo_states}
        for robot, p in enumerate(positions):
            line = lines.get(system.paths[robot][p])
            if line is not None:
                line.append(robot)
        return Configuration(
            positions, tuple(tuple(sorted(q, key=before.__getitem__)) for q in lines.values())
        )


def _bits(system: System) -> list[tuple[int, int]]:
    """Return per robot how many bits its position and its place in line need."""
    queues = set(system.fifo_states)
    found = []
    for path in system.paths:
        longest = max((min(system.room[s], len(system.visitors[s])) for s in path if s in queues), default=1)
        found.append(((len(path) - 1).bit_length(), (longest - 1).bit_length()))
    return found


def word_bits(system: System) -> int:
    """Return how many bits a configuration of `system` needs; it fits into a word up to `WORD_BITS`."""
    return sum(map(sum, _bits(system)))


def make_words(system: System) -> Words:
    """Return `system` as arrays; `word_bits` must not be above `WORD_BITS`."""
    longest = max(len(path) for path in system.paths)
    robots = len(system.robots)
    shared = {s: k for k, s in enumerate(s for s, private in enumerate(system.private) if not private)}
    queues = set(system.fifo_states)
    columns = np.zeros((4, robots), np.uint64)
    after = np.full((robots, longest), -1, np.int64)
    state = np.full((robots, longest), -1, np.int64)
    low = 0
    for i, (path, (bits, line_bits)) in enumerate(zip(system.paths, _bits(system), strict=True)):
        columns[:, i] = low, (1 << bits) - 1, low + bits, (1 << line_bits) - 1
        low += bits + line_bits
        for p, s in enumerate(path):
            state[i, p] = shared.get(s, -1)
            following = system.robots[i].next_position(p)
            after[i, p] = -1 if following is None else following
    columns[2] = np.minimum(columns[2], WORD_BITS)  # a robot that never queues may begin beyond the word
    columns[0] = np.minimum(columns[0], WORD_BITS)
    return Words(
        system,
        columns[0],
        columns[1],
        columns[2],
        columns[3],
        after,
        state,
        np.array([system.room[s] for s in shared] or [1], np.int64),
        np.array([s in queues for s in shared] or [False], np.int64),
    )
