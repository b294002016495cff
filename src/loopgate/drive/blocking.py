"""The vehicles for which one waits that is refused for want of a slot or a clear way, read off the tables."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, cast

from loopgate.drive.codes import CROSSING, NOBODY, OCCUPIED, SERVICE
from loopgate.drive.tables import Tables

__all__ = ["blockers"]


def blockers(robot: int, tables: Tables) -> list[list[int]]:
    """Return whom the request of `robot` waits for: of every set, some vehicle has to move on."""
    one: Any = tables.vehicles[robot]
    leg: Any = tables.legs[one["leg_at"] + one["granted"] % one["legs"]]
    if one["reason"] == CROSSING:
        return list(_on_the_way(robot, leg, tables))
    wanted = tables.legs[one["leg_at"] + (one["granted"] + 1) % one["legs"]]
    state: Any = tables.states[cast("Any", wanted)["state"]]
    if one["reason"] == SERVICE:
        return list(_movers(robot, leg, state, tables))
    if state["held_by"] < state["room"]:
        return list(_kept_by([int(state["slot"])], robot, tables))
    return [_others(robot, state["holders"], state["held_by"], tables)]


def _on_the_way(robot: int, leg: Any, tables: Tables) -> Iterator[list[int]]:  # noqa: ANN401  a row
    passes = cast("Any", tables.passes)[leg["pass_at"] : leg["pass_end"]]
    moves, foes = cast("Any", tables.moves), cast("Any", tables.foes)
    yield from _kept_by({int(way) for way in moves["way"][passes["movement"]]}, robot, tables)
    for one in passes:
        for foe in foes["movement"][one["foe_at"] : one["foe_end"]]:
            move = moves[foe]
            yield from ([other] for other in _others(robot, move["passing"], move["under_way"], tables))


def _movers(robot: int, leg: Any, state: Any, tables: Tables) -> Iterator[list[int]]:  # noqa: ANN401  rows
    """Yield those that must move next, for whom place or way are kept."""
    passes = cast("Any", tables.passes)[leg["pass_at"] : leg["pass_end"]]
    ways = cast("Any", tables.moves)["way"][passes["movement"]].tolist()
    for other in sorted({int(state["mover"]), *ways}):
        if other not in (NOBODY, robot) and cast("Any", tables.vehicles)["mover"][other]:
            yield [other]


def _others(robot: int, begin: int, length: int, tables: Tables) -> list[int]:
    return [other for other in tables.lists[begin : begin + length].tolist() if other != robot]


def _kept_by(late: Iterable[int], robot: int, tables: Tables) -> Iterator[list[int]]:
    """Yield those for whom something is kept still: not those that something else keeps by now."""
    for other in sorted(late):
        one: Any = tables.vehicles[other]
        if other not in (NOBODY, robot) and one["pending"] and one["reason"] in (CROSSING, OCCUPIED):
            yield [other]
