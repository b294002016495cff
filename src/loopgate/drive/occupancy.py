"""The books of who holds what, as the steps keep them: states with their lines, crossings, and requests."""

from __future__ import annotations

from loopgate.drive.codes import NOBODY
from loopgate.drive.gaps import leg_of, state_of
from loopgate.drive.tables import Numbers, Tables
from loopgate.kernel_cache import inner, part


@inner
def last_state(i: int, t: Tables) -> int:
    """Return the state of the last leg that was granted to the vehicle."""
    return state_of(i, t.vehicles[i].granted, t)


@inner
def wanted_state(i: int, t: Tables) -> int:
    """Return the state behind that."""
    return state_of(i, t.vehicles[i].granted + 1, t)


@inner
def room(state: int, t: Tables) -> int:
    """Return how many more vehicles fit into the state, and into its lists."""
    place = t.states[state]
    return int(min(place.room, place.most) - place.held_by)


@inner
def first_before(i: int, t: Tables) -> int:
    """Return the first vehicle in this vehicle's FIFO state; `NOBODY` if it is this one, or without order."""
    state = t.states[last_state(i, t)]
    head = int(t.lists[state.line])
    return NOBODY if head == i or not state.fifo else head


@inner
def append(at: int, length: int, most: int, one: int, t: Tables) -> int:
    """Put `one` at the end of a list of `length`; return the new length. There is room, or the run ends."""
    if length >= most:
        t.run[0].lost += 1
        return length
    t.lists[at + length] = one
    return length + 1


@inner
def remove(lists: Numbers, at: int, length: int, one: int) -> int:
    """Take `one`, if it is there, out of a list of `length`, keeping the order; return the new length."""
    for k in range(at, at + length):
        if lists[k] == one:
            for later in range(k, at + length - 1):
                lists[later] = lists[later + 1]
            return length - 1
    return length


@inner
def left(i: int, state: int, t: Tables) -> None:
    """Take note that the rear of the vehicle has left the state."""
    place = t.states[state]
    place.held_by = remove(t.lists, place.holders, place.held_by, i)
    t.run[0].version += 1


@inner
def cleared(i: int, leg: int, t: Tables) -> None:
    """Take note that the rear of the vehicle has passed the crossings behind the leg."""
    j = leg_of(i, leg, t)
    for k in range(t.legs[j].pass_at, t.legs[j].pass_end):
        move = t.moves[t.passes[k].movement]
        move.under_way = remove(t.lists, move.passing, move.under_way, i)
    if t.legs[j].pass_at < t.legs[j].pass_end:
        t.run[0].version += 1


@inner
def strike(i: int, t: Tables) -> None:
    """Take the request of a vehicle out, if there is one."""
    run, kept = t.run[0], 0
    old = run.waiting - run.fresh
    for n in range(run.waiting):
        if t.entries[n].waiting != i:
            t.entries[kept].waiting = t.entries[n].waiting
            kept += 1
        elif n >= old:
            run.fresh -= 1
    run.waiting = kept


@part
def leaves(i: int, t: Tables) -> None:
    """Let a vehicle whose row is about to be given back hold nothing, and keep nothing for it."""
    one = t.vehicles[i]
    for leg in range(one.tail, one.granted + 1):
        left(i, state_of(i, leg, t), t)
    for leg in range(one.crossed, one.granted):
        cleared(i, leg, t)
    place = t.states[last_state(i, t)]
    place.queue = remove(t.lists, place.line, place.queue, i)
    strike(i, t)
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


@inner
def _write(at: int, length: int, one: int, to: int, t: Tables) -> None:
    for k in range(at, at + length):
        if t.lists[k] == one:
            t.lists[k] = to


@inner
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
