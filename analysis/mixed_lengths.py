"""Long and short vehicles on small roads: do all fit, and does everybody get on? Every configuration of them.

    python analysis/mixed_lengths.py --systems 10000     # some minutes

Vehicles of one to three units of length come to places of some units, drive once or round and round. Between
some places they change lanes, where others may stand while nobody wants to. The ledger answers who may come
and who may move. An oracle of its own, which knows metres and no slots, looks at every configuration that
comes about: whether the vehicles fit into each place by their lengths, and whether each vehicle can go on
from there by moves that the ledger admits.
"""

from __future__ import annotations

import argparse
import random
import sys
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from math import inf
from typing import NamedTuple

from loopgate.cli.terminal import show_progress
from loopgate.control.chain import closes
from loopgate.control.circles import Circles
from loopgate.control.ledger import Ledger
from loopgate.control.places import ChangeStretch, Leg, Make, Place, Vehicle, joined
from loopgate.gates.certified.crowding import SPARE, find_crowd

LEAST = 2
"""Each place holds so many of its longest visitors, or one of them beside a short one, if they come once."""

Standing = tuple[tuple[tuple[int, int], ...], ...]
"""Who stands in each place, first in line first: vehicle, and position on its way."""


class Node(NamedTuple):
    """A configuration: who stands where, and who is still to come; all others have arrived."""

    lines: Standing
    outside: frozenset[int]


@dataclass(frozen=True)
class Vehicles:
    """Vehicles on ways over places.

    `ways`: the places of each vehicle's way. `once`: whether each drives once. `needs`: the length of each.
    `rooms`: the length of each place.

    `before`, `behind`: two lanes before a stretch on which lanes can be changed, and after it; none if there
    is no stretch. `overhang`: its length.
    """

    ways: tuple[tuple[int, ...], ...]
    once: tuple[bool, ...]
    needs: tuple[int, ...]
    rooms: tuple[int, ...]
    before: tuple[int, ...] = ()
    behind: tuple[int, ...] = ()
    overhang: int = 0

    def changes(self, here: int, there: int) -> bool:
        """Return whether a vehicle changes lanes between two places."""
        if here not in self.before or there not in self.behind:
            return False
        return self.before.index(here) != self.behind.index(there)

    @property
    def fitting(self) -> list[int]:
        """How many of its longest visitors fit into each place; into those that nobody visits any two."""
        longest = [1] * len(self.rooms)
        for way, need in zip(self.ways, self.needs, strict=True):
            for place in way:
                longest[place] = max(longest[place], need)
        return [room // need for room, need in zip(self.rooms, longest, strict=True)]

    @property
    def least(self) -> list[int]:
        """How many slots each place has at least."""
        return [max(LEAST, most) for most in self.fitting]

    def ledger(self, node: Node) -> tuple[Ledger, list[list[Leg]]]:
        """Return a ledger in which the vehicles stand like that, and the paths of all."""
        places = [self._place(k) for k in range(len(self.rooms))]
        away, stretch = Place("away", len(self.ways) + 1), ChangeStretch()
        stretch.before = [places[k] for k in self.before]
        stretch.behind = [places[k] for k in self.behind]
        for place in stretch.behind:
            place.stretch = stretch
        paths = []
        for way, once in zip(self.ways, self.once, strict=True):
            legs = [Leg(places[place], k) for k, place in enumerate(way)]
            legs += [Leg(away, len(way))] * once
            for leg, here, there in zip(legs, way, (*way[1:], way[0]), strict=False):
                if self.changes(here, there) and (leg.number < len(way) - 1 or not once):
                    leg.change = leg.nears = stretch
            paths.append(joined(legs, closed=not once))
        ledger = Ledger([])
        ledger.circles = Circles(places)
        for line in node.lines:
            for vehicle, position in line:
                # In which order they came makes no difference, so some stand where there is no slot yet.
                make = self.make(vehicle)
                ledger.take_in(f"{vehicle}", paths[vehicle], position, make, beyond=len(self.ways))
        ledger.answer()  # it finds the circles of ways
        return ledger, paths

    def _place(self, number: int) -> Place:
        most, room = self.fitting[number], float(self.rooms[number])
        kept_m = inf if most >= LEAST else room - LEAST
        return Place(f"{number}", max(LEAST, most), room, 1.0, kept_m, float(self.overhang))

    def is_clear(self, node: Node) -> bool:
        """Return whether nobody stands on the stretch."""
        return all(self._length(node.lines[place]) <= self.rooms[place] for place in self.behind)

    def _length(self, line: tuple[tuple[int, int], ...]) -> int:
        return sum(self.needs[vehicle] for vehicle, _ in line)

    def make(self, vehicle: int) -> Make:
        """Return the properties of a vehicle, without a gap."""
        return Make(float(self.needs[vehicle]), 1.0, 1.0, 1.0, 1.0, 0.0)

    def moved(self, node: Node, place: int) -> Node:
        """Return what comes of it when the first vehicle of a place moves."""
        lines = [list(line) for line in node.lines]
        vehicle, position = lines[place].pop(0)
        after = position + 1
        if not self.once[vehicle]:
            after %= len(self.ways[vehicle])
        if after < len(self.ways[vehicle]):
            lines[self.ways[vehicle][after]].append((vehicle, after))
        return Node(tuple(map(tuple, lines)), node.outside)

    def entered(self, node: Node, vehicle: int) -> Node:
        """Return what comes of it when a vehicle comes."""
        lines = list(node.lines)
        first = self.ways[vehicle][0]
        lines[first] = (*lines[first], (vehicle, 0))
        return Node(tuple(lines), node.outside - {vehicle})

    def fit(self, node: Node) -> bool:
        """Return whether all vehicles fit into their places by their lengths."""
        return all(
            self._length(line) <= room + (self.overhang if place in self.behind else 0)
            for place, (line, room) in enumerate(zip(node.lines, self.rooms, strict=True))
        )


def draw(seed: int, *, loops: bool) -> Vehicles:
    """Draw a system; with `loops`, some vehicles drive round and round.

    Most drive along a ring of places, so that full places can wait for one another.
    """
    rng = random.Random(seed)
    places = rng.randint(2, 5)
    kinds: list[tuple[tuple[int, ...], bool, int]] = []
    for _ in range(rng.randint(2, 4)):
        round_ = loops and rng.random() < 0.5  # noqa: PLR2004  some of them
        first, length = rng.randrange(places), rng.randint(2, places)
        way = [(first + k) % places for k in range(length)]
        if rng.random() < 0.3:  # noqa: PLR2004  the others turn elsewhere
            rng.shuffle(way)
        if not round_ and rng.random() < 0.2:  # noqa: PLR2004  one in five comes twice
            way.append(way[0])
        kinds.append((tuple(way), not round_, rng.choice((1, 1, 2, 3))))
    longest = [max([1, *(need for way, _, need in kinds if place in way)]) for place in range(places)]
    stay = {place for way, once, need in kinds if need > 1 and not once for place in way}
    short = [place not in stay and rng.random() < 0.5 for place in range(places)]  # noqa: PLR2004  half of them
    rooms = tuple(
        most + 1 if is_short else LEAST * most + rng.randint(0, 1)
        for most, is_short in zip(longest, short, strict=True)
    )
    many = rng.randint(3, 9)
    ways, once, needs = zip(*sorted(rng.choice(kinds) for _ in range(many)), strict=True)
    if places < 4 or rng.random() < 0.3:  # noqa: PLR2004  two lanes before the stretch, and two behind it
        return Vehicles(ways, once, needs, rooms)
    lanes = rng.sample(range(places), 4)
    return Vehicles(ways, once, needs, rooms, tuple(lanes[:2]), tuple(lanes[2:]), rng.randint(1, 2))


class Everything:
    """All configurations that come about from empty roads, by the ledger's answers.

    `moves`: for each, the configurations after the moves that the ledger admits, and who moves.
    """

    def __init__(self, vehicles: Vehicles, most: int) -> None:
        self.vehicles = vehicles
        self.admits_fuller = self.decisions = self.stands_on_stretch = self.not_kept = 0
        begin = Node(((),) * len(vehicles.rooms), frozenset(range(len(vehicles.ways))))
        self.moves: dict[Node, list[tuple[int, Node]]] = {}
        self.whole = True
        todo = [begin]
        while todo:
            node = todo.pop()
            if node in self.moves:
                continue
            if len(self.moves) >= most:
                self.whole = False
                return
            self.moves[node], more = self._answers(node)
            todo += [after for _, after in self.moves[node]] + more

    def _answers(self, node: Node) -> tuple[list[tuple[int, Node]], list[Node]]:
        """Return the moves that the ledger admits, and what comes of letting in whom it lets in."""
        vehicles = self.vehicles
        ledger, paths = vehicles.ledger(node)
        moves = []
        for place, line in enumerate(node.lines):
            if not line:
                continue
            head = ledger.vehicles[f"{line[0][0]}"]
            self.decisions += 1
            if self._may_go(node, head) and not closes(head):
                moves.append((line[0][0], vehicles.moved(node, place)))
        more = []
        kinds = set()
        for vehicle in sorted(node.outside):
            kind = vehicles.ways[vehicle], vehicles.once[vehicle], vehicles.needs[vehicle]
            if kind in kinds:
                continue  # which of equal vehicles comes makes no difference
            kinds.add(kind)
            self.decisions += 1
            if ledger.fits(paths[vehicle][0], float(vehicles.needs[vehicle])) and self._may_stay(
                node, vehicle
            ):
                more.append(vehicles.entered(node, vehicle))
        self.stands_on_stretch += not vehicles.is_clear(node)
        self.not_kept += any(one.credits.keys() - one.kept.keys() for one in ledger.vehicles.values())
        least = vehicles.least
        self.admits_fuller += any(len(line) > most for line, most in zip(node.lines, least, strict=True))
        return moves, more

    def _may_go(self, node: Node, head: Vehicle) -> bool:
        """Return whether the next place has room, and nobody stands where a vehicle changes lanes."""
        wanted = head.wanted()
        if head.leg.change is not None and not self.vehicles.is_clear(node):
            return False
        return wanted is None or head.finds_room(wanted)

    def _may_stay(self, node: Node, vehicle: int) -> bool:
        """Return whether condition (S) holds with one more vehicle on a loop."""
        vehicles = self.vehicles
        if vehicles.once[vehicle]:
            return True
        there = [one for line in node.lines for one, _ in line if not vehicles.once[one]]
        loops = [list(vehicles.ways[one]) for one in (*there, vehicle)]
        passing = [list(way) for way, once in zip(vehicles.ways, vehicles.once, strict=True) if once]
        passing = [[*way, len(vehicles.rooms)] for way in passing]
        slots = [max(SPARE, most) for most in (*vehicles.least, len(vehicles.ways) + 1)]
        return find_crowd(loops, slots, passing) is None

    def unfit(self) -> int:
        """Return the number of configurations in which some vehicles do not fit by their lengths."""
        return sum(not self.vehicles.fit(node) for node in self.moves)

    def stuck(self) -> int:
        """Return the number of vehicles that can never move again, summed over all configurations."""
        before: dict[Node, list[Node]] = {node: [] for node in self.moves}
        movers: dict[int, set[Node]] = {}
        for node, moves in self.moves.items():
            for vehicle, after in moves:
                movers.setdefault(vehicle, set()).add(node)
                if after in before:
                    before[after].append(node)
        lost = 0
        for vehicle in range(len(self.vehicles.ways)):
            goes, todo = set[Node](), list(movers.get(vehicle, ()))
            while todo:
                node = todo.pop()
                if node not in goes:
                    goes.add(node)
                    todo += before[node]
            there = {
                node for node in self.moves if any(one == vehicle for line in node.lines for one, _ in line)
            }
            lost += len(there - goes)
        return lost


def look(seeds: Iterable[int], *, loops: bool, most: int) -> Counter[str]:
    """Look at systems, and count what is found."""
    found = Counter[str]({"do not fit": 0, "stuck": 0})
    for seed in seeds:
        every = Everything(draw(seed, loops=loops), most)
        if not every.whole:
            found["too large"] += 1
            continue
        found["places without room for two of the longest"] += sum(
            most < LEAST for most in every.vehicles.fitting
        )
        found["systems"] += 1
        found["configurations"] += len(every.moves)
        found["decisions"] += every.decisions
        found["with more vehicles than the longest"] += every.admits_fuller
        found["with vehicles on a stretch"] += every.stands_on_stretch
        found["with metres not kept where there is no circle"] += every.not_kept
        found["do not fit"] += every.unfit()
        found["stuck"] += every.stuck()
    return found


def main() -> int:
    """Look, print, and return whether anything is wrong."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--systems", type=int, default=2_000, help="half of them with loops")
    parser.add_argument("--most", type=int, default=3_000, help="configurations of a system, at most")
    options = parser.parse_args()
    wrong, half = 0, options.systems // 2
    for loops in (False, True):
        found = Counter[str]()
        with show_progress("systems", total=half) as report:
            for seed in range(half):
                found += look([seed], loops=loops, most=options.most)
                report(seed + 1)
        kind = "loops and trips" if loops else "trips"
        words = ", ".join(f"{count:,} {what}" for what, count in sorted(found.items()))
        sys.stdout.write(f"{kind}: {words}; {found['do not fit']} do not fit, {found['stuck']} stuck\n")
        wrong += found["do not fit"] + found["stuck"]
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
