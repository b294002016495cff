"""The certified gate: it never admits an unsafe move and never blocks everyone."""

import math
from collections import OrderedDict
from collections.abc import Callable, Iterator
from functools import cached_property
from typing import Any

from loopgate.errors import GateError, UnsafeStartError
from loopgate.gates.base import Decision, Reason, refusal
from loopgate.gates.certified.chain_rule import ChainRule
from loopgate.gates.certified.crowding import is_plain_for_the_chain, refuse_crowds
from loopgate.gates.certified.exploration import Exploration
from loopgate.gates.certified.free_slots import FreeSlots
from loopgate.gates.certified.homes import Homes
from loopgate.gates.certified.liveness_proof import LivenessProof
from loopgate.gates.certified.occupancy import Occupancy, stuck_for_good
from loopgate.gates.certified.search import Budget, BudgetError
from loopgate.gates.certified.system_index import SystemIndex
from loopgate.model import Configuration, System


class MovePatience:
    """Finds the robot that has waited too long, counted in moves of other robots.

    Parameters
    ----------
    patience
        Number of moves of other robots, per robot of the system, after which a robot without a move has
        waited too long; 0: never.

    Notes
    -----
    A robot is favoured until it moves, or until it has been favoured for as long as it had waited: it may be
    parked or broken down, and then the next robot gets its turn. O(1) per move.
    """

    def __init__(self, robots: int, patience: int) -> None:
        self._limit = patience * robots
        self._moves = 0
        self._since = OrderedDict.fromkeys(range(robots), 0)
        self._begun = 0
        self.favoured = -1
        """The robot that the gate works towards, or -1."""

    def moved(self, robot: int, *, for_good: bool) -> bool:
        """Count a move; return whether another robot is now favoured. `for_good`: the robot now stays."""
        if not self._limit:
            return False
        self._moves += 1
        before = self.favoured
        if for_good:
            self._since.pop(robot, None)
        else:
            self._since[robot] = self._moves
            self._since.move_to_end(robot)
        if robot == before:
            self.favoured = -1
        elif before >= 0 and self._moves - self._begun > self._limit:
            self._since[before] = self._moves
            self._since.move_to_end(before)
            self.favoured = -1
        if self.favoured < 0 and self._since:
            oldest = next(iter(self._since))
            if self._moves - self._since[oldest] > self._limit:
                self.favoured = oldest
                self._begun = self._moves
        return self.favoured != before

    def forget(self) -> None:
        """Restart all counts."""
        self._since = OrderedDict.fromkeys(sorted(self._since), self._moves)
        self.favoured = -1


_SMALL = 200_000
"""Up to this many combinations of positions, the exact exploration is used where robots have no homes."""


def choose_proof(system: System, promise: str, budget: Budget) -> LivenessProof:
    """Return the proof of a promise, with a witness of the start; see `CertifiedGate` for the order.

    Raises `UnsafeStartError` if the promise cannot be given for the start; the text names the robots. Raises
    `GateError` if a witness does not pass the gate's own check: a fault of ours.

    Parameters
    ----------
    promise
        ``everyone``, ``somebody`` or ``auto``.
    budget
        Of each exact search; where `Exploration` is chosen it is raised to what that needs.
    """
    layout = SystemIndex(system)
    if layout.hopeless:
        msg = (
            f"gate certified: robots that come to rest for good in shared states block "
            f"{layout.names(layout.hopeless)} for ever; end their paths elsewhere"
        )
        raise UnsafeStartError(msg)
    nodes = budget.nodes
    failed: GateError = UnsafeStartError("gate certified: no proof")
    for proof in _proofs(layout, promise, budget):
        budget.nodes = max(nodes, _SMALL) if isinstance(proof, Exploration) else nodes
        stand = Occupancy.of(proof.layout, system.initial)
        try:
            if proof.begin(system.initial, stand):
                return proof
        except BudgetError:
            other = "" if isinstance(proof, Homes | ChainRule) else ", or ask for promise=somebody"
            msg = f"gate certified: the start could not be shown live within the budget; raise budget{other}"
            failed = UnsafeStartError(msg)
            continue
        failed = _refusal(proof, stand)
        if not isinstance(proof, FreeSlots):
            break
    raise failed from None


def _proofs(layout: SystemIndex, promise: str, budget: Budget) -> Iterator[LivenessProof]:
    """Yield the proofs that may keep the promise, the strongest first."""
    system = layout.system
    flow = ChainRule(system, budget)
    if promise != "somebody":
        if flow.by_chain_alone:
            refuse_crowds(layout, Occupancy.of(layout, system.initial))
            flow.for_everyone = True
            yield flow
            return
        if not layout.homeless:
            yield Homes(layout, budget)
            return
        roomy = FreeSlots.applies(layout)
        small = math.prod(len(path) for path in layout.path) <= _SMALL
        if (small and not (promise == "auto" and roomy and layout.all_wide)) or (
            promise == "everyone" and not roomy
        ):
            yield Exploration(layout, budget)
        if roomy:
            yield FreeSlots(layout, budget)
        if promise == "everyone":
            return
    restless = flow.layout.homeless
    if restless:
        msg = (
            f"gate certified: robots {layout.names(restless)} share every state on their paths and none "
            "of these holds two; give each a state of its own or one that holds two"
        )
        raise UnsafeStartError(msg)
    yield flow


def _refusal(proof: LivenessProof, stand: Occupancy) -> GateError:
    """Return why a start is refused for which `proof` has no witness."""
    if proof.missing is Reason.FAULT:
        return GateError(
            "gate certified: what shows the start to be live did not pass the gate's own check; "
            "this is a fault of loopgate: please report it with the system"
        )
    layout = stand.layout
    everyone = list(range(len(layout.path)))
    stuck = stuck_for_good(stand, everyone)
    if not stuck and isinstance(proof, FreeSlots):
        return UnsafeStartError(
            "gate certified: the start could not be shown to be live for everyone: no moves lead to a slot "
            "free in every place; start fewer robots, or ask for promise=somebody"
        )
    if not stuck and isinstance(proof, ChainRule):
        away = [i for i, p in enumerate(stand.at) if not layout.home[i][p]]
        return UnsafeStartError(
            f"gate certified: the start could not be shown to be live: robots {layout.names(away)} "
            "start in places that hold one, and not all of them find a slot in the next that holds two; "
            "start them there, or fewer of them"
        )
    names = layout.names(stuck or everyone)
    return UnsafeStartError(
        f"gate certified: the start is not live: robots {names} cannot all go on; start them elsewhere"
    )


_PROMISES = ("auto", "everyone", "somebody")


def _is_count(value: object) -> bool:
    return isinstance(value, int) and value >= 1


def _is_time(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and 0 <= value < math.inf


_STAYS = refusal(Reason.STAYS)


class CertifiedGate:
    """The gate ``certified``: it admits a move only if it can show that its promise still holds after it.

    The gate promises that *everyone* can go on for ever, by the first method that applies:

    - The chain rule (`ChainRule`), exact, if all paths are closed and each place is left in order of arrival
      and holds two robots or more, or is visited by one robot only. The start must not be crowded (see
      `loopgate.gates.certified.crowding`).
    - `Homes`, exact, if every robot has a state on its path where it blocks no other robot.
    - `Exploration`, exact, if the system is small. By default only if some place holds one robot.
    - `FreeSlots`, if a configuration with a free slot in every place can be reached; it may refuse safe
    moves.

    If no method applies, or if asked to, the gate promises that *somebody* can always move and that no
    circular wait ever forms (`ChainRule`). For this each path needs a place for two robots, or a home.

    Raises `GateError` if an option is invalid. Raises `UnsafeStartError` if the promise does not hold at the
    start; the message names the robots.

    Parameters
    ----------
    system
        The system; its start must fulfil the promise.
    promise
        ``everyone``, ``somebody``, or ``auto`` as above.
    budget
        Largest number of nodes that a search may visit for one decision; beyond it the move is refused for
        now.
    patience
        Number of moves (for each robot of the system) that other robots may make while a robot waits. After
        them the gate admits only moves that let the waiting robot move soon, until it has moved; only under
        the promise *everyone*. 0: never.
    budget_ms
        Longest time of a search for one decision [ms], by the clock given to `use_clock`; beyond it the move
        is refused for now. 0, the default: no limit. With a limit the same seed may give different runs. The
        search at the start is limited by `budget` only.
    """

    def __init__(
        self,
        system: System,
        promise: str = "auto",
        budget: int = 2_000,
        patience: int = 50,
        budget_ms: float = 0,
    ) -> None:
        self.check_options(promise=promise, budget=budget, patience=patience, budget_ms=budget_ms)
        self._system = system
        self._budget = Budget(budget, budget_ms / 1000)
        self._steers_after = patience
        self._asked_promise = promise
        self._plain = promise != "somebody" and is_plain_for_the_chain(system)
        self._configuration: Configuration | None = system.initial
        if not self._plain:
            self._stand  # noqa: B018  an unsafe start is refused here

    @cached_property
    def _proof(self) -> LivenessProof:
        """The liveness proof; nothing asks for it where a ledger applies the chain rule itself."""
        return choose_proof(self._system, self._asked_promise, self._budget)

    @cached_property
    def _layout(self) -> SystemIndex:
        return self._proof.layout

    @cached_property
    def _patience(self) -> MovePatience:
        steers = 0 if isinstance(self._proof, ChainRule) else self._steers_after
        return MovePatience(len(self._system.robots), steers)

    @cached_property
    def _stand(self) -> Occupancy:
        return Occupancy.of(self._layout, self._system.initial)

    @staticmethod
    def check_options(
        *, promise: str = "auto", budget: int = 2_000, patience: int = 50, budget_ms: float = 0
    ) -> None:
        """Raise `GateError` if an option of the gate is invalid."""
        if promise not in _PROMISES:
            msg = f"gate certified: promise is {promise!r}; expected {', '.join(_PROMISES)}"
            raise GateError(msg)
        if not _is_count(budget):
            msg = f"gate certified: budget is {budget!r}; expected a whole number from 1 up"
            raise GateError(msg)
        if patience and not _is_count(patience):
            msg = f"gate certified: patience is {patience!r}; expected a whole number from 0 up"
            raise GateError(msg)
        if not _is_time(budget_ms):
            msg = f"gate certified: budget_ms is {budget_ms!r}; expected a number of milliseconds from 0 up"
            raise GateError(msg)

    @property
    def promise(self) -> str:
        """The promise: ``everyone`` (every robot can go on for ever) or ``somebody`` (some robot can)."""
        return "everyone" if self._plain or self._proof.for_everyone else "somebody"

    @property
    def by_chain_alone(self) -> bool:
        """Whether every move is decided by the walk along full places alone (`ChainRule.by_chain_alone`)."""
        return self._plain or (isinstance(self._proof, ChainRule) and self._proof.by_chain_alone)

    def use_clock(self, clock: Callable[[], float]) -> None:
        """Set the function that returns the time [s], by which `budget_ms` is measured."""
        self._budget.clock = clock

    def decide(self, configuration: Configuration, robot: int) -> Decision:
        """Decide the next move of `robot`; fast in the configuration after the last known move."""
        if configuration is not self._configuration:
            self._follow(configuration)
        return self.decide_here(robot)

    def decide_here(self, robot: int) -> Decision:
        """Decide the next move of `robot` in the configuration after all known moves."""
        stand, layout = self._stand, self._layout
        here = stand.at[robot]
        there = layout.follow[robot][here]
        if there < 0:
            return _STAYS
        path = layout.path[robot]
        line = stand.queue.get(path[here])
        if line is not None and line[0] != robot:
            return refusal(Reason.BEHIND, blockers=(line[line.index(robot) - 1],))
        s = path[there]
        if stand.count[s] >= layout.room[s]:
            return refusal(Reason.OCCUPIED, blockers=stand.occupants(s))
        proof = self._proof
        return proof.at_once(stand, robot) or proof.judge(self._here(), stand, robot)

    def certificate(self, configuration: Configuration, robot: int) -> dict[str, Any] | None:
        """Return a proof of the decision about `robot`, which ``check-certificate`` can check.

        The proof is plain data; `loopgate.research.theory.certificates` describes its kinds and checks it.
        None if there is no proof: capacity or order forbids the move, or the gate refused it because of its
        budget, a fault, another robot's turn, or an inconclusive search.
        """
        decision = self.decide(configuration, robot)
        silent = decision.reason in {Reason.BUDGET, Reason.FAULT, Reason.NEGOTIATION}
        if silent or not self._stand.enabled(robot):
            return None
        shown = self._proof.shown(self._stand, robot, decision)
        return shown and {
            "positions": list(configuration.positions),
            "queues": [self._proof.ids(queue) for queue in configuration.queues],
            "robot": self._system.robots[robot].id,
            "verdict": "admitted" if decision.admitted else "refused",
            **shown,
        }

    def moved(self, configuration: Configuration, robot: int) -> None:
        """Tell the gate of a move; after a move that was not admitted it searches its witness anew."""
        stand = self._stand
        after = self._layout.follow[robot][stand.at[robot]]
        if configuration.positions[robot] != after or not stand.enabled(robot):
            self._follow(configuration)
            return
        self._move(robot, configuration)

    def moved_here(self, robot: int) -> None:
        """Tell the gate of an admitted move in the configuration after all known moves."""
        self._move(robot, None)

    def _move(self, robot: int, configuration: Configuration | None) -> None:
        stand = self._stand
        before = stand.at[robot]
        stand.step(robot)
        self._configuration = configuration
        if not self._proof.moved(robot, before):
            self._begin()
        if self._patience.moved(robot, for_good=stand.wanted(robot) < 0):
            self._proof.favour(self._here(), stand, self._patience.favoured)

    def _here(self) -> Configuration:
        """Return the present configuration; make it if it is not known yet. O(robots)."""
        if self._configuration is None:
            self._configuration = Configuration(tuple(self._stand.at), self._stand.queues())
        return self._configuration

    def _follow(self, configuration: Configuration) -> None:
        if configuration != self._here():
            self._stand = Occupancy.of(self._layout, configuration)
            self._configuration = configuration
            self._begin()
        self._configuration = configuration

    def _begin(self) -> None:
        self._patience.forget()
        try:
            self._proof.begin(self._here(), self._stand)
        except BudgetError:
            return
