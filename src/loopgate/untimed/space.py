"""All configurations that a system can reach without a gate, and which of them are live. Compiled."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from loopgate.model import Configuration, System
from loopgate.untimed.exploration import ExplorationLimitError
from loopgate.untimed.kernels import expand, spread_live
from loopgate.untimed.packed import Packed, pack
from loopgate.untimed.table import LIVE, find, has_flag, insert, moved_over, new_table

__all__ = ["Space"]

_CHUNK = 1 << 16
_FULLEST = 0.75
"""Share of the table's slots that may be taken."""
_GB = 1_000_000_000


class Space:
    """The reachable configurations of a system in one table, with a flag for liveness.

    Parameters
    ----------
    system
        A system for which `loopgate.untimed.packed.why_not_packed` finds nothing.
    memory_gb
        The most memory for the table and the lists beside it [GB].
    progress
        Called now and then with the number of configurations found.

    Attributes
    ----------
    count, transitions, deadlocks, stuck, live
        Configurations, moves between them, those with a circular wait, those that are unfinished and without
        a move, those that are live.
    table
        The table, see `loopgate.untimed.table`.

    Raises
    ------
    ExplorationLimitError
        If the memory does not suffice.

    Notes
    -----
    Eight bytes per slot, of which 37 to 75 % are taken; while the table grows, the old and the new one exist.
    """

    def __init__(
        self, system: System, *, memory_gb: float, progress: Callable[[int], None] = lambda _: None
    ) -> None:
        self.packed: Packed = pack(system)
        self._memory_gb = memory_gb
        self._progress = progress
        self.table: NDArray[np.uint64] = new_table(12)
        self.count = 1
        self._totals = np.zeros(4, np.int64)
        self._spread(self._fill())

    @property
    def transitions(self) -> int:
        """Moves between the configurations."""
        return int(self._totals[0])

    @property
    def deadlocks(self) -> int:
        """Configurations with a circular wait."""
        return int(self._totals[1])

    @property
    def stuck(self) -> int:
        """Unfinished configurations without a move."""
        return int(self._totals[2])

    @property
    def live(self) -> int:
        """Live configurations."""
        return int(self._totals[3])

    def is_live(self, configuration: Configuration) -> bool:
        """Return whether a reachable configuration is live.

        Raises
        ------
        KeyError
            If it cannot be reached from the start.
        """
        key = np.uint64(self.packed.key(configuration))
        if not find(self.table, key):
            msg = "the configuration cannot be reached from the start"
            raise KeyError(msg)
        return has_flag(self.table, key, LIVE)

    def _fill(self) -> list[NDArray[np.uint64]]:
        """Find all configurations, breadth first; return those in which every robot is at home."""
        packed, system = self.packed, self.packed.system
        start = np.uint64(packed.key(system.initial))
        home = all(
            system.private[path[p]] for path, p in zip(system.paths, system.initial.positions, strict=True)
        )
        insert(self.table, start, LIVE if home else np.uint64(0))
        self._totals[3] = home
        first = np.array([start], np.uint64)
        homes = [first] if home else []
        level = [first]
        robots = len(system.robots)
        out = np.empty(_CHUNK * robots, np.uint64)
        out_homes = np.empty(_CHUNK * robots, np.uint64)
        while level:
            following: list[NDArray[np.uint64]] = []
            for keys in level:
                begin = 0
                while begin < len(keys):
                    chunk = min(len(keys) - begin, _CHUNK)
                    chunk = self._make_room(chunk, robots)
                    found, at_home = expand(
                        keys[begin : begin + chunk], self.table, out, out_homes,
                        packed.shift, packed.mask, packed.after, packed.state, packed.home, packed.room,
                        self._totals,
                    )  # fmt: skip
                    begin += chunk
                    self.count += found
                    self._totals[3] += at_home
                    following.append(out[:found].copy())
                    homes.append(out_homes[:at_home].copy())
                    self._progress(self.count)
            level = [keys for keys in following if len(keys)]
        return homes

    def _make_room(self, chunk: int, robots: int) -> int:
        """Let the table grow until some of `chunk` configurations can be visited; return how many."""
        while True:
            room = int(_FULLEST * self.table.size) - self.count
            if room >= min(chunk, 256) * robots:
                return min(chunk, room // robots)
            larger = 2 * self.table.size
            needed_gb = 8 * (larger + self.table.size + self.count) / _GB
            if needed_gb > self._memory_gb:
                msg = (
                    f"more than {self.count} configurations: they need {needed_gb:.1f} GB of memory, and "
                    f"{self._memory_gb:g} GB are allowed; allow more or explore a smaller system"
                )
                raise ExplorationLimitError(msg)
            table = new_table(larger.bit_length() - 1)
            moved_over(self.table, table)
            self.table = table

    def _spread(self, homes: list[NDArray[np.uint64]]) -> None:
        """Mark live every configuration from which a home can be reached."""
        packed = self.packed
        stack = np.empty(self.count, np.uint64)  # memory is taken as the pages are touched
        top = 0
        for keys in homes:
            stack[top : top + len(keys)] = keys
            top += len(keys)
        while top:
            top = spread_live(
                stack, top, 1 << 20, self.table,
                packed.shift, packed.mask, packed.before, packed.state, packed.home, packed.room,
                self._totals,
            )  # fmt: skip
            self._progress(self.count)
