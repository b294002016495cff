"""Lemmas 1 to 4 and Theorem 1 of Zhou et al. 2020, as functions that say which condition decided.

The lemmas give conditions that every higher-order deadlock fulfils; Theorem 1 turns them round into reasons
for a circuit to be live. They are stated as the paper states them, which is not to say that they hold: the
second condition of Theorem 1 looks one step ahead, which is not enough (docs/studies/what-is-not-true.md).
"""

from dataclasses import dataclass
from enum import StrEnum

from loopgate.gates.circuits import Circuit, sub_circuit
from loopgate.model import Configuration, System


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
