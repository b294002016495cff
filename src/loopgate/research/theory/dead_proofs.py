"""Following a proof, line by line, that not all robots can get home."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from loopgate.model import Configuration, System
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
