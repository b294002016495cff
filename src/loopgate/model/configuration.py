"""A configuration: the positions of all robots."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol


class Placement(Protocol):
    """The interface of positions of robots: of a `Configuration` or a `MutableConfiguration`."""

    @property
    def positions(self) -> Sequence[int]:
        """The index on its path of each robot."""
        ...

    @property
    def queues(self) -> Sequence[Sequence[int]]:
        """The robots in each FIFO state in order, by state number."""
        ...


class Configuration(NamedTuple):
    """The positions of all robots of a system, and their order within FIFO states."""

    positions: tuple[int, ...]
    """``positions[i]`` is the index on its path of robot ``i``; each visit of a state in one round is a
    position of its own."""
    queues: tuple[tuple[int, ...], ...] = ()
    """For each FIFO state, in the order of ``System.fifo_states``, the robots in it, head first. Empty for
    systems without FIFO states."""


class MutableConfiguration:
    """A configuration that can be changed: moves are made and undone in place.

    `System.make` and `System.take_back` do so.
    """

    __slots__ = ("positions", "queues")

    def __init__(self, placement: Placement) -> None:
        self.positions = list(placement.positions)
        self.queues = [list(queue) for queue in placement.queues]

    def frozen(self) -> Configuration:
        """Return an immutable copy of the present configuration."""
        return Configuration(tuple(self.positions), tuple(map(tuple, self.queues)))
