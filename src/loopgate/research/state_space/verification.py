"""Checking a gate in every configuration: each decision against the exact answer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field, fields
from typing import Any

import numpy as np

from loopgate.arrays import Flags
from loopgate.errors import UnsafeStartError
from loopgate.gates import Decision, Gate, Reason
from loopgate.model import Configuration, System
from loopgate.research.state_space.reach import Counterexample, Reach, ask_gate, promise_of
from loopgate.research.state_space.space import StateSpace

Each = Callable[[Gate, Configuration, int], None]
"""A function that is called with the gate, the configuration and the robot of a decision."""


def nothing(gate: Gate, configuration: Configuration, robot: int) -> None:
    """Ignore a decision."""
    del gate, configuration, robot


@dataclass(frozen=True, slots=True)
class Verification:
    """The findings of a check of a gate; two findings can be added."""

    method: str
    """``exhaustive`` or ``walks``."""
    judge: str
    """The method that finds the exact answer: ``oracle`` (all configurations) or ``homing`` (ways home). For
    a gate that promises that somebody can always move: ``somebody`` (all configurations) or, if they are too
    many, ``deadlocks`` (circular waits only)."""
    systems: int = 1
    """Systems checked."""
    configurations: int = 0
    """Configurations in which the gate decided about every robot; in walks some count more than once."""
    decisions: int = 0
    """Decisions about enabled moves."""
    safe: int = 0
    safe_admitted: int = 0
    """`safe` and `safe_admitted`: decisions about safe moves, and how many of these the gate admitted; 0 if
    safety was not judged."""
    unsafe_admitted: int = 0
    stuck: int = 0
    disabled_admitted: int = 0
    """`unsafe_admitted`, `stuck` and `disabled_admitted`: broken promises; see `Counterexample`."""
    budget_stops: int = 0
    """Refusals because the gate's budget was used up."""
    starts_refused: int = 0
    live_starts_refused: int = 0
    dead_starts_accepted: int = 0
    """`starts_refused`, `live_starts_refused` and `dead_starts_accepted`: starts that the gate refused, live
    starts among these, and accepted starts that are not live (no walk begins there)."""
    explored: int = 0
    reachable_live: int = 0
    """`explored` and `reachable_live`: configurations reachable under the gate, and under the best possible
    safe gate (exhaustive checks only)."""
    deadlocks: int = 0
    """Configurations with a circular wait that are reachable under the gate (exhaustive checks only)."""
    starving: int = 0
    """Configurations reachable under the gate from which, by admitted moves, not every robot can go on for
    ever (exhaustive checks only). Not part of `holds`: some gates only promise that somebody can move."""
    counterexample: Counterexample | None = field(default=None)
    """The first found, if any."""

    @property
    def holds(self) -> bool:
        """Whether the check found no broken promise."""
        broken = self.unsafe_admitted + self.stuck + self.disabled_admitted
        return not broken + self.live_starts_refused + self.dead_starts_accepted

    @property
    def permissiveness(self) -> float | None:
        """The share of safe moves that the gate accepts; None if safety was not judged."""
        return self.safe_admitted / self.safe if self.safe else None

    @property
    def coverage(self) -> float | None:
        """The share of reachable configurations that the gate reaches; None for random walks."""
        return self.explored / self.reachable_live if self.reachable_live else None

    def __add__(self, other: Verification) -> Verification:
        mine = {f.name: getattr(self, f.name) for f in fields(self)}
        for name, value in mine.items():
            theirs = getattr(other, name)
            if isinstance(value, int):
                mine[name] = value + theirs
            elif name == "counterexample":
                mine[name] = value or theirs
            elif value != theirs:
                mine[name] = "mixed"
        return Verification(**mine)

    def as_dict(self) -> dict[str, Any]:
        """Return all findings as a JSON object."""
        data = asdict(self)
        data.update(holds=self.holds, permissiveness=self.permissiveness, coverage=self.coverage)
        return data


def verify_everywhere(
    system: System,
    make: Callable[[System], Gate],
    *,
    limit: int = 100_000,
    progress: Callable[[int], None] = lambda _: None,
    each: Each = nothing,
) -> Verification:
    """Check a gate in every configuration that is reachable under it, breadth first.

    Raises `ExplorationLimitError` if there are more than `limit` configurations.

    Parameters
    ----------
    make
        Function that makes the gate. The gate's decisions must depend on the configuration only; `Gate.moved`
        is not called.
    progress
        Called with the number of configurations found so far.
    each
        Called after each decision about a possible move.
    """
    space = StateSpace(system, limit=limit, progress=progress)
    return verify_space(space, make, progress=progress, each=each)


def verify_space(
    space: StateSpace,
    make: Callable[[System], Gate],
    *,
    promise: str | None = None,
    progress: Callable[[int], None] = lambda _: None,
    each: Each = nothing,
) -> Verification:
    """Check a gate as `verify_everywhere` does, in a `StateSpace` that exists already.

    Parameters
    ----------
    make, progress, each
        As for `verify_everywhere`.
    promise
        The meaning of *safe*. ``everyone``: every robot can go on for ever. ``somebody``: some robot can
        always move, and no circular wait ever forms. Default: the gate's own promise, see `promise_of`.
    """
    try:
        gate = make(space.system)
    except UnsafeStartError:
        live = int(space.live[0])
        return Verification("exhaustive", "oracle", starts_refused=1, live_starts_refused=live)
    asked = promise or promise_of(gate)
    judge = "oracle" if asked == "everyone" else asked
    good = space.keeping(asked)
    if not good[0]:
        return Verification("exhaustive", judge, dead_starts_accepted=1)
    disabled: list[tuple[int, int]] = []
    budget_stops = 0

    def take_note(here: Configuration, robot: int, decision: Decision, possible: bool) -> None:  # noqa: FBT001
        nonlocal budget_stops
        budget_stops += decision.reason is Reason.BUDGET
        if possible:
            each(gate, here, robot)
        elif decision.admitted:
            disabled.append((space.number(here), robot))

    reach = Reach(space, ask_gate(space, gate, take_note), progress)
    moves, order = space.moves, reach.order
    decided = (reach.rank >= 0)[moves.sources]
    safe = decided & good[moves.targets]
    unsafe = reach.admitted & ~safe
    return Verification(
        "exhaustive",
        judge,
        configurations=len(order),
        decisions=int(decided.sum()),
        safe=int(safe.sum()),
        safe_admitted=int((safe & reach.admitted).sum()),
        unsafe_admitted=int(unsafe.sum()),
        stuck=int(reach.stuck.sum()),
        disabled_admitted=len(disabled),
        budget_stops=budget_stops,
        explored=len(order),
        reachable_live=len(Reach(space, None, within=good).order),
        deadlocks=int(space.locked[order].sum()),
        starving=int((~moves.only(reach.admitted).everyone())[order].sum()),
        counterexample=_first(space, reach, unsafe, disabled),
    )


def _first(
    space: StateSpace, reach: Reach, unsafe: Flags, disabled: list[tuple[int, int]]
) -> Counterexample | None:
    """Return the broken promise that is found first, with a shortest way to it."""
    moves = space.moves
    edges = np.flatnonzero(unsafe)
    broken: list[tuple[int, int, int, str]] = [
        (int(reach.rank[number]), 0, robot, "disabled") for number, robot in disabled
    ]
    broken += [
        (rank, 1, robot, "unsafe")
        for rank, robot in zip(
            reach.rank[moves.sources[edges]].tolist(), moves.movers[edges].tolist(), strict=True
        )
    ]
    broken += [(rank, 2, -1, "stuck") for rank in reach.rank[reach.stuck].tolist()]
    if not broken:
        return None
    rank, _, robot, kind = min(broken)
    number = int(reach.order[rank])
    return counterexample(space.system, kind, reach.way(number), space.configuration(number), robot)


def counterexample(
    system: System, kind: str, way: list[int], here: Configuration, robot: int
) -> Counterexample:
    """Describe a broken promise in the configuration `here`, or after a move of `robot`."""
    way = way if robot < 0 else [*way, robot]
    there = system.moved(here, robot) if kind == "unsafe" else here
    return Counterexample(kind, tuple(system.robots[i].id for i in way), system.describe(there))
