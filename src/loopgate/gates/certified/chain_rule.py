"""The chain rule for systems with places of several slots, connected by narrow places of one slot."""

from collections.abc import Callable
from typing import Any

from loopgate.gates.base import Decision, Reason, refusal
from loopgate.gates.certified.chain import follow
from loopgate.gates.certified.homes import Homes
from loopgate.gates.certified.liveness_proof import LivenessProof
from loopgate.gates.certified.occupancy import Occupancy
from loopgate.gates.certified.proof import dead_after
from loopgate.gates.certified.search import Budget
from loopgate.gates.certified.system_index import SystemIndex
from loopgate.gates.deadlocks import deadlocked
from loopgate.model import Configuration, System

_FREE = Decision(admitted=True, reason=Reason.FREE, stage="chain")


class ChainRule(LivenessProof):
    """The chain rule as a proof of the promise that no circular wait ever forms.

    A place of two slots or more is *wide*. A robot *rests* in a wide place, or at a home, where it never
    blocks another robot. A robot between two rests has a reserved slot in the rest to which it drives, and
    the witness of `Homes` keeps its path there open. Seen from the rests only, each full place waits for the
    place that its first robot wants next. A move that fills a place is admitted if and only if it closes no
    circle of full places.

    Parameters
    ----------
    system
        Every robot must have a rest on its path.
    budget
        See `Homes`.

    Notes
    -----
    Sound by Reveliotis, Lawley and Ferreira (IEEE TAC 42(10), 1997): with two slots or more in each place, a
    state without circular wait always has a move that leads to another. O(length of the chain of full places)
    per decision where all places are wide.

    Where the chain decides alone and no set of places is crowded (see `loopgate.gates.certified.crowding`), a
    configuration without a circle is live for *everyone*, and the same rule promises that.
    """

    def __init__(self, system: System, budget: Budget) -> None:
        layout = SystemIndex(system, rests=True)
        super().__init__(layout)
        self._wide = layout.wide
        self._narrow = Homes(layout, budget)
        self.for_everyone = False
        self._held: list[int] = []
        self._coming: dict[int, list[int]] = {}
        self._rest = [self._rests(i) for i in range(len(layout.path))]
        self._after = [self._next_rests(i) for i in range(len(layout.path))]

    @property
    def by_chain_alone(self) -> bool:
        """Whether the chain of full places decides every move: all states are private, or wide."""
        layout = self.layout
        waits = zip(layout.fifo, self._wide, layout.system.private, strict=True)
        rests = all((fifo and wide) or private for fifo, wide, private in waits)
        return rests and all(map(all, layout.straight))

    def _rests(self, robot: int) -> list[int]:
        """Return, by position, the rest in which the robot stands or to which it drives."""
        path = self.layout.path[robot]
        return [path[self._rest_position(robot, p)] for p in range(len(path))]

    def _next_rests(self, robot: int) -> list[int]:
        """Return, by position, the rest after that of `_rests`, or -1."""
        follow = self.layout.follow[robot]
        leaving = [follow[self._rest_position(robot, p)] for p in range(len(follow))]
        return [-1 if q < 0 else self._rest[robot][q] for q in leaving]

    def _rest_position(self, robot: int, position: int) -> int:
        for _ in range(self.layout.steps[robot][position]):
            position = self.layout.follow[robot][position]
        return position

    def begin(self, configuration: Configuration, stand: Occupancy) -> bool:
        """Start in `configuration`; return False if it has a circular wait or a robot has no way home."""
        layout = self.layout
        self._held = [0] * len(layout.room)
        self._coming = {s: [] for s, wide in enumerate(self._wide) if wide}
        for i, p in enumerate(stand.at):
            rest = self._rest[i][p]
            self._held[rest] += 1
            if self._wide[rest] and not layout.home[i][p]:
                self._coming[rest].append(i)
        if any(self._held[s] > layout.room[s] for s in self._coming) or self.jammed(stand):
            return False
        found = self._narrow.begin(configuration, stand)
        self.missing = self._narrow.missing
        return found

    def jammed(self, stand: Occupancy) -> list[int]:
        """Return the full wide places that can never again lose a robot, ascending."""
        full = [s for s in self._coming if self._held[s] >= self.layout.room[s]]
        waits: dict[int, list[list[int]]] = {}
        for s in full:
            leavers, every = self._leavers(stand, s)
            goals = [self._after[i][stand.at[i]] for i in leavers]
            waits[s] = [[goal] for goal in goals] if every and goals else [goals]
        return sorted(deadlocked(waits))

    def _leavers(self, stand: Occupancy, place: int) -> tuple[list[int], bool]:
        """Return the robots of which one leaves `place` next, and whether it may be any of them.

        From a place with a line, it is the first robot in line that does not return at once. Without such a
        robot it is the first robot to arrive, which is not known yet.
        """
        after, at = self._after, stand.at
        line = stand.queue.get(place)
        if line is not None:
            for i in line:
                if after[i][at[i]] != place:
                    return [i], False
            return [i for i in self._coming[place] if after[i][at[i]] != place], True
        inside = [*stand.occupants(place), *self._coming[place]]
        return [i for i in inside if after[i][at[i]] not in (place, -1)], False

    def judge(self, configuration: Configuration, stand: Occupancy, robot: int) -> Decision:
        """Decide the next move of `robot`, which capacity and order allow."""
        return self.at_once(stand, robot) or self._narrow.judge(configuration, stand, robot)

    def at_once(self, stand: Occupancy, robot: int) -> Decision | None:
        """Decide by the chain rule alone; None if the way over narrow places matters too."""
        p = stand.at[robot]
        if self.layout.home[robot][p]:
            target = self._after[robot][p]
            if self._wide[target] and target != self._rest[robot][p]:
                held = self._held[target] + 1
                room = self.layout.room[target]
                if held > room:
                    detail = "its slots are kept for robots on their way to it"
                    return refusal(Reason.OCCUPIED, detail, "chain", self._coming[target])
                if held == room:
                    circle = self.closes(stand, robot, target)
                    if circle:
                        return self._refuse(stand, circle)
            if self.layout.straight[robot][p]:
                return _FREE
        return None

    def closes(self, stand: Occupancy, robot: int, target: int) -> list[int]:
        """Return the circle of full places that the robot's move to `target` would close."""

        def first(place: int) -> int | None:
            leavers, unsure = self._leavers(stand, place)
            if place == target and (unsure or target not in stand.queue):
                return None  # the robot itself may leave it next
            return leavers[0] if len(leavers) == 1 else None

        left = self._rest[robot][stand.at[robot]]
        full = follow(_Rests(stand, self._held, first, self._after), target, entered=target, left=left)
        if full.places and first(full.places[-1]) is None:
            return self._closes_any(stand, robot, left, target)
        return full.circle()

    def _closes_any(self, stand: Occupancy, robot: int, left: int, target: int) -> list[int]:
        """Return the result of `closes` where several robots may leave a place next.

        Places that can become free are removed one after the other.
        """
        there = stand.after(robot)
        on_its_way = not self.layout.home[robot][there.at[robot]]
        if on_its_way:
            self._coming[target].append(robot)
        self._held[target] += 1
        self._held[left] -= 1
        stuck = self.jammed(there)
        self._held[target] -= 1
        self._held[left] += 1
        if on_its_way:
            self._coming[target].pop()
        return stuck

    def _refuse(self, stand: Occupancy, circle: list[int]) -> Decision:
        states = self.layout.system.states
        heads = [leavers[0] for s in circle if (leavers := self._leavers(stand, s)[0])]
        detail = "full places in a circle: " + " -> ".join(states[s] for s in circle)
        return refusal(Reason.DEADLOCK, detail, "chain", heads)

    def moved(self, robot: int, before: int) -> bool:
        """Record that `robot` moved from the position `before`; return False if no witness is known."""
        after = self.layout.follow[robot][before]
        rested, rests = self.layout.home[robot][before], self.layout.home[robot][after]
        target = self._rest[robot][after]
        if rested:
            self._held[self._rest[robot][before]] -= 1
            self._held[target] += 1
            if not rests and self._wide[target]:
                self._coming[target].append(robot)
            if self.layout.straight[robot][before]:
                self._narrow.forget_verdicts()
                return True
        elif rests and self._wide[target]:
            self._coming[target].remove(robot)
        return self._narrow.moved(robot, before)

    def favour(self, configuration: Configuration, stand: Occupancy, robot: int) -> None:
        """Do nothing: the drive itself serves vehicles that wait long."""

    def shown(self, stand: Occupancy, robot: int, decision: Decision) -> dict[str, Any] | None:
        """Return the certificate of a decision: the chain rule's name, or the full places of a refusal."""
        states = self.layout.system.states
        if decision.admitted and self.for_everyone:
            return {"kind": "chain"}
        if decision.admitted:
            moves = [robot, *(self._narrow.witness_after(stand, robot) or [])]
            return {"kind": "rest", "moves": self.ids(moves)}
        if decision.stage != "chain":
            return dead_after(stand, robot, "no rest")
        target = self._after[robot][stand.at[robot]]
        if decision.reason is Reason.OCCUPIED:
            return {"kind": "reserved", "place": states[target]}
        return {"kind": "full", "places": [states[s] for s in self.closes(stand, robot, target)]}


class _Rests:
    """Rests as places for the chain rule.

    `held`: number of robots that hold each. `first`: returns the robot that leaves a rest next; None if
    several may. `after`: by robot and position, the rest after the one that it holds.
    """

    def __init__(
        self, stand: Occupancy, held: list[int], first: Callable[[int], int | None], after: list[list[int]]
    ) -> None:
        self._at, self._layout = stand.at, stand.layout
        self._held, self._after = held, after
        self.first = first

    def free(self, place: int) -> int:
        """Return the number of free slots; a narrow place always counts as free."""
        return self._layout.room[place] - self._held[place] if self._layout.wide[place] else 1

    def wanted(self, robot: int) -> int | None:
        """Return the rest that a robot drives to next; None where its path ends."""
        place = self._after[robot][self._at[robot]]
        return place if place >= 0 else None
