"""Requests: taken, looked at, put in order, decided, granted or refused; and the books of who holds what.

What `Pressure` and the chain rule of the certified gate (`loopgate.gates.certified.Flow`) would say is said
here, where every state is private, or a FIFO state that holds two, so that a robot rests wherever it stands.
What any other negotiation or gate says comes from outside, between these steps; see `Gatekeeper`.
"""

from __future__ import annotations

from typing import Final

from loopgate.drive import service
from loopgate.drive.gaps import IN_THE_WAY, PAST, begin_m, leg_of, relation, state_of, together
from loopgate.drive.tables import (
    CROSSING,
    DEADLOCK,
    FREE,
    NOBODY,
    NOTHING,
    OCCUPIED,
    REASONS,
    RESERVE,
    SERVICE,
    SPACING,
    STOPPING,
    Numbers,
    Tables,
)
from loopgate.gates import Reason
from loopgate.kernel_cache import kernel, part

__all__ = [
    "asks",
    "cleared",
    "collect",
    "decide",
    "decide_by_chain",
    "due",
    "first_before",
    "joins",
    "leaves",
    "left",
    "refuse",
    "rename",
    "room",
    "settle",
    "still_free",
]

REASK_S: Final = 1.0
"""A refusal that any change may lift is asked again at most this often [s]."""

_PATIENCE_S: Final = 60.0
"""How long a request is passed over, on its crossing or for a slot, before others have to let it pass [s]."""

_SHORT_OF_SLOTS_S: Final = 30.0
"""How old a request is that finds no slot when those who could leave one get more attention [s]."""

_PATIENCE_THERE_S: Final = 10.0
"""How long these are passed over [s]: a long queue would else leave one by one, each after a minute. And so
long those who are behind the middle on their loop: the streets ahead of them wait."""

_GIVES_WAY_S: Final = 10.0
"""How long one that the gate has refused keeps nothing for itself [s]."""

_RED: Final = REASONS.index(Reason.RED)
_TRAFFIC: Final = REASONS.index(Reason.TRAFFIC)

_PASSING: Final = (NOTHING, CROSSING, RESERVE, SPACING, STOPPING, _RED, _TRAFFIC)
"""Refusals that end without a word, looked at again every step: vehicles drive on and leave a crossing, time
goes by, and so does what lies outside of the system, such as lights."""


@kernel
def _here(i: int, t: Tables) -> int:
    """Return the state of the last leg that was granted to the vehicle."""
    return state_of(i, t.vehicles[i].granted, t)


@kernel
def _wanted(i: int, t: Tables) -> int:
    """Return the state behind that."""
    return state_of(i, t.vehicles[i].granted + 1, t)


@kernel
def room(state: int, t: Tables) -> int:
    """Return how many more vehicles fit into the state."""
    return int(t.states[state].room - t.states[state].held_by)


@kernel
def first_before(i: int, t: Tables) -> int:
    """Return the head of the FIFO state that the vehicle stands in, if that is another one, or `NOBODY`."""
    state = t.states[_here(i, t)]
    head = int(t.lists[state.line])
    return NOBODY if head == i or not state.fifo else head


@kernel
def _remove(lists: Numbers, at: int, length: int, one: int) -> int:
    """Take `one`, if it is there, out of a list of `length`, keeping the order; return the new length."""
    for k in range(at, at + length):
        if lists[k] == one:
            for later in range(k, at + length - 1):
                lists[later] = lists[later + 1]
            return length - 1
    return length


@kernel
def _append(at: int, length: int, most: int, one: int, t: Tables) -> int:
    """Put `one` at the end of a list of `length`; return the new length. There is room, or the run ends."""
    if length >= most:
        t.run[0].lost += 1
        return length
    t.lists[at + length] = one
    return length + 1


@kernel
def left(i: int, state: int, t: Tables) -> None:
    """Take note that the rear of the vehicle has left the state."""
    place = t.states[state]
    place.held_by = _remove(t.lists, place.holders, place.held_by, i)
    t.run[0].version += 1


@kernel
def cleared(i: int, leg: int, t: Tables) -> None:
    """Take note that the rear of the vehicle has passed the crossings behind the leg."""
    j = leg_of(i, leg, t)
    for k in range(t.legs[j].pass_at, t.legs[j].pass_end):
        move = t.moves[t.passes[k].movement]
        move.under_way = _remove(t.lists, move.passing, move.under_way, i)
    if t.legs[j].pass_at < t.legs[j].pass_end:
        t.run[0].version += 1


@kernel
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


@kernel
def _strike(i: int, t: Tables) -> None:
    """Take the request of a vehicle out, if there is one."""
    kept = 0
    for n in range(t.run[0].waiting):
        if t.entries[n].waiting != i:
            t.entries[kept].waiting = t.entries[n].waiting
            kept += 1
    t.run[0].waiting = kept


@part
def joins(i: int, t: Tables) -> None:
    """Let a vehicle that has just got its row hold the state it stands in, behind all others there."""
    place = t.states[_here(i, t)]
    place.queue = _append(place.line, place.queue, place.most, i, t)
    place.held_by = _append(place.holders, place.held_by, place.most, i, t)
    t.run[0].version += 1


@part
def leaves(i: int, t: Tables) -> None:
    """Let a vehicle whose row is about to be given back hold nothing, and keep nothing for it."""
    one = t.vehicles[i]
    for leg in range(one.tail, one.granted + 1):
        left(i, state_of(i, leg, t), t)
    for leg in range(one.crossed, one.granted):
        cleared(i, leg, t)
    place = t.states[_here(i, t)]
    place.queue = _remove(t.lists, place.line, place.queue, i)
    _strike(i, t)
    _keep_for_another(i, NOBODY, t)


@part
def rename(i: int, to: int, t: Tables) -> None:
    """Let a vehicle have another number, which nobody has; its row is the same yet."""
    one = t.vehicles[i]
    for leg in range(one.tail, one.granted + 1):
        place = t.states[state_of(i, leg, t)]
        _write(place.holders, place.held_by, i, to, t)
        _write(place.line, place.queue, i, to, t)
    for leg in range(one.crossed, one.granted):
        j = leg_of(i, leg, t)
        for k in range(t.legs[j].pass_at, t.legs[j].pass_end):
            move = t.moves[t.passes[k].movement]
            _write(move.passing, move.under_way, i, to, t)
    for n in range(t.run[0].waiting):
        if t.entries[n].waiting == i:
            t.entries[n].waiting = to
    _keep_for_another(i, to, t)


@kernel
def _write(at: int, length: int, one: int, to: int, t: Tables) -> None:
    for k in range(at, at + length):
        if t.lists[k] == one:
            t.lists[k] = to


@kernel
def _keep_for_another(i: int, to: int, t: Tables) -> None:
    """Let what is kept for a vehicle be kept for another one, or nobody."""
    for s in range(len(t.states)):
        place = t.states[s]
        if place.slot == i:
            place.slot = to
        if place.slot_before == i:
            place.slot_before = to
        if place.served == i:
            place.served = to
        if place.mover == i:
            place.mover = to
    for m in range(len(t.moves)):
        if t.moves[m].way == i:
            t.moves[m].way = to


@kernel
def _sort(length: int, t: Tables) -> None:
    """Sort those that are ready by weight, then number."""
    e = t.entries
    for n in range(1, length):
        one, heavy = e[n].ready, e[n].weight
        k = n - 1
        while k >= 0 and (e[k].weight > heavy or (e[k].weight == heavy and e[k].ready > one)):
            e[k + 1].ready, e[k + 1].weight = e[k].ready, e[k].weight
            k -= 1
        e[k + 1].ready, e[k + 1].weight = one, heavy


@part
def _keep(t: Tables) -> None:
    """Keep way and last slot for some of those that have been passed over for too long; oldest request first.

    A long crossing is hardly ever clear all along by itself, and the slot that a full place gives back is
    taken by whoever has the shorter way. Those on the crossing drive on to slots of their own, so it clears.
    Nobody keeps a way to a place that has no slot for it, and of two that are in each other's way the older
    keeps its own: so each waits for older ones only, never two for each other. Who is refused by the gate
    for all that lets others go before it again.
    """
    before, late = t.run[0].late, _late(t)
    t.run[0].late = late
    if before == 0 and late == 0 and t.run[0].serving == 0:
        return
    for m in range(len(t.moves)):
        t.moves[m].way = NOBODY
    for s in range(len(t.states)):
        t.states[s].slot_before = t.states[s].slot
        t.states[s].slot = NOBODY
    for n in range(late):
        _keep_for(t.entries[n].ready, t)
    for s in range(len(t.states)):
        if t.states[s].slot != t.states[s].slot_before:
            t.run[0].version += 1  # who was refused for a slot that was kept is looked at again
            return


@part
def _keep_for(i: int, t: Tables) -> None:
    """Keep the last slot for a vehicle, and its way if a slot is left, unless they are kept for another."""
    wanted = _wanted(i, t)
    if t.states[wanted].slot == NOBODY:
        t.states[wanted].slot = i
    if room(wanted, t) <= (1 if t.states[wanted].slot != i else 0):
        return
    j = leg_of(i, t.vehicles[i].granted, t)
    for k in range(t.legs[j].pass_at, t.legs[j].pass_end):
        if t.moves[t.passes[k].movement].way != NOBODY:
            return
    for k in range(t.legs[j].pass_at, t.legs[j].pass_end):
        for f in range(t.passes[k].foe_at, t.passes[k].foe_end):
            foe = t.moves[t.foes[f].movement]
            if foe.way == NOBODY:
                foe.way = i


@part
def _late(t: Tables) -> int:
    """Sort those for whom something is kept into `Entry.ready`, oldest first; return how many.

    On the way it stamps the states whose heads lack a slot.
    """
    run, v, e = t.run[0], t.vehicles, t.entries
    passed_over = 0
    for n in range(run.waiting):
        i = e[n].waiting
        if run.now_s - v[i].since_s < _PATIENCE_THERE_S or v[i].reason not in (CROSSING, OCCUPIED):
            continue
        e[passed_over].ready = i
        passed_over += 1
        if v[i].reason == OCCUPIED and run.now_s - v[i].since_s >= _SHORT_OF_SLOTS_S:
            wanted = _wanted(i, t)
            if room(wanted, t) <= 0:
                t.states[wanted].short = run.turn
    late = 0
    for n in range(passed_over):
        i = e[n].ready
        if run.now_s - v[i].asked_at_s < _GIVES_WAY_S:
            continue
        patience_s = _PATIENCE_THERE_S if v[i].spare_s < 0.0 else _PATIENCE_S
        if t.states[_here(i, t)].short == run.turn or run.now_s - v[i].since_s >= patience_s:
            e[late].ready = i
            e[late].weight = v[i].since_s
            late += 1
    _sort(late, t)
    return late


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
    wanted = _wanted(i, t)
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


@kernel
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


@kernel
def refuse(i: int, reason: int, stage: int, t: Tables) -> None:
    """Refuse the vehicle's request; it is told only if it is for a new reason."""
    one, run = t.vehicles[i], t.run[0]
    if one.reason != reason:
        one.reason = reason
        one.stage = stage
        t.reasons[reason].refused += 1
        t.entries[run.answers].answered = i
        run.answers += 1


@kernel
def grant(i: int, reason: int, stage: int, t: Tables) -> None:
    """Let the vehicle have its next leg, with the crossing before it."""
    one, run = t.vehicles[i], t.run[0]
    j = leg_of(i, one.granted, t)
    for k in range(t.legs[j].pass_at, t.legs[j].pass_end):
        move = t.moves[t.passes[k].movement]
        move.under_way = _append(move.passing, move.under_way, move.most, i, t)
        move.entered = run.turn
    before = t.states[_here(i, t)]
    before.queue = _remove(t.lists, before.line, before.queue, i)
    one.granted += 1
    run.grants += 1
    t.lists[one.number_at + one.granted % one.numbers] = run.grants
    if one.granted - one.crossed >= one.numbers:
        run.lost += 1
    place = t.states[_here(i, t)]
    place.queue = _append(place.line, place.queue, place.most, i, t)
    place.held_by = _append(place.holders, place.held_by, place.most, i, t)
    place.filled = run.turn
    run.version += 1
    one.pending = False
    one.going = True
    one.reason = reason
    one.stage = stage
    _strike(i, t)
    t.entries[run.answers].answered = i
    run.answers += 1


@kernel
def still_free(i: int, t: Tables) -> bool:
    """Return whether no grant of this turn got into the way of a vehicle; else refuse it."""
    crossed = t.states[_wanted(i, t)].filled == t.run[0].turn
    j = leg_of(i, t.vehicles[i].granted, t)
    for k in range(t.legs[j].pass_at, t.legs[j].pass_end):
        for f in range(t.passes[k].foe_at, t.passes[k].foe_end):
            crossed |= t.moves[t.foes[f].movement].entered == t.run[0].turn
    if crossed:
        why = _in_the_way(i, t)
        if why != NOTHING:
            refuse(i, why, 0, t)
            return False
    return True


@kernel
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
    if one.reason == OCCUPIED and room(_wanted(i, t), t) <= 0:
        return False
    if one.looked_at == run.version and one.reason not in _PASSING:
        return False
    one.looked_at = run.version
    why = _in_the_way(i, t)
    if why == NOTHING and run.now_s - one.since_s < one.spare_s and t.states[_here(i, t)].queue == 1:
        why = SPACING  # nobody waits behind it
    if why != NOTHING:
        refuse(i, why, 0, t)
        return False
    return True


@part
def due(i: int, t: Tables) -> bool:
    """Return whether the gate may be asked, for the first time or again."""
    return bool(not t.vehicles[i].decided or t.run[0].now_s - t.vehicles[i].asked_at_s >= REASK_S)


@kernel
def collect(t: Tables) -> int:
    """Look at the requests, at all of them once a step, else at new ones; return how many are ready.

    Within a step grants take room and give none back, so each is looked at once.
    """
    run = t.run[0]
    run.turn += 1
    begin = run.waiting - run.fresh
    if run.now_s > run.decided_s:
        run.decided_s = run.now_s
        _keep(t)
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
    wanted, here = t.states[_wanted(i, t)], t.states[_here(i, t)]
    if wanted.held_by < run.crowded * wanted.room:
        return False
    fuller = wanted.held_by / wanted.room - here.held_by / here.room
    return bool(fuller >= (run.now_s - t.vehicles[i].since_s) / run.patience_s)


@kernel
def _closes(i: int, t: Tables) -> bool:
    """Return whether the vehicle's move would close a circle of full places (`ChainRule.closes`).

    All fit into a private state, and there are two at least: so none is ever full in a chain.
    """
    here = _here(i, t)
    target = _wanted(i, t)
    if t.states[target].queue + 1 < t.states[target].room:
        return False
    place = target
    for _ in range(len(t.states)):
        place = _wanted(t.lists[t.states[place].line], t)
        if place == here or t.states[place].queue < t.states[place].room - (1 if place == target else 0):
            return False
        if place == target:
            break
    return True  # also for a circle without it, of which there are none


@kernel
def decide_by_chain(i: int, t: Tables) -> None:
    """Decide the vehicle's request by the chain rule, if its way is still free."""
    if still_free(i, t):
        closes = _closes(i, t)
        t.run[0].decisions += 1
        settle(i, 0 if closes else 1, DEADLOCK if closes else FREE, t.run[0].chain, t)


@kernel
def decide(t: Tables) -> None:
    """Answer what `collect` finds, by pressure and the chain rule."""
    run, e = t.run[0], t.entries
    going = 0
    staying = 0
    for n in range(collect(t)):
        i = e[n].ready
        if not due(i, t):
            continue
        if not t.vehicles[i].mover and _waits(i, t):
            e[staying].staying = i
            staying += 1
            continue
        here = t.states[_here(i, t)]
        queues = here.held_by + here.outside - t.states[_wanted(i, t)].held_by
        e[going].ready = i
        e[going].weight = -(queues + (run.now_s - t.vehicles[i].since_s) / run.wait_s)
        going += 1
    _sort(going, t)
    for n in range(going):
        decide_by_chain(e[n].ready, t)
    for n in range(staying):
        refuse(e[n].staying, RESERVE, 0, t)
