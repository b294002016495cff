"""The chain rule as the ledger asks it, beside an oracle that has seen all configurations, and the gate."""

from __future__ import annotations

from collections import Counter
from random import Random

import pytest
from by_hand import ByHand
from everyone import draw
from road_oracle import Lines, Reach
from road_oracle import Roads as Drawn
from small_roads import (
    Roads,
    commuters,
    figure_eight,
    one_way_grid,
    ring,
    road_system,
    roundabout,
    two_rings,
    two_way_grid,
)

from loopgate.abstraction.itinerary import DrawnLeg
from loopgate.control.chain import circle_from, closes, closes_by_entering, next_mover
from loopgate.control.places import Leg, Place, Vehicle, path_of
from loopgate.errors import SystemModelError, UnsafeStartError
from loopgate.gates import make_gate
from loopgate.gates.certified import CertifiedGate
from loopgate.model import System
from loopgate.negotiation.simple import OldestFirst

ROADS = (
    ring(4),
    two_rings(3),
    commuters(3),
    figure_eight(3),
    one_way_grid(),
    two_way_grid(),
    roundabout(3),
    roundabout(4),
)
MOST = 400
"""The most configurations of a system that is looked at."""
MOVES = 150


class Stand:
    """Places of drawn roads, in which vehicles stand as they are told."""

    def __init__(self, roads: Drawn) -> None:
        self.roads = roads
        self.places = [Place(f"p{number}", slots) for number, slots in enumerate(roads.slots)]
        self._paths = [path_of([self.places[p] for p in loop], closed=True) for loop in roads.loops]
        self._one = {
            (loop, leg.number): Vehicle(0, f"{loop} {leg.number}", leg)
            for loop, path in enumerate(self._paths)
            for leg in path
        }

    def leg(self, entry: tuple[int, int]) -> Leg:
        """Return the leg on which a vehicle stands."""
        return self._one[entry].leg

    def put(self, here: Lines) -> None:
        """Let vehicles stand so; those on the same loop in the same place are one object."""
        for place, line in zip(self.places, here, strict=True):
            place.line = [self._one[entry] for entry in line]


def look(roads: Drawn, reach: Reach, found: Counter[str]) -> None:
    """Compare each move of each live configuration, and whether one more vehicle may come in anywhere."""
    stand = Stand(roads)
    for here, live in zip(reach.all, reach.live.tolist(), strict=True):
        if not live:
            continue
        stand.put(here)
        for number, there in roads.moves(here):
            circle = closes(stand.places[number].line[0])
            assert (not circle) == bool(reach.live[reach.number[there]])
            found["refused" if circle else "let go"] += 1
        for place in stand.places:
            assert not circle_from(place)
            if place.line:
                mover = next_mover(place.line[0])
                assert mover is not None
                assert not closes(mover)
        for loop, path in enumerate(roads.loops):
            for position, number in enumerate(path):
                if len(here[number]) < roads.slots[number]:
                    lines = list(here)
                    lines[number] = (*lines[number], (loop, position))
                    circled = roads.circle(tuple(lines))
                    assert closes_by_entering(stand.leg((loop, position))) == circled
                    found["may not come" if circled else "may come"] += 1


@pytest.mark.parametrize("systems", [800, pytest.param(2500, marks=pytest.mark.slow)])
def test_every_move_of_small_systems_is_judged_as_all_configurations_say(systems: int) -> None:
    """Whatever the rule lets go can go on for ever, all of it, and it lets go whatever can."""
    found: Counter[str] = Counter()
    for seed in range(systems):
        roads = draw(seed, narrow=False)
        if not any(roads.start) or roads.crowded():
            continue
        try:
            reach = Reach(roads, MOST)
        except OverflowError:
            continue
        found["systems"] += 1
        look(roads, reach, found)
    assert found["systems"] > systems // 3
    rarest = min(found[what] for what in ("refused", "let go", "may not come", "may come"))
    assert rarest > 1000 / 2500 * systems


def walk(system: System, seed: int) -> int:
    """Make random moves, all judged by rule and gate before each; return how many are refused."""
    gate = make_gate("certified:promise=somebody", system)
    assert isinstance(gate, CertifiedGate)
    assert gate.by_chain_alone
    legs = [
        [DrawnLeg(system.states[s], 10.0 * k, 10.0 * k + 9.0) for k, s in enumerate(path)]
        for path in system.paths
    ]
    hand = ByHand(system, legs, gate, OldestFirst(Random(0)), serve_after_s=0.0)
    vehicles = sorted(hand.ledger.vehicles.values(), key=lambda one: one.number)
    rng, refused = Random(seed), 0
    for second in range(MOVES):
        can = []
        for one in vehicles:
            wanted = one.wanted()
            assert wanted is not None
            if one.leg.place.line[0] is one and len(wanted.line) < wanted.slots:
                lets_go = not closes(one)
                assert lets_go == gate.decide_here(one.number).admitted
                refused += not lets_go
                can += [one] * lets_go
        chosen = rng.choice(can)  # some vehicle can always move
        hand.asks(chosen.name, float(second))
        assert hand.decide(float(second)) == [(chosen.name, "granted")]
        hand.cleared(chosen.name)
        hand.waits(chosen.name)
        gate.moved_here(chosen.number)
    return refused


@pytest.mark.parametrize("roads", ROADS, ids=lambda roads: roads.name)
def test_the_chain_rule_of_the_ledger_is_the_gates(roads: Roads) -> None:
    """Every decision of long walks, from few vehicles to as many as the gate takes; some are refused."""
    refused = 0
    for capacity in (2, 3):
        for vehicles in range(2, capacity * len(roads.places)):
            for seed in range(2):
                try:
                    system = road_system(roads, vehicles, capacity, seed=seed)
                    make_gate("certified:promise=somebody", system)
                except (SystemModelError, UnsafeStartError):
                    continue
                if not any(system.private):
                    refused += walk(system, seed)
    assert refused or len(roads.loops) == 1


def test_a_place_that_holds_one_is_left_to_the_gate() -> None:
    """There the exact stage has a say."""
    system = road_system(ring(4), 3, lambda place: 1 if place == "p0" else 2)
    gate = make_gate("certified", system)
    assert isinstance(gate, CertifiedGate)
    assert not gate.by_chain_alone
