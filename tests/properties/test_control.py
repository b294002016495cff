"""The ledger beside exact answers: the chain rule, its service, and whether anyone waits who could go."""

from __future__ import annotations

from collections import Counter
from random import Random

import pytest
from service_rule import next_mover as next_of_gate
from small_roads import Roads, commuters, figure_eight, one_way_grid, ring, road_system, roundabout, two_rings

from loopgate.control.chain import circle_from, closes, next_mover
from loopgate.control.ledger import Ledger
from loopgate.control.places import Place, Vehicle, path_of
from loopgate.control.rules import usual
from loopgate.errors import SystemModelError
from loopgate.gates.certified.occupancy import Occupancy
from loopgate.gates.certified.system_index import SystemIndex
from loopgate.model import System
from loopgate.research.theory.certificates import keeps_everyone
from loopgate.research.theory.oracle import Oracle, OracleLimitError

SMALL = (ring(3), ring(4), two_rings(3), commuters(3), figure_eight(3))
ROADS = (*SMALL, one_way_grid(), roundabout(3))


def laid_out(system: System, *, everybody: bool = False) -> tuple[Ledger, list[Vehicle]]:
    """Return a ledger of the system's robots where they start."""
    ledger = Ledger(usual(), everybody=everybody)
    everyone = len(system.robots)
    rooms = zip(system.states, system.room, system.private, strict=True)
    places = [Place(name, everyone if alone else room) for name, room, alone in rooms]
    vehicles = []
    for number, path in enumerate(system.paths):
        at = system.initial.positions[number]
        legs = path_of([places[s] for s in path], closed=True)
        vehicles.append(ledger.take_in(system.robots[number].id, legs, at))
    order = {i: n for line in system.initial.queues for n, i in enumerate(line)}
    for place in places:
        place.line.sort(key=lambda vehicle: order.get(vehicle.number, 0))
    return ledger, vehicles


def systems(roads: Roads, most: int) -> list[System]:
    """Return systems on the roads in which everyone can be kept going, from few vehicles to many."""
    found = []
    for capacity in (2, 3):
        for vehicles in range(2, min(most, capacity * len(roads.places))):
            for seed in range(3):
                try:
                    system = road_system(roads, vehicles, capacity, seed=seed)
                except SystemModelError:
                    continue
                if not any(system.private) and keeps_everyone(system):
                    found.append(system)
    return found


@pytest.mark.parametrize("most", [2_000, pytest.param(10_000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("roads", SMALL, ids=lambda roads: roads.name)
def test_the_chain_rule_admits_what_is_safe_and_nothing_else(roads: Roads, most: int) -> None:
    """Every enabled move of random walks, beside a search through all configurations, if there are few."""
    seen: Counter[bool] = Counter()
    for system in systems(roads, 12):
        oracle, rng = Oracle(system, limit=most), Random(1)
        ledger, vehicles = laid_out(system)
        here = system.initial
        try:
            if not oracle.live(here):
                continue
        except OracleLimitError:
            continue
        stand = Occupancy.of(SystemIndex(system), here)
        for _ in range(40):
            can = []
            for robot in (r for r in range(len(vehicles)) if system.enabled(here, r)):
                ours = not closes(vehicles[robot])
                assert ours == oracle.safe(here, robot)
                seen[ours] += 1
                can += [robot] * ours
            assert not any(circle_from(vehicle.leg.place) for vehicle in vehicles)
            served = rng.randrange(len(vehicles))
            mover = next_mover(vehicles[served])
            assert mover is not None
            assert mover.number == next_of_gate(stand, served)
            robot = rng.choice(can)
            ledger._settle(vehicles[robot], again=True)
            here = system.moved(here, robot)
            stand = Occupancy.of(SystemIndex(system), here)
    assert seen[True]
    assert seen[False] or len(roads.loops) == 1


@pytest.mark.parametrize("roads", ROADS, ids=lambda roads: roads.name)
def test_nobody_waits_who_could_go(roads: Roads) -> None:
    """Wake lists let go what asking everybody does, in the same order; vehicles leave on the way.

    A vehicle that a grant of an answer lets go is asked about in the next one.
    """
    reasons: Counter[str] = Counter()
    for system in systems(roads, 20):
        ledger, vehicles = laid_out(system)
        beside, others = laid_out(system, everybody=True)
        rng = Random(2)
        for turn in range(60):
            for number in rng.sample(range(len(vehicles)), rng.randint(1, len(vehicles))):
                if vehicles[number].name in ledger.vehicles:
                    ledger.ask(vehicles[number])
                    beside.ask(others[number])
            if turn % 20 == 19 and len(ledger.vehicles) > 1:
                number = rng.choice([v.number for v in ledger.vehicles.values()])
                ledger.leave(vehicles[number])
                beside.leave(others[number])
            gone = [vehicle.name for vehicle in ledger.answer()]
            assert gone == [vehicle.name for vehicle in beside.answer()]
            for vehicle in ledger.vehicles.values():
                if vehicle.asks and vehicle.leg.place.line[0] is vehicle:
                    assert ledger.why_not(vehicle) or vehicle.woken
                    reasons[vehicle.reason] += 1
        assert ledger.looked_at <= beside.looked_at
    assert reasons["occupied"]
