"""Model-checking a gate over numbered configurations: every decision against the exact answer, fast."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from loopgate.errors import UnsafeStartError
from loopgate.gates import Gate, Reason
from loopgate.model import Configuration, System
from loopgate.untimed.numbered import Moves, Numbered
from loopgate.untimed.verification import Counterexample, Verification

__all__ = ["verify_numbered"]


def verify_numbered(
    numbered: Numbered,
    make: Callable[[System], Gate],
    *,
    promise: str | None = None,
    progress: Callable[[int], None] = lambda _: None,
    each: Callable[[Gate, Configuration, int], None] = lambda _g, _c, _r: None,
) -> Verification:
    """Check every configuration that a gate lets come about, breadth first from the start.

    Parameters
    ----------
    numbered
        All configurations of the system.
    make
        Makes the gate. Its decisions must depend on the configuration alone; `Gate.moved` is not called.
    promise
        What counts as safe: ``everyone``, a configuration from which every robot can go on for ever;
        ``somebody``, one from which somebody can always move on without any circular wait ever. By default
        what the gate promises, and ``everyone`` if it does not say.
    progress
        Called with the number of configurations found so far.
    each
        Called after each decision about an enabled move.
    """
    system = numbered.words.system
    try:
        gate = make(system)
    except UnsafeStartError:
        live = int(numbered.live[0])
        return Verification("exhaustive", "oracle", starts_refused=1, live_starts_refused=live)
    asked = promise or getattr(gate, "promise", "everyone")
    judge = "oracle" if asked == "everyone" else "somebody"
    good = numbered.live if asked == "everyone" else numbered.somebody()
    if not good[0]:
        return Verification("exhaustive", judge, dead_starts_accepted=1)
    check = _Check(numbered, good)
    while check.index < len(check.visited):
        progress(len(check.visited))
        check.ask(gate, each)
    return check.result(judge)


class _Check:
    def __init__(self, numbered: Numbered, good: NDArray[np.bool_]) -> None:
        self._numbered = numbered
        self._system = numbered.words.system
        self._good = good
        self._rank = np.full(numbered.count, -1, np.int32)
        self._rank[0] = 0
        self._came = [(-1, -1)]
        self._first = [0]
        self._targets: list[int] = []
        self._movers: list[int] = []
        self._example: Counterexample | None = None
        self._counts = dict.fromkeys(
            ("decisions", "safe", "safe_admitted", "unsafe_admitted", "stuck", "disabled_admitted"), 0
        )
        self._counts["budget_stops"] = 0
        self.visited = [0]
        self.index = 0

    def ask(self, gate: Gate, each: Callable[[Gate, Configuration, int], None]) -> None:
        """Ask about every robot in the next configuration."""
        numbered, counts, number = self._numbered, self._counts, self.visited[self.index]
        here = numbered.configuration(number)
        moves = numbered.moves
        begin, end = int(moves.first[number]), int(moves.first[number + 1])
        after = dict(zip(moves.movers[begin:end].tolist(), moves.targets[begin:end].tolist(), strict=True))
        broken: tuple[str, int] | None = None
        admitted = 0
        for robot in range(moves.robots):
            decision = gate.decide(here, robot)
            counts["budget_stops"] += decision.reason is Reason.BUDGET
            there = after.get(robot)
            if there is None:
                if decision.admitted:
                    counts["disabled_admitted"] += 1
                    broken = ("disabled", robot)
                continue
            each(gate, here, robot)
            safe = bool(self._good[there])
            counts["decisions"] += 1
            counts["safe"] += safe
            if not decision.admitted:
                continue
            admitted += 1
            counts["safe_admitted"] += safe
            if not safe:
                counts["unsafe_admitted"] += 1
                broken = broken or ("unsafe", robot)
            self._enter(there, robot)
        self._first.append(len(self._targets))
        if not admitted and int(moves.resting[number]).bit_count() < moves.robots:
            counts["stuck"] += 1
            broken = broken or ("stuck", -1)
        if broken and self._example is None:
            self._example = self._describe(*broken, here)
        self.index += 1

    def _enter(self, there: int, robot: int) -> None:
        if self._rank[there] < 0:
            self._rank[there] = len(self.visited)
            self.visited.append(there)
            self._came.append((self.index, robot))
        self._targets.append(int(self._rank[there]))
        self._movers.append(robot)

    def _describe(self, kind: str, robot: int, here: Configuration) -> Counterexample:
        """Put a broken promise into words."""
        way: list[int] = []
        index = self.index
        while index > 0:
            index, mover = self._came[index]
            way.append(mover)
        way.reverse()
        if robot >= 0:
            way.append(robot)
        there = here if robot < 0 or kind == "disabled" else self._system.moved(here, robot)
        return Counterexample(
            kind, tuple(self._system.robots[i].id for i in way), self._system.describe(there)
        )

    def result(self, judge: str) -> Verification:
        """Return what was found."""
        visited = np.array(self.visited)
        admitted = Moves(
            np.array(self._first, np.int64),
            np.array(self._targets, np.int32),
            np.array(self._movers, np.int8),
            self._numbered.moves.resting[visited],
            self._numbered.moves.robots,
        )
        return Verification(
            "exhaustive",
            judge,
            configurations=len(visited),
            explored=len(visited),
            reachable_live=_reached(self._numbered, self._good),
            deadlocks=int(self._numbered.locked[visited].sum()),
            starving=int((~admitted.everyone()).sum()),
            counterexample=self._example,
            **self._counts,
        )


def _reached(numbered: Numbered, good: NDArray[np.bool_]) -> int:
    """Return how many good configurations can be reached from the start through good ones."""
    moves = numbered.moves
    seen = np.zeros(numbered.count, np.bool_)
    level = np.array([0])
    seen[0] = True
    while len(level):
        spans = [moves.targets[moves.first[k] : moves.first[k + 1]] for k in level.tolist()]
        there = np.unique(np.concatenate(spans))
        level = there[good[there] & ~seen[there]]
        seen[level] = True
    return int(seen.sum())
