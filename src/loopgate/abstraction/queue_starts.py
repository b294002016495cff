"""Where vehicles stand at the beginning on queues: every place keeps a slot free, so no circle is closed."""

import random
from collections import deque
from collections.abc import Mapping, Sequence

from loopgate.abstraction.itinerary import Itinerary
from loopgate.errors import TooManyVehiclesError
from loopgate.network.loop import HOLD_MARGIN_M
from loopgate.network.vehicle_type import VehicleType

ABSTRACTION = "queues"

FIRST_M = 7.0
"""Room before the stop line at the start [m]: a vehicle drives for one step before it can be held."""

_SPREAD_M = 0.3
"""The room that standing vehicles keep at the start beyond their gaps [m]."""


def startable(length_m: float, needed_m: float, capacity: int) -> int:
    """Return how many vehicles may start on a place: one fewer than it holds, and fewer on a tight one.

    With a slot free everywhere no place is full, hence no circle of full places: the start is live.
    """
    fitting = int((length_m - HOLD_MARGIN_M - _first_m(length_m, needed_m)) / (needed_m + _SPREAD_M))
    return max(1, min(capacity - 1, fitting))


def slots_m(length_m: float, needed_m: float, types: Sequence[VehicleType]) -> list[float]:
    """Return the positions of the fronts on a lane [m], for vehicles from the head on."""
    front = length_m - HOLD_MARGIN_M - _first_m(length_m, needed_m)
    fronts: list[float] = []
    for number, kind in enumerate(types):
        if number:
            # The gap is that of the follower: SUMO counts less than that as a collision.
            front -= types[number - 1].length_m + kind.min_gap_m + _SPREAD_M
        fronts.append(front)
    return fronts


def _first_m(length_m: float, needed_m: float) -> float:
    return min(FIRST_M, length_m - HOLD_MARGIN_M - needed_m)


def choose_places(
    itineraries: Sequence[Itinerary],
    most: Mapping[str, int],
    *,
    names: Sequence[str],
    wishes: Mapping[int, int],
    rng: random.Random,
) -> list[int]:
    """Choose for each vehicle the position on its path at which it starts.

    A vehicle takes a place at random among those with room; where its loop has none left, vehicles already
    placed move to other places of theirs (augmenting paths), so a start is found whenever there is one.
    Raises `TooManyVehiclesError` if there are more vehicles than places; it says how many there is room for.

    Parameters
    ----------
    itineraries
        One per vehicle.
    most
        How many vehicles may start on each place.
    wishes
        Position on the path for vehicles whose place is given, by number; they move on where it is full.
    rng
        Draws the place of each other vehicle.
    """
    taken: dict[str, list[int]] = {}
    chosen: dict[int, int] = {}
    for number, itinerary in enumerate(itineraries):
        positions = list(range(len(itinerary.legs)))
        if number in wishes:
            first = wishes[number]
            positions = positions[first:] + positions[:first]
        else:
            rng.shuffle(positions)
        if not _place(number, positions, itineraries, most, taken, chosen):
            raise TooManyVehiclesError(
                ABSTRACTION,
                vehicles=len(itineraries),
                loops=len({itinerary.loop for itinerary in itineraries}),
                fitting=number,
                name=names[number],
            )
    return [chosen[number] for number in range(len(itineraries))]


def _place(
    number: int,
    positions: Sequence[int],
    itineraries: Sequence[Itinerary],
    most: Mapping[str, int],
    taken: dict[str, list[int]],
    chosen: dict[int, int],
) -> bool:
    """Find a place for one vehicle, moving others along an augmenting path if it must (breadth first)."""
    came: dict[str, tuple[int, int]] = {}
    open_: deque[str] = deque()

    def reach(robot: int, order: Sequence[int]) -> None:
        for position in order:
            state = str(itineraries[robot].legs[position].state)
            if state not in came:
                came[state] = (robot, position)
                open_.append(state)

    reach(number, positions)
    while open_:
        state = open_.popleft()
        if len(taken.get(state, ())) < most[state]:
            while True:
                robot, position = came[state]
                before = chosen.get(robot)
                taken.setdefault(state, []).append(robot)
                chosen[robot] = position
                if before is None:
                    return True
                state = str(itineraries[robot].legs[before].state)
                taken[state].remove(robot)
        for robot in taken[state]:
            reach(robot, range(len(itineraries[robot].legs)))
    return False
