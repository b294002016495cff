"""Checks the claims of the certified gate, decision by decision, without its code and without a search.

A certificate says for one configuration and one robot whether its move was admitted or refused, and shows
why. Only the model is used here, so that a mistake of the gate's cannot hide in its own checker.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import lru_cache, partial
from typing import Any

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import maximum_bipartite_matching

from loopgate.errors import LoopgateError
from loopgate.model import Configuration, System
from loopgate.research.theory.oracle import Oracle, OracleLimitError
from loopgate.research.theory.places import Places


class Group:
    """Some robots of a system at their positions, without the other robots."""

    def __init__(self, places: Places, at: Mapping[int, int], order: Mapping[int, Sequence[int]]) -> None:
        self.places = places
        self.system: System = places.system
        self.at = dict(at)
        self.order = {s: [i for i in queue if i in at] for s, queue in order.items()}

    @classmethod
    def of(cls, places: Places, configuration: Configuration) -> Group:
        """Return all robots of a configuration."""
        order = dict(zip(places.system.fifo_states, configuration.queues, strict=True))
        return cls(places, dict(enumerate(configuration.positions)), order)

    @classmethod
    def named(cls, places: Places, line: Mapping[str, Any]) -> Group:
        """Return the robots that a line of a proof is about."""
        system = places.system
        number: dict[str, int] = {robot.id: i for i, robot in enumerate(system.robots)}
        at = {number[name]: position for name, position in line["at"].items()}
        order: dict[int, list[int]] = {s: [] for s in system.fifo_states}
        for i in sorted(at):
            if (s := system.paths[i][at[i]]) in order:
                order[s].append(i)
        for name, queue in line.get("order", {}).items():
            s = system.states.index(name)
            given = [number[robot] for robot in queue]
            if sorted(given) != order[s]:
                msg = f"the order in {name} does not name the robots in it"
                raise ValueError(msg)
            order[s] = given
        return cls(places, at, order)

    def state(self, robot: int) -> int:
        """Return where the robot stands."""
        return self.system.paths[robot][self.at[robot]]

    def inside(self, state: int) -> list[int]:
        """Return the robots in a state, in their order if it is FIFO."""
        return self.order[state] if state in self.order else [i for i in self.at if self.state(i) == state]

    def wanted(self, robot: int) -> int | None:
        """Return the state the robot enters next."""
        following = self.system.robots[robot].next_position(self.at[robot])
        return None if following is None else self.system.paths[robot][following]

    def can_move(self, robot: int) -> bool:
        """Return whether the robot's next move breaks neither capacity nor order."""
        wanted, here = self.wanted(robot), self.state(robot)
        if wanted is None or (here in self.order and self.order[here][0] != robot):
            return False
        return len(self.inside(wanted)) < self.system.room[wanted]

    def move(self, robot: int) -> Group:
        """Return the robots after a move, which must be possible."""
        following = self.system.robots[robot].next_position(self.at[robot])
        if following is None or not self.can_move(robot):
            msg = f"{self.system.robots[robot].id} cannot move"
            raise ValueError(msg)
        here = self.state(robot)
        there = Group(self.places, {**self.at, robot: following}, self.order)
        if here in there.order:
            there.order[here].remove(robot)
        if there.state(robot) in there.order:
            there.order[there.state(robot)].append(robot)
        return there

    def includes(self, other: Group) -> bool:
        """Return whether `other` consists of some of these robots, at the same positions."""
        return all(self.at.get(i) == p for i, p in other.at.items()) and all(
            [i for i in self.order[s] if i in other.at] == queue for s, queue in other.order.items()
        )

    def waits_for_good(self, robots: Sequence[int]) -> bool:
        """Return whether `robots` wait for each other: none can move before another one does."""
        among = set(robots)
        done = {i for i in self.at if self.wanted(i) is None}
        return bool(among) and all(self._waits(i, among, done) for i in among)

    def _waits(self, robot: int, among: set[int], done: set[int]) -> bool:
        wanted, here = self.wanted(robot), self.state(robot)
        if wanted is None:
            return False
        if here in self.order and self.order[here][0] != robot:
            ahead = self.order[here][: self.order[here].index(robot)]
            return any(i in among or i in done for i in ahead)
        inside = self.inside(wanted)
        if len(inside) < self.system.room[wanted]:
            return False
        stay = [i in among or i in done for i in inside]
        return stay[0] if wanted in self.order else all(stay)

    def drive(self, robot: int, moves: int) -> Group:
        """Return the group after `moves` of `robot`, which must end where it blocks no other robot."""
        there = self
        if not 0 <= moves <= len(self.system.paths[robot]):
            msg = f"{self.system.robots[robot].id} is to move {moves} times, more than once round"
            raise ValueError(msg)
        for _ in range(moves):
            there = there.move(robot)
        places, goal = self.places, there.state(robot)
        others = [i for i in self.at if i != robot and not places.home(i, self.at[i])]
        ways = {i: places.way_home(i, self.at[i]) for i in others}
        if places.ends_in(robot, there.at[robot]) and not places.hinders_nobody(goal):
            settling = [i for i in others if self._settles(i, goal)]
            passing = [i for i in others if goal in ways[i][: -1 if i in settling else None]]
            inside = [i for i in self.inside(goal) if i != robot]
            harmless = not passing and len(inside) + len(settling) < self.system.room[goal]
        elif places.home(robot, there.at[robot]):
            harmless = True
        else:
            harmless = all(goal not in way for way in ways.values())
        if not harmless:
            msg = f"{self.system.robots[robot].id} may be in the way in {self.system.states[goal]}"
            raise ValueError(msg)
        return there

    def _settles(self, robot: int, state: int) -> bool:
        path = self.system.paths[robot]
        way = self.places.way_home(robot, self.at[robot])
        return path[-1] == state and self.places.ends_in(robot, len(path) - 1) and way[-1:] == [state]


def follow_proof(
    places: Places, proof: Sequence[Mapping[str, Any]], there: Configuration, fail: Callable[[str], None]
) -> None:
    """Check each line of `proof`, up to the last line about `there`; call `fail` with the first fault.

    Lines are those of the certified gate's proofs: ``wait``, ``harmless`` with ``to``, or ``moves``. Each
    refers to earlier lines only, so that no claim rests on itself. O(lines * robots^2 * path).
    """
    number: dict[str, int] = {robot.id: i for i, robot in enumerate(places.system.robots)}
    groups: list[Group] = []
    for n, line in enumerate(proof):
        group = Group.named(places, line)
        try:
            _check_line(group, groups, line, number)
        except (ValueError, KeyError, IndexError) as error:
            fail(f"line {n} of its proof: {error}")
        groups.append(group)
    if not groups or not Group.of(places, there).includes(groups[-1]):
        fail("its proof is about something else")


def _check_line(
    group: Group, before: list[Group], line: Mapping[str, Any], number: Mapping[str, int]
) -> None:
    if "wait" in line:
        if not group.waits_for_good([number[name] for name in line["wait"]]):
            msg = "its robots can move again some day"
            raise ValueError(msg)
        return
    if "harmless" in line:
        for name, moves in line["harmless"]:
            group = group.drive(number[name], moves)
        _expect(group, before, line["to"])
        return
    follow = line["moves"]
    movable = [i for i, p in group.at.items() if not group.places.home(i, p) and group.can_move(i)]
    if all(group.places.home(i, p) for i, p in group.at.items()):
        msg = "everybody is at home"
        raise ValueError(msg)
    for i in movable:
        _expect(group.move(i), before, follow[group.system.robots[i].id])


def _expect(group: Group, before: list[Group], index: int) -> None:
    if not 0 <= index < len(before) or not group.includes(before[index]):
        msg = f"line {index} is not about what follows from it"
        raise ValueError(msg)


@lru_cache(maxsize=16)
def keeps_everyone(system: System) -> bool:
    """Return whether every configuration of the system without a circle of full places is live for everyone.

    That is so where all paths are closed, all shared places are left in order of arrival and hold two or
    more, and (S) holds: no set of places that some loop enters and leaves has more robots who never leave it
    than its slots less two. A robot's own place never blocks: it counts as one that holds two.
    """
    closed = all(r.next_position(len(r.path) - 1) is not None for r in system.robots)
    shared = [s for s, own in enumerate(system.private) if not own]
    wide = all(system.room[s] > 1 for s in shared) and set(shared) == set(system.fifo_states)
    slots = [max(2, room) for room in system.room]
    return closed and wide and leaves_room_for_passers(system.paths, slots)


def leaves_room_for_passers(loops: Sequence[Sequence[int]], slots: Sequence[int]) -> bool:
    """Return whether condition (S) holds for robots on loops over places with given slots.

    By Hall's theorem: iff for each two places of which one follows the other on some loop, all robots can
    stand on their loops at once with two slots of the former empty and the latter without limit. A set that
    has the former, and not the latter, and too many residents is what makes that impossible.
    """
    steps = {(a, b) for loop in loops for a, b in zip(loop, (*loop[1:], loop[0]), strict=True)}
    return all(fits_with_two_empty(loops, slots, empty=a, endless=b) for a, b in sorted(steps))


def fits_with_two_empty(
    loops: Sequence[Sequence[int]], slots: Sequence[int], *, empty: int, endless: int
) -> bool:
    """Return whether all robots can stand on their loops at once, two slots of `empty` left."""
    room = list(slots)
    room[empty] -= 2
    room[endless] = len(loops)
    first = np.cumsum([0, *room])
    rows = [robot for robot, loop in enumerate(loops) for place in set(loop) for _ in range(room[place])]
    slots_of = [np.arange(first[place], first[place + 1]) for loop in loops for place in set(loop)]
    columns = np.concatenate(slots_of) if slots_of else np.zeros(0, dtype=np.int64)
    standing = csr_array((np.ones(len(rows)), (rows, columns)), shape=(len(loops), first[-1]))
    return bool((maximum_bipartite_matching(standing, perm_type="column") >= 0).all())


_MOST_CONFIGURATIONS = 250_000
"""More than the certified gate looks at for one decision, if its budget is not raised."""


class CertificateError(LoopgateError):
    """A certificate that does not prove its claim."""


def check_certificate(system: System, certificate: Mapping[str, Any]) -> None:
    """Check one certificate.

    Raises `CertificateError` if it does not show what it claims; the text says which step fails.

    Parameters
    ----------
    certificate
        ``positions``, ``queues`` (robots by name), ``robot``, ``verdict`` (``admitted`` or ``refused``) and
        ``kind``:

        - ``home``: after ``moves``, which begin with the robot's, every robot is at home.
        - ``round``: after ``approach``, which begins with the robot's move, the ``circle`` moves everybody
          and leads back to where it began.
        - ``rest``: after ``moves`` every robot rests and no full places wait for one another in a circle.
        - ``room``: after ``moves`` every place that can block has a slot free, and who will end has ended.
        - ``chain``: after the robot's move no full places wait for one another in a circle, and the system
          is one in which everyone can go on for ever then.
        - ``wait``: after the robot's move, ``robots`` can never move again.
        - ``dead``: ``proof`` shows line by line that after the robot's move not all can get home.
        - ``no rest``: ``proof`` shows the same for getting to a rest.
        - ``exhausted``: all configurations that can follow were looked at (checked by doing it again).
        - ``full``: after the robot's move ``places`` would be full and wait for one another.
        - ``reserved``: all slots of ``place`` are taken or kept for robots on their way to it.
    """
    try:
        _Check(system, certificate).run()
    except (LookupError, TypeError, ValueError, ArithmeticError, AttributeError) as error:
        msg = f"certificate: malformed ({type(error).__name__}: {error})"
        raise CertificateError(msg) from error


class _Check:
    def __init__(self, system: System, certificate: Mapping[str, Any]) -> None:
        self._system = system
        self._certificate = certificate
        self._number: dict[str, int] = {robot.id: i for i, robot in enumerate(system.robots)}
        self._places = Places(system)
        queues = tuple(tuple(self._number[name] for name in queue) for queue in certificate["queues"])
        self._here = Configuration(tuple(certificate["positions"]), queues)
        self._robot = self._number[certificate["robot"]]

    def run(self) -> None:
        """Check the configuration, then the evidence for this kind of certificate."""
        self._possible()
        kind, verdict = self._certificate["kind"], self._certificate["verdict"]
        admitting = {"home": self._home, "round": self._round, "rest": self._rest}
        admitting |= {"room": self._room, "chain": self._chain}
        no_rest: Callable[[], None] = partial(self._dead, rests=True)
        refusing = {"wait": self._wait, "dead": self._dead, "no rest": no_rest, "full": self._full}
        refusing |= {"exhausted": self._exhausted, "reserved": self._reserved}
        checks = {"admitted": admitting, "refused": refusing}[verdict]
        if kind not in checks:
            self._fail(f"kind {kind!r} does not show that a move is {verdict}")
        checks[kind]()

    def _fail(self, what: str) -> None:
        msg = f"certificate for {self._certificate['robot']}: {what}"
        raise CertificateError(msg)

    def _possible(self) -> None:
        system, here = self._system, self._here
        if len(here.positions) != len(system.robots) or not all(
            0 <= p < len(path) for p, path in zip(here.positions, system.paths, strict=True)
        ):
            self._fail("its positions are none of this system's")
        expected = system.configuration(here.positions).queues
        if [sorted(q) for q in expected] != [sorted(q) for q in here.queues]:
            self._fail("its queues do not hold the robots that stand in them")
        if any(n > room for n, room in zip(system.occupancy(here), system.room, strict=True)):
            self._fail("a state holds more robots than it can")

    def _play(self, here: Configuration, names: Iterable[str]) -> Configuration:
        for step, name in enumerate(names, start=1):
            robot = self._number[name]
            if not self._system.enabled(here, robot):
                self._fail(f"move {step}, of {name}, is not possible there")
            here = self._system.moved(here, robot)
        return here

    def _begins(self, names: Sequence[str]) -> None:
        if names[:1] != [self._certificate["robot"]]:
            self._fail("its moves do not begin with the one that was asked for")

    def _home(self) -> None:
        moves = self._certificate["moves"]
        self._begins(moves)
        end = self._play(self._here, moves)
        for i, p in enumerate(end.positions):
            if not self._places.home(i, p):
                self._fail(f"{self._system.robots[i].id} is not at home in the end")

    def _round(self) -> None:
        approach, circle = self._certificate["approach"], self._certificate["circle"]
        self._begins(approach)
        start = self._play(self._here, approach)
        if self._play(start, circle) != start:
            self._fail("its circle does not lead back to where it began")
        for i, robot in enumerate(self._system.robots):
            if robot.id not in circle and not self._system.finished(start, i):
                self._fail(f"{robot.id} does not move in the circle")

    def _rest(self) -> None:
        moves = self._certificate["moves"]
        self._begins(moves)
        end = self._play(self._here, moves)
        for i, p in enumerate(end.positions):
            if not self._places.rest(i, p):
                self._fail(f"{self._system.robots[i].id} does not rest in the end")
        jammed = self._places.jammed(end)
        if jammed:
            names = ", ".join(self._system.states[s] for s in jammed)
            self._fail(f"in the end the full places {names} wait for one another")

    def _room(self) -> None:
        moves, system = self._certificate["moves"], self._system
        self._begins(moves)
        end = self._play(self._here, moves)
        for i, p in enumerate(end.positions):
            ends = self._places.ends_in(i, len(system.paths[i]) - 1)
            if ends and not (self._places.ends_in(i, p) and self._places.hinders_nobody(system.paths[i][p])):
                self._fail(f"{system.robots[i].id} has not ended out of the way in the end")
        for s, inside in enumerate(system.occupancy(end)):
            if inside >= system.room[s] and not self._places.hinders_nobody(s):
                self._fail(f"{system.states[s]} has no slot free in the end")

    def _chain(self) -> None:
        if not keeps_everyone(self._system):
            self._fail("that full places wait in no circle is not enough for everyone to go on here")
        jammed = self._places.jammed(self._after())
        if jammed:
            names = ", ".join(self._system.states[s] for s in jammed)
            self._fail(f"after it the full places {names} wait for one another")

    def _after(self) -> Configuration:
        return self._play(self._here, [self._certificate["robot"]])

    def _wait(self) -> None:
        there = self._after()
        robots = [self._number[name] for name in self._certificate["robots"]]
        if not Group.of(self._places, there).waits_for_good(robots):
            self._fail("its robots can move again some day")

    def _dead(self, *, rests: bool = False) -> None:
        places = Places(self._system, rests=rests)
        follow_proof(places, self._certificate["proof"], self._after(), self._fail)

    def _exhausted(self) -> None:
        try:
            live = Oracle(self._system, limit=_MOST_CONFIGURATIONS).live(self._after())
        except OracleLimitError:
            self._fail(f"more than {_MOST_CONFIGURATIONS} configurations follow, which no gate looks through")
            return
        if live:
            self._fail("everybody can go on for ever from there")

    def _full(self) -> None:
        there = self._after()
        places = [self._system.states.index(name) for name in self._certificate["places"]]
        if not self._places.closed_jam(there, places):
            self._fail("its places are not full, or do not wait for one another")

    def _reserved(self) -> None:
        place = self._system.states.index(self._certificate["place"])
        if self._places.held(self._here, place) < self._system.room[place]:
            self._fail(f"{self._certificate['place']} has a slot left")
