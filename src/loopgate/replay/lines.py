"""Loops, places and the ways between them as lines on the map."""

from dataclasses import dataclass

import numpy as np

from loopgate.arrays import Floats
from loopgate.audit.layout import Layout, LoopWay
from loopgate.network.curve import cut_curve, gap
from loopgate.network.loop import arc_lengths


@dataclass(frozen=True, slots=True)
class PlaceLink:
    """The way from a place to the next: the names of its crossings, and its line on the map."""

    crossings: tuple[str, ...]
    line: Floats


@dataclass(frozen=True, slots=True)
class DrawnLines:
    """The lines of a layout, as points on the map."""

    loops: dict[str, Floats]
    """The points of each loop, by name [m]."""
    places: dict[str, Floats]
    """The points of each place, by name [m]."""
    links: tuple[PlaceLink, ...]
    """The ways between places."""
    after: dict[str, tuple[int, ...]]
    """For each loop, the numbers of the links after its legs."""
    foes: tuple[tuple[int, ...], ...]
    """For each link, the numbers of the links that exclude it."""


def find_lines(layout: Layout) -> DrawnLines:
    """Return loops, places and links of a run.

    A line follows the lanes on which vehicles leave their spans. O(legs times conflicts).
    """
    loops: dict[str, Floats] = {}
    places: dict[str, Floats] = {}
    links: dict[tuple[str, str, tuple[str, ...]], int] = {}
    drawn: list[PlaceLink] = []
    after: dict[str, tuple[int, ...]] = {}
    passing: dict[str, list[int]] = {}
    excluded: list[set[str]] = []
    for name, loop in layout.loops.items():
        points, arcs = loop_curve(layout, loop)
        loops[name] = points
        numbers = []
        for k, leg in enumerate(loop.legs):
            behind = loop.legs[(k + 1) % len(loop.legs)]
            places.setdefault(leg.state, cut_curve(points, arcs, loop.length_m, leg.begin_m, leg.end_m))
            crossings = tuple(crossing for crossing, _ in leg.crossings)
            key = (leg.state, behind.state, crossings)
            if key not in links:
                links[key] = len(drawn)
                to_m = leg.end_m + gap(loop.length_m, leg.end_m, behind.begin_m)
                line = cut_curve(points, arcs, loop.length_m, leg.end_m, to_m)
                drawn.append(PlaceLink(crossings, line))
                excluded.append({foe for _, foes in leg.crossings for foe in foes})
                for crossing in crossings:
                    passing.setdefault(crossing, []).append(links[key])
            numbers.append(links[key])
        after[name] = tuple(numbers)
    foes = tuple(
        tuple(sorted({number for foe in foes for number in passing.get(foe, ())})) for foes in excluded
    )
    return DrawnLines(loops, places, tuple(drawn), after, foes)


def loop_curve(layout: Layout, loop: LoopWay) -> tuple[Floats, Floats]:
    """Return a loop's points, shape (n, 2), and the arc length of each point [m]."""
    points, arcs = [], []
    for span in loop.spans:
        shape = np.asarray(layout.shapes[span.lanes[0]], dtype=np.float64)
        points.append(shape)
        arcs.append(arc_lengths(shape, span.begin_m, span.end_m))
    return np.concatenate(points), np.concatenate(arcs)
