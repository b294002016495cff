"""Find the drawn conflicts that the abstraction does not have, or has on a stretch that is too short."""

import math
from collections.abc import Iterator, Sequence

from loopgate.audit.drawing import Drawn, Side
from loopgate.audit.layout import Layout, LoopLeg

_BESIDE_M = 0.5
"""How far a drawn stretch may reach beyond the stretch of the abstraction [m]."""

Stretch = tuple[float, float] | None


def find_unmodelled(layout: Layout, drawn: Drawn) -> list[tuple[str, str, str]]:
    """Return the drawn conflicts that the abstraction does not cover: two lanes and the fault.

    No body may touch a body that waits in a place. Of two bodies that are between places, some movement of
    the first must be a foe of some movement of the second, over the whole drawn stretch. A layout without
    crossings has no movements: the list is then empty.
    """
    if not any(leg.crossings for loop in layout.loops.values() for leg in loop.legs):
        return []
    found: dict[tuple[str, str], str] = {}
    for meeting in drawn:
        one, other = (
            side._replace(begin_m=side.begin_m + loops[side.loop], end_m=side.end_m + loops[side.loop])
            for side, loops in zip((meeting.one, meeting.other), meeting.loops, strict=True)
        )
        if one.waits or other.waits:
            found[one.lane, other.lane] = "can touch as drawn, where one of them may wait"
            continue
        said = list(_foes(layout, one, other))
        if not said:
            found[one.lane, other.lane] = "can touch as drawn, but are no foes"
            continue
        beyond = max(_beyond(layout, side, [s[k] for s in said]) for k, side in enumerate((one, other)))
        if beyond > _BESIDE_M:
            found[one.lane, other.lane] = f"can touch as drawn {beyond:.1f} m beyond the stretch they share"
    return [(one, other, text) for (one, other), text in sorted(found.items())]


def _foes(layout: Layout, one: Side, other: Side) -> Iterator[tuple[Stretch, Stretch]]:
    """Yield the stretches that two conflicting movements share by the abstraction, each along its own way."""
    theirs = [crossing for leg in _under_way(layout, other) for crossing in leg.crossings]
    for leg in _under_way(layout, one):
        for movement, foes in leg.crossings:
            for foe, back in theirs:
                if foe in foes and movement in back:
                    yield foes[foe], back[movement]


def _under_way(layout: Layout, side: Side) -> list[LoopLeg]:
    """Return the legs between whose place and the next place a body of this side may be."""
    loop = layout.loops[side.loop]
    legs = []
    for leg, following in zip(loop.legs, [*loop.legs[1:], *loop.legs[:1]], strict=True):
        over_m = (following.begin_m - leg.end_m) % loop.length_m
        front = (side.begin_m - leg.end_m + _BESIDE_M) % loop.length_m
        rear = (side.end_m - leg.end_m) % loop.length_m
        if front <= over_m + side.begin_m - side.end_m + _BESIDE_M or rear <= over_m:
            legs.append(leg)
    return legs


def _beyond(layout: Layout, side: Side, stretches: Sequence[Stretch]) -> float:
    """Return how far bodies touch outside the abstraction's stretches, on either end [m]."""
    lap_m = layout.loops[side.loop].length_m
    before, behind = math.inf, math.inf
    for stretch in stretches:
        if stretch is None:
            return 0.0
        lap = round((side.begin_m - stretch[0]) / lap_m) * lap_m
        before = min(before, stretch[0] + lap - side.begin_m)
        behind = min(behind, side.end_m - stretch[1] - lap)
    return max(before, behind)
