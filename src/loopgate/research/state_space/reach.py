"""All configurations that are reachable under a gate, by a breadth-first search."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from loopgate.arrays import Flags, Small
from loopgate.errors import PluginError
from loopgate.gates import Decision, Gate
from loopgate.gates.collision import CollisionGate
from loopgate.gates.following import careful
from loopgate.gates.open import OpenGate
from loopgate.model import Configuration, RobotId, StateId
from loopgate.plugins import blaming, name_of_class
from loopgate.reading import shown
from loopgate.research.state_space.kernels import advance
from loopgate.research.state_space.space import StateSpace

Ask = Callable[[Small, Flags], None]
"""Writes which moves out of the configurations with these numbers are admitted, move by move."""
Each = Callable[[Configuration, int, Decision, bool], None]
"""A function that is called with each decision and whether the move is possible at all."""

_CHUNK = 1 << 14


@dataclass(frozen=True, slots=True)
class Counterexample:
    """A sequence of moves to a configuration in which a gate's promise is broken."""

    kind: str
    """``unsafe``: the gate admitted the last move although it is not safe. ``stuck``: the gate admits no move
    although robots are not finished. ``disabled``: the last move breaks a capacity or an order."""
    moves: tuple[RobotId, ...]
    """The robots that move, in order, from the start; a shortest sequence if all configurations are known."""
    configuration: tuple[StateId, ...]
    """The states that the robots occupy after the moves."""


PROMISES = ("everyone", "somebody")


def promise_of(gate: Gate) -> str:
    """Return the promise by which `gate` is judged: ``everyone`` or ``somebody``.

    Its attribute ``promise`` says which; a gate that does not say is taken to promise everyone.

    Raises `PluginError` if the attribute says neither.
    """
    who = f"gate {name_of_class(gate)}"
    with blaming(f"{who}: promise", "everyone or somebody"):
        promise = getattr(gate, "promise", "everyone")
    if promise not in PROMISES:
        msg = f"{who}: promise is {shown(promise)}; expected everyone or somebody"
        raise PluginError(msg)
    return str(promise)


class Reach:
    """The configurations that can be reached by admitted moves, breadth first from the start.

    Parameters
    ----------
    asked
        The function that asks the gate; without one all moves are admitted.
    progress
        Called now and then with the number of configurations found.
    within
        If given, only moves that lead to these configurations count where nothing is asked.

    Attributes
    ----------
    order
        Numbers of the configurations in the order in which they are found.
    rank
        Each one's place in that order; -1 for those that cannot be reached.
    admitted
        Whether a move is admitted; asked only where it begins in `order`.
    ways
        How many moves of a configuration are.
    """

    def __init__(
        self,
        space: StateSpace,
        asked: Ask | None,
        progress: Callable[[int], None] = lambda _: None,
        within: Flags | None = None,
    ) -> None:
        self._space = space
        moves = space.moves
        self.rank = np.full(space.count, -1, np.int32)
        self.ways = np.zeros(space.count, np.int16)
        self.admitted = np.full(len(moves.targets), asked is None)
        if within is not None:
            self.admitted = within[moves.targets]
        order = np.zeros(space.count, np.int32)
        self.rank[0] = 0
        begin, count = 0, 1
        while begin < count:
            end = min(count, begin + _CHUNK)
            if asked is not None:
                asked(order[begin:end], self.admitted)
            count = advance(
                begin, end, count, order, self.rank, self.ways, self.admitted, moves.first, moves.targets
            )
            begin = end
            progress(count)
        self.order: Small = order[:count]

    @property
    def stuck(self) -> Flags:
        """Whether the gate admits no move in a reachable configuration with unfinished robots."""
        stopped: Flags = (self.rank >= 0) & (self.ways == 0) & ~self._space.moves.done
        return stopped

    def way(self, number: int) -> list[int]:
        """Return the robots that move on a shortest way to a configuration."""
        moves = self._space.moves
        robots: list[int] = []
        while number:
            edges = np.flatnonzero(self.admitted & (moves.targets == number))
            sources = np.searchsorted(moves.first, edges, side="right") - 1
            nearest = int(np.argmin(self.rank[sources]))
            robots.append(int(moves.movers[edges[nearest]]))
            number = int(sources[nearest])
        return robots[::-1]


def asking(space: StateSpace, gate: Gate) -> Ask | None:
    """Return a function that asks `gate` about moves; None for a gate that admits every move."""
    if type(gate) in (OpenGate, CollisionGate):  # what is derived from them decides as it likes
        return None
    return ask_gate(space, gate)


def ask_gate(space: StateSpace, gate: Gate, each: Each | None = None) -> Ask:
    """Return a function that asks the gate about every robot, and tells each answer to `each`."""
    moves = space.moves
    robots = range(moves.robots)
    gate = careful(gate, space.system)

    def one_by_one(numbers: Small, admitted: Flags) -> None:
        for number in numbers.tolist():
            here = space.configuration(number)
            begin, end = moves.first[number : number + 2].tolist()
            edge_of = dict(zip(moves.movers[begin:end].tolist(), range(begin, end), strict=True))
            for robot in edge_of if each is None else robots:
                decision = gate.decide(here, robot)
                edge = edge_of.get(robot)
                if edge is not None:
                    admitted[edge] = decision.admitted
                if each is not None:
                    each(here, robot, decision, edge is not None)

    return one_by_one
