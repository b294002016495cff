"""Model-checking a gate: every decision against the exact answer, exhaustively or along random walks."""

from __future__ import annotations

import random
from collections import deque
from collections.abc import Callable
from typing import TypeAlias

from loopgate.errors import UnsafeStartError
from loopgate.gates import Gate, Reason
from loopgate.model import Configuration, System
from loopgate.theory.deadlocks import deadlocked_robots
from loopgate.theory.oracle import OracleLimitError
from loopgate.untimed.exploration import ExplorationLimitError
from loopgate.untimed.judges import ByDeadlocks, ByOracle, Judge, judge_for
from loopgate.untimed.numbered import Numbered, why_not_numbered
from loopgate.untimed.numbered_checking import verify_numbered
from loopgate.untimed.verification import Counterexample, Verification

__all__ = ["verify_everywhere", "verify_plainly", "verify_walks"]


Each: TypeAlias = Callable[[Gate, Configuration, int], None]
"""What is called with the gate, the configuration and the robot of a decision."""


def _nothing(gate: Gate, configuration: Configuration, robot: int) -> None:
    del gate, configuration, robot


class _Count:
    """Asks a gate about every robot and keeps count."""

    def __init__(self, system: System, judge: Judge | None, each: Each) -> None:
        self._system = system
        self._judge = judge
        self._each = each
        self._judges_moves = judge is not None and judge.name != "deadlocks"
        self.counts: dict[str, int] = dict.fromkeys(
            ("configurations", "decisions", "safe", "safe_admitted", "unsafe_admitted", "stuck"), 0
        )
        self.counts.update(disabled_admitted=0, budget_stops=0)

    def ask(self, gate: Gate, here: Configuration) -> tuple[list[int], tuple[str, int] | None]:
        """Return the robots admitted and, if there is one, a promise broken here and the move that does."""
        system, counts = self._system, self.counts
        broken: tuple[str, int] | None = None
        admitted = []
        counts["configurations"] += 1
        for robot in range(len(system.robots)):
            decision = gate.decide(here, robot)
            counts["budget_stops"] += decision.reason is Reason.BUDGET
            if not system.enabled(here, robot):
                if decision.admitted:
                    counts["disabled_admitted"] += 1
                    broken = ("disabled", robot)
                continue
            counts["decisions"] += 1
            self._each(gate, here, robot)
            safe = self._judge is None or self._judge.live(system.moved(here, robot))
            if self._judges_moves:
                counts["safe"] += safe
                counts["safe_admitted"] += safe and decision.admitted
            if decision.admitted:
                admitted.append(robot)
                if not safe:
                    counts["unsafe_admitted"] += 1
                    broken = broken or ("unsafe", robot)
        if not admitted and not all(system.finished(here, i) for i in range(len(system.robots))):
            counts["stuck"] += 1
            broken = broken or ("stuck", -1)
        return admitted, broken

    def example(self, broken: tuple[str, int], moves: list[int], here: Configuration) -> Counterexample:
        """Put a broken promise into words."""
        kind, robot = broken
        if robot >= 0:
            moves = [*moves, robot]
        there = here if robot < 0 or kind == "disabled" else self._system.moved(here, robot)
        names = tuple(self._system.robots[i].id for i in moves)
        return Counterexample(kind, names, self._system.describe(there))


def _make(
    make: Callable[[System], Gate], system: System, judge: Judge | None, method: str
) -> Gate | Verification:
    try:
        return make(system)
    except UnsafeStartError:
        live = judge is not None and judge.live(system.initial)
        name = judge.name if judge else "none"
        return Verification(method, name, starts_refused=1, live_starts_refused=int(live))


def _promises_everyone(gate: Gate) -> bool:
    return getattr(gate, "promise", "everyone") == "everyone"


def verify_everywhere(
    system: System,
    make: Callable[[System], Gate],
    *,
    limit: int = 100_000,
    progress: Callable[[int], None] = lambda _: None,
    each: Each = _nothing,
) -> Verification:
    """Check every configuration that the gate lets come about, breadth first from the start.

    Parameters
    ----------
    system
        The system.
    make
        Makes the gate. Its decisions must depend on the configuration alone; `Gate.moved` is not called.
    limit
        The most configurations to look at.
    progress
        Called with the number of configurations found so far.
    each
        Called after each decision about an enabled move.

    Raises
    ------
    OracleLimitError
        If there are more than `limit` configurations.

    Notes
    -----
    Systems that fit into words are checked by `verify_numbered`, the others by `verify_plainly`, with the
    same result.
    """
    if why_not_numbered(system):
        return verify_plainly(system, make, limit=limit, progress=progress, each=each)
    try:
        numbered = Numbered(system, limit=limit)
    except ExplorationLimitError as error:
        raise OracleLimitError(str(error)) from error
    return verify_numbered(numbered, make, progress=progress, each=each)


def verify_plainly(
    system: System,
    make: Callable[[System], Gate],
    *,
    limit: int = 100_000,
    progress: Callable[[int], None] = lambda _: None,
    each: Each = _nothing,
) -> Verification:
    """Check as `verify_everywhere` does, with the plain oracle.

    Without `starving`; and of gates that promise somebody only circular waits and stops are seen.
    """
    oracle = ByOracle(system, limit=limit)
    oracle.live(system.initial)
    gate = _make(make, system, oracle, "exhaustive")
    if isinstance(gate, Verification):
        return gate
    judge: Judge = oracle if _promises_everyone(gate) else ByDeadlocks(system)
    if not judge.live(system.initial):
        return Verification("exhaustive", judge.name, dead_starts_accepted=1)
    count = _Count(system, judge, each)
    came: dict[Configuration, tuple[Configuration, int] | None] = {system.initial: None}
    todo = deque([system.initial])
    example: Counterexample | None = None
    while todo:
        here = todo.popleft()
        progress(len(came))
        admitted, broken = count.ask(gate, here)
        if broken and example is None:
            example = count.example(broken, _way(came, here), here)
        for robot in admitted:
            there = system.moved(here, robot)
            if there not in came:
                came[there] = (here, robot)
                todo.append(there)
    return Verification(
        "exhaustive",
        judge.name,
        explored=len(came),
        reachable_live=_reachable_live(system, judge),
        deadlocks=sum(bool(deadlocked_robots(system, here)) for here in came),
        counterexample=example,
        **count.counts,
    )


def _way(came: dict[Configuration, tuple[Configuration, int] | None], here: Configuration) -> list[int]:
    moves: list[int] = []
    step = came[here]
    while step is not None:
        here, robot = step
        moves.append(robot)
        step = came[here]
    return moves[::-1]


def _reachable_live(system: System, judge: Judge) -> int:
    if not judge.live(system.initial):
        return 0
    seen, todo = {system.initial}, [system.initial]
    while todo:
        here = todo.pop()
        for robot in range(len(system.robots)):
            if system.enabled(here, robot):
                there = system.moved(here, robot)
                if there not in seen and judge.live(there):
                    seen.add(there)
                    todo.append(there)
    return len(seen)


def verify_walks(
    system: System,
    make: Callable[[System], Gate],
    *,
    seed: int,
    walks: int = 1,
    steps: int = 100,
    limit: int = 20_000,
    progress: Callable[[int], None] = lambda _: None,
    each: Each = _nothing,
) -> Verification:
    """Check along random walks of admitted moves, each told to the gate.

    The judge is a plain search for a way home where private states decide liveness, or the SAT solver where
    there are many robots and it covers the system; else the oracle; beyond its limit nobody, and then only
    stuck configurations, broken capacities and circular waits are found.

    Parameters
    ----------
    system, make
        The system, and what makes the gate; each walk begins with a new one.
    seed
        Of the walks.
    walks, steps
        How many walks, and the most moves of each.
    limit
        The most configurations the oracle may look at.
    progress
        Called with the number of moves made so far.
    each
        Called after each decision about an enabled move.
    """
    rng = random.Random(seed)
    judge = judge_for(system, limit)
    total: Verification | None = None
    example: Counterexample | None = None
    done = 0
    for _ in range(walks):
        gate = _make(make, system, judge, "walks")
        if isinstance(gate, Verification):
            return gate
        if judge is None or not _promises_everyone(gate):
            judge = ByDeadlocks(system)
        if not judge.live(system.initial):
            return Verification("walks", judge.name, dead_starts_accepted=1)
        count = _Count(system, judge, each)
        here, moves = system.initial, list[int]()
        for _ in range(steps):
            admitted, broken = count.ask(gate, here)
            if broken:
                example = example or count.example(broken, moves, here)
            if not admitted:
                break
            robot = rng.choice(admitted)
            here = system.moved(here, robot)
            gate.moved(here, robot)
            moves.append(robot)
            done += 1
            progress(done)
        found = Verification("walks", judge.name, systems=0, counterexample=example, **count.counts)
        total = found if total is None else total + found
    return (total or Verification("walks", "none", systems=0)) + Verification(
        "walks", judge.name if judge else "none", systems=1
    )
