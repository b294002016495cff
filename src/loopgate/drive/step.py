"""The work between two steps of the traffic, and the way in from Python.

Nothing here speaks to SUMO: what is to be done to vehicles, and what goes into the trace, are rows for the
caller, in the order in which they came about.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Final

import numpy as np

from loopgate.drive import lights, occupancy, others, requests, seen
from loopgate.drive.codes import BRAKE, NOBODY, NOTHING, PIVOT, RELEASE, STEER, STOP
from loopgate.drive.cycle_slack import is_too_tight
from loopgate.drive.gaps import begin_m, end_m, leg_of, state_of
from loopgate.drive.sense import (
    MUST_ASK,
    PIVOTED,
    REAR_PASSED,
    RUNS_THROUGH,
    TRESPASS,
    act,
    must_ask,
    note,
    sense,
)
from loopgate.drive.tables import Floats, Numbers, Tables
from loopgate.drive.yielding import give_way
from loopgate.kernel_cache import inner, only_with, outer, part, way_in

__all__ = [
    "ANSWER",
    "BEGIN",
    "COLLECT",
    "CONSIDER",
    "DECIDE",
    "FIND",
    "FOLLOW",
    "FULL",
    "GIVE_WAY",
    "IDLE",
    "INSIDE",
    "LEAVE",
    "LIGHTS",
    "LOOK",
    "NO_ROBOTS",
    "ORDER",
    "REFUSE",
    "ROOM",
    "SEE",
    "SETTLE",
    "STILL_FREE",
    "TELL",
    "TIGHT",
    "TURN",
    "UNREAD",
    "Step",
]

FULL: Final = 24
"""So many rows, and so many acts, there may be per vehicle in one step; there is room for the rows of two."""

BEGIN: Final = 0
LOOK: Final = 1
CONSIDER: Final = 2
ANSWER: Final = 3
TURN: Final = 4
COLLECT: Final = 5
STILL_FREE: Final = 6
REFUSE: Final = 7
SETTLE: Final = 8
TELL: Final = 9
DECIDE: Final = 10
IDLE: Final = 11
LEAVE: Final = 12
ORDER: Final = 13
UNREAD: Final = 14
LIGHTS: Final = 15
FOLLOW: Final = 16
SEE: Final = 17
GIVE_WAY: Final = 18
FIND: Final = 19
INSIDE: Final = 20
TIGHT: Final = 21
ROOM: Final = 22


@inner
def _aim_rear(i: int, t: Tables) -> None:
    """Say where the vehicle gives back what it leaves."""
    one = t.vehicles[i]
    target = math.inf
    if one.crossed < one.granted:
        target = begin_m(i, one.crossed + 1, t) + one.length_m
        if one.tail == one.crossed:
            # Nobody waits for a slot while there are others: one look for slot and crossing together.
            left_m = end_m(i, one.crossed, t) + one.length_m
            target = max(target, left_m) if occupancy.room(state_of(i, one.crossed, t), t) > 0 else left_m
    one.rear_m = target


@inner
def _aim(i: int, t: Tables) -> None:
    """Say where the vehicle's grants end, and where it gives back what it leaves."""
    one = t.vehicles[i]
    one.note_m = -math.inf  # its beginning is to be noted too
    one.line_m = end_m(i, one.granted, t)
    if one.granted - 1 <= one.crossed:  # else it still leaves an earlier leg
        _aim_rear(i, t)


@inner
def _free_behind(i: int, t: Tables) -> None:
    """Give back what the rear of the vehicle is out of."""
    one = t.vehicles[i]
    rear_m = one.front - one.length_m
    while one.tail != one.granted and rear_m >= end_m(i, one.tail, t):
        state = state_of(i, one.tail, t)
        one.tail += 1
        occupancy.left(i, state, t)
        _note(i, t.run[0].leave, one.tail - 1, t)
    while one.crossed != one.tail and rear_m >= begin_m(i, one.crossed + 1, t):
        one.crossed += 1
        occupancy.cleared(i, one.crossed - 1, t)
    _aim_rear(i, t)


@inner
def _note(i: int, event: int, leg: int, t: Tables) -> None:
    """Write a row about the state in which the leg lies."""
    note(i, event, t.states[state_of(i, leg, t)].word, NOTHING, NOTHING, t)


@inner
def _note_answer(i: int, event: int, leg: int, t: Tables) -> None:
    """Write a row about the answer to the vehicle's request for the leg."""
    one = t.vehicles[i]
    note(i, event, t.states[state_of(i, leg, t)].word, t.reasons[one.reason].word, one.stage, t)


@part
def _note_trespass(i: int, t: Tables) -> None:
    one, run = t.vehicles[i], t.run[0]
    one.trespassing = not one.trespassing
    if one.trespassing:
        run.trespasses += 1
        word = t.states[state_of(i, one.granted + 1, t)].word
        note(i, run.enter, word, run.not_granted, NOTHING, t)


@inner
def _hold(i: int, t: Tables) -> None:
    one = t.vehicles[i]
    if not one.held:
        one.held = True
        one.held_m = one.line_m
        act(i, STOP, t)


@part
def _run_through(i: int, t: Tables) -> None:
    """Stop a vehicle that does not brake for its line, whatever the simulator makes of its stop.

    It stands where it comes to rest, as one that is refused, until it is granted what it asked for.
    """
    t.vehicles[i].held_m = math.inf  # once is enough
    t.run[0].overruns += 1
    _note(i, t.run[0].overrun, t.vehicles[i].granted + 1, t)
    act(i, BRAKE, t)


@inner
def _ask(i: int, t: Tables) -> None:
    t.vehicles[i].asking = False
    if t.vehicles[i].steered:
        return  # it is considered when it is on its lane
    first = occupancy.first_before(i, t)
    if first == NOBODY:
        requests.asks(i, t)
    elif math.isnan(t.vehicles[first].halted_s):
        # It asks when the vehicle before it is granted. That may be too late to stop at the line then,
        # since it brakes for that vehicle no earlier than it must. One that rests there it cannot pass.
        _hold(i, t)


@inner
def _consider(i: int, t: Tables) -> None:
    """Let a vehicle ask now if it must, else when it must: its line is new, or it is first in it now."""
    one = t.vehicles[i]
    if one.legs <= 1 or one.pending or one.steered or one.going or one.aside:
        return  # one that has been granted in this step is about to be told
    if must_ask(i, t):
        _ask(i, t)
    else:
        one.asking = True


@inner
def _go(i: int, t: Tables) -> None:
    one, run = t.vehicles[i], t.run[0]
    one.going = False
    _aim(i, t)
    _note_answer(i, run.grant, one.granted, t)
    one.longest_s = max(one.longest_s, run.now_s - one.since_s)
    if one.held:
        one.held = False
        one.held_m = math.inf
        act(i, RELEASE, t)
        if not math.isnan(one.halted_s):
            one.hold_s += run.now_s - one.halted_s
            one.halted_s = math.nan
            _note(i, run.go, one.granted, t)
    wanted = state_of(i, one.granted, t)
    if occupancy.room(wanted, t) <= 0:  # each slot of it is given back as soon as the rear is out of it now
        place = t.states[wanted]
        for n in range(place.holders, place.holders + place.held_by):
            other = t.lists[n]
            if t.vehicles[other].tail < t.vehicles[other].granted:
                _aim_rear(other, t)
    behind = leg_of(i, one.granted - 1, t)
    if t.legs[behind].pinned or one.steered:
        one.steered = True
        act(i, STEER, t)
    _consider(i, t)  # the next state may begin within the braking distance
    here = t.states[t.legs[behind].state]
    if here.fifo:
        for n in range(here.line, here.line + here.queue):
            other = t.lists[n]
            if n == here.line:
                _consider(other, t)
            elif not t.vehicles[other].held and not t.vehicles[other].aside:
                t.vehicles[other].asking = True


@part
def _leave(i: int, last: int, t: Tables) -> None:
    """Let a vehicle go, and whoever is first behind it then ask; another one is to have its number."""
    place = t.states[state_of(i, t.vehicles[i].granted, t)]
    occupancy.leaves(i, t)
    if place.queue > 0:
        _consider(int(t.lists[place.line]), t)
    if last != i:
        occupancy.rename(last, i, t)


@part
def _begin(t: Tables) -> None:
    for i in range(len(t.vehicles)):
        _aim(i, t)
        _consider(i, t)


@inner
def _heeds_renewal(i: int, t: Tables) -> bool:
    one = t.vehicles[i]
    return bool(one.heeds_renewal or one.held or one.steered)


@part
def _look(odometer: Floats, halted: Numbers, t: Tables) -> None:
    """Bring all vehicles up to date after a step of the traffic, and do what is due."""
    called = sense(odometer, t)
    for i in halted:
        if t.vehicles[i].held and math.isnan(t.vehicles[i].halted_s):
            t.vehicles[i].halted_s = t.run[0].now_s
            _note(i, t.run[0].hold, t.vehicles[i].granted + 1, t)
    for n in range(called):
        i, why = t.calls[n, 0], t.calls[n, 1]
        if why & PIVOTED and _heeds_renewal(i, t):
            act(i, PIVOT, t)
        if why & REAR_PASSED:
            _free_behind(i, t)
        if why & TRESPASS:
            _note_trespass(i, t)
        if why & RUNS_THROUGH:
            _run_through(i, t)
        if why & MUST_ASK:
            _ask(i, t)


@inner
def _tell(t: Tables) -> bool:
    """Let vehicles go or stay as they have been answered; return whether any may go."""
    run = t.run[0]
    requests.stay(t)
    answers = run.answers
    run.answers = 0
    again = False
    for n in range(answers):
        i = t.entries[n].answered
        if t.vehicles[i].going:
            _go(i, t)
            again = True
        else:
            _note_answer(i, run.refuse, t.vehicles[i].granted + 1, t)
            _hold(i, t)
    return again


@inner
def _answer(t: Tables) -> bool:
    """Answer all requests and look at lights; return whether some of these have to be read to go on."""
    going = True
    while going:
        if lights.unread(t):
            return True
        requests.decide(t)
        going = _tell(t)
    return lights.look(t)


@only_with("others", otherwise=0)
def _ask_others(what: int, i: int, t: Tables) -> int:
    """Do what has to do with ordinary traffic alone."""
    said = 0
    if what == FOLLOW:
        said = seen.follow_routes(t)
    elif what == SEE:
        said = seen.see(t)
    elif what == GIVE_WAY:
        said = give_way(t)
    elif what == FIND:
        others.find_in_the_way(i, t)
    elif what == INSIDE:
        said = 1 if others.find_inside(i, t) else 0
    elif what == TIGHT:
        said = 1 if is_too_tight(i, t.vehicles[i].granted + 1, t) else 0
    elif what == ROOM:
        said = 1 if others.has_room(i, t) else 0
    return said


@outer
def _step(
    what: int,
    i: int,
    leg: int,
    reason: int,
    stage: int,
    odometer: Floats,
    robots: Numbers,
    tables: tuple[Any, ...],
) -> int:
    t = Tables(*tables)
    if what == BEGIN:
        _begin(t)
    if what in (LOOK, TURN):
        _look(odometer, robots, t)
    if what == CONSIDER:
        for j in robots:
            t.vehicles[j].steered = False
            _consider(j, t)
    if what == DECIDE:
        for j in robots:
            requests.decide_by_chain(j, t)
    said = 0
    if what in (ANSWER, TURN):
        said = 1 if _answer(t) else 0
    elif what == UNREAD:
        said = 1 if lights.unread(t) else 0
    elif what == LIGHTS:
        said = 1 if lights.look(t) else 0
    elif what == COLLECT:
        said = requests.collect(t)
    elif what == ORDER:
        said = requests.order(i, t)
    elif what == STILL_FREE:
        said = 1 if requests.still_free(i, t) else 0
    elif what == REFUSE:
        requests.refuse(i, reason, stage, t)
    elif what == SETTLE:
        requests.settle(i, leg, reason, stage, t)
    elif what == TELL:
        said = 1 if _tell(t) else 0
    elif what == LEAVE:
        _leave(i, leg, t)
    elif what >= FOLLOW:
        said = _ask_others(what, i, t)
    return said


_NO_ODOMETER: Final = np.zeros(0)
NO_ROBOTS: Final[Numbers] = np.zeros(0, dtype=np.int64)

_WAYS_IN: Final[dict[tuple[Any, ...], Callable[..., int]]] = {}
"""Ways in that were made, by all that the compiler makes of the tables: to type them takes it milliseconds,
and vehicles that join and leave bring new tables each time."""


def _kind(table: Any) -> object:  # noqa: ANN401  a table or none
    """Return all that the type of a table depends on for the compiler."""
    if not isinstance(table, np.ndarray):
        return type(table)
    flags = table.flags
    layout = flags.c_contiguous, flags.f_contiguous, flags.writeable, flags.aligned
    return type(table), table.dtype, table.ndim, layout


class Step:
    """The one way into the compiled drive, from Python: called with a constant of this module.

    Parameters
    ----------
    tables
        What the steps work on.

    Notes
    -----
    There is one way in, with all tables in a plain tuple: each way costs seconds to compile. So does each set
    of tables: with those of lights, with those of ordinary traffic too, or neither.
    Uncompiled (``NUMBA_DISABLE_JIT=1``) the same steps run in Python: the oracle of the compiled ones.
    """

    def __init__(self, tables: Tables) -> None:
        self._there: list[bool] = []
        """Which tables there are."""
        self.use(tables)

    def use(self, tables: Tables) -> None:
        """Work on these tables from now on."""
        before, self._there = self._there, [one is not None for one in tables]
        self._tables = tuple(tables)
        if self._there != before:
            kinds = tuple(_kind(one) for one in self._tables)
            if kinds not in _WAYS_IN:
                _WAYS_IN[kinds] = way_in(_step, IDLE, 0, 0, 0, 0, _NO_ODOMETER, NO_ROBOTS, self._tables)
            self._enter = _WAYS_IN[kinds]

    def __call__(
        self,
        what: int,
        robot: int = 0,
        leg: int = 0,
        reason: int = 0,
        stage: int = 0,
        odometer: Floats = _NO_ODOMETER,
        robots: Numbers = NO_ROBOTS,
    ) -> int:
        """Make a step.

        Parameters
        ----------
        what
            ``BEGIN``: all vehicles are taken over. ``LOOK``: all are brought up to date after a step of the
            traffic. ``CONSIDER``: some are steered no longer. ``ANSWER``: all requests are answered, by
            pressure and the chain rule, and vehicles told. ``TURN``: `LOOK` and `ANSWER`. ``UNREAD``,
            ``COLLECT``, ``ORDER``, ``STILL_FREE``, ``REFUSE``, ``SETTLE``, ``DECIDE``, ``TELL``, ``LIGHTS``:
            parts of `ANSWER`, for other rules in between; see `loopgate.drive.requests`. ``FOLLOW``, ``SEE``:
            ordinary vehicles have been read; see `loopgate.drive.seen`. ``GIVE_WAY``: gated ones give way to
            them; see `loopgate.drive.yielding`. ``FIND``, ``INSIDE``, ``TIGHT``, ``ROOM``: who of them is in
            the way of a vehicle or inside its next state, whether a circle is too tight for it, and whether
            it has room to come back from beside the road; see `loopgate.drive.others`. ``LEAVE``: a vehicle
            is about to give its row back, to another one perhaps. ``IDLE``: nothing is done.
        robot, leg, reason, stage
            The vehicle that it is about, and what about it. For ``ORDER`` it is how many are ready. For
            ``SETTLE`` the leg says whether the vehicle is admitted, for ``LEAVE`` who is to have its row,
            maybe itself.
        odometer
            What the simulator says, by vehicle [m].
        robots
            The vehicles that came to rest at a stop, are steered no longer, or are to be decided.

        Returns
        -------
        int
            How many are ready (``COLLECT``), go (``ORDER``), are found (``FOLLOW``) or have to be told
            (``GIVE_WAY``), and how many rows that takes (``SEE``); whether it is so (``STILL_FREE``,
            ``INSIDE``, ``TIGHT``, ``ROOM``), or anybody may go (``TELL``), or lights have to be read before
            `ANSWER`, which has stopped there, can go on (``ANSWER``, ``TURN``, ``UNREAD``, ``LIGHTS``).
        """
        return int(self._enter(what, robot, leg, reason, stage, odometer, robots, self._tables))
