"""`loopgate.simulation.gatekeeper.Gatekeeper` with pressure and the chain rule, compiled; see there.

What is compiled is `Pressure`, `RightOfWay` and `loopgate.gates.certified.Flow` where every state is a FIFO
state that holds two, or private, so that a robot rests wherever it stands: then the chain of heads decides
alone. All robots fit into a private state, and there are two at least: so none is ever full in a chain.
"""

from __future__ import annotations

from typing import Final

from numba import njit

from loopgate.simulation.compiled import count as c
from loopgate.simulation.compiled.sight import in_the_way, leg_of
from loopgate.simulation.compiled.tables import Books
from loopgate.simulation.gatekeeper import REASK_S
from loopgate.simulation.right_of_way import GIVES_WAY_S, PATIENCE_S, PATIENCE_THERE_S, SHORT_OF_SLOTS_S
from loopgate.simulation.sensing import Numbers

__all__ = ["asks", "cleared", "decide", "first_before", "left", "room", "state_of"]

_NOBODY: Final = -1


@njit(cache=True, error_model="numpy")
def state_of(i: int, leg: int, b: Books) -> int:
    """Return the state in which leg `leg` of vehicle `i` lies."""
    return int(b.legs[leg_of(i, leg, b)].state)


@njit(cache=True, error_model="numpy")
def _here(i: int, b: Books) -> int:
    """Return the state that the gate has the vehicle in."""
    return state_of(i, b.vehicles[i].admitted, b)


@njit(cache=True, error_model="numpy")
def _wanted(i: int, b: Books) -> int:
    """Return the state behind that."""
    return state_of(i, b.vehicles[i].admitted + 1, b)


@njit(cache=True, error_model="numpy")
def room(state: int, b: Books) -> int:
    """Return how many more vehicles fit into the state."""
    return int(b.states[state].room - b.states[state].held_by)


@njit(cache=True, error_model="numpy")
def first_before(i: int, b: Books) -> int:
    """Return the head of the line that the vehicle stands in, if that is another one, or -1."""
    head = b.pool[b.states[_here(i, b)].line]
    return _NOBODY if head == i else int(head)


@njit(cache=True, error_model="numpy")
def _remove(pool: Numbers, at: int, length: int, one: int) -> int:
    """Take `one`, if it is there, out of a list of `length`, keeping the order; return the new length."""
    for k in range(at, at + length):
        if pool[k] == one:
            for later in range(k, at + length - 1):
                pool[later] = pool[later + 1]
            return length - 1
    return length


@njit(cache=True, error_model="numpy")
def _append(b: Books, at: int, length: int, most: int, one: int) -> int:
    """Put `one` at the end of a list of `length`; return the new length. There is room, or the run ends."""
    if length >= most:
        b.pool[c.LOST] += 1
        return length
    b.pool[at + length] = one
    return length + 1


@njit(cache=True, error_model="numpy")
def left(i: int, state: int, b: Books) -> None:
    """Take note that the rear of the vehicle has left the state."""
    place = b.states[state]
    place.held_by = _remove(b.pool, place.holders, place.held_by, i)
    b.pool[c.VERSION] += 1


@njit(cache=True, error_model="numpy")
def cleared(i: int, leg: int, b: Books) -> None:
    """Take note that the rear of the vehicle has passed the crossings behind the leg."""
    j = leg_of(i, leg, b)
    for k in range(b.legs[j].pass_at, b.legs[j].pass_end):
        movement = b.passes[k].movement
        move = b.moves[movement]
        move.under_way = _remove(b.pool, move.passing, move.under_way, i)
    if b.legs[j].pass_at < b.legs[j].pass_end:
        b.pool[c.VERSION] += 1


@njit(cache=True, error_model="numpy")
def asks(i: int, now_s: float, b: Books) -> None:
    """Take the request of a vehicle for its next state."""
    v = b.vehicles
    if v[i].pending or first_before(i, b) >= 0:
        return
    v[i].pending = True
    v[i].since_s = now_s
    v[i].reason = c.NOTHING
    v[i].looked_at = -1
    v[i].asked_at_s = -1.0
    v[i].decided = False
    v[b.pool[c.WAITING]].waiting = i
    b.pool[c.WAITING] += 1
    v[b.pool[c.FRESH]].fresh = i
    b.pool[c.FRESH] += 1


@njit(cache=True, error_model="numpy")
def _sort(length: int, b: Books) -> None:
    """Sort `Rider.ready` by weight, then number."""
    v = b.vehicles
    for n in range(1, length):
        one, heavy = v[n].ready, v[n].weight
        k = n - 1
        while k >= 0 and (v[k].weight > heavy or (v[k].weight == heavy and v[k].ready > one)):
            v[k + 1].ready, v[k + 1].weight = v[k].ready, v[k].weight
            k -= 1
        v[k + 1].ready, v[k + 1].weight = one, heavy


@njit(cache=True, error_model="numpy")
def _renew(now_s: float, b: Books) -> bool:
    """Keep what is due to each, see `RightOfWay.renew`; return whether slots changed hands."""
    for n in range(b.pool[c.WAYS]):
        b.moves[b.moves[n].kept].way = _NOBODY
    b.pool[c.WAYS] = 0
    before = b.pool[c.SLOTS]
    for state in range(len(b.states)):
        b.states[state].slot_before = b.states[state].slot
        b.states[state].slot = _NOBODY
    b.pool[c.SLOTS] = 0
    for n in range(_late(now_s, b)):
        _keep(b.vehicles[n].ready, b)
    if b.pool[c.SLOTS] != before:
        return True
    for n in range(before):  # as many: if one is gone, another is new
        kept = b.states[b.states[n].kept]
        if kept.slot != kept.slot_before:
            return True
    return False


@njit(cache=True, error_model="numpy")
def _keep(i: int, b: Books) -> None:
    """Keep the last slot for a vehicle, and its way if a slot is left, unless they are kept for another."""
    wanted = _wanted(i, b)
    if b.states[wanted].slot == _NOBODY:
        b.states[wanted].slot = i
        b.states[b.pool[c.SLOTS]].kept = wanted
        b.pool[c.SLOTS] += 1
    if room(wanted, b) <= (1 if b.states[wanted].slot != i else 0):
        return
    j = leg_of(i, b.vehicles[i].admitted, b)
    for k in range(b.legs[j].pass_at, b.legs[j].pass_end):
        if b.moves[b.passes[k].movement].way != _NOBODY:
            return
    for k in range(b.legs[j].pass_at, b.legs[j].pass_end):
        for f in range(b.passes[k].foe_at, b.passes[k].foe_end):
            foe = b.foes[f].movement
            if b.moves[foe].way == _NOBODY:
                b.moves[foe].way = i
                b.moves[b.pool[c.WAYS]].kept = foe
                b.pool[c.WAYS] += 1


@njit(cache=True, error_model="numpy")
def _late(now_s: float, b: Books) -> int:
    """Sort those whom something is kept for into `Rider.ready`, oldest first; return how many.

    On the way it stamps the states whose heads lack a slot.
    """
    v = b.vehicles
    passed_over = 0
    stamp = b.pool[c.DECIDED]
    for n in range(b.pool[c.WAITING]):
        i = v[n].waiting
        if now_s - v[i].since_s < PATIENCE_THERE_S:
            continue
        if v[i].reason not in (c.CROSSING, c.OCCUPIED):
            continue
        v[passed_over].ready = i
        passed_over += 1
        if v[i].reason == c.OCCUPIED and now_s - v[i].since_s >= SHORT_OF_SLOTS_S:
            wanted = _wanted(i, b)
            if room(wanted, b) <= 0:
                b.states[wanted].short = stamp
    late = 0
    for n in range(passed_over):
        i = v[n].ready
        if now_s - v[i].asked_at_s < GIVES_WAY_S:
            continue
        here = _here(i, b)
        if b.states[here].short == stamp or now_s - v[i].since_s >= PATIENCE_S:
            v[late].ready = i
            v[late].weight = v[i].since_s
            late += 1
    _sort(late, b)
    return late


@njit(cache=True, error_model="numpy")
def _in_the_way(i: int, b: Books) -> int:
    """Return why the vehicle may not set out now, or `NOTHING`."""
    v = b.vehicles
    wanted = _wanted(i, b)
    free = room(wanted, b)
    if free <= 0 or (free == 1 and b.states[wanted].slot not in (_NOBODY, i)):
        return c.OCCUPIED
    j = leg_of(i, v[i].admitted, b)
    for k in range(b.legs[j].pass_at, b.legs[j].pass_end):
        if b.moves[b.passes[k].movement].way not in (_NOBODY, i):
            return c.CROSSING
        for f in range(b.passes[k].foe_at, b.passes[k].foe_end):
            at = b.moves[b.foes[f].movement].passing
            for n in range(at, at + b.moves[b.foes[f].movement].under_way):
                if b.pool[n] != i and in_the_way(i, k, f, b.pool[n], b):
                    return c.CROSSING
    return c.NOTHING


@njit(cache=True, error_model="numpy")
def _refuse(i: int, reason: int, answers: int, b: Books) -> int:
    v = b.vehicles
    if v[i].reason != reason:
        v[i].reason = reason
        b.pool[c.REFUSED + reason] += 1
        v[answers].answered = i
        v[answers].yes = False
        answers += 1
    return answers


@njit(cache=True, error_model="numpy")
def _closes(i: int, b: Books) -> bool:
    """Return whether the vehicle's move would close a circle of full places (`Flow.closes`)."""
    here = _here(i, b)
    target = _wanted(i, b)
    if b.states[target].queue + 1 < b.states[target].room:
        return False
    place = target
    for _ in range(len(b.states)):
        head = b.pool[b.states[place].line]
        place = _wanted(head, b)
        if place == here or b.states[place].queue < b.states[place].room - (1 if place == target else 0):
            return False
        if place == target:
            break
    return True  # also for a circle without it, of which there are none


@njit(cache=True, error_model="numpy")
def _grant(i: int, b: Books) -> None:
    v = b.vehicles
    here = _here(i, b)
    wanted = _wanted(i, b)
    stamp = b.pool[c.DECIDED]
    j = leg_of(i, v[i].admitted, b)
    for k in range(b.legs[j].pass_at, b.legs[j].pass_end):
        move = b.moves[b.passes[k].movement]
        move.under_way = _append(b, move.passing, move.under_way, move.most, i)
        move.entered = stamp
    v[i].admitted += 1
    left = b.states[here]
    left.queue = _remove(b.pool, left.line, left.queue, i)
    place = b.states[wanted]
    place.queue = _append(b, place.line, place.queue, place.most, i)
    place.held_by = _append(b, place.holders, place.held_by, place.most, i)
    place.filled = stamp
    b.pool[c.VERSION] += 1
    v[i].pending = False
    kept = 0
    for n in range(b.pool[c.WAITING]):
        if v[n].waiting != i:
            v[kept].waiting = v[n].waiting
            kept += 1
    b.pool[c.WAITING] = kept


@njit(cache=True, error_model="numpy")
def _crossed_by_grants(i: int, b: Books) -> bool:
    v = b.vehicles
    stamp = b.pool[c.DECIDED]
    if b.states[_wanted(i, b)].filled == stamp:
        return True
    j = leg_of(i, v[i].admitted, b)
    for k in range(b.legs[j].pass_at, b.legs[j].pass_end):
        for f in range(b.passes[k].foe_at, b.passes[k].foe_end):
            if b.moves[b.foes[f].movement].entered == stamp:
                return True
    return False


@njit(cache=True, error_model="numpy")
def _possible(i: int, now_s: float, answers: int, b: Books) -> tuple[bool, int]:
    """Return whether it is for the negotiation and the gate to say, and the number of answers."""
    v = b.vehicles
    reason = v[i].reason
    if reason == c.OCCUPIED and room(_wanted(i, b), b) <= 0:
        return False, answers
    if v[i].looked_at == b.pool[c.VERSION] and reason not in (c.NOTHING, c.CROSSING):
        return False, answers
    v[i].looked_at = b.pool[c.VERSION]
    why = _in_the_way(i, b)
    if why != c.NOTHING:
        return False, _refuse(i, why, answers, b)
    return not v[i].decided or now_s - v[i].asked_at_s >= REASK_S, answers


@njit(cache=True, error_model="numpy")
def _waits(i: int, now_s: float, pressure: tuple[float, float, float], b: Books) -> bool:
    """Return whether the vehicle has to leave room for others (`Pressure`)."""
    v = b.vehicles
    crowded, patience_s, _ = pressure
    wanted = _wanted(i, b)
    ahead, capacity = b.states[wanted].held_by, b.states[wanted].room
    if ahead < crowded * capacity:
        return False
    here = _here(i, b)
    share = b.states[here].held_by / b.states[here].room
    return bool(ahead / capacity - share >= (now_s - v[i].since_s) / patience_s)


@njit(cache=True, error_model="numpy")
def decide(
    now_s: float,
    first: bool,  # noqa: FBT001  compiled functions take their arguments by position
    pressure: tuple[float, float, float],
    b: Books,
) -> int:
    """Decide what is pending, all of it `first` in a step, then what is new; return the number of answers."""
    v = b.vehicles
    b.pool[c.DECIDED] += 1
    length = b.pool[c.FRESH]
    if first:
        if _renew(now_s, b):
            b.pool[c.VERSION] += 1
        length = b.pool[c.WAITING]
    b.pool[c.FRESH] = 0
    answers = 0
    going = 0
    staying = 0
    for n in range(length):
        i = v[n].waiting if first else v[n].fresh
        possible, answers = _possible(i, now_s, answers, b)
        if not possible:
            continue
        if _waits(i, now_s, pressure, b):
            v[staying].staying = i
            staying += 1
            continue
        here = _here(i, b)
        wanted = _wanted(i, b)
        queues = b.states[here].held_by - b.states[wanted].held_by
        v[going].ready = i
        v[going].weight = -(queues + (now_s - v[i].since_s) / pressure[2])
        going += 1
    _sort(going, b)
    for n in range(going):
        i = v[n].ready
        if _crossed_by_grants(i, b):
            why = _in_the_way(i, b)
            if why != c.NOTHING:
                answers = _refuse(i, why, answers, b)
                continue
        v[i].asked_at_s = now_s
        v[i].decided = True
        b.pool[c.DECISIONS] += 1
        if _closes(i, b):
            answers = _refuse(i, c.DEADLOCK, answers, b)
            continue
        _grant(i, b)
        v[answers].answered = i
        v[answers].yes = True
        answers += 1
    for n in range(staying):
        answers = _refuse(v[n].staying, c.RESERVE, answers, b)
    return answers
