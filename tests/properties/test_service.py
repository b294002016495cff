"""The service rule on small roads with crossings: the vehicle that must move next, and that it is enough."""

from __future__ import annotations

import random
from collections.abc import Iterator
from math import inf

import pytest
from crossed_roads import CrossedRoads, Unfair
from keeping_cases import movers_seen
from small_roads import (
    Roads,
    commuters,
    figure_eight,
    one_way_grid,
    road_system,
    roundabout,
    two_rings,
    two_way_grid,
)

from loopgate.errors import SystemModelError, UnsafeStartError
from loopgate.gates.certified.occupancy import Occupancy
from loopgate.gates.certified.system_index import SystemIndex
from loopgate.model import System

ROADS = (two_rings(3), commuters(3), figure_eight(3), one_way_grid(), two_way_grid(), roundabout(3))
PATIENCE_S = 15.0
FOR_S = 400
SOON_S = 150.0
"""Longer than any wait on these roads under the service, though the longest is of tens of moves by others."""


def crowded(roads: Roads) -> Iterator[tuple[System, int]]:
    """Yield systems with few free slots, each with a seed."""
    for capacity in (2, 3):
        most = capacity * len(roads.places)
        for vehicles in range(most * 2 // 3, most):
            seed = vehicles % 3
            try:
                system = road_system(roads, vehicles, capacity, seed=seed)
                CrossedRoads(system, seed, serve_after_s=inf)
            except (SystemModelError, UnsafeStartError):
                continue
            yield system, seed


def flash(world: CrossedRoads) -> None:
    """Let lights be green for a vehicle for three seconds in every twenty, in the second to come."""
    at_s = world.now_s + 1.0
    red = [one.name for i, one in enumerate(world.vehicles) if (at_s + 7 * i) % 20 >= 3]
    world.hand.withhold("red", *red)


@pytest.mark.parametrize("roads", ROADS, ids=lambda roads: roads.name)
def test_the_vehicle_that_must_move_next_is_the_one_that_the_rule_of_the_gate_names(roads: Roads) -> None:
    """For the oldest request, in every second in which a vehicle is served."""
    served = 0
    for system, seed in crowded(roads):
        world = CrossedRoads(system, seed, serve_after_s=PATIENCE_S, negotiation=Unfair({seed}))
        served += movers_seen(world, PATIENCE_S, FOR_S // 2)
    assert served


@pytest.mark.parametrize("roads", ROADS, ids=lambda roads: roads.name)
def test_nobody_is_kept_waiting_by_a_negotiation_that_never_lets_it_go(roads: Roads) -> None:
    """Two vehicles are never let go by it. They are granted all the same; without service they stand."""
    starved = 0
    for system, seed in crowded(roads):
        never = set(random.Random(seed).sample(range(len(system.robots)), 2))
        fair = CrossedRoads(system, seed, serve_after_s=PATIENCE_S, negotiation=Unfair(never))
        fair.drive(FOR_S)
        assert max(fair.longest_s) < SOON_S
        unfair = CrossedRoads(system, seed, serve_after_s=inf, negotiation=Unfair(never))
        unfair.drive(FOR_S)
        starved += max(unfair.longest_s) > FOR_S - SOON_S
    assert starved


@pytest.mark.parametrize("roads", ROADS[:4], ids=lambda roads: roads.name)
def test_nobody_is_kept_waiting_by_lights_that_turn_green_again_and_again(roads: Roads) -> None:
    """Seventeen of twenty seconds are red, and others may cross in the three that are green."""
    for system, seed in list(crowded(roads))[::3]:
        world = CrossedRoads(system, seed, serve_after_s=PATIENCE_S, negotiation=Unfair({seed}))
        for _ in range(3 * FOR_S):
            flash(world)
            world.drive(1)
        assert max(world.longest_s) < 5 * SOON_S
        assert min(world.moves) > 0


def way_length(here: Occupancy, robot: int) -> int:
    """Return how many full places lead from the robot's to the first with room."""
    head, length, room = robot, 0, here.layout.room
    while here.count[there := here.wanted(head)] >= room[there]:
        head, length = here.queue[there][0], length + 1
    return length


@pytest.mark.parametrize("roads", ROADS, ids=lambda roads: roads.name)
def test_the_way_of_the_oldest_only_gets_shorter(roads: Roads) -> None:
    """From second to second, as long as its service has met no circle, whatever the lights show."""
    shorter = 0
    for system, seed in crowded(roads):
        layout = SystemIndex(system)
        world = CrossedRoads(system, seed, serve_after_s=PATIENCE_S)
        before: dict[int, int] = {}
        for _ in range(FOR_S // 2):
            flash(world)
            world.let_ask()
            oldest = world.oldest(PATIENCE_S)
            world.decide()
            after = Occupancy.of(layout, world.hand.configuration())
            if (
                oldest is None
                or not world.vehicles[oldest].asks
                or world.vehicles[oldest] in world.hand.ledger.keeping._turned
            ):
                before = {}
                continue
            length = way_length(after, oldest)
            shorter += length < before.get(oldest, length)
            assert length <= before.get(oldest, length)
            before = {oldest: length}
    assert shorter
