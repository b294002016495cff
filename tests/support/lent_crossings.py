"""Drawn junctions with lights between them, and vehicles that stand there: what lending must keep.

A way leads from a lane over one or two lanes inside a joined crossing to a lane behind it. Before each
movement inside there may be a light. The vehicles are moved by an adversary: as far as it likes in each step,
but never through a red light, into the vehicle ahead, or on while they are held. It knows cells, not foes:
parts of two movements on which no two bodies may be at a time.

A way may also lead over short places between two crossings. A vehicle that comes there while another leaves
may stand on its crossing until that one is out.
"""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Iterable
from itertools import combinations, pairwise
from math import inf
from typing import Final, NamedTuple

from fake_traffic import FakeTraffic

from loopgate.abstraction.itinerary import Crossing, DrawnLeg
from loopgate.control.lamps import Lamp, Signal
from loopgate.control.layout import PlaceLayout
from loopgate.control.ledger import Ledger
from loopgate.control.lending import Lending
from loopgate.control.lights import Lights
from loopgate.control.places import GrantedPass, Make, Vehicle
from loopgate.control.rules import crossing, room
from loopgate.model import StateId
from loopgate.traffic.base import Light, Phase, Program

LONG_M: Final = 5.0
MOVEMENT_M: Final = 6.0
PLACE_M: Final = 20.0
SHORT_M: Final = 12.5
"""A place between two crossings fits two vehicles with their gaps, and no more [m]."""
GAP_M: Final = 1.0
PARTED_M: Final = 4.0
"""So far beyond a lane, the rear of a vehicle is no longer in the way of the vehicles that leave it."""

Span = tuple[float, float]


class Way(NamedTuple):
    """A way: lanes and movements in order, with their begins and ends as arc lengths [m]."""

    lanes: tuple[str, ...]
    pieces: dict[str, Span]


class Town:
    """A drawn system, its vehicles, and the gate."""

    def __init__(self, seed: int, *, lends: bool = True, between: int = 0) -> None:
        self.rng = rng = random.Random(seed)
        inside = [f"l{k}" for k in range(rng.randint(1, 3))]
        long_m = {lane: float(rng.choice((6, 9, 14))) for lane in inside}
        long_m |= {f"m{k}": SHORT_M for k in range(between)}
        draw = self._way_between if between else self._way
        self.ways = [draw(rng, inside, long_m) for _ in range(rng.randint(3, 6))]
        moves = sorted({f"{a}>{b}" for way in self.ways for a, b in pairwise(way.lanes)})
        self.cells = self._cells(rng, moves)
        self.traffic = FakeTraffic({})
        lit = [move for move in moves if move[0] in "lm" and rng.random() < 0.8]
        self.fixed = rng.random() < 0.5
        self.period = {move: (rng.randint(0, 9), rng.randint(6, 15)) for move in lit}
        self._shine()
        signals = {move: Signal(Lamp(move, self.traffic), 0, 10.0) for move in lit}
        legs = [self._legs(way) for way in self.ways]
        slots = {str(leg.state): 99 if leg.away else 2 for way in legs for leg in way}
        layout = PlaceLayout(slots, legs, signals)
        self.paths = [layout.path(way) for way in legs]
        self.ledger = Ledger([room, crossing])
        self.lights, self.lending = Lights(self.traffic), Lending(self.traffic, self.ledger)
        self.lends = lends
        self.way_of: dict[Vehicle, Way] = {}
        self.found: Counter[str] = Counter()
        self.made = self.crammed = 0

    @staticmethod
    def _way(rng: random.Random, inside: list[str], long_m: dict[str, float]) -> Way:
        between = rng.sample(inside, rng.randint(1, min(2, len(inside)))) if rng.random() < 0.8 else []
        return _drawn((f"a{rng.randint(0, 2)}", *between, f"e{rng.randint(0, 2)}"), long_m)

    @staticmethod
    def _way_between(rng: random.Random, inside: list[str], long_m: dict[str, float]) -> Way:
        """Draw a way over one or more places between crossings; it has no lane twice."""
        places = [lane for lane in long_m if lane not in inside]
        lanes, spare = [f"a{rng.randint(0, 2)}"], rng.sample(inside, len(inside))
        for place in (*rng.sample(places, rng.randint(1, len(places))), f"e{rng.randint(0, 2)}"):
            number = rng.randint(0, min(2, len(spare)))
            lanes += [*spare[:number], place]
            del spare[:number]
        return _drawn(tuple(lanes), long_m)

    @staticmethod
    def _cells(rng: random.Random, moves: list[str]) -> dict[tuple[str, str], tuple[Span, Span]]:
        """Draw for pairs of movements the parts that they share: where they merge, part or cross."""
        cells: dict[tuple[str, str], tuple[Span, Span]] = {}
        for one, other in combinations(moves, 2):
            (a, b), (c, d) = one.split(">"), other.split(">")
            if a == c:
                if rng.random() < 0.4:
                    continue
                cells[one, other] = (0.0, PARTED_M - 1.0), (0.0, PARTED_M - 1.0)
            elif b == d:
                cells[one, other] = (3.0, MOVEMENT_M), (3.0, MOVEMENT_M)
            elif rng.random() < 0.5:
                starts = float(rng.randint(0, 4)), float(rng.randint(0, 4))
                cells[one, other] = (starts[0], starts[0] + 2.0), (starts[1], starts[1] + 2.0)
        return cells | {(other, one): (b, a) for (one, other), (a, b) in cells.items()}

    def _legs(self, way: Way) -> tuple[DrawnLeg, ...]:
        legs: list[DrawnLeg] = []
        over: list[Crossing] = []
        here, (begin_m, end_m) = way.lanes[0], way.pieces[way.lanes[0]]
        for piece, (from_m, to_m) in [*way.pieces.items()][1:]:
            if ">" in piece:
                ahead_m = from_m - end_m
                shared = {other: part for (one, other), (part, _) in self.cells.items() if one == piece}
                foes = {other: (low + ahead_m, high + ahead_m) for other, (low, high) in shared.items()}
                over.append(Crossing(piece, frozenset(foes), foes, 10.0, ahead_m))
            elif not piece.startswith("l"):
                legs.append(DrawnLeg(StateId(here), begin_m, end_m, tuple(over)))
                over, here, begin_m, end_m = [], piece, from_m, to_m
        legs.append(DrawnLeg(StateId(here), begin_m, end_m))
        return (*legs, DrawnLeg(StateId("away"), end_m, inf, away=True))

    def _shine(self) -> None:
        """Set the lights of the next step."""
        now_s = int(self.traffic.now_s)
        for move, (offset, half) in self.period.items():
            turn, spent = divmod(now_s + offset, half)
            letters = "Gr" if turn % 2 else "rG"
            changes_s = now_s + half - 1 - spent if self.fixed else now_s
            self.traffic.lights[move] = Light(letters[0], float(changes_s), letters, 0)
            phases = Phase(letters[0], half, 1), Phase(letters[1], half, 0)
            self.traffic.programs[move] = Program(phases, fixed=self.fixed)

    def step(self, *, comes: bool) -> None:
        """Let a vehicle come, the gate answer, and the adversary move the vehicles."""
        self.traffic.now_s += 1.0
        self._shine()
        if comes:
            self._comes()
        for vehicle in self.ledger.vehicles.values():
            near = vehicle.leg.after is not None and vehicle.front_m > vehicle.line_m - 6.0
            if near and vehicle.leg.place.line[0] is vehicle:
                self.ledger.ask(vehicle)
        gone = self.ledger.answer(self.traffic.now_s)
        self.crammed += sum(len(one.leg.place.bodies) > one.leg.place.slots for one in gone)
        self.lights.look(gone, [])
        if self.lends:
            self.lending.look(self.lights.at_red)
        for vehicle in [one for one in self.way_of if one.leg.after is None]:
            self.ledger.leave(vehicle)
            self.lending.forget(vehicle)
            self.lights.forget(vehicle)
            del self.way_of[vehicle]
            self.found["arrived"] += 1
        for vehicle in self.rng.sample(list(self.way_of), len(self.way_of)):
            self._move(vehicle)
        self._check()

    def _comes(self) -> None:
        number = self.rng.randrange(len(self.ways))
        leg = self.paths[number][0]
        if leg.place.is_full() or any(one.front_m < 3 * LONG_M for one in leg.place.line):
            return
        name, self.made = f"v{self.made}", self.made + 1
        make = Make(LONG_M, 2.0, 4.0, 10.0, 1.0, GAP_M, foreseen=False)
        vehicle = self.ledger.take_in(name, self.paths[number], 0, make, 1000.0)
        vehicle.front_m = LONG_M
        if any(self._room(vehicle, self.ways[number], other) < 0.0 for other in self.way_of):
            self.ledger.leave(vehicle)
            return
        self.way_of[vehicle] = self.ways[number]

    def _move(self, vehicle: Vehicle) -> None:
        """Move a vehicle as far as the adversary likes and may."""
        far_m = 0.0 if vehicle.name in self.traffic.standing else float(self.rng.choice((0, 1, 2, 3, 3)))
        end_m = vehicle.line_m if vehicle.leg.after is not None else inf
        stops_m = [end_m - vehicle.front_m]
        for trip in vehicle.trips:
            stops_m += [trip.light_m - vehicle.front_m] if self._is_red(trip, vehicle) else []
        way = self.way_of[vehicle]
        stops_m += [self._room(vehicle, way, other) for other in self.way_of if other is not vehicle]
        far_m = max(0.0, min(far_m, *stops_m))
        vehicle.front_m += far_m
        vehicle.speed = far_m
        if vehicle.front_m >= vehicle.due_m or vehicle.trips or len(vehicle.bodies) > 1:
            self.ledger.passed(vehicle)

    def _is_red(self, trip: GrantedPass, vehicle: Vehicle) -> bool:
        move = trip.over.movement.name
        return move in self.period and vehicle.front_m <= trip.light_m and self._next(move) == "r"

    def _next(self, move: str) -> str:
        """Return the letter that a light shows in the step that is driven now."""
        offset, half = self.period[move]
        return "Gr"[0 if (int(self.traffic.now_s) + 1 + offset) // half % 2 else 1]

    def _room(self, vehicle: Vehicle, way: Way, other: Vehicle) -> float:
        """Return how far a vehicle may go behind another that is ahead on a piece of its way [m]."""
        theirs, room_m = self.way_of[other], inf
        rear_m = other.front_m - LONG_M
        for name, (begin_m, end_m) in way.pieces.items():
            if name not in theirs.pieces or vehicle.front_m - LONG_M >= end_m:
                continue
            shift_m = begin_m - theirs.pieces[name][0]
            ahead = other.front_m + shift_m > max(begin_m, vehicle.front_m)
            tail_m = PARTED_M if ">" not in name else 0.0
            if ahead and rear_m + shift_m < end_m + tail_m:
                room_m = min(room_m, rear_m + shift_m - GAP_M - vehicle.front_m)
        return room_m

    def _check(self) -> None:
        """Count bodies on one cell, other than of vehicles that follow each other out of one lane."""
        at = {vehicle: self._on(vehicle, way) for vehicle, way in self.way_of.items()}
        for one, other in combinations(at, 2):
            for move, (low, high) in at[one].items():
                for foe, (left, right) in at[other].items():
                    (a, b), (c, d) = self.cells.get((move, foe), ((inf, inf), (inf, inf)))
                    apart = move.partition(">")[0] != foe.partition(">")[0]
                    if apart and low < b and high > a and left < d and right > c:
                        self.found["touch"] += 1

    def _on(self, vehicle: Vehicle, way: Way) -> dict[str, Span]:
        """Return the movements on which a vehicle is, and from where to where [m]."""
        front_m, rear_m = vehicle.front_m, vehicle.front_m - LONG_M
        return {
            name: (rear_m - begin_m, front_m - begin_m)
            for name, (begin_m, end_m) in way.pieces.items()
            if ">" in name and rear_m < end_m and front_m > begin_m
        }

    def run(self, steps: int = 150, empties_in: int = 1500) -> Counter[str]:
        """Drive for so many steps while vehicles come, then until the last has arrived, at most so long."""
        for _ in range(steps):
            self.step(comes=True)
        for _ in range(empties_in):
            if not self.way_of:
                break
            self.step(comes=False)
        self.found["stuck"] += bool(self.way_of)
        self.found["follows out"] += self.crammed
        self.found["lent"] += self.lending.lent
        self.found["trespasses"] += self.ledger.trespasses
        return self.found


def _drawn(lanes: tuple[str, ...], long_m: dict[str, float]) -> Way:
    """Return the way over these lanes."""
    pieces, at_m = {lanes[0]: (0.0, PLACE_M)}, PLACE_M
    for before, lane in pairwise(lanes):
        pieces[f"{before}>{lane}"] = at_m, at_m + MOVEMENT_M
        at_m += MOVEMENT_M
        pieces[lane] = at_m, at_m + long_m.get(lane, PLACE_M)
        at_m = pieces[lane][1]
    return Way(lanes, pieces)


def look(seeds: Iterable[int], *, lends: bool = True, between: int = 0) -> Counter[str]:
    """Return what happens in drawn systems, one for each seed.

    `between`: how many places lie between crossings.
    """
    found: Counter[str] = Counter()
    for seed in seeds:
        found += Town(seed, lends=lends, between=between).run()
    return found
