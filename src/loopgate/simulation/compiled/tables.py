"""The tables of the compiled drive: vehicles, roads and the books of who holds what, as rows of numbers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from loopgate.simulation.sensing import Mark, Numbers, Vehicle

__all__ = ["Books", "Foe", "Leg", "Move", "Pass", "Rider", "State"]


class Rider(Vehicle):
    """A vehicle under the gate.

    Attributes
    ----------
    leg_at
        Where the legs of its loop are in the table of legs.
    number_at, numbers
        Where the numbers of its last grants are in the pool, by leg modulo how many there are.
    length_m
        Its length [m].
    tail, crossed, admitted
        What it holds, as `Driver` has it, and the last leg that the gate let it into, which runs ahead of
        `granted` within a decision.
    held, steered
        Whether it has a stop at its line, and whether it is steered (see `Steering`).
    asked_s, halted_s, hold_s, longest_s
        When it asked and when it came to rest, not a number if it has not; time at rest so far, longest time
        from asking to a grant [s].
    pending, since_s, reason, looked_at, asked_at_s, decided
        Its request, as `Pending` has it.
    waiting, fresh, ready, weight, staying, answered, yes
        Lists of vehicles that have nothing to do with the one of this row: those with a request, oldest
        first; those of them not looked at yet; room for sorting, with keys; those asked to wait; the answers
        of a decision, and whether they are grants.
    """

    leg_at: int
    number_at: int
    numbers: int
    length_m: float
    tail: int
    crossed: int
    admitted: int
    held: bool
    steered: bool
    asked_s: float
    halted_s: float
    hold_s: float
    longest_s: float
    pending: bool
    since_s: float
    reason: int
    looked_at: int
    asked_at_s: float
    decided: bool
    waiting: int
    fresh: int
    ready: int
    weight: float
    staying: int
    answered: int
    yes: bool


class Leg:
    """A leg: the stretch of its loop [m], its state, whether pins follow, and the passes behind it."""

    begin_m: float
    end_m: float
    state: int
    pinned: bool
    pass_at: int
    pass_end: int


class Pass:
    """A crossing behind a leg: its movement, the lowest limit on it [m/s], and its foes."""

    movement: int
    speed_mps: float
    foe_at: int
    foe_end: int


class Foe:
    """A foe of a pass: its movement, and the stretch that both use, as `Crossing.overlaps` has it [m].

    Not a number where there is none: the foe is in the way all along.
    """

    movement: int
    from_m: float
    to_m: float


class State:
    """A state.

    Attributes
    ----------
    room, word
        How many vehicles it holds, and its name by number.
    most
        How many vehicles there is room for in each of these two lists.
    holders, held_by
        Where in the pool the vehicles are that hold it, in the order in which they took it, and how many.
    line, queue
        Where in the pool the vehicles are that the gate has in it, head first, and how many.
    filled
        The decision in which a grant last took a slot of it.
    slot, slot_before, kept
        The vehicle its last slot is kept for, or -1, now and before; and a list of states for which there is
        one, that has nothing to do with the state of this row.
    short
        The decision in which its head was last found to lack a slot.
    """

    room: int
    word: int
    most: int
    holders: int
    held_by: int
    line: int
    queue: int
    filled: int
    slot: int
    slot_before: int
    kept: int
    short: int


class Move:
    """A movement over a junction.

    Attributes
    ----------
    passing, under_way, most
        Where in the pool the vehicles are that are under way on it, how many, and how many it has room for.
    entered
        The decision in which a grant last led over it.
    way, kept
        The vehicle it is kept clear for, or -1; and a list of movements for which there is one, that has
        nothing to do with the movement of this row.
    """

    passing: int
    under_way: int
    most: int
    entered: int
    way: int
    kept: int


class Books(NamedTuple):
    """All tables, and a pool of numbers: counters (see `count`), and lists that the tables point into.

    Attributes
    ----------
    vehicles, roads, marks
        The vehicles, the beginnings of their edges and of their legs, as `sense` has them.
    legs, passes, foes, states, moves
        The abstraction.
    pool
        Numbers.
    """

    vehicles: Sequence[Rider]
    roads: Sequence[Mark]
    marks: Sequence[Mark]
    legs: Sequence[Leg]
    passes: Sequence[Pass]
    foes: Sequence[Foe]
    states: Sequence[State]
    moves: Sequence[Move]
    pool: Numbers
