"""A configuration: the positions of all robots."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol


class Placement(Protocol):
    """Positions of robots: a `Configuration`, or a mutable configuration."""

    @property
    def positions(self) -> Sequence[int]:
        """See `Configuration`."""
        ...

    @property
    def queues(self) -> Sequence[Sequence[int]]:
        """See `Configuration`."""
        ...


class Configuration(NamedTuple):
    """The state of a system: one position per robot, and the order within its FIFO states."""

    positions: tuple[int, ...]
    """``positions[i]`` is the index on its path of robot ``i``, so that a state that comes back in a round
    counts once per visit."""
    queues: tuple[tuple[int, ...], ...] = ()
    """For each FIFO state, in the order of ``System.fifo_states``, the robots in it, head first. Empty for
    systems without FIFO states."""


class MutableConfiguration:
    """A configuration in which moves are made and taken back, at no cost for the robots that stay.

    `System.make` and `System.take_back` do so.
    """

    __slots__ = ("positions", "queues")

    def __init__(self, placement: Placement) -> None:
        self.positions = list(placement.positions)
        self.queues = [list(queue) for queue in placement.queues]

    def frozen(self) -> Configuration:
        """Return an unchangeable copy of the present configuration."""
        return Configuration(tuple(self.positions), tuple(map(tuple, self.queues)))
