"""Breadth-first exploration under a gate, within a space whose live configurations are known."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from loopgate.errors import GateError
from loopgate.gates import Gate
from loopgate.gates.algorithm2 import Algorithm2Gate
from loopgate.gates.banker import BankerGate
from loopgate.gates.collision import CollisionGate
from loopgate.gates.open import OpenGate
from loopgate.model import System
from loopgate.theory.deadlocks import deadlocked_robots
from loopgate.theory.walks import default_lookahead
from loopgate.untimed.exploration import Witness
from loopgate.untimed.kernel_circuits import scratch_for
from loopgate.untimed.kernel_gated import ALGORITHM2, BANKER, COLLISION, expand_gated, judge
from loopgate.untimed.packed import Packed
from loopgate.untimed.space import Space
from loopgate.untimed.table import LIVE, VISITED, has_flag, set_flag

__all__ = ["Gated", "Judgement", "judge_moves"]

_CHUNK = 1 << 16
_MOST_STATES = 64
_MOST_ROBOTS = 64


class Gated:
    """The configurations of a space that a gate lets come about.

    Parameters
    ----------
    space
        All configurations, with their liveness; the flag ``VISITED`` of its table is used here.
    gate
        The gate. ``open``, ``collision``, ``banker`` and (with single capacities) ``algorithm2`` are
        compiled.
    progress
        Called now and then with the number of configurations found.

    Attributes
    ----------
    count, transitions, deadlocks, stuck, live
        As in `loopgate.untimed.exploration.Exploration`.
    stuck_live
        How many of the stuck configurations are live.
    """

    def __init__(self, space: Space, gate: Gate, *, progress: Callable[[int], None] = lambda _: None) -> None:
        self._space = space
        self._gate = gate
        self._progress = progress
        self._native = _native(space.packed.system, gate)
        self.count = 1
        self.stuck_live = 0
        self._totals = np.zeros(4, np.int64)

    @property
    def transitions(self) -> int:
        """Admitted moves between the configurations."""
        return int(self._totals[0])

    @property
    def deadlocks(self) -> int:
        """Configurations with a circular wait."""
        return int(self._totals[1])

    @property
    def stuck(self) -> int:
        """Unfinished configurations in which the gate admits nothing."""
        return int(self._totals[2])

    @property
    def live(self) -> int:
        """Live configurations."""
        return int(self._totals[3])

    def explore(self, *, witness: bool = False) -> Witness | None:
        """Explore; return a shortest counterexample if one is wanted and there is one."""
        packed = self._space.packed
        start = np.array([packed.key(packed.system.initial)], np.uint64)
        set_flag(self._space.table, start[0], VISITED)
        levels = [start]
        found: Witness | None = None
        while len(levels[-1]):
            following, bad = self._level(levels[-1])
            if bad is not None and witness and found is None:
                found = self._trace_back(levels, bad)
            if witness and found is None:
                levels.append(following)
            else:
                levels = [following]
        return found

    def _level(self, keys: NDArray[np.uint64]) -> tuple[NDArray[np.uint64], int | None]:
        """Visit one level; return the next one, and the first unsafe (else stuck) key of this one."""
        following: list[NDArray[np.uint64]] = []
        bads: list[NDArray[np.uint64]] = []
        for begin in range(0, len(keys), _CHUNK):
            part = keys[begin : begin + _CHUNK]
            native = self._native
            out, bad = self._visit(part) if native is None else self._visit_compiled(part, native)
            following.append(out)
            bads.append(bad)
            self.count += len(out)
            self._progress(self.count)
        all_bad = np.concatenate(bads)
        self.stuck_live += sum(has_flag(self._space.table, key, LIVE) for key in all_bad)
        first: int | None = None
        if len(all_bad):
            unsafe = [key for key in all_bad if not has_flag(self._space.table, key, LIVE)]
            first = int(unsafe[0] if unsafe else all_bad[0])
        return np.concatenate(following), first

    def _visit_compiled(
        self, keys: NDArray[np.uint64], native: NDArray[np.int64]
    ) -> tuple[NDArray[np.uint64], NDArray[np.uint64]]:
        packed = self._space.packed
        robots = len(packed.system.robots)
        out = np.empty(len(keys) * robots, np.uint64)
        bad = np.empty(len(keys), np.uint64)
        found, bads = expand_gated(
            keys, self._space.table, out, bad, native,
            packed.shift, packed.mask, packed.after, packed.state, packed.home, packed.room,
            _visits(packed, native), *scratch_for(robots), self._totals,
        )  # fmt: skip
        return out[:found], bad[:bads]

    def _visit(self, keys: NDArray[np.uint64]) -> tuple[NDArray[np.uint64], NDArray[np.uint64]]:
        """Visit `keys`, asking the gate itself."""
        packed, table, system = self._space.packed, self._space.table, self._space.packed.system
        out: list[int] = []
        bad: list[int] = []
        for key in keys.tolist():
            here = packed.configuration(key)
            moves = 0
            for robot in range(len(system.robots)):
                if not (system.enabled(here, robot) and self._gate.decide(here, robot).admitted):
                    continue
                moves += 1
                there = packed.key(system.moved(here, robot))
                if set_flag(table, np.uint64(there), VISITED):
                    out.append(there)
            stuck = moves == 0 and not all(system.finished(here, i) for i in range(len(system.robots)))
            live = has_flag(table, np.uint64(key), LIVE)
            self._totals += (moves, bool(deadlocked_robots(system, here)), stuck, live)
            if stuck or not live:
                bad.append(key)
        return np.array(out, np.uint64), np.array(bad, np.uint64)

    def _trace_back(self, levels: list[NDArray[np.uint64]], key: int) -> Witness:
        """Return the way to `key`, which is in the last of the levels."""
        packed, system = self._space.packed, self._space.packed.system
        last = packed.configuration(key)
        kind = "stuck" if has_flag(self._space.table, np.uint64(key), LIVE) else "unsafe"
        moves: list[int] = []
        here = last
        for level in reversed(levels[:-1]):
            for robot, position in enumerate(here.positions):
                p = int(packed.before[robot, position])
                if p < 0:
                    continue
                there = system.configuration((*here.positions[:robot], p, *here.positions[robot + 1 :]))
                if np.uint64(packed.key(there)) not in level:
                    continue
                if self._gate.decide(there, robot).admitted:
                    moves.append(robot)
                    here = there
                    break
        return Witness(
            kind, tuple(system.robots[robot].id for robot in reversed(moves)), system.describe(last)
        )


def _native(system: System, gate: Gate) -> NDArray[np.int64] | None:
    """Return the numbers that stand for `gate` in the compiled loops, or None."""
    if isinstance(gate, (OpenGate, CollisionGate)):
        return np.array([COLLISION, 0, 0], np.int64)
    if isinstance(gate, BankerGate):
        return np.array([BANKER, 0, 0], np.int64)
    shared = sum(not private for private in system.private)
    if (
        isinstance(gate, Algorithm2Gate)
        and all(room == 1 for room in system.room)
        and shared <= _MOST_STATES
        and len(system.robots) <= _MOST_ROBOTS
    ):
        return np.array([ALGORITHM2, default_lookahead(system), gate.lookahead], np.int64)
    return None


def _visits(packed: Packed, native: NDArray[np.int64]) -> NDArray[np.uint64]:
    """Return the shared states on each robot's path as bits; zeros where no gate asks."""
    visits = np.zeros(len(packed.system.robots), np.uint64)
    if native[0] == ALGORITHM2:
        for i, row in enumerate(packed.state):
            for s in row[row >= 0].tolist():
                visits[i] |= np.uint64(1 << s)
    return visits


@dataclass(frozen=True, slots=True)
class Judgement:
    """How a gate answers in the live configurations of a space, whether or not it lets them come about.

    Attributes
    ----------
    safe
        Moves from live configurations to live ones.
    accepted
        How many of these the gate admits.
    unsafe_accepted
        Moves to configurations that are not live that it admits.
    blocked
        Unfinished live configurations in which it admits nothing.
    """

    safe: int
    accepted: int
    unsafe_accepted: int
    blocked: int


def judge_moves(space: Space, gate: Gate) -> Judgement:
    """Ask a compiled gate about every move of every live configuration.

    Raises
    ------
    GateError
        If the gate is not compiled for this system.
    """
    packed = space.packed
    native = _native(packed.system, gate)
    if native is None:
        msg = f"{type(gate).__name__}: not compiled for this system; explore it instead"
        raise GateError(msg)
    counts = judge(
        space.table, native, packed.shift, packed.mask, packed.after, packed.state, packed.home, packed.room,
        _visits(packed, native), *scratch_for(len(packed.system.robots)),
    )  # fmt: skip
    return Judgement(*counts)
