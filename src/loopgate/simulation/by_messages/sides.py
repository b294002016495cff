"""Divides a network into two halves, for runs in which the radio between them is cut."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from loopgate.abstraction.itinerary import Itinerary

__all__ = ["far_side"]


def far_side(itineraries: Iterable[Itinerary], number: Callable[[str], int | None]) -> frozenset[int]:
    """Return the places in the eastern half of the network; both halves have equally many places.

    Parameters
    ----------
    number
        Function that returns the number of a place by its name, or None for a place that no vehicle visits.
    """
    middles_m: dict[int, float] = {}
    for loop, legs in {id(one.loop): (one.loop, one.legs) for one in itineraries}.values():
        points, arcs = loop.curve()
        for leg in legs:
            place = number(str(leg.state))
            if place is not None and place not in middles_m:
                middle_m = (leg.begin_m + leg.end_m) / 2.0 % loop.lap_m
                middles_m[place] = float(np.interp(middle_m, arcs, points[:, 0]))
    line_m = float(np.median(list(middles_m.values()))) if middles_m else 0.0
    return frozenset(place for place, at_m in middles_m.items() if at_m > line_m)
