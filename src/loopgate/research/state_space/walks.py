"""Checking a gate along random walks of admitted moves, where not every configuration can be looked at."""

import random
from collections import Counter
from collections.abc import Callable
from typing import NamedTuple

from loopgate.errors import UnsafeStartError
from loopgate.gates import Gate, Reason
from loopgate.gates.careful import careful
from loopgate.gates.deadlocks import deadlocked_robots, homes_decide_liveness
from loopgate.model import Configuration, System
from loopgate.research.state_space.reach import Counterexample, promise_of
from loopgate.research.state_space.space import ExplorationLimitError, StateSpace
from loopgate.research.state_space.verification import Each, Verification, counterexample, nothing
from loopgate.research.theory.homing import Homing


class _Judge(NamedTuple):
    """The exact answer: does a configuration keep the promise."""

    name: str
    live: Callable[[Configuration], bool]


def _judge_for(system: System, promise: str, limit: int) -> _Judge:
    """Return a judge of `system` by a promise: exact, or by circular waits if the system is too large."""
    if promise == "everyone" and homes_decide_liveness(system):
        return _Judge("homing", Homing(system).live)
    try:
        space = StateSpace(system, limit=limit)
    except ExplorationLimitError:
        return _Judge("deadlocks", lambda here: not deadlocked_robots(system, here))
    good = space.keeping(promise)
    name = "oracle" if promise == "everyone" else promise
    return _Judge(name, lambda here: bool(good[space.number(here)]))


def verify_walks(
    system: System,
    make: Callable[[System], Gate],
    *,
    seed: int,
    walks: int = 1,
    steps: int = 100,
    limit: int = 20_000,
    progress: Callable[[int], None] = lambda _: None,
    each: Each = nothing,
) -> Verification:
    """Check a gate along random walks of admitted moves.

    If private states decide liveness, a search for ways home judges each move; otherwise a visit of all
    configurations does. Beyond the limit only stuck configurations, broken capacities and circular waits are
    found.

    Parameters
    ----------
    system, make
        The system, and a function that makes the gate; each walk begins with a new gate.
    walks, steps
        Number of walks, and largest number of moves of each.
    limit
        Largest number of configurations to visit for a judgement.
    progress
        Called with the number of moves made so far.
    each
        Called after each decision about a possible move.
    """
    rng = random.Random(seed)
    judge: _Judge | None = None
    counts: Counter[str] = Counter()
    example: Counterexample | None = None
    for _ in range(walks):
        try:
            gate = make(system)
        except UnsafeStartError:
            judge = judge or _judge_for(system, "everyone", limit)
            live = int(judge.name != "deadlocks" and judge.live(system.initial))
            return Verification("walks", judge.name, starts_refused=1, live_starts_refused=live)
        judge = judge or _judge_for(system, promise_of(gate), limit)
        if not judge.live(system.initial):
            return Verification("walks", judge.name, dead_starts_accepted=1)
        here, moves, asked = system.initial, list[int](), careful(gate, system)
        for _ in range(steps):
            admitted, broken = _ask(system, gate, asked, here, judge, counts, each)
            if broken and example is None:
                example = counterexample(system, broken[0], moves, here, broken[1])
            if not admitted:
                break
            robot = rng.choice(admitted)
            here = system.moved(here, robot)
            asked.moved(here, robot)
            moves.append(robot)
            counts["done"] += 1
            progress(counts["done"])
    del counts["done"]
    return Verification("walks", judge.name if judge else "none", counterexample=example, **counts)


def _ask(
    system: System,
    gate: Gate,
    asked: Gate,
    here: Configuration,
    judge: _Judge,
    counts: Counter[str],
    each: Each,
) -> tuple[list[int], tuple[str, int] | None]:
    """Ask a gate about every robot; return the admitted robots and one whose move breaks the promise."""
    broken: tuple[str, int] | None = None
    admitted = []
    counts["configurations"] += 1
    for robot in range(len(system.robots)):
        decision = asked.decide(here, robot)
        counts["budget_stops"] += decision.reason is Reason.BUDGET
        if not system.enabled(here, robot):
            if decision.admitted:
                counts["disabled_admitted"] += 1
                broken = ("disabled", robot)
            continue
        counts["decisions"] += 1
        each(gate, here, robot)
        safe = judge.live(system.moved(here, robot))
        if judge.name != "deadlocks":
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
