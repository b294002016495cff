"""Conflicts among movements as their lanes are drawn, found without the abstraction's help."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import shapely

from loopgate.audit.layout import Layout, LoopWay

__all__ = ["DrawnConflict", "find_drawn", "unsaid"]

_LEAST_M = 0.1
"""Shorter stretches are corners that touch [m]."""

_BESIDE_M = 0.5
"""How far a drawn stretch may reach beyond the one that the abstraction says [m]: curves are drawn as a few
straight pieces."""


@dataclass(frozen=True, slots=True)
class DrawnConflict:
    """A stretch of a loop, in arc length [m], on which bodies can touch those on another movement.

    Movements are named as in the layout; by their lanes where it does not name them.
    """

    movement: str
    foe: str
    begin_m: float
    end_m: float


@dataclass(frozen=True, slots=True)
class _Movement:
    name: str
    origin: str
    lanes: tuple[tuple[str, float, float], ...]  # internal lane, metres driven before it, its length [m]


def find_drawn(layout: Layout, *, width_m: float | None = None) -> dict[str, list[DrawnConflict]]:
    """Find where bodies on two movements can touch, from the drawn lanes alone.

    A body sweeps a band as wide as itself along the centre line of its lanes inside the junction. Where the
    bands of two movements overlap, the bodies can touch. Movements from one lane follow each other.

    Parameters
    ----------
    layout
        The layout: its loops and shapes; states and crossings are not looked at.
    width_m
        Width of a body [m]; the widest vehicle's if not given.

    Returns
    -------
    dict
        By loop, the conflicts with the movements of all loops.
    """
    wide = width_m or max((v.width_m for v in layout.vehicles.values()), default=1.8)
    movements: dict[str, _Movement] = {}
    names = {lanes: name for name, lanes in layout.movements.items()}
    on_loop: dict[str, list[tuple[str, float]]] = {}
    for name, loop in layout.loops.items():
        on_loop[name] = []
        for movement, begin_m in _movements(loop, names):
            movements.setdefault(movement.name, movement)
            on_loop[name].append((movement.name, begin_m))
    touching = _touching(movements, layout, wide)
    return {
        name: [
            DrawnConflict(movement, foe, at_m + begin, at_m + end)
            for movement, at_m in passed
            for foe, (begin, end) in touching.get(movement, {}).items()
        ]
        for name, passed in on_loop.items()
    }


def unsaid(layout: Layout, drawn: Mapping[str, list[DrawnConflict]]) -> list[tuple[str, str, str]]:
    """Return the drawn conflicts that the abstraction does not cover: two movements, and what is wrong.

    Only layouts with crossings say anything about movements; elsewhere the list is empty.
    """
    found: dict[tuple[str, str], str] = {}
    for name, conflicts in drawn.items():
        loop = layout.loops[name]
        said: dict[str, list[Mapping[str, tuple[float, float] | None]]] = defaultdict(list)
        for leg in loop.legs:
            for movement, foes in leg.crossings:
                said[movement].append(foes)
        for c in conflicts:
            if not said.get(c.movement):
                continue
            known = [foes[c.foe] for foes in said[c.movement] if c.foe in foes]
            if not known:
                found[c.movement, c.foe] = "can touch as drawn, but are no foes"
                continue
            outside = min(_outside(stretch, c, loop.length_m) for stretch in known)
            if outside > _BESIDE_M:
                found[c.movement, c.foe] = f"can touch as drawn {outside:.1f} m beyond the stretch they share"
    return [(one, other, text) for (one, other), text in sorted(found.items())]


def _outside(stretch: tuple[float, float] | None, drawn: DrawnConflict, lap_m: float) -> float:
    if stretch is None:
        return 0.0
    lap = round((drawn.begin_m - stretch[0]) / lap_m) * lap_m
    return max(stretch[0] + lap - drawn.begin_m, drawn.end_m - stretch[1] - lap, 0.0)


def _movements(loop: LoopWay, names: Mapping[tuple[str, ...], str]) -> Iterator[tuple[_Movement, float]]:
    """Yield the movements of a loop with the arc length at which each begins [m]."""
    count = len(loop.spans)
    for number, span in enumerate(loop.spans):
        if span.internal:
            continue
        lanes: list[tuple[str, float, float]] = []
        driven = 0.0
        following = loop.spans[(number + 1) % count]
        while following.internal:
            length = following.end_m - following.begin_m
            lanes.append((following.lanes[0], driven, length))
            driven += length
            following = loop.spans[(number + len(lanes) + 1) % count]
        via = tuple(lane for lane, _, _ in lanes)
        if via:
            yield _Movement(names.get(via, " ".join(via)), span.lanes[0], tuple(lanes)), span.end_m


def _touching(
    movements: Mapping[str, _Movement], layout: Layout, width_m: float
) -> dict[str, dict[str, tuple[float, float]]]:
    found: dict[str, dict[str, tuple[float, float]]] = {}
    pieces = [(m, lane, at, length) for m in movements.values() for lane, at, length in m.lanes]
    lines = [shapely.LineString(layout.shapes[lane]) for _, lane, _, _ in pieces]
    bands = [line.buffer(width_m / 2, cap_style="flat") for line in lines]
    if not bands:
        return found  # a network without lanes inside junctions
    tree = shapely.STRtree(bands)
    one, other = tree.query(bands, predicate="intersects")
    for a, b in zip(one.tolist(), other.tolist(), strict=True):
        mine, foe = pieces[a][0], pieces[b][0]
        if mine.name == foe.name or mine.origin == foe.origin:
            continue
        if _junction(pieces[a][1]) != _junction(pieces[b][1]):
            continue  # one above the other, or bands that touch where the junctions do
        shared = shapely.intersection(bands[a], bands[b])
        corners = shapely.points(shapely.get_coordinates(shared))
        along = shapely.line_locate_point(lines[a], corners) / lines[a].length
        _, _, at_m, length_m = pieces[a]
        begin, end = at_m + float(np.min(along)) * length_m, at_m + float(np.max(along)) * length_m
        if end - begin < _LEAST_M:
            continue
        known = found.setdefault(mine.name, {}).get(foe.name, (begin, end))
        found[mine.name][foe.name] = min(known[0], begin), max(known[1], end)
    return found


def _junction(internal_lane: str) -> str:
    """Return the junction of an internal lane ``:junction_link_lane``."""
    return internal_lane.rsplit("_", 2)[0]
