"""The certified gate as agents: the robots of a component keep the witness together."""

import random
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field

from loopgate.errors import GateError, IllegalMoveError
from loopgate.gates.certified.system_index import SystemIndex
from loopgate.model import Configuration, Robot, System
from loopgate.research.agents.member import Member
from loopgate.research.agents.messages import Kind
from loopgate.research.agents.network import Link, MessageNetwork


@dataclass(slots=True)
class CertifiedRun:
    """The result of a run of certified agents."""

    moves: list[tuple[int, int]] = field(default_factory=list)
    """Robots in the order in which they moved, with the time [ticks]."""
    last: Configuration | None = None
    """Where everybody stands at the end."""
    coordinators: list[int] = field(default_factory=list)
    """Robots that coordinated, in order."""
    messages: Counter[Kind] = field(default_factory=Counter)
    """Copies sent, by kind."""

    @property
    def messages_per_move(self) -> float:
        """Copies sent per move made."""
        return self.messages.total() / max(1, len(self.moves))


def components(system: System) -> list[list[int]]:
    """Return the robots in groups that share no state with each other, in order of their first robot."""
    groups: list[tuple[set[int], set[int]]] = []
    for i, path in enumerate(system.paths):
        states = set(path)
        touching = [group for group in groups if group[1] & states]
        merged = ({i}.union(*(g[0] for g in touching)), states.union(*(g[1] for g in touching)))
        groups = [group for group in groups if group not in touching]
        groups.append(merged)
    return sorted(sorted(robots) for robots, _ in groups)


def run_certified_agents(
    system: System,
    *,
    ticks: int,
    seed: int,
    link: Link | None = None,
    failures: Mapping[int, int] | None = None,
) -> CertifiedRun:
    """Let the robots of one component drive, agreeing by messages only.

    Raises `IllegalMoveError` if ever a move is made that capacity or order forbid in the world as it is: a
    collision; `GateError` if a robot has no home.

    Parameters
    ----------
    system
        One component; every robot has a home.
    ticks
        How long; delays are in the same unit.
    failures
        When a robot breaks down for good.
    """
    if SystemIndex(system).homeless:
        msg = (
            f"certified agents: robots {SystemIndex(system).names(SystemIndex(system).homeless)} have no home"
        )
        raise GateError(msg)
    run = CertifiedRun(last=system.initial)
    network = MessageNetwork(link or Link(delay=(0.2, 0.8)), random.Random(seed))
    now = 0

    def drive(robot: int) -> None:
        here = run.last or system.initial
        if not system.enabled(here, robot):
            msg = f"robot {system.robots[robot].id}: it was granted a move that is not possible at {now}"
            raise IllegalMoveError(msg)
        run.last = system.moved(here, robot)
        run.moves.append((robot, now))

    members = [Member(i, system, network, drive) for i in range(len(system.robots))]
    for tick in range(ticks):
        now = tick
        for robot, when in (failures or {}).items():
            if when == tick:
                members[robot].fail()
        for member in members:
            member.tick(tick)
            if member.leading and run.coordinators[-1:] != [member.robot]:
                run.coordinators.append(member.robot)
        network.run(tick + 1)
    run.messages = network.sent
    return run


def part(system: System, robots: list[int]) -> System:
    """Return the system of some of the robots, such as one component."""
    chosen: list[Robot] = [system.robots[i] for i in robots]
    used = {s for robot in chosen for s in robot.path}
    capacity = {name: room for name, room in system.capacity.items() if name in used}
    return System(chosen, capacity, [s for s in sorted(system.fifo) if s in used])
