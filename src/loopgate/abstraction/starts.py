"""Chooses start positions: each vehicle in a state of its own, in full length on one lane."""

import random
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from loopgate.abstraction.itinerary import DrawnLeg, Itinerary
from loopgate.errors import ScenarioError
from loopgate.model import StateId
from loopgate.network.loop import HOLD_MARGIN_M, Loop


class StartPosition(NamedTuple):
    """A vehicle's start: index on its path, and arc length of its front [m]."""

    position: int
    front_m: float


def choose_starts(
    itineraries: Sequence[Itinerary],
    *,
    names: Sequence[str],
    vehicle_length_m: float,
    rng: random.Random,
    given_m: Mapping[str, float],
) -> list[StartPosition]:
    """Choose a start state for each vehicle: a private state if possible.

    Raises `ScenarioError` if two vehicles would start in one zone, a given position lies across two states,
    or a loop has no state that is long enough.

    Parameters
    ----------
    itineraries, names
        One of each per vehicle.
    rng
        Chooses among the states.
    given_m
        Arc length of the front for vehicles with a given position, by name.
    """
    visitors: dict[StateId, set[int]] = {}
    for i, itinerary in enumerate(itineraries):
        for leg in itinerary.legs:
            visitors.setdefault(leg.state, set()).add(i)
    choices: list[list[StartPosition]] = []
    for itinerary, name in zip(itineraries, names, strict=True):
        loop = itinerary.loop
        if name in given_m:
            choices.append([_given(itinerary, name, given_m[name], vehicle_length_m)])
            continue
        places = [
            StartPosition(position, front)
            for position, leg in enumerate(itinerary.legs)
            if (front := _place_within(loop, leg, vehicle_length_m)) is not None
        ]
        if not places:
            msg = (
                f"loop {loop.id}: no lane on it has {vehicle_length_m:g} m within one state, so {name} "
                f"cannot start; use a shorter vehicle, longer private pieces, or another loop"
            )
            raise ScenarioError(msg)
        private = [s for s in places if len(visitors[itinerary.legs[s.position].state]) == 1]
        rng.shuffle(places)
        choices.append([rng.choice(private)] if private else places)
    return _match(itineraries, names, choices)


def _match(
    itineraries: Sequence[Itinerary], names: Sequence[str], choices: Sequence[Sequence[StartPosition]]
) -> list[StartPosition]:
    """Give each vehicle one of its choices so that no state is used twice (augmenting paths)."""
    holder: dict[StateId, int] = {}
    chosen: dict[int, StartPosition] = {}

    def state(i: int, start: StartPosition) -> StateId:
        return itineraries[i].legs[start.position].state

    def place(i: int, seen: set[StateId]) -> bool:
        for start in choices[i]:
            here = state(i, start)
            if here in seen:
                continue
            seen.add(here)
            if here not in holder or place(holder[here], seen):
                holder[here] = i
                chosen[i] = start
                return True
        return False

    for i, name in enumerate(names):
        if not place(i, set()):
            zone = state(i, choices[i][0])
            msg = (
                f"vehicles {names[holder[zone]]} and {name} both start in {zone}, which holds one; "
                f"start one elsewhere, leave one out, or use loops that share less (--max-shared)"
            )
            raise ScenarioError(msg)
    return [chosen[i] for i in range(len(names))]


def _given(itinerary: Itinerary, name: str, front_m: float, vehicle_length_m: float) -> StartPosition:
    lap = itinerary.loop.lap_m
    for position, leg in enumerate(itinerary.legs):
        for front in (front_m % lap, front_m % lap - lap):
            if leg.begin_m + vehicle_length_m <= front <= leg.end_m:
                return StartPosition(position, front)
    msg = (
        f"vehicle {name}: at {front_m:.1f} m on {itinerary.loop.id} it stands across two states; "
        f"move it by its length (departPos) or leave the place open"
    )
    raise ScenarioError(msg)


def _place_within(loop: Loop, leg: DrawnLeg, vehicle_length_m: float) -> float | None:
    """Return the middle position for the front within a leg and its longest lane, or None."""
    best: tuple[float, float] | None = None
    for span in loop.spans:
        if span.internal:
            continue
        for shift in (0.0, -loop.length_m):
            low = max(span.begin_m + shift + HOLD_MARGIN_M, leg.begin_m) + vehicle_length_m
            high = min(span.end_m + shift - HOLD_MARGIN_M, leg.end_m)
            if high >= low and (best is None or high - low > best[1] - best[0]):
                best = (low, high)
    return None if best is None else (best[0] + best[1]) / 2.0
