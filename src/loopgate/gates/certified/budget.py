"""The budget of an exact search."""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf


class BudgetError(Exception):
    """The search has looked at as many nodes as it may, or for as long as it may."""


@dataclass(slots=True)
class Budget:
    """The most that one exact search may cost.

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
        """Stop a search that looks at its `nodes`-th node now.

        Raises `BudgetError` if that is one too many, or the deadline has come.
        """
        if nodes > self.nodes:
            raise BudgetError
        if deadline_s < inf and self.clock is not None and self.clock() >= deadline_s:
            raise BudgetError
