"""The exact search, depth first over single moves, with the cheap rules in between; and its budget."""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf

from loopgate.gates.certified.banker import reduce_to_core
from loopgate.gates.certified.occupancy import Occupancy, stuck_for_good
from loopgate.gates.certified.system_index import SystemIndex

_MEMORY = 200_000
"""Dead cores remembered; the memory is emptied when it is full."""


class BudgetError(Exception):
    """A search that has used up its budget of nodes or time."""


@dataclass(slots=True)
class Budget:
    """The limits of one search: nodes and time.

    Attributes
    ----------
    nodes
        The most nodes to look at.
    time_s
        The longest time [s]; 0: no limit.
    clock
        Tells the time [s] from any origin; without one, time has no limit. The gate has none of its own,
        so that its answers depend on nothing but the configuration unless its caller wants them to.
    """

    nodes: int
    time_s: float = 0.0
    clock: Callable[[], float] | None = None

    def deadline_s(self) -> float:
        """Return when a search that begins now must end, by the clock; infinity without a limit."""
        if self.clock is None or not self.time_s:
            return inf
        return self.clock() + self.time_s

    def check(self, nodes: int, deadline_s: float) -> None:
        """Raise `BudgetError` if the search has used up its budget at its `nodes`-th node.

        Raises `BudgetError` if that is one too many, or the deadline has come.
        """
        if nodes > self.nodes:
            raise BudgetError
        if deadline_s < inf and self.clock is not None and self.clock() >= deadline_s:
            raise BudgetError


class Search:
    """The exact search for moves that bring every robot home, or for a proof that there are none.

    After each move every robot that can go home without harm does (`reduce_to_core`); a core with robots
    that can never move again is dead; robots that share no state on their ways home are searched apart.
    Dead cores are remembered for later decisions: a core that cannot get home cannot get home with more
    robots about either.

    Parameters
    ----------
    layout
        The system's layout; every robot must have a home.
    budget
        The most cores to branch on, and the longest time, in one call.

    Notes
    -----
    Exponential in the size of the core at worst; the problem is NP-complete (Lawley and Reveliotis 2001).
    """

    def __init__(self, layout: SystemIndex, budget: Budget) -> None:
        self._layout = layout
        self._budget = budget
        self._deadline_s = inf
        self._dead: set[tuple[tuple[int, ...], tuple[int, ...], tuple[tuple[int, ...], ...]]] = set()
        self._settlers = [i for i, s in enumerate(layout.settles) if s >= 0]
        self.nodes = 0
        """Number of cores that the last call branched on."""

    def solve(self, stand: Occupancy, robots: list[int], *, timed: bool = False) -> list[int] | None:
        """Return moves that bring `robots` home from `stand` (which is changed); None if there are none.

        The other robots must be at home already. Only a `timed` search has the budget's limit of time.

        Raises `BudgetError` if the budget is used up before the answer is known.
        """
        self.nodes = 0
        self._deadline_s = self._budget.deadline_s() if timed else inf
        return self._solve(stand, robots)

    def _solve(self, stand: Occupancy, robots: list[int]) -> list[int] | None:
        moves, core = reduce_to_core(stand, robots)
        if not core:
            return moves
        if stuck_for_good(stand, core):
            return None
        for part in parts_of(stand, core):
            found = self._branch(stand, part)
            if found is None:
                return None
            moves += found
        return moves

    def _branch(self, stand: Occupancy, part: list[int]) -> list[int] | None:
        key = self._key(stand, part)
        if key in self._dead:
            return None
        self.nodes += 1
        self._budget.check(self.nodes, self._deadline_s)
        for i in part:
            if not stand.enabled(i):
                continue
            found = self._solve(stand.after(i), part)
            if found is not None:
                return [i, *found]
        if len(self._dead) >= _MEMORY:
            self._dead.clear()
        self._dead.add(key)
        return None

    def _key(
        self, stand: Occupancy, part: list[int]
    ) -> tuple[tuple[int, ...], tuple[int, ...], tuple[tuple[int, ...], ...]]:
        at = stand.at
        part = [*part, *(i for i in self._settlers if self._layout.home[i][at[i]])]
        if not stand.queue:
            return tuple(part), tuple([at[i] for i in part]), ()
        lines = sorted({stand.state(i) for i in part}.intersection(stand.queue))
        return tuple(part), tuple([at[i] for i in part]), tuple(tuple(stand.queue[s]) for s in lines)


def parts_of(stand: Occupancy, core: list[int]) -> list[list[int]]:
    """Split robots into parts that share no state from here to their homes, the smallest part first."""
    layout = stand.layout
    leader = {i: i for i in core}

    def find(i: int) -> int:
        while leader[i] != i:
            leader[i] = leader[leader[i]]
            i = leader[i]
        return i

    first: dict[int, int] = {}
    for i in core:
        for s in (stand.state(i), *layout.way[i][stand.at[i]]):
            if not layout.never_blocks[s]:
                leader[find(i)] = find(first.setdefault(s, i))
    parts: dict[int, list[int]] = {}
    for i in core:
        parts.setdefault(find(i), []).append(i)
    return sorted(parts.values(), key=len)
