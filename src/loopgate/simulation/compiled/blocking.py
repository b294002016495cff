"""Whom a refused vehicle waits for, read off the books: `Gatekeeper.blockers` for the compiled drive."""

from __future__ import annotations

from collections.abc import Iterable

from loopgate.simulation.compiled import count as c
from loopgate.simulation.compiled.tables import Books

__all__ = ["blockers"]


def blockers(robot: int, books: Books) -> list[list[int]]:
    """Return whom the request of `robot` waits for: of every set, some vehicle has to move on.

    Parameters
    ----------
    robot
        The vehicle.
    books
        Who holds what.
    """
    rider = books.vehicles[robot]
    if not rider.pending or rider.reason == c.NOTHING:
        return []
    if rider.reason == c.OCCUPIED:
        state = books.states[_wanted(robot, books)]
        if state.held_by < state.room:
            return _kept_by({int(state.slot)}, robot, books)
        return [_others(robot, state.holders, state.held_by, books)]
    if rider.reason == c.CROSSING:
        return _on_the_way(robot, books)
    heads = _heads(robot, books) if rider.reason == c.DEADLOCK else []
    return [heads or [other for other in range(len(books.vehicles)) if other != robot]]


def _on_the_way(robot: int, books: Books) -> list[list[int]]:
    leg = books.legs[_leg(robot, books)]
    passes = [books.passes[k] for k in range(leg.pass_at, leg.pass_end)]
    waits = _kept_by({int(books.moves[one.movement].way) for one in passes}, robot, books)
    for one in passes:
        for f in range(one.foe_at, one.foe_end):
            move = books.moves[books.foes[f].movement]
            waits += [[other] for other in _others(robot, move.passing, move.under_way, books)]
    return waits


def _others(robot: int, begin: int, length: int, books: Books) -> list[int]:
    return [other for other in books.pool[begin : begin + length].tolist() if other != robot]


def _kept_by(late: Iterable[int], robot: int, books: Books) -> list[list[int]]:
    riders = books.vehicles
    return [
        [other]
        for other in sorted(late)
        if other not in (-1, robot)
        and riders[other].pending
        and riders[other].reason in (c.CROSSING, c.OCCUPIED)
    ]


def _heads(robot: int, books: Books) -> list[int]:
    """Return the heads of the full places round the circle that the vehicle's move would close.

    None if it closes none by now; if the place itself is full by now, those in it.
    """
    here = _here(robot, books)
    target = place = _wanted(robot, books)
    heads: list[int] = []
    state = books.states[target]
    if state.queue >= state.room:
        return _others(robot, state.line, state.queue, books)
    if state.queue + 1 < state.room:
        return heads
    while True:
        head = int(books.pool[books.states[place].line])
        heads.append(head)
        place = _wanted(head, books)
        state = books.states[place]
        if place == here or state.queue < state.room - (place == target):
            return []
        if place == target or len(heads) > len(books.states):
            return heads


def _leg(robot: int, books: Books, ahead: int = 0) -> int:
    rider = books.vehicles[robot]
    return int(rider.leg_at + (rider.admitted + ahead) % rider.legs)


def _here(robot: int, books: Books) -> int:
    return int(books.legs[_leg(robot, books)].state)


def _wanted(robot: int, books: Books) -> int:
    return int(books.legs[_leg(robot, books, ahead=1)].state)
