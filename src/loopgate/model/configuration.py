"""A configuration: the positions of all robots."""

from typing import NamedTuple


class Configuration(NamedTuple):
    """The state of a system: one position per robot, and the order within its FIFO states."""

    positions: tuple[int, ...]
    """``positions[i]`` is the index on its path of robot ``i``, so that a state that comes back in a round
    counts once per visit."""
    queues: tuple[tuple[int, ...], ...] = ()
    """For each FIFO state, in the order of ``System.fifo_states``, the robots in it, head first. Empty for
    systems without FIFO states."""
