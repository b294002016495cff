"""Small road systems which vehicles enter and leave, looked at configuration by configuration."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import NamedTuple

from loopgate.errors import GateError, SystemModelError
from loopgate.gates import Gate, make_gate
from loopgate.gates.certified import CertifiedGate
from loopgate.gates.certified import chain as rule
from loopgate.gates.certified.crowding import SPARE, find_crowd
from loopgate.model import Configuration, Robot, RobotId, StateId, System

AWAY = StateId("away")

Lines = tuple[tuple[int, ...], ...]
"""Who stands in each place, first in line first."""


class Node(NamedTuple):
    """A configuration: who stands where, and who is still to come; all others have arrived."""

    lines: Lines
    outside: frozenset[int]


@dataclass(frozen=True)
class Comers:
    """Vehicles on ways over places, some driven once; where a place holds one the gate searches."""

    ways: tuple[tuple[int, ...], ...]
    once: tuple[bool, ...]
    slots: tuple[int, ...]
    _gates: dict[frozenset[int], tuple[System, Gate, list[int]]] = field(default_factory=dict)
    _taken: dict[object, bool] = field(default_factory=dict)

    @property
    def wide(self) -> bool:
        """Whether every place holds two, so that the chain rule decides alone, as in a run."""
        return min(self.slots) > 1

    @property
    def begin(self) -> Node:
        """Nobody is there yet."""
        return Node(((),) * len(self.slots), frozenset(range(len(self.ways))))

    def following(self, place: int, robot: int) -> int | None:
        """Return the place that a vehicle wants next, None if it is about to arrive."""
        way = self.ways[robot]
        after = way.index(place) + 1
        return None if self.once[robot] and after == len(way) else way[after % len(way)]

    def moves(self, lines: Lines) -> dict[int, Lines]:
        """Return where the moves lead that there is room for, whatever a gate says."""
        found = {}
        for place, line in enumerate(lines):
            if line:
                there = list(lines)
                there[place] = line[1:]
                wanted = self.following(place, line[0])
                if wanted is not None:
                    if len(lines[wanted]) >= self.slots[wanted]:
                        continue
                    there[wanted] = (*lines[wanted], line[0])
                found[line[0]] = tuple(there)
        return found

    def entered(self, node: Node, robot: int) -> Node:
        """Return what comes of it when a vehicle enters behind all others in its first place."""
        lines, first = list(node.lines), self.ways[robot][0]
        lines[first] = (*lines[first], robot)
        return Node(tuple(lines), node.outside - {robot})

    def admitted(self, node: Node) -> dict[int, Lines]:
        """Return where the moves lead that the gate admits."""
        moves = self.moves(node.lines)
        if not moves:
            return {}
        system, gate, members = self._gate(node)
        here = self._configuration(system, members, node)
        return {
            robot: there for robot, there in moves.items() if gate.decide(here, members.index(robot)).admitted
        }

    def may_enter(self, node: Node, robot: int) -> bool:
        """Return whether a run lets a vehicle in: by the walk along full places, or by a gate made anew."""
        first = self.ways[robot][0]
        if len(node.lines[first]) >= self.slots[first]:
            return False
        if self.wide and self.once[robot]:
            wanted = self.following(first, robot)
            standing = _Standing(self, node.lines)
            return not rule.closes_by_entering(
                standing,
                first,
                free=self.slots[first] - len(node.lines[first]),
                onward=standing.away if wanted is None else wanted,
            )
        there = self.entered(node, robot)
        key = there.lines, None if self.wide else there.outside
        if key not in self._taken:
            self._taken[key] = self._takes(there)
        return self._taken[key]

    def _takes(self, node: Node) -> bool:
        """Return whether a gate can be made for those who are there."""
        try:
            members = [robot for line in node.lines for robot in line]
            system = self._system(node, members if self.wide else self._members(node))
            gate = make_gate("certified", system)
        except (GateError, SystemModelError):
            return False
        passing = [self._names(robot) for robot, once in enumerate(self.once) if once]
        if not self.wide or all(self.once) or not passing or getattr(gate, "promise", "") != "everyone":
            return True
        number = {state: place for place, state in enumerate(system.states)}
        ways = [[number.get(state, len(number)) for state in way] for way in passing]
        return find_crowd(system.paths, [max(SPARE, room) for room in system.room], ways) is None

    def _members(self, node: Node) -> list[int]:
        """Return whom the gate knows.

        By the chain rule alone it is the same for all who drive once, be they there or not. Else it is made
        for those who have come, and has who has arrived stay away.
        """
        there = [robot for line in node.lines for robot in line]
        gone = [robot for robot in range(len(self.ways)) if robot not in there and robot not in node.outside]
        if self.wide:
            others = [robot for robot, once in enumerate(self.once) if once and robot not in there]
            return [*there, *others]
        return [*there, *gone]

    def _gate(self, node: Node) -> tuple[System, Gate, list[int]]:
        """Return the gate for those who are there, the first time made for how they stand."""
        members = self._members(node)
        key = frozenset(members)
        if key not in self._gates:
            start = node
            if self.wide:  # without those who drive once no circle can be there
                loops = tuple(tuple(r for r in line if not self.once[r]) for line in node.lines)
                start = Node(loops, node.outside)
            system = self._system(start, members)
            gate = make_gate("certified:promise=somebody" if self.wide else "certified", system)
            assert isinstance(gate, CertifiedGate)
            if self.wide:
                assert gate.by_chain_alone
            else:
                assert gate.promise == "everyone"
            self._gates[key] = system, gate, members
        return self._gates[key]

    def _names(self, robot: int) -> tuple[StateId, ...]:
        return (*(StateId(f"p{place}") for place in self.ways[robot]), *((AWAY,) if self.once[robot] else ()))

    def _path(self, robot: int) -> tuple[StateId, ...]:
        """Return a way as states; by the chain rule it comes from a state outside, and goes round to that."""
        if self.wide and self.once[robot]:
            return (StateId(f"outside{robot}"), *self._names(robot))
        return self._names(robot)

    def _position(self, node: Node, robot: int) -> int:
        ahead = int(self.wide and self.once[robot])
        for place, line in enumerate(node.lines):
            if robot in line:
                return ahead + self.ways[robot].index(place)
        return 0 if self.wide else len(self.ways[robot])

    def _system(self, node: Node, members: Sequence[int]) -> System:
        robots = [
            Robot(
                RobotId(f"r{robot}"),
                self._path(robot),
                closed=self.wide or not self.once[robot],
                start=self._position(node, robot),
            )
            for robot in members
        ]
        visited = {state for robot in robots for state in robot.path}
        room = {StateId(f"p{place}"): most for place, most in enumerate(self.slots)}
        room[AWAY] = len(self.ways) + 2
        in_order = visited - {AWAY} if not self.wide else visited
        return System(robots, {state: room.get(state, 1) for state in visited}, in_order)

    def _configuration(self, system: System, members: list[int], node: Node) -> Configuration:
        lines = {StateId(f"p{place}"): line for place, line in enumerate(node.lines)}
        queues = (lines.get(system.states[state], ()) for state in system.fifo_states)
        return Configuration(
            tuple(self._position(node, robot) for robot in members),
            tuple(tuple(members.index(robot) for robot in line) for line in queues),
        )


class _Standing:
    """Lines as the entry rule has them; the place behind the last is away."""

    def __init__(self, comers: Comers, lines: Lines) -> None:
        self._comers, self._lines = comers, lines
        self.away = len(lines)

    def free(self, state: int) -> int:
        return self._comers.slots[state] - len(self._lines[state]) if state < self.away else 1

    def first(self, state: int) -> int | None:
        return self._lines[state][0] if state < self.away and self._lines[state] else None

    def wanted(self, robot: int) -> int:
        place = next(place for place, line in enumerate(self._lines) if robot in line)
        following = self._comers.following(place, robot)
        return self.away if following is None else following


class Everything:
    """All configurations that come about by the gate and the rule of entry.

    Parameters
    ----------
    comers
        The vehicles.
    most
        So many configurations are looked at.

    Raises
    ------
    OverflowError
        If they are too many.
    """

    def __init__(self, comers: Comers, most: int) -> None:
        self.comers = comers
        self.moves: dict[Node, dict[int, Node]] = {}
        self.entries: dict[Node, dict[int, Node]] = {}
        todo = [comers.begin]
        while todo:
            node = todo.pop()
            if node in self.moves:
                continue
            if len(self.moves) >= most:
                msg = "too many configurations"
                raise OverflowError(msg)
            self.moves[node] = {
                robot: Node(lines, node.outside) for robot, lines in comers.admitted(node).items()
            }
            self.entries[node] = {
                robot: comers.entered(node, robot) for robot in node.outside if comers.may_enter(node, robot)
            }
            todo += [*self.moves[node].values(), *self.entries[node].values()]

    def stuck(self) -> set[Node]:
        """Return from where not all who are there can arrive, or go on if they are on loops, nobody entering.

        And, where every place holds two or all drive once, from where not all can come and arrive who do.
        """
        comers = self.comers
        bad = self.moves.keys() - self._leads_to(lambda node: not self._under_way(node), entering=False)
        if comers.wide or all(comers.once):
            bad |= self.moves.keys() - self._leads_to(
                lambda node: not self._under_way(node) and all(not comers.once[r] for r in node.outside),
                entering=True,
            )
        loops = [robot for robot, once in enumerate(comers.once) if not once]
        return bad.union(*(self._left_behind(robot) for robot in loops))

    def _left_behind(self, robot: int) -> set[Node]:
        """Return from where one that is there can never move again."""
        goes_on = self._leads_to(lambda node: robot in self.moves[node], entering=False)
        return {node for node in self.moves if robot not in node.outside} - goes_on

    def _under_way(self, node: Node) -> list[int]:
        return [robot for line in node.lines for robot in line if self.comers.once[robot]]

    def _leads_to(self, goal: Callable[[Node], object], *, entering: bool) -> set[Node]:
        """Return from where one of these can be reached."""
        before: dict[Node, list[Node]] = {node: [] for node in self.moves}
        for node, moves in self.moves.items():
            for there in (*moves.values(), *(self.entries[node].values() if entering else ())):
                before[there].append(node)
        found = {node for node in self.moves if goal(node)}
        todo = list(found)
        while todo:
            new = set(before[todo.pop()]) - found
            found |= new
            todo += new
        return found

    @property
    def decided(self) -> int:
        """How many moves and entries there was room for."""
        return sum(len(self._tries(node)) for node in self.moves)

    def refused(self) -> tuple[int, int, int]:
        """Return of moves and entries of who all drive once: how many are safe, refused although, unsafe.

        Safe is what leaves all who are there a way to arrive.
        """
        safe = needless = unsafe = 0
        known: dict[Lines, bool] = {}
        for node in self.moves:
            for yes, there in self._tries(node):
                good = self._can_arrive(there, known)
                safe += good
                needless += good and not yes
                unsafe += yes and not good
        return safe, needless, unsafe

    def _tries(self, node: Node) -> list[tuple[bool, Lines]]:
        """Return of each move and entry that there is room for whether it is admitted, and where it leads."""
        comers, moves, entries = self.comers, self.moves[node], self.entries[node]
        first = {robot: comers.ways[robot][0] for robot in node.outside}
        free = [robot for robot, place in first.items() if len(node.lines[place]) < comers.slots[place]]
        tries = [(robot in moves, there) for robot, there in comers.moves(node.lines).items()]
        return [*tries, *((robot in entries, comers.entered(node, robot).lines) for robot in free)]

    def _can_arrive(self, lines: Lines, known: dict[Lines, bool]) -> bool:
        if lines not in known:
            known[lines] = not any(lines) or any(
                self._can_arrive(there, known) for there in self.comers.moves(lines).values()
            )
        return known[lines]


def draw(seed: int, *, loops: bool, least: int) -> Comers:
    """Draw vehicles over a few places that hold `least` to 3, some on loops if asked for."""
    rng = random.Random(seed)
    places = rng.choice((2, 2, 2, 3, 4))
    number = 4 if places == 2 else rng.randint(2, 3)
    slots = tuple(rng.choice((least, least, least, least, 2, 3)) for _ in range(places))
    stay = rng.randint(1, number - 1) if loops else 0
    loop = rng.sample(range(places), rng.randint(2, min(3, places)))
    ways = [loop[k % len(loop) :] + loop[: k % len(loop)] for k in range(stay)]
    ways += [rng.sample(range(places), rng.randint(1, places)) for _ in range(number - stay)]
    return Comers(tuple(map(tuple, ways)), tuple(k >= stay for k in range(number)), slots)


def explored(seeds: Iterable[int], *, loops: bool, least: int, most: int) -> Iterator[Everything]:
    """Yield what comes about in the systems of these seeds that have no more configurations than `most`."""
    for seed in seeds:
        with suppress(OverflowError):
            yield Everything(draw(seed, loops=loops, least=least), most)
