"""Circuits of risky walks, and the sub-circuits that one step leaves (Zhou et al. 2020, Def. 9)."""

from collections.abc import Iterator
from dataclasses import dataclass

from loopgate.gates.walks import Holders, Walk, risky_walks
from loopgate.model import Configuration, System


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
