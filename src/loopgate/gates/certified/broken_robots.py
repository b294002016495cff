"""The part of a system that is left when robots have broken down for good."""

from loopgate.errors import UnsafeStartError
from loopgate.gates.certified.banker import reduce_to_core
from loopgate.gates.certified.gate import CertifiedGate
from loopgate.gates.certified.occupancy import Occupancy
from loopgate.gates.certified.system_index import SystemIndex
from loopgate.model import Configuration, Robot, System


class Remainder:
    """The robots that can still move, in a system of their own.

    A robot that has broken down stays where it is and takes a slot for good. Who has to pass a state that is
    closed by that drives on to the last home before it and stays there; who has none before it stays where
    it is, and takes a slot as well. All others go on as before.

    Parameters
    ----------
    system, configuration
        The system, and where everybody stands.
    broken
        The robots that have broken down.
    lost
        States that lose a slot besides: where one may still stand that broke down while it moved.

    Attributes
    ----------
    broken
        These and the robots directly behind them that cannot get anywhere.
    gate
        A certified gate for the others, whose promise is to everyone of them; None if nobody is left.
    """

    def __init__(
        self,
        system: System,
        configuration: Configuration,
        broken: frozenset[int],
        lost: tuple[int, ...] = (),
    ) -> None:
        self._full = system
        self._lost = lost
        self.gate: CertifiedGate | None = None
        self._home = SystemIndex(system).home
        self.broken = broken
        while True:
            self._robots = [i for i in range(len(system.robots)) if i not in self.broken]
            self._base: dict[int, int] = {}
            stuck = self._build(configuration)
            if not stuck:
                return
            self.broken |= stuck

    def _build(self, configuration: Configuration) -> frozenset[int]:
        """Make the system and its gate; return robots that turn out to be stuck instead."""
        full = self._full
        room = list(full.room)
        queued = set[int]()
        for s in [*self._lost, *(full.state_at(configuration, i) for i in sorted(self.broken))]:
            room[s] -= 1
            if s in full.fifo_states:
                queued.add(s)
        closed = {s for s in range(len(room)) if room[s] < 1} | queued
        robots: list[Robot] = []
        stuck: set[int] = set()
        for i in self._robots:
            robot = self._shortened(i, configuration.positions[i], closed)
            if robot is None:
                stuck.add(i)
            else:
                robots.append(robot)
        if stuck or not robots:
            self.gate = None
            return frozenset(stuck)
        used = {s for robot in robots for s in robot.path}
        capacity = {name: room[s] for s, name in enumerate(full.states) if name in used and room[s] > 1}
        self.system = System(robots, capacity, [s for s in full.fifo if s in used])
        try:
            self.gate = CertifiedGate(self.system, promise="everyone", patience=0)
        except UnsafeStartError:
            return frozenset(self._who_cannot_get_home())
        return frozenset()

    def _who_cannot_get_home(self) -> list[int]:
        """Return the robots that Banker's rule does not bring home; all, where that names none."""
        layout = SystemIndex(self.system)
        _, core = reduce_to_core(
            Occupancy.of(layout, self.system.initial), list(range(len(self.system.robots)))
        )
        return [self._robots[k] for k in core] or self._robots[:]

    def _shortened(self, robot: int, position: int, closed: set[int]) -> Robot | None:
        full = self._full
        whole, path = full.robots[robot], full.paths[robot]
        if closed.isdisjoint(path):
            return Robot(whole.id, whole.path, closed=whole.closed, start=position)
        last = -1
        ahead: list[int] = []
        here: int | None = position
        while here is not None and len(ahead) < len(path) and (not ahead or path[here] not in closed):
            if self._home[robot][here]:
                last = len(ahead)
            ahead.append(here)
            here = whole.next_position(here)
        if last < 0 or path[position] in closed:
            return None
        self._base[robot] = position
        return Robot(whole.id, tuple(whole.path[p] for p in ahead[: last + 1]), closed=False)

    def admits(self, configuration: Configuration, robot: int) -> bool:
        """Return whether the robot may make its next move in a configuration of the whole system."""
        if self.gate is None or robot in self.broken:
            return False
        positions = [
            (configuration.positions[i] - self._base[i]) % len(self._full.paths[i])
            if i in self._base
            else configuration.positions[i]
            for i in self._robots
        ]
        full = self._full
        queue_of = dict(zip(full.fifo_states, configuration.queues, strict=True))
        queues = tuple(
            tuple(self._robots.index(i) for i in queue_of[full.states.index(self.system.states[t])])
            for t in self.system.fifo_states
        )
        here = Configuration(tuple(positions), queues)
        return self.gate.decide(here, self._robots.index(robot)).admitted
