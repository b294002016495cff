"""Requests: taken, looked at, put in order, decided, granted or refused; `occupancy` says who holds what.

What `Pressure` and the chain rule of the certified gate (`loopgate.gates.certified.Flow`) would say is said
here, where every state is private, or a FIFO state that holds two, so that a robot rests wherever it stands.
What any other negotiation or gate says comes from outside, between these steps; see `Gatekeeper`.
"""

from __future__ import annotations

from typing import Final

from loopgate.drive import lights, others, service
from loopgate.drive.chain import last_of_circle
from loopgate.drive.codes import (
    CROSSING,
    DEADLOCK,
    FREE,
    NOBODY,
    NOTHING,
    OCCUPIED,
    RED,
    RESERVE,
    SERVICE,
    SPACING,
    STOPPING,
    TRAFFIC,
)
from loopgate.drive.gaps import IN_THE_WAY, PAST, begin_m, leg_of, relation, together
from loopgate.drive.occupancy import append, first_before, last_state, remove, room, strike, wanted_state
from loopgate.drive.patience import keep_for_late, sort_ready
from loopgate.drive.tables import Tables
from loopgate.kernel_cache import inner, part

__all__ = [
    "asks",
    "collect",
    "decide",
    "decide_by_chain",
    "order",
    "refuse",
    "settle",
    "stay",
    "still_free",
]

REASK_S: Final = 1.0
"""A refusal that any change may lift is asked again at most this often [s]."""

_PASSING: Final = (NOTHING, CROSSING, RESERVE, SPACING, STOPPING, RED, TRAFFIC)
"""Refusals that end without a word, looked at again every step: vehicles drive on and leave a crossing, time
goes by, and so does what lies outside of the system, such as lights."""


@inner
def asks(i: int, t: Tables) -> None:
    """Take a request of the vehicle, the head of its state, for the next one; it stays until granted.

    In a FIFO state the head stays the head until it is granted, so others need not ask.
    """
    one, run = t.vehicles[i], t.run[0]
    if one.pending or first_before(i, t) != NOBODY:
        return
    one.pending = True
    one.since_s = run.now_s
    one.reason = NOTHING
    one.looked_at = -1
    one.asked_at_s = -1.0
    one.decided = False
    t.entries[run.waiting].waiting = i
    run.waiting += 1
    run.fresh += 1


@part
def _fits_behind(state: int, t: Tables) -> bool:
    """Return whether one more fits behind those who stop somewhere in the state, not at its end.

    Nobody does behind one that leaves its lane: it would be passed, and would no longer be first when it
    comes back.
    """
    place = t.states[state]
    for n in range(place.queue):
        i = int(t.lists[place.line + n])
        if service.stops_here(i, t):
            leg = t.vehicles[i].granted
            begins_m = begin_m(i, leg, t)
            slot_m = t.legs[leg_of(i, leg, t)].slot_m
            space_m = t.vehicles[i].stop_m - begins_m
            if t.vehicles[i].parks or (place.queue - n + 1) * slot_m > space_m:
                return False
    return True


@part
def _no_place(i: int, t: Tables) -> int:
    """Return why the vehicle may not have its next state now, or `NOTHING`."""
    if service.stops_here(i, t):
        return STOPPING
    wanted = wanted_state(i, t)
    free = room(wanted, t)
    if free <= 0 or t.states[wanted].shut:
        return OCCUPIED
    if not _fits_behind(wanted, t):
        return STOPPING
    if service.bars(i, wanted, t):
        return SERVICE
    if free == 1 and t.states[wanted].slot not in (NOBODY, i) and t.states[wanted].mover != i:
        return OCCUPIED
    return NOTHING


@inner
def _in_the_way(i: int, t: Tables) -> int:
    """Return why the vehicle may not set out now, or `NOTHING`."""
    why = _no_place(i, t)
    if why != NOTHING:
        return why
    j, order = leg_of(i, t.vehicles[i].granted, t), PAST
    for k in range(t.legs[j].pass_at, t.legs[j].pass_end):
        way = t.moves[t.passes[k].movement].way
        if way not in (NOBODY, i):
            return SERVICE if t.vehicles[way].mover else CROSSING
        for f in range(t.passes[k].foe_at, t.passes[k].foe_end):
            foe = t.moves[t.foes[f].movement]
            for n in range(foe.passing, foe.passing + foe.under_way):
                other = int(t.lists[n])
                if other == i:
                    continue
                if service.stops_here(other, t):
                    return CROSSING
                order = together(order, relation(i, k, f, other, t))
                if order == IN_THE_WAY:
                    return CROSSING
    return NOTHING


@inner
def refuse(i: int, reason: int, stage: int, t: Tables) -> None:
    """Refuse the vehicle's request; it is told only if it is for a new reason."""
    one, run = t.vehicles[i], t.run[0]
    if one.reason != reason:
        one.reason = reason
        one.stage = stage
        t.reasons[reason].refused += 1
        t.entries[run.answers].answered = i
        run.answers += 1


@inner
def grant(i: int, reason: int, stage: int, t: Tables) -> None:
    """Let the vehicle have its next leg, with the crossing before it."""
    one, run = t.vehicles[i], t.run[0]
    j = leg_of(i, one.granted, t)
    for k in range(t.legs[j].pass_at, t.legs[j].pass_end):
        move = t.moves[t.passes[k].movement]
        move.under_way = append(move.passing, move.under_way, move.most, i, t)
        move.entered = run.turn
    before = t.states[last_state(i, t)]
    before.queue = remove(t.lists, before.line, before.queue, i)
    one.granted += 1
    run.grants += 1
    t.numbers[i, one.granted % t.numbers.shape[1]] = run.grants
    if one.granted - one.crossed >= t.numbers.shape[1]:
        run.lost += 1
    place = t.states[last_state(i, t)]
    place.queue = append(place.line, place.queue, place.most, i, t)
    place.held_by = append(place.holders, place.held_by, place.most, i, t)
    place.filled = run.turn
    run.version += 1
    one.pending = False
    one.going = True
    one.reason = reason
    one.stage = stage
    lights.let_go(i, j, t)
    strike(i, t)
    t.entries[run.answers].answered = i
    run.answers += 1


@inner
def still_free(i: int, t: Tables) -> bool:
    """Return whether no grant of this turn got into the way of a vehicle; else refuse it."""
    crossed = t.states[wanted_state(i, t)].filled == t.run[0].turn
    j = leg_of(i, t.vehicles[i].granted, t)
    for k in range(t.legs[j].pass_at, t.legs[j].pass_end):
        for f in range(t.passes[k].foe_at, t.passes[k].foe_end):
            crossed |= t.moves[t.foes[f].movement].entered == t.run[0].turn
    why = _in_the_way(i, t) if crossed else NOTHING
    if why == NOTHING and t.run[0].grants > t.run[0].granted and others.obstruct(i, t):
        why = TRAFFIC
    if why != NOTHING:
        refuse(i, why, NOTHING, t)
    return bool(why == NOTHING)


@inner
def settle(i: int, admitted: int, reason: int, stage: int, t: Tables) -> None:
    """Let a request be decided as the gate says."""
    t.vehicles[i].asked_at_s = t.run[0].now_s
    t.vehicles[i].decided = True
    if admitted:
        grant(i, reason, stage, t)
    else:
        refuse(i, reason, stage, t)


@part
def _possible(i: int, t: Tables) -> bool:
    """Return whether it is for the negotiation and the gate to say; else note the refusal."""
    one, run = t.vehicles[i], t.run[0]
    if one.reason == OCCUPIED and room(wanted_state(i, t), t) <= 0:
        return False
    if one.looked_at == run.version and one.reason not in _PASSING:
        return False
    one.looked_at = run.version
    why = _in_the_way(i, t)
    if why == NOTHING and run.now_s - one.since_s < one.spare_s and t.states[last_state(i, t)].queue == 1:
        why = SPACING  # nobody waits behind it
    if why == NOTHING and lights.keeps(i, t):
        why = RED
    if why == NOTHING and others.obstruct(i, t):
        why = TRAFFIC
    if why == NOTHING:
        why = one.withheld
    if why != NOTHING:
        refuse(i, why, NOTHING, t)
        return False
    return True


@part
def _due(i: int, t: Tables) -> bool:
    """Return whether the gate may be asked, for the first time or again."""
    return bool(not t.vehicles[i].decided or t.run[0].now_s - t.vehicles[i].asked_at_s >= REASK_S)


@part
def _look_outside(t: Tables) -> None:
    """See which of those that must move next are kept by something outside of the system."""
    for i in range(len(t.vehicles)):
        one = t.vehicles[i]
        if one.mover and one.pending:
            one.barred = one.withheld != NOTHING or lights.keeps(i, t) or others.obstruct(i, t)


@inner
def collect(t: Tables) -> int:
    """Look at the requests, at all of them once a step, else at new ones; return how many are ready.

    Within a step grants take room and give none back, so each is looked at once.
    """
    run = t.run[0]
    run.turn += 1
    run.granted = run.grants
    begin = run.waiting - run.fresh
    if run.now_s > run.decided_s:
        run.decided_s = run.now_s
        if not run.alone:
            keep_for_late(t)
            if run.serving > 0:
                _look_outside(t)
            service.serve(t)
        begin = 0
    run.fresh = 0
    ready = 0
    for n in range(begin, run.waiting):
        i = t.entries[n].waiting
        if _possible(i, t):
            t.entries[ready].ready = i
            ready += 1
    return ready


@part
def _waits(i: int, t: Tables) -> bool:
    """Return whether the vehicle has to leave room for others (`Pressure`)."""
    run = t.run[0]
    wanted, here = t.states[wanted_state(i, t)], t.states[last_state(i, t)]
    if wanted.held_by < run.crowded * wanted.room:
        return False
    fuller = wanted.held_by / wanted.room - here.held_by / here.room
    return bool(fuller >= (run.now_s - t.vehicles[i].since_s) / run.patience_s)


@inner
def decide_by_chain(i: int, t: Tables) -> None:
    """Decide the vehicle's request by the chain rule, if its way is still free."""
    if still_free(i, t):
        closes = last_of_circle(i, t) != NOBODY
        t.run[0].decisions += 1
        settle(i, 0 if closes else 1, DEADLOCK if closes else FREE, t.run[0].chain, t)


@inner
def order(ready: int, t: Tables) -> int:
    """Put those that are ready in order by pressure; return how many go, the others are to stay."""
    run, e = t.run[0], t.entries
    going = 0
    for n in range(ready):
        i = e[n].ready
        if not _due(i, t):
            continue
        if not t.vehicles[i].mover and _waits(i, t):
            e[run.staying].staying = i
            run.staying += 1
            continue
        here = t.states[last_state(i, t)]
        queues = here.held_by + here.outside - t.states[wanted_state(i, t)].held_by
        e[going].ready = i
        e[going].weight = -(queues + (run.now_s - t.vehicles[i].since_s) / run.wait_s)
        going += 1
    sort_ready(going, t)
    return going


@inner
def stay(t: Tables) -> None:
    """Refuse those that the negotiation asks to wait."""
    run = t.run[0]
    for n in range(run.staying):
        refuse(t.entries[n].staying, RESERVE, NOTHING, t)
    run.staying = 0


@inner
def decide(t: Tables) -> None:
    """Answer what `collect` finds, by pressure and the chain rule."""
    for n in range(order(collect(t), t)):
        decide_by_chain(t.entries[n].ready, t)
