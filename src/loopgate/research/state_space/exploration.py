"""Exhaustive exploration: every configuration that a gate lets come about, in figures."""

import random
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Any, NamedTuple

import numpy as np

from loopgate.arrays import Small
from loopgate.errors import SystemModelError, UnsafeStartError
from loopgate.gates import Gate, Reason
from loopgate.gates.deadlocks import deadlocked_robots, homes_decide_liveness
from loopgate.gates.following import careful
from loopgate.model import Configuration, System
from loopgate.reading import of_kind
from loopgate.research.state_space.reach import Counterexample, Reach, asking, promise_of
from loopgate.research.state_space.space import ExplorationLimitError, StateSpace
from loopgate.research.state_space.verification import Each, Verification, counterexample, nothing
from loopgate.research.theory.homing import Homing
from loopgate.research.theory.orders import Orders


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


@dataclass(frozen=True, slots=True)
class ExplorationFigures:
    """The counts of configurations that are reachable from the start under a gate."""

    configurations: int
    """Number of configurations (positions of all robots, and their order within FIFO states)."""
    transitions: int
    """Number of admitted moves between them."""
    live: int
    """Number of live configurations: every robot could go on for ever without the gate."""
    deadlocks: int
    """Number of configurations with a circular wait (Def. 3)."""
    higher_order: dict[str, int] | None
    """Number of configurations that are neither live nor a deadlock, by order (Def. 11), or ``"unordered"``.
    None if some robot has no private or terminal state."""
    stuck: int
    """Number of configurations in which the gate admits no move although robots are not finished."""
    unsafe_admitted: int
    """Number of configurations that break the gate's promise although an admitted move leads to them."""
    seconds: float
    counterexample: Counterexample | None = field(default=None)
    """A shortest sequence of moves to an unsafe or stuck configuration, if asked for and found; empty if the
    start is one."""

    def as_dict(self) -> dict[str, Any]:
        """Return the counts as a JSON object, without the counterexample."""
        figures = asdict(self) | {"seconds": round(self.seconds, 3)}
        del figures["counterexample"]
        return figures


def explore(
    system: System,
    gate: Gate,
    *,
    counterexample: bool = False,
    memory_gb: float = 4.0,
    limit: int | None = None,
    progress: Callable[[int], None] | None = None,
) -> ExplorationFigures:
    """Visit every configuration that is reachable from the start under `gate`, and count deadlocks.

    Raises `ExplorationLimitError` if the memory or the limit is too small.

    Parameters
    ----------
    system, gate
        The system to explore, and its gate. The gate's decisions must depend on the configuration only;
        `Gate.moved` is not called.
    counterexample
        Whether to look for a shortest counterexample.
    limit
        Largest number of configurations to visit without the gate.
    progress
        Called at times with the number of configurations found so far.

    Notes
    -----
    The search first finds all configurations that can be reached without the gate (`StateSpace`), then the
    configurations that can be reached under the gate (`Reach`).

    Examples
    --------
    >>> from loopgate import Robot, System, explore, make_gate
    >>> system = System([Robot("a", ("a1", "s1", "s2")), Robot("b", ("b1", "s2", "s1"))])
    >>> explore(system, make_gate("collision", system)).deadlocks
    1
    >>> explore(system, make_gate("certified", system)).deadlocks
    0
    """
    system = of_kind(System, system, "explore: the system", SystemModelError, "a System")
    began = time.perf_counter()
    tell = progress or (lambda _: None)
    space = StateSpace(system, memory_gb=memory_gb, limit=limit, progress=tell)
    reach = Reach(space, asking(space, gate), tell)
    order, live = reach.order, space.live
    good = space.keeping(promise_of(gate))
    dead = order[~(live | space.locked)[order]]
    stuck = reach.stuck
    found: Counterexample | None = None
    bad = order[(stuck | ~good)[order]] if counterexample else order[:0]
    if len(bad):
        names = tuple(system.robots[i].id for i in reach.way(int(bad[0])))
        where = system.describe(space.configuration(int(bad[0])))
        found = Counterexample("stuck" if good[bad[0]] else "unsafe", names, where)
    return ExplorationFigures(
        configurations=len(order),
        transitions=int(reach.ways.sum(dtype=np.int64)),
        live=int(live[order].sum()),
        deadlocks=int(space.locked[order].sum()),
        higher_order=_orders(space, dead) if homes_decide_liveness(system) else None,
        stuck=int(stuck.sum()),
        unsafe_admitted=int((~good)[order[1:]].sum()),
        seconds=time.perf_counter() - began,
        counterexample=found,
    )


def _orders(space: StateSpace, dead: Small) -> dict[str, int]:
    """Count configurations that are neither live nor have a circular wait by their order.

    Where a robot is in a private state does not matter, nor who stands before whom, so those that differ in
    nothing else are looked at once.
    """
    orders = Orders(space.system)
    keys, private = space.keys[dead], space.encoding.arrays.state < 0
    where = np.stack([space.encoding.positions(keys, i) for i in range(len(space.system.robots))])
    for i, row in enumerate(where):
        row[private[i][row]] = np.argmax(private[i])
    _, firsts, counts = np.unique(where, axis=1, return_index=True, return_counts=True)
    found: dict[str, int] = {}
    for number, count in zip(dead[firsts].tolist(), counts.tolist(), strict=True):
        order = orders.of_configuration(space.configuration(number))
        key = "unordered" if order is None else str(order)
        found[key] = found.get(key, 0) + count
    return {key: found[key] for key in sorted(found, key=lambda k: (k == "unordered", len(k), k))}
