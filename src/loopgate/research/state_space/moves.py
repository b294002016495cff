"""Moves between numbered configurations, and the configurations from which robots can go on for ever."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from loopgate.arrays import Flags, Ints, Small
from loopgate.research.state_space.kernels import keep_moving, spread_back


@dataclass(frozen=True, slots=True, eq=False)
class Moves:
    """Moves between numbered configurations."""

    first: Ints
    """The moves out of configuration k are those from ``first[k]`` up to ``first[k + 1]``."""
    targets: Small
    movers: NDArray[np.int16]
    """`targets` and `movers`: where each move leads, and which robot makes it."""
    rests: NDArray[np.int16]
    """How many robots stay for good in each configuration."""
    robots: int

    @property
    def done(self) -> Flags:
        """Whether all robots stay for good."""
        return np.asarray(self.rests == self.robots)

    @property
    def sources(self) -> Small:
        """Where each move begins."""
        return np.repeat(np.arange(len(self.rests), dtype=np.int32), np.diff(self.first))

    def only(self, which: Flags) -> Moves:
        """Return some of the moves."""
        first = np.concatenate([[0], np.cumsum(which)])[self.first]
        return Moves(first, self.targets[which], self.movers[which], self.rests, self.robots)

    def leading_to(self, good: Flags) -> Flags:
        """Return from where something good can be reached. O(moves) per sweep; few sweeps do."""
        found = good.copy()
        _sweep(lambda backwards: spread_back(found, self.first, self.targets, backwards))
        return found

    def everyone(self) -> Flags:
        """Return whether every robot can go on for ever from each configuration.

        That is so iff a strongly connected set of configurations can be reached inside which every robot
        moves but for those that stay for good. O(configurations + moves).
        """
        count = len(self.rests)
        graph = csr_array(
            (np.ones(len(self.targets), np.int8), self.targets, self.first.astype(np.int32)),
            shape=(count, count),
        )
        components, of = connected_components(graph, directed=True, connection="strong")
        sources = self.sources
        within = of[sources] == of[self.targets]
        moving = np.zeros((components, self.robots), np.bool_)
        moving[of[sources[within]], self.movers[within]] = True
        return self.leading_to(moving.sum(axis=1)[of] + self.rests == self.robots)

    def somebody(self, allowed: Flags) -> Flags:
        """Return whether some robot can move for ever within `allowed`, or all have come to their ends.

        The largest part of `allowed` that can be kept: each configuration of it has a move to another.
        O(moves) per sweep; few sweeps do.
        """
        good, done = allowed.copy(), self.done
        _sweep(lambda backwards: keep_moving(good, done, self.first, self.targets, backwards))
        return good


def _sweep(once: Callable[[bool], bool]) -> None:
    """Sweep down and up in turn until a sweep changes nothing."""
    backwards = True
    while once(backwards):
        backwards = not backwards
