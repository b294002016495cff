"""Loops with stops all over, and vehicles on them."""

from __future__ import annotations

from collections.abc import Iterable
from random import Random

from loopgate.network import Loop


def loops_with_stops(loops: Iterable[Loop]) -> list[str]:
    """Return elements of a route file: loops with a stop on every third road, four vehicles on each."""
    draw, lines = Random(3), list[str]()
    for number, loop in enumerate(loops):
        stops = ""
        for edge in loop.edges[::3]:
            end_m, duration_s = draw.uniform(8.0, 79.0), draw.choice((5, 12, 25))
            stops += (
                f'<stop lane="{edge}_0" startPos="{end_m - 2}" endPos="{end_m}" duration="{duration_s}"/>'
            )
        lines.append(f'<route id="{loop.id}" edges="{" ".join(loop.edges)}">{stops}</route>')
        lines += [f'<vehicle id="s{number}.{k}" route="{loop.id}" depart="0"/>' for k in range(4)]
    return lines
