"""The service rule, in the drive: the vehicle that must move next, so that one that waited enough goes on.

Past a patience the vehicle with the oldest request is *served*. `loopgate.gates.certified.service` says of
the model whose move, the *mover's*, brings it nearer to its grant; here nobody can get before that one. On
the way from the served vehicle over full places to the first with room nobody but the mover can do anything
but take room there: so the last slot of it is the mover's. Once there is a slot, nobody sets out across the
mover's way, and no negotiation is asked whether it may go. With each such move the way gets shorter; but for
a circle, when it leads on from there: from then on nobody but the mover enters any of the places that the
rule has looked at, until the served vehicle has its grant. Others are served at the same time where they look
at none of these places; of two that do, the older goes first.

Why each request is granted after finitely many moves is proved in docs/proofs/roads.md.
"""

from __future__ import annotations

from typing import Final

from loopgate.drive.chain import follow, last_of_circle
from loopgate.drive.codes import NOBODY, STOPPING
from loopgate.drive.gaps import end_m, leg_of, state_of
from loopgate.drive.occupancy import wanted_state
from loopgate.drive.tables import Tables
from loopgate.kernel_cache import inner, part

__all__ = ["bars", "serve", "stops_here"]

_THROUGH_RED_S: Final = 120.0
"""After this long a mover's way is kept clear while its light is red too [s]. Else each green could find
somebody there who may cross at the same time."""


@inner
def stops_here(i: int, t: Tables) -> bool:
    """Return whether the vehicle is to stop, or does, before it gets to the end of its last grant."""
    return bool(t.vehicles[i].stop_m < end_m(i, t.vehicles[i].granted, t))


@inner
def bars(i: int, state: int, t: Tables) -> bool:
    """Return whether the state, or the last slot of it, is kept for another vehicle, which must move next.

    Vehicles with room behind them leave one slot more. Nobody is short of the one that they would give back;
    else the holes that a crowd lives on were taken by those who come to it.
    """
    place = t.states[state]
    if place.mover in (NOBODY, i):
        return False
    leaves = 1 if _full(state_of(i, t.vehicles[i].granted, t), t) else 2
    return bool(t.vehicles[place.served].turned or place.room - place.held_by <= leaves)


@inner
def _goes_by_itself(i: int, t: Tables) -> bool:
    """Return whether a vehicle goes on without service: it stops, is beside the road, or gets no grants."""
    one = t.vehicles[i]
    return bool(stops_here(i, t) or one.aside or one.withheld == STOPPING)


@inner
def serve(t: Tables) -> None:
    """Name who must move next for those past the patience, oldest first; once a step, after all else kept."""
    run = t.run[0]
    before = run.serving
    run.serving = 0
    if before == 0 and not _any_late(t):
        return
    _begin(before == 0, t)
    for n in range(run.waiting):
        i = t.entries[n].waiting
        if t.vehicles[i].reason == STOPPING:
            continue
        if not _is_late(i, t):
            break  # the oldest come first
        mover = _mover(i, t)
        if mover != NOBODY and _goes_by_itself(mover, t):
            mover = NOBODY
        for s in range(len(t.states)):
            place = t.states[s]
            if place.served == i and place.mover == NOBODY:
                if mover == NOBODY:
                    place.served = NOBODY
                else:
                    place.mover = mover
        t.vehicles[i].turned = t.vehicles[i].turned and mover != NOBODY
        if mover != NOBODY:
            run.serving += 1
            t.vehicles[mover].mover = True
            _clear_way(mover, t)
    run.version += 1  # who was barred, or is the mover by now, is looked at again


@part
def _any_late(t: Tables) -> bool:
    for n in range(t.run[0].waiting):
        i = t.entries[n].waiting
        if t.vehicles[i].reason != STOPPING:
            return _is_late(i, t)  # the oldest come first
    return False


@part
def _is_late(i: int, t: Tables) -> bool:
    """Return whether a vehicle has waited for long, and not for a stop, which ends by itself."""
    one = t.vehicles[i]
    if one.reason == STOPPING:
        return False
    return bool(one.pending and t.run[0].now_s - one.since_s >= t.run[0].serve_after_s)


@part
def _begin(anew: bool, t: Tables) -> None:  # noqa: FBT001  compiled
    """Forget movers, and what was looked at for those who have their grant."""
    for i in range(len(t.vehicles)):
        if anew or not t.vehicles[i].mover:
            t.vehicles[i].named_s = t.run[0].now_s
            t.vehicles[i].barred = False
        t.vehicles[i].mover = False
        t.vehicles[i].turned = t.vehicles[i].turned and _is_late(i, t)
    for s in range(len(t.states)):
        t.states[s].mover = NOBODY
        if t.states[s].served != NOBODY and not t.vehicles[t.states[s].served].turned:
            t.states[s].served = NOBODY


@part
def _full(state: int, t: Tables) -> bool:
    return bool(t.states[state].queue >= t.states[state].room)


@part
def _mover(served: int, t: Tables) -> int:
    """Return who must move next, or `NOBODY` if one of the places on the way is an older vehicle's.

    What is looked at is marked as the served vehicle's, besides what was before.
    """
    first, end = follow(served, NOBODY, NOBODY, served, t)
    if end == NOBODY or _full(end, t):
        return NOBODY  # full places in a circle: the gate lets none come about
    t.states[end].served = served
    last = last_of_circle(first, t)
    if last == NOBODY:
        return int(first)
    t.vehicles[served].turned = True
    return int(last)


@part
def _clear_way(mover: int, t: Tables) -> None:
    """Let nobody set out across the mover's way, if it asks, unless an older one's mover needs it."""
    one = t.vehicles[mover]
    if not one.pending:
        return
    if one.barred and t.run[0].now_s - one.named_s < _THROUGH_RED_S:
        return
    wanted = t.states[wanted_state(mover, t)]
    if wanted.held_by >= wanted.room:
        return  # who leaves it is still in it; then the slot is the mover's
    j = leg_of(mover, one.granted, t)
    for k in range(t.legs[j].pass_at, t.legs[j].pass_end):
        way = t.moves[t.passes[k].movement].way
        if way != NOBODY and t.vehicles[way].mover:
            return
    for k in range(t.legs[j].pass_at, t.legs[j].pass_end):
        t.moves[t.passes[k].movement].way = NOBODY
    for k in range(t.legs[j].pass_at, t.legs[j].pass_end):
        for f in range(t.passes[k].foe_at, t.passes[k].foe_end):
            foe = t.moves[t.foes[f].movement]
            if foe.way == NOBODY or not t.vehicles[foe.way].mover:
                foe.way = mover
