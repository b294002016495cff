"""The queues abstraction: lanes become places with capacity, junctions become crossings between them."""

import random
from collections import deque
from collections.abc import Mapping, Sequence

from loopgate.abstraction.itinerary import Abstraction, Itinerary
from loopgate.abstraction.queue_layout import QueueLayout, lay_out_queues
from loopgate.errors import TooManyVehiclesError
from loopgate.model import Robot, RobotId, StateId, System
from loopgate.network.loop import Loop
from loopgate.network.road import RoadNetwork
from loopgate.network.vehicle_type import DEFAULT_TYPE, VehicleType

_NEVER_FULL = 2
"""Free slots at the end of an open route when all vehicles have arrived."""


def make_queues(
    network: RoadNetwork,
    loops: Sequence[Loop],
    types: Sequence[VehicleType] = (),
    *,
    seed: int = 1,
    names: Sequence[str] | None = None,
    starts_m: Mapping[str, float] | None = None,
    later: Sequence[tuple[Loop, VehicleType]] = (),
    own_lengths: bool = False,
) -> Abstraction:
    """Abstract loops to vehicles that queue on lanes, and place the vehicles.

    A lane with at least two slots is a place: a FIFO state whose capacity is ``floor(usable length / (vehicle
    length + gap))``, computed for its longest visitors. Everything between two places is the crossing:
    movements over junctions, change stretches, narrow streets, and lanes too short to wait on. A vehicle
    never waits on a crossing: it takes the whole crossing and a slot of the next place at once.

    Raises `ScenarioError` if a loop cannot be cut into queues, or more vehicles are given than can start; the
    text says why, and how many can start.

    Parameters
    ----------
    loops
        One per vehicle; a loop may occur several times.
    types
        One per vehicle; SUMO's default type for all if empty.
    seed
        Seed of the starting places.
    names
        One per vehicle; ``v1``, ``v2``, ... if not given.
    starts_m
        Arc length of the front for vehicles with a given position, by name: they start on that lane, or
        on the next of their lanes with a free slot, in line with the others.
    later
        Loop and type of vehicles that join later. They take no places yet, but their places and crossings
        are made.
    own_lengths
        Whether vehicles keep their extra metres ahead, as under the chain rule.
    """
    kinds = list(types) or [DEFAULT_TYPE] * len(loops)
    called = list(names) if names is not None else [f"v{k + 1}" for k in range(len(loops))]
    users = [*zip(loops, kinds, strict=True), *later]
    layout = lay_out_queues(network, users, counted=True, own_lengths=own_lengths)
    itineraries = [layout.itineraries[loop.id] for loop in loops]
    given = starts_m or {}
    wishes = {k: _leg_at(itineraries[k], given[name]) for k, name in enumerate(called) if name in given}
    most = most_at_start(layout)
    try:
        positions = choose_places(itineraries, most, names=called, wishes=wishes, rng=random.Random(seed))
    except TooManyVehiclesError as error:
        raise _told_exactly(network, loops, kinds, called, error) from None
    lines: dict[str, list[int]] = {}
    for k, (itinerary, position) in enumerate(zip(itineraries, positions, strict=True)):
        lines.setdefault(str(itinerary.legs[position].state), []).append(k)
    fronts = [0.0] * len(loops)
    for name, line in lines.items():
        for k, slot in zip(line, layout.places[name].slots_m([kinds[k] for k in line]), strict=True):
            fronts[k] = itineraries[k].legs[positions[k]].begin_m + slot
    robots = [
        Robot(RobotId(name), tuple(leg.state for leg in itinerary.legs), start=position)
        for name, itinerary, position in zip(called, itineraries, positions, strict=True)
    ]
    everybody = len(loops) + len(later) + _NEVER_FULL
    room = {name: everybody if place.away else place.capacity for name, place in layout.places.items()}
    visited = {state for robot in robots for state in robot.path}
    capacity = {StateId(name): most for name, most in room.items() if name in visited}
    return Abstraction(
        name="queues",
        system=System(robots, capacity, capacity.keys()),
        itineraries=tuple(itineraries),
        starts_m=tuple(fronts),
        later=tuple(layout.itineraries[loop.id] for loop, _ in later),
        room=room,
        rooms={name: place.room for name, place in layout.places.items() if place.room is not None},
    )


def _told_exactly(
    network: RoadNetwork,
    loops: Sequence[Loop],
    kinds: Sequence[VehicleType],
    names: Sequence[str],
    error: TooManyVehiclesError,
) -> TooManyVehiclesError:
    """Return the error with the largest number of first vehicles that can start.

    Without the later vehicles, places may have more slots, since the longest visitors may be missing. Slots
    only become fewer with each vehicle. What the error says is near, so longer and longer steps lead from
    there to a number that is too large, and bisection then finds it.
    """
    low, high = error.fitting, error.vehicles - 1
    if len({kind.needed_m for kind in kinds}) == 1 and low >= error.loops:
        return error
    step = 1
    while low < high:
        count = min(low + step, (low + high + 1) // 2)
        layout = lay_out_queues(network, list(zip(loops[:count], kinds[:count], strict=True)), counted=True)
        ways = [layout.itineraries[loop.id] for loop in loops[:count]]
        try:
            choose_places(ways, most_at_start(layout), names=names, wishes={}, rng=random.Random(0))
            low, step = count, 2 * step
        except TooManyVehiclesError as less:
            low, high, step = max(low, less.fitting), count - 1, 1
    return TooManyVehiclesError(vehicles=error.vehicles, loops=error.loops, fitting=low, name=names[low])


def most_at_start(layout: QueueLayout) -> dict[str, int]:
    """Return the largest number of vehicles that may start on each place, by the place's name."""
    return {name: place.at_start for name, place in layout.places.items()}


def _leg_at(itinerary: Itinerary, arc_m: float) -> int:
    """Return the first leg whose end does not lie before an arc length."""
    arc = arc_m % itinerary.loop.lap_m
    return next((k for k, leg in enumerate(itinerary.legs) if leg.end_m >= arc), 0)


def choose_places(
    itineraries: Sequence[Itinerary],
    most: Mapping[str, int],
    *,
    names: Sequence[str],
    wishes: Mapping[int, int],
    rng: random.Random,
) -> list[int]:
    """Choose for each vehicle the index on its path at which it starts.

    A vehicle takes a random place with a free slot. If its loop has none left, vehicles already placed move
    to other places (augmenting paths), so a start is found whenever there is one. Raises
    `TooManyVehiclesError` if there are more vehicles than places; it says how many fit.

    Parameters
    ----------
    itineraries
        One per vehicle.
    most
        How many vehicles may start on each place.
    wishes
        Index on the path for vehicles with a given place, by number; they move on where it is full.
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
                vehicles=len(itineraries),
                loops=len({itinerary.loop.id for itinerary in itineraries}),
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
