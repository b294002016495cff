"""Ways over crossings and last slots that are kept for vehicles passed over for too long."""

from __future__ import annotations

from typing import Final

from loopgate.drive.codes import CROSSING, NOBODY, OCCUPIED
from loopgate.drive.gaps import leg_of
from loopgate.drive.occupancy import last_state, room, wanted_state
from loopgate.drive.tables import Tables
from loopgate.kernel_cache import inner, part

__all__ = ["keep_for_late", "sort_ready"]

_PATIENCE_S: Final = 60.0
"""How long a request is passed over, on its crossing or for a slot, before others have to let it pass [s]."""

_SHORT_OF_SLOTS_S: Final = 30.0
"""How old a request is that finds no slot when those who could leave one get more attention [s]."""

_PATIENCE_THERE_S: Final = 10.0
"""How long these are passed over [s]: a long queue would else leave one by one, each after a minute. And so
long those who are behind the middle on their loop: the streets ahead of them wait."""

_GIVES_WAY_S: Final = 10.0
"""How long one that the gate has refused keeps nothing for itself [s]."""


@part
def keep_for_late(t: Tables) -> None:
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
    wanted = wanted_state(i, t)
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
            wanted = wanted_state(i, t)
            if room(wanted, t) <= 0:
                t.states[wanted].short = run.turn
    late = 0
    for n in range(passed_over):
        i = e[n].ready
        if run.now_s - v[i].asked_at_s < _GIVES_WAY_S:
            continue
        patience_s = _PATIENCE_THERE_S if v[i].spare_s < 0.0 else _PATIENCE_S
        if t.states[last_state(i, t)].short == run.turn or run.now_s - v[i].since_s >= patience_s:
            e[late].ready = i
            e[late].weight = v[i].since_s
            late += 1
    sort_ready(late, t)
    return late


@inner
def sort_ready(length: int, t: Tables) -> None:
    """Sort those that are ready by weight, then number."""
    e = t.entries
    for n in range(1, length):
        one, heavy = e[n].ready, e[n].weight
        k = n - 1
        while k >= 0 and (e[k].weight > heavy or (e[k].weight == heavy and e[k].ready > one)):
            e[k + 1].ready, e[k + 1].weight = e[k].ready, e[k].weight
            k -= 1
        e[k + 1].ready, e[k + 1].weight = one, heavy
