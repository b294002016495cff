"""Starting places on the road for vehicles that no abstraction places."""

from collections import defaultdict
from collections.abc import Sequence
from random import Random

from loopgate.errors import ScenarioError
from loopgate.network import Loop, VehicleType

_TRY_EVERY_M = 2.5


def spread(
    loops: Sequence[Loop],
    types: Sequence[VehicleType],
    rng: Random,
    wishes_m: Sequence[float | None] | None = None,
) -> list[float]:
    """Place vehicles on their loops so that each stands on one lane and none overlap.

    Parameters
    ----------
    loops, types
        One per vehicle; a loop may come several times.
    rng
        Draws where on its loop each vehicle would like to stand; it takes the next free place from there.
    wishes_m
        Where it would, if it is said, by vehicle [m].

    Returns
    -------
    list of float
        Arc length of each vehicle's front [m].

    Raises
    ------
    ScenarioError
        If a loop has no free place left; the text names the vehicle's number and the loop.
    """
    taken: defaultdict[str, list[tuple[float, float]]] = defaultdict(list)
    fronts: list[float] = []
    for number, (loop, kind) in enumerate(zip(loops, types, strict=True)):
        drawn = rng.uniform(0.0, loop.length_m)
        said = wishes_m[number] if wishes_m else None
        wish = drawn if said is None else said
        front = _next_free(loop, kind, wish, taken)
        if front is None:
            msg = (
                f"vehicle {number + 1} of {len(loops)}: no free place left on loop {loop.id}; "
                f"take fewer vehicles or more loops"
            )
            raise ScenarioError(msg)
        fronts.append(front)
    return fronts


def _next_free(
    loop: Loop, kind: VehicleType, wish: float, taken: defaultdict[str, list[tuple[float, float]]]
) -> float | None:
    needed = kind.length_m + kind.min_gap_m
    for step in range(int(loop.length_m / _TRY_EVERY_M) + 1):
        arc = (wish + step * _TRY_EVERY_M) % loop.length_m
        span = loop.span_at(arc)
        front = arc - span.begin_m
        if span.internal or front < needed or front > span.length_m - 1.0:
            continue
        used = taken[span.lane_id]
        if all(front <= low or front - needed >= high for low, high in used):
            used.append((front - needed, front))
            return arc
    return None
