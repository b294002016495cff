"""Algorithm 2 of Zhou et al. 2020, central version: every circuit of the move must be live by Theorem 1.

Like the paper's algorithm it is neither safe nor free of blocking. There are systems of five robots in which
it admits a move into an inevitable deadlock, and others in which it stops all robots in a live configuration
(docs/studies/paper.md). The gate ``certified`` does neither.

A *full* state has no free slot. A state of capacity 1 with a robot in it is an occupied collision state: its
robot must leave before another robot can enter. A state of larger capacity with a free slot is as good as a
private state. Without a free slot it is an occupied collision state whose robot is the head of its queue; if
it is not FIFO, any of its robots may leave first. But if a chain of such full states leads to a state with a
free slot, or to a private state, all states of the chain can get a free slot by moves that block no robot. So
they count as having one.

The lemmas give conditions that every higher-order deadlock fulfils; Theorem 1 turns them round into reasons
for a circuit to be live. They are stated as the paper states them, which is not to say that they hold: the
second condition of Theorem 1 looks one step ahead, which is not enough (docs/studies/paper.md).

It gives the answer of `theorem1` for the circuits of `circuits_through`, but does not list circuits that
condition (1) makes live. Sets of states are whole numbers, one bit per state.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property

from loopgate.errors import GateError
from loopgate.gates.base import Decision, Reason, refusal
from loopgate.gates.collision import collision_decision
from loopgate.gates.following import Follower
from loopgate.model import Configuration, Placement, System


@dataclass(frozen=True, slots=True)
class Circuit:
    """Risky walks of different robots, each ending where the next begins, the last where the first begins."""

    walks: tuple[Walk, ...]

    @property
    def robots(self) -> tuple[int, ...]:
        """The robots in the order of their walks, ``I(W)``; their number is ``m``."""
        return tuple(walk.robot for walk in self.walks)

    @property
    def intermediate(self) -> frozenset[int]:
        """The intermediate states of all walks, ``SE(W)``."""
        return frozenset(state for walk in self.walks for state in walk.intermediate)

    @property
    def is_deadlock_cycle(self) -> bool:
        """Whether all walks have length 0 (Def. 10)."""
        return all(len(walk.states) == 2 for walk in self.walks)  # noqa: PLR2004 - tail and head


def circuits_through(
    system: System, configuration: Configuration, state: int, *, lookahead: int | None = None
) -> Iterator[Circuit]:
    """Yield every circuit that passes the robots which hold `state` (Alg. 1, step 2).

    A circuit begins with the walk of such a robot. Nothing if `state` is private or has room. There can be
    exponentially many in the number of robots: meant for the theory, not for the road.
    """
    held = Holders(system, configuration)
    walks: dict[int, tuple[Walk, ...]] = {}

    def extend(chain: list[Walk], robot: int, used: frozenset[int]) -> Iterator[Circuit]:
        if robot not in walks:
            walks[robot] = risky_walks(system, configuration, robot, held=held, lookahead=lookahead)
        for walk in walks[robot]:
            if walk.head == state and chain:
                yield Circuit((*chain, walk))
                continue
            for after in held.of(walk.head):
                if after not in used:
                    yield from extend([*chain, walk], after, used | {after})

    for first in held.of(state):
        yield from extend([], first, frozenset((first,)))


def all_circuits(
    system: System, configuration: Configuration, *, lookahead: int | None = None
) -> Iterator[Circuit]:
    """Yield every circuit of the configuration once, beginning with its lowest robot."""
    for state in range(len(system.states)):
        for circuit in circuits_through(system, configuration, state, lookahead=lookahead):
            if circuit.robots[0] == min(circuit.robots):
                yield circuit


def sub_circuit(circuit: Circuit, mover: int) -> Circuit | None:
    """Return the circuit that is left of `circuit` when its walk number `mover` is shortened by one step.

    Follows function ``check`` (Alg. 1): the next walks are asked in turn whether they pass the mover's new
    state; the first that does is cut there and closes the sub-circuit. The walk just behind the mover is not
    asked: a step releases its robot (proof of Lemma 2). None if no walk passes: then no circuit is left.
    """
    first = circuit.walks[mover]
    moved = Walk(first.robot, first.states[1:])
    here = moved.tail
    walks = [moved]
    count = len(circuit.walks)
    for step in range(1, count - 1):
        walk = circuit.walks[(mover + step) % count]
        if here in walk.intermediate:
            cut = walk.states.index(here, 1)
            return Circuit((*walks, Walk(walk.robot, walk.states[: cut + 1])))
        walks.append(walk)
    return None


def describe_circuit(system: System, circuit: Circuit) -> str:
    """Return the circuit for people: ``r1: s2 s3 s6 > r2: s6 s7 > ...``."""
    return " > ".join(
        f"{system.robots[walk.robot].id}: {' '.join(system.states[s] for s in walk.states)}"
        for walk in circuit.walks
    )


@dataclass(frozen=True, slots=True)
class Walk:
    """An individual walk of a robot (Def. 7).

    Attributes
    ----------
    robot
        The robot that makes the walk.
    states
        State numbers from the tail, where the robot stands, to the head.
    """

    robot: int
    states: tuple[int, ...]

    @property
    def tail(self) -> int:
        """The state in which the robot stands, ``t(w)``."""
        return self.states[0]

    @property
    def head(self) -> int:
        """The last state, ``h(w)``."""
        return self.states[-1]

    @property
    def intermediate(self) -> tuple[int, ...]:
        """The states between tail and head in driving order, ``SE(w)``; ``L(w)`` of them."""
        return self.states[1:-1]


def default_lookahead(system: System) -> int:
    """Return how many states a robot looks ahead: ``N - 2`` from its position (Alg. 1, step 1).

    It is at least one, so that two robots that block each other are found where Prop. 1 does not hold.
    """
    return max(1, len(system.robots) - 2)


def steps_ahead(system: System, robot: int, position: int, most: int) -> Iterator[int]:
    """Yield the next positions of `robot` after `position`: `most` of them, or up to the path's end."""
    following = system.following[robot]
    for _ in range(most):
        position = following[position]
        if position < 0:
            return
        yield position


class Holders:
    """The states that are blocked in a configuration, and the robots that block them; computed on demand.

    A state of capacity 1 is blocked if and only if a robot is in it. A larger state is blocked if and only if
    it is full, and no chain of moves out of full states of capacity above 1 leads to a private state or a
    state with a free slot.
    """

    def __init__(self, system: System, configuration: Configuration) -> None:
        self._system = system
        self._here = configuration
        self._known: dict[int, tuple[int, ...]] = {}

    @cached_property
    def _standing(self) -> dict[int, int]:
        """The robot in each occupied state; one of them in a state of larger capacity."""
        paths = zip(self._system.paths, self._here.positions, strict=True)
        return {path[p]: robot for robot, (path, p) in enumerate(paths)}

    def of(self, state: int) -> tuple[int, ...]:
        """Return the robots in a full `state`, any of which may leave first; () if it has a free slot."""
        if self._system.private[state]:
            return ()
        if self._system.room[state] == 1:
            return (self._standing[state],) if state in self._standing else ()
        if state not in self._known:
            self._follow(state)
        return self._known[state]

    def _follow(self, root: int) -> None:
        """Find the robots in `root`, a state of capacity above 1, and in the full states that it leads to."""
        system, here = self._system, self._here
        full: dict[int, tuple[int, ...]] = {}
        before: dict[int, list[int]] = {root: []}
        given: list[int] = []
        to_do = [root]
        while to_do:
            state = to_do.pop()
            if system.private[state] or (system.room[state] > 1 and system.has_room(here, state)):
                given.append(state)
            elif system.room[state] > 1:
                inside = tuple(system.occupants(here, state))
                full[state] = inside[:1] if system.states[state] in system.fifo else inside
                for robot in full[state]:
                    wanted = system.next_state(here, robot)
                    if wanted is None:
                        continue
                    if wanted not in before:
                        to_do.append(wanted)
                    before.setdefault(wanted, []).append(state)
        self._known.update(full)
        released = set(given)
        self._known.update(dict.fromkeys(given, ()))
        while given:
            for state in before[given.pop()]:
                if state not in released:
                    released.add(state)
                    given.append(state)
                    self._known[state] = ()


def risky_walks(
    system: System,
    configuration: Configuration,
    robot: int,
    *,
    held: Holders | None = None,
    lookahead: int | None = None,
) -> tuple[Walk, ...]:
    """Return the risky walks of `robot`, shortest first (Def. 8; Alg. 1, step 1).

    A risky walk runs through collision states only and ends in a state that another robot holds. A robot in a
    private state, or behind others in a FIFO state, has none. If a held state comes several times, the
    nearest counts (Section 6).

    Parameters
    ----------
    system, configuration, robot
        The system, the positions of all robots, and the robot of the walks.
    held
        `Holders` of the configuration, if the caller has them.
    lookahead
        States to look ahead; `default_lookahead` if not given.
    """
    held = held or Holders(system, configuration)
    path = system.paths[robot]
    tail = path[configuration.positions[robot]]
    if robot not in held.of(tail):
        return ()
    most = default_lookahead(system) if lookahead is None else lookahead
    states = [tail]
    heads: set[int] = set()
    walks: list[Walk] = []
    for position in steps_ahead(system, robot, configuration.positions[robot], most):
        state = path[position]
        by = held.of(state)
        if system.private[state] or (system.room[state] > 1 and not by):
            break
        states.append(state)
        if by not in {(), (robot,)} and state not in heads:
            heads.add(state)
            walks.append(Walk(robot, tuple(states)))
    return tuple(walks)


def safe_walk(system: System, configuration: Placement, robot: int) -> Walk | None:
    """Return the safe walk of `robot`, or None (Def. 8).

    In a safe walk every state up to the robot's next private state has a free slot. The terminal state of an
    open path counts as private if no other robot will come to it. O(path length).
    """
    states = [system.state_at(configuration, robot)]
    path = system.paths[robot]
    for position in steps_ahead(system, robot, configuration.positions[robot], len(path)):
        state = path[position]
        if not system.has_room(configuration, state):
            return None
        states.append(state)
        last = system.robots[robot].next_position(position) is None
        if system.private[state] or (last and not _needed(system, configuration, robot, state)):
            return Walk(robot, tuple(states))
    return None


def _needed(system: System, configuration: Placement, robot: int, state: int) -> bool:
    """Return whether another robot than `robot` will come to `state`."""
    for other in system.visitors[state] - {robot}:
        path = system.paths[other]
        ahead = steps_ahead(system, other, configuration.positions[other], len(path))
        if any(path[position] == state for position in ahead):
            return True
    return False


class Condition(StrEnum):
    """Which condition of Theorem 1 decided."""

    TOO_MANY_STATES = "(1) |SE(W)| > m - 3"
    UNSHARED_STATE = "(1) SE(W) has a state outside S_alpha(W)"
    BREAKS_UP = "(2) a robot's move leaves no circuit"
    SUB_TOO_MANY_STATES = "(2) a robot's move leaves a sub-circuit with |SE(W')| > m' - 3"
    SUB_UNSHARED_STATE = (
        "(2) a robot's move leaves a sub-circuit where SE(W') has a state outside S_alpha(W')"
    )
    DEADLOCK_CYCLE = "deadlock cycle"
    NONE = "no condition holds"


@dataclass(frozen=True, slots=True)
class CircuitVerdict:
    """The verdict of Theorem 1 on a circuit.

    Attributes
    ----------
    live
        Whether a condition holds.
    condition
        Which one; for a circuit that is not live, `DEADLOCK_CYCLE` or `NONE`.
    mover
        The robot whose move fulfils condition (2).
    steps
        How many steps it makes; 1 but for Remark 2.
    """

    live: bool
    condition: Condition
    mover: int | None = None
    steps: int = 0


def lemma1(system: System, circuit: Circuit) -> bool:
    """Return whether ``SE(W)`` lies within ``S_alpha(W)``, as it does for every higher-order deadlock."""
    robots = set(circuit.robots)
    return all(len(system.visitors[state] & robots) > 1 for state in circuit.intermediate)


def movable_walks(system: System, configuration: Configuration, circuit: Circuit) -> list[int]:
    """Return the indices of the walks whose robots are movable: the next state has signal 0 (Section 4.1).

    The next state of a risky walk is a collision state.
    """
    return [
        index
        for index, walk in enumerate(circuit.walks)
        if len(walk.states) > 2  # noqa: PLR2004 - else the next state is the head, which is held
        and system.has_room(configuration, walk.states[1])
    ]


def theorem1(
    system: System, configuration: Configuration, circuit: Circuit, *, lookahead: int = 1
) -> CircuitVerdict:
    """Judge by Theorem 1 whether a circuit is live.

    Parameters
    ----------
    system, configuration
        The positions of all robots; the asking robot is placed in the state that it wants to enter.
    circuit
        A circuit of that configuration.
    lookahead
        Steps that the one robot of condition (2) may make; 1 is the theorem, more is Remark 2.

    Notes
    -----
    A deadlock cycle is never live. The theorem need not say so, since by Prop. 2 such a cycle has three
    robots; where Prop. 1 does not hold it may have two. O(lookahead * m^2 * length) set operations.
    """
    if circuit.is_deadlock_cycle:
        return CircuitVerdict(live=False, condition=Condition.DEADLOCK_CYCLE)
    if len(circuit.intermediate) > len(circuit.walks) - 3:
        return CircuitVerdict(live=True, condition=Condition.TOO_MANY_STATES)
    if not lemma1(system, circuit):
        return CircuitVerdict(live=True, condition=Condition.UNSHARED_STATE)
    for index in movable_walks(system, configuration, circuit):
        verdict = _condition2(system, configuration, circuit, index, lookahead)
        if verdict is not None:
            return verdict
    return CircuitVerdict(live=False, condition=Condition.NONE)


def _condition2(
    system: System, configuration: Configuration, circuit: Circuit, index: int, lookahead: int
) -> CircuitVerdict | None:
    """Return the verdict that up to `lookahead` steps of the robot of walk `index` lead to, if any."""
    mover = circuit.walks[index].robot
    left = circuit
    for step in range(1, lookahead + 1):
        smaller = sub_circuit(left, index if step == 1 else 0)
        if smaller is None:
            return CircuitVerdict(live=True, condition=Condition.BREAKS_UP, mover=mover, steps=step)
        left = smaller
        if len(left.intermediate) > len(left.walks) - 3 and not left.is_deadlock_cycle:
            return CircuitVerdict(live=True, condition=Condition.SUB_TOO_MANY_STATES, mover=mover, steps=step)
        if not lemma1(system, left):
            return CircuitVerdict(live=True, condition=Condition.SUB_UNSHARED_STATE, mover=mover, steps=step)
        if 0 not in movable_walks(system, configuration, left):
            break
    return None


_SMALLEST_CYCLE = 3
"""Robots in the smallest deadlock cycle (Prop. 2)."""

_Leg = tuple[Walk, int]
"""A risky walk and the set of its intermediate states."""


class BudgetSpent(Exception):  # noqa: N818 - not an error: the gate answers with Reason.BUDGET
    """The search was not finished within its budget."""


class CircuitSearch:
    """Searches for a circuit through a state that is not live by Theorem 1.

    Parameters
    ----------
    lookahead
        Steps of the moving robot in condition (2) of Theorem 1; 1 is the paper, more is its Remark 2.
    budget
        The most search steps per question; a step is a walk appended to a chain, or one of a circuit judged.
    """

    def __init__(self, system: System, *, lookahead: int, budget: int) -> None:
        self._system = system
        self._visits = [sum(1 << s for s in set(path)) for path in system.paths]
        self._configuration = system.initial
        self._held = Holders(system, system.initial)
        self._legs: dict[int, list[_Leg]] = {}
        self._lookahead = lookahead
        self._budget = budget
        self._steps = 0

    def find(self, configuration: Configuration, state: int) -> Circuit | None:
        """Return a circuit through the robots that hold `state` which is not live, or None if all are live.

        Raises `BudgetSpent` if the budget did not suffice to say which. Time is O(N * look-ahead + budget *
        N) at most.
        """
        self._configuration = configuration
        self._held = Holders(self._system, configuration)
        self._legs.clear()
        self._steps = 0
        for first in self._held.of(state):
            alive = self._circling(first, state)
            if alive and (circuit := self._search(first, state, alive)) is not None:
                return circuit
        return None

    def _legs_of(self, robot: int) -> list[_Leg]:
        legs = self._legs.get(robot)
        if legs is None:
            walks = risky_walks(self._system, self._configuration, robot, held=self._held)
            legs = self._legs[robot] = [
                (walk, sum(1 << state for state in set(walk.intermediate))) for walk in walks
            ]
        return legs

    def _circling(self, first: int, state: int) -> set[int]:
        """Return the robots that may be on a circuit of interest through `first`; empty if there is none.

        Drops, until nothing changes, robots that `first` does not reach or that do not reach `state`, and
        walks that condition (1) makes live in any circuit of the robots left.
        """
        alive = self._mutual(first, state)
        while alive:
            once = twice = 0
            for robot in alive:
                twice |= once & self._visits[robot]
                once |= self._visits[robot]
            most = max(0, len(alive) - _SMALLEST_CYCLE)
            dropped = False
            for robot in alive:
                legs = self._legs[robot]
                kept = [leg for leg in legs if not leg[1] & ~twice and leg[1].bit_count() <= most]
                if len(kept) < len(legs):
                    self._legs[robot] = kept
                    dropped = True
            if not dropped:
                break
            alive = self._mutual(first, state)
        return alive

    def _mutual(self, first: int, state: int) -> set[int]:
        reached = {first}
        to_do = [first]
        before: dict[int, list[int]] = {}
        closing: list[int] = []
        while to_do:
            robot = to_do.pop()
            for walk, _ in self._legs_of(robot):
                head = walk.head
                if head == state:
                    closing.append(robot)
                for after in self._held.of(head):
                    before.setdefault(after, []).append(robot)
                    if after not in reached:
                        reached.add(after)
                        to_do.append(after)
        back = set(closing)
        while closing:
            for robot in before.get(closing.pop(), ()):
                if robot not in back:
                    back.add(robot)
                    closing.append(robot)
        return back if first in back else set()

    def _options(self, robot: int, state: int, *, begun: bool) -> Iterator[tuple[_Leg, int | None]]:
        for leg in self._legs_of(robot):
            head = leg[0].head
            if head == state and begun:
                yield leg, None
            else:
                for after in self._held.of(head):
                    yield leg, after

    def _search(self, first: int, state: int, alive: set[int]) -> Circuit | None:
        """Extend chains of walks from `first`, depth first, until one closes that is not live."""
        most = max(0, len(alive) - _SMALLEST_CYCLE)
        chain: list[Walk] = []
        unions = [0]
        robots = [first]
        stack = [self._options(first, state, begun=False)]
        while stack:
            option = next(stack[-1], None)
            if option is None:
                stack.pop()
                robots.pop()
                unions.pop()
                if chain:
                    chain.pop()
                continue
            (walk, between), after = option
            self._spend(1)
            union = unions[-1] | between
            if union.bit_count() > most:
                continue
            if after is None:
                circuit = Circuit((*chain, walk))
                if self._is_dead(circuit, union):
                    return circuit
            elif after in alive and after not in robots:
                chain.append(walk)
                unions.append(union)
                robots.append(after)
                stack.append(self._options(after, state, begun=True))
        return None

    def _is_dead(self, circuit: Circuit, union: int) -> bool:
        """Return whether Theorem 1 does not call the circuit live; `union` are its intermediate states."""
        count = len(circuit.walks)
        if union and union.bit_count() > count - _SMALLEST_CYCLE:
            return False
        self._spend(count)
        return not theorem1(self._system, self._configuration, circuit, lookahead=self._lookahead).live

    def _spend(self, steps: int) -> None:
        self._steps += steps
        if self._steps > self._budget:
            raise BudgetSpent


class Algorithm2Gate(Follower, follows=True):
    """The gate ``algorithm2``: it admits a move if every circuit that it joins is live by Theorem 1.

    States that hold several robots are read as `loopgate.gates.algorithm2` says: one with room is as good as
    private, a full one is an occupied collision state whose robot is the head of its queue. A move into a
    state that keeps room is then free at once, and otherwise, where all states hold several, the decision is
    one walk along the chain of full states.

    Raises `GateError` if an option is not a whole number from 1 up.

    Parameters
    ----------
    lookahead
        Steps of the one robot in condition (2) of Theorem 1: 1 is the paper, more is its Remark 2. More
        look-ahead calls more circuits live, so it admits more.
    budget
        The most search steps per decision, which bounds its time; beyond, the answer is ``BUDGET``. There can
        be exponentially many circuits (Section 4.2 of the paper).

    Notes
    -----
    Source: Algorithm 1 with ``visit`` and ``check``, Algorithm 2 lines 2 to 10. As the proof of Theorem 2
    needs it, all circuits are judged, not only the first. Before the negotiation `Neg`, which is not the
    gate's.
    """

    def __init__(self, system: System, *, lookahead: int = 1, budget: int = 20_000) -> None:
        super().__init__(system)
        self.check_options(lookahead=lookahead, budget=budget)
        self.lookahead = lookahead
        self._search = CircuitSearch(system, lookahead=lookahead, budget=budget)

    @staticmethod
    def check_options(*, lookahead: int = 1, budget: int = 20_000) -> None:
        """Raise `GateError` if an option is not a whole number from 1 up."""
        options: dict[str, object] = {"lookahead": lookahead, "budget": budget}
        for name, value in options.items():
            if not isinstance(value, int) or isinstance(value, bool) or value < 1:
                msg = f"gate algorithm2: {name} is {value!r}; expected a whole number from 1 up"
                raise GateError(msg)

    def decide(self, configuration: Placement, robot: int) -> Decision:
        """Decide the next move of `robot`. A deadlock's blockers are the other robots of its circuit."""
        first = collision_decision(self._system, configuration, robot)
        if not first.admitted:
            return first
        state = self._system.next_state(configuration, robot)
        if state is None or self._system.private[state]:
            return first
        trial = self._trial(configuration)
        position = self._system.make(trial, robot)
        moved = None if self._system.has_room(trial, state) else trial.frozen()
        self._system.take_back(trial, robot, position)
        if moved is None:
            return first
        try:
            circuit = self._search.find(moved, state)
        except BudgetSpent:
            return refusal(Reason.BUDGET, "circuits not all judged within the budget")
        if circuit is None:
            return first
        # The order of a deadlock is the number of its intermediate states (Lemma 3).
        detail = f"order-{len(circuit.intermediate)} deadlock {describe_circuit(self._system, circuit)}"
        return refusal(Reason.DEADLOCK, detail, blockers=(i for i in circuit.robots if i != robot))
