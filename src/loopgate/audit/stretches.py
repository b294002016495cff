"""Stretches of loops with a limit on vehicles: a number of bodies, or one direction at a time."""

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise, product

import numpy as np

from loopgate.arrays import Floats, Ints
from loopgate.audit.drawing import DrawnConflict
from loopgate.audit.layout import Layout, LoopWay, SizedStretches

ROUNDING_M = 0.02
"""Recorded positions are rounded to centimetres: stretches are taken this much shorter at either end [m]."""


@dataclass(frozen=True, slots=True)
class StretchGroup:
    """The common limit of a group of stretches."""

    kind: str
    """``place``, ``crossing`` (as the abstraction says) or ``drawn`` (as the lanes are drawn)."""
    names: tuple[str, ...]
    """The state; or the two movements, of which only one may have bodies on the stretch."""
    room: int = 0
    """How many bodies a place holds; 0 for the other kinds."""
    metres: float = 0.0
    """A place also holds more bodies that fit into so many metres with their gaps."""
    zone: int = 0
    """Number of the zone of those in which two lanes meet, as drawn."""
    sizes: tuple[int, ...] = ()
    """Of the two movements, the sizes of the vehicles on them; empty for vehicles of any length."""


@dataclass(frozen=True, slots=True)
class LoopStretches:
    """The stretches of one loop: begin and end [m], number of the group, side (0 or 1).

    `above_m`, `up_to_m`: the lengths of the bodies that a stretch is for [m].
    """

    begin_m: Floats
    end_m: Floats
    group: Ints
    side: Ints
    above_m: Floats
    up_to_m: Floats
    first: int
    """Number of its first stretch among those of all loops."""


@dataclass(frozen=True, slots=True)
class Stretches:
    """All stretches of a layout.

    `count`: how many stretches there are in all.
    """

    groups: tuple[StretchGroup, ...]
    loops: Mapping[str, LoopStretches]
    count: int


def lay_stretches(layout: Layout, drawn: Mapping[str, list[DrawnConflict]]) -> Stretches:
    """Return the stretches of places, of crossings as the abstraction says, and of conflicts as drawn.

    `drawn`: by loop, see `loopgate.audit.drawing.find_drawn`.
    """
    numbers: dict[StretchGroup, int] = {}
    loops: dict[str, LoopStretches] = {}
    count = 0
    for name, loop in layout.loops.items():
        rows = [
            (begin + ROUNDING_M, end - ROUNDING_M, numbers.setdefault(group, len(numbers)), side, *lengths)
            for group, side, begin, end, lengths in (
                *_places(layout, loop),
                *_crossings(loop),
                *_drawn(drawn[name]),
            )
        ]
        table = np.array(rows, dtype=np.float64).reshape(-1, 6)
        begin, end, group, side, above, up_to = table.T
        loops[name] = LoopStretches(
            begin, end, group.astype(np.int64), side.astype(np.int64), above, up_to, count
        )
        count += len(rows)
    return Stretches(tuple(numbers), loops, count)


_ANY = -math.inf, math.inf

_Row = tuple[StretchGroup, int, float, float, tuple[float, float]]


def _places(layout: Layout, loop: LoopWay) -> Iterator[_Row]:
    for leg in loop.legs:
        room = layout.room.get(leg.state)
        if room is not None:
            group = StretchGroup("place", (leg.state,), room, layout.metres.get(leg.state, 0.0))
            yield group, 0, leg.begin_m, leg.end_m, _ANY


def _crossings(loop: LoopWay) -> Iterator[_Row]:
    for number, leg in enumerate(loop.legs):
        following = (number + 1) % len(loop.legs)
        behind = loop.legs[following].begin_m + (0.0 if following else loop.length_m)
        for movement, foes in leg.crossings:
            for foe, stretch in foes.items():
                sized = leg.sized.get(movement, {}).get(foe)
                if sized is not None:
                    yield from _by_size(sized, movement, foe)
                    continue
                begin, end = stretch or _on_edge(loop, movement, leg.end_m, behind)
                yield _pair("crossing", movement, foe), int(movement > foe), begin, end, _ANY


_PASSAGE = re.compile(r"(.+):\d+>\d+")
"""The name of a way over a stretch of an edge: the edge, and two of its lanes."""


def _on_edge(loop: LoopWay, movement: str, begin_m: float, end_m: float) -> tuple[float, float]:
    """Return the part of a crossing on the edge of a passage; the whole crossing for other movements [m].

    Who stands at a light before a narrow street may have let others over it first.
    """
    passage = _PASSAGE.fullmatch(movement)
    edge = passage[1] if passage else ""
    on_it = [span for span in loop.spans if any(lane.rpartition("_")[0] == edge for lane in span.lanes)]
    for span, lap_m in product(on_it, (0.0, loop.length_m)):
        low, high = max(span.begin_m + lap_m, begin_m), min(span.end_m + lap_m, end_m)
        if low < high:
            return low, high
    return begin_m, end_m


def _by_size(sized: SizedStretches, movement: str, foe: str) -> Iterator[_Row]:
    side, bounds = int(movement > foe), [*pairwise((-math.inf, *sized.sizes[:-1], math.inf))]
    for mine, row in enumerate(sized.among):
        for theirs, stretch in enumerate(row):
            if stretch is not None:
                sizes = (theirs, mine) if side else (mine, theirs)
                group = replace(_pair("crossing", movement, foe), sizes=sizes)
                yield group, side, *stretch, bounds[mine]


def _drawn(conflicts: list[DrawnConflict]) -> Iterator[_Row]:
    for c in conflicts:
        yield _pair("drawn", c.movement, c.foe, c.zone), int(c.movement > c.foe), c.begin_m, c.end_m, _ANY


def _pair(kind: str, one: str, other: str, zone: int = 0) -> StretchGroup:
    return StretchGroup(kind, (min(one, other), max(one, other)), zone=zone)
