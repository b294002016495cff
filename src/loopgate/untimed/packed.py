"""A system as arrays of numbers, a configuration as one 64-bit word."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from loopgate.model import Configuration, System
from loopgate.theory.deadlocks import homes_decide_liveness

__all__ = ["KEY_BITS", "Packed", "pack", "why_not_packed"]

KEY_BITS = 58
"""Bits of a configuration's word; the others are flags of the table of visited configurations."""


@dataclass(frozen=True, slots=True, eq=False)
class Packed:
    """A system as arrays; robots are rows, positions columns, and only shared states are numbered.

    Attributes
    ----------
    system
        The system itself.
    shift
        ``shift[i]`` is the lowest bit of robot i's position in the word.
    mask
        The position's bits, shifted down.
    after, before
        Next and previous position, or -1.
    state
        Number of the shared state at a position, or -1 if it is private.
    home
        Whether a robot is at home at a position: in a private state of a closed path, or at an open path's
        end.
    room
        Capacity of each shared state.
    """

    system: System
    shift: NDArray[np.uint64]
    mask: NDArray[np.uint64]
    after: NDArray[np.int64]
    before: NDArray[np.int64]
    state: NDArray[np.int64]
    home: NDArray[np.int64]
    room: NDArray[np.int64]

    def key(self, configuration: Configuration) -> int:
        """Return the configuration's word."""
        return sum(p << int(s) for p, s in zip(configuration.positions, self.shift, strict=True))

    def configuration(self, key: int) -> Configuration:
        """Return the configuration behind a word."""
        positions = (key >> int(s) & int(m) for s, m in zip(self.shift, self.mask, strict=True))
        return self.system.configuration(positions)


def why_not_packed(system: System) -> str:
    """Return why the compiled exploration cannot take `system`; empty if it can."""
    bits = sum((len(path) - 1).bit_length() for path in system.paths)
    if bits > KEY_BITS:
        return f"its configurations need {bits} bits, and {KEY_BITS} are there"
    for state in system.fifo_states:
        if system.room[state] > 1:
            return f"state {system.states[state]} is a queue of several robots, whose order counts"
    if not homes_decide_liveness(system):
        return "a robot on a closed path has no private state, or passes where another ends"
    return ""


def pack(system: System) -> Packed:
    """Return `system` as arrays. `why_not_packed` must be empty."""
    longest = max(len(path) for path in system.paths)
    robots = len(system.robots)
    shared = {s: k for k, s in enumerate(s for s, private in enumerate(system.private) if not private)}
    shift = np.zeros(robots, np.uint64)
    mask = np.zeros(robots, np.uint64)
    after = np.full((robots, longest), -1, np.int64)
    before = np.full((robots, longest), -1, np.int64)
    state = np.full((robots, longest), -1, np.int64)
    home = np.zeros((robots, longest), np.int64)
    low = 0
    for i, path in enumerate(system.paths):
        bits = (len(path) - 1).bit_length()
        shift[i], mask[i] = low, (1 << bits) - 1
        low += bits
        for p, s in enumerate(path):
            state[i, p] = shared.get(s, -1)
            following = system.robots[i].next_position(p)
            goes_round = system.robots[i].next_position(len(path) - 1) is not None
            home[i, p] = system.private[s] if goes_round else following is None
            if following is not None:
                after[i, p] = following
                before[i, following] = p
    room = np.array([system.room[s] for s in shared] or [1], np.int64)
    return Packed(system, shift, mask, after, before, state, home, room)
