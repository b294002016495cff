"""One run, move by move: the robots that the gate admits at each step, and why it refuses the others."""

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from itertools import islice
from typing import Any

from loopgate.errors import IllegalMoveError
from loopgate.gates import Gate, Reason
from loopgate.gates.algorithm2 import Circuit, circuits_through, describe_circuit
from loopgate.gates.following import careful
from loopgate.model import Configuration, RobotId, StateId, System
from loopgate.research.theory.orders import OrderLimitError, Orders

_MOST_CIRCUITS = 2000
_MOST_ORDERS = 20_000


@dataclass(frozen=True, slots=True)
class RefusedMove:
    """Why a robot may not move now."""

    reason: Reason
    """The gate's reason, or ``NEGOTIATION`` for a robot that was admitted while another moved."""
    detail: str
    """The reason for people: the robots in the next state, or the deadlock's order and circuit."""
    order: int | None = None
    """Order of the deadlock that the move would cause (Def. 11), if it would."""
    circuit: tuple[RobotId, ...] = ()
    """The robots of that deadlock."""


@dataclass(frozen=True, slots=True)
class TraceStep:
    """One step of a trace: a configuration, and the gate's answer for each robot."""

    step: int
    """Number of moves made before."""
    configuration: tuple[StateId, ...]
    admitted: tuple[RobotId, ...]
    """The robots that the gate admits."""
    refused: dict[RobotId, RefusedMove]
    """The other robots, admitted robots that lost the negotiation included; robots that stay for good are
    left out."""
    moved: RobotId | None
    """The robot that moves next; None at the end."""

    def as_dict(self) -> dict[str, Any]:
        """Return the step as a JSON object."""
        data = asdict(self)
        for refusal in data["refused"].values():
            if not refusal["circuit"]:
                del refusal["order"], refusal["circuit"]
        return data


def trace_moves(system: System, gate: Gate, moves: Iterable[RobotId]) -> list[TraceStep]:
    """Make given moves from the start, and return the gate's answer to every robot at each step.

    Raises `SystemModelError` if a move names no robot of the system; `IllegalMoveError` if the gate refuses a
    move; the message gives the reason.
    """
    here, gate = system.initial, careful(gate, system)
    steps: list[TraceStep] = []
    orders = Orders(system, limit=_MOST_ORDERS)
    for name in moves:
        robot = system.robot_number(name)
        step = _step(system, gate, here, len(steps), robot, orders)
        if name not in step.admitted:
            refusal = step.refused.get(name)
            why = "it stays for good" if refusal is None else f"{refusal.reason} ({refusal.detail})"
            others = " ".join(step.admitted) or "none"
            msg = f"move {len(steps) + 1}: robot {name} is refused: {why}; admitted are {others}"
            raise IllegalMoveError(msg)
        steps.append(step)
        here = system.move(here, robot)
        gate.moved(here, robot)
    steps.append(_step(system, gate, here, len(steps), None, orders))
    return steps


def _step(
    system: System, gate: Gate, here: Configuration, number: int, mover: int | None, orders: Orders
) -> TraceStep:
    admitted: list[RobotId] = []
    refused: dict[RobotId, RefusedMove] = {}
    for robot, entry in enumerate(system.robots):
        decision = gate.decide(here, robot)
        if decision.admitted and system.enabled(here, robot):
            admitted.append(entry.id)
            if mover is not None and robot != mover:
                detail = f"{system.robots[mover].id} moves first"
                refused[entry.id] = RefusedMove(Reason.NEGOTIATION, detail)
        elif decision.reason is Reason.DEADLOCK:
            refused[entry.id] = _deadlock(system, here, robot, decision.detail, orders)
        elif decision.reason is not Reason.STAYS:
            reason = Reason.OCCUPIED if decision.admitted else decision.reason
            refused[entry.id] = RefusedMove(reason, decision.detail or _why(system, here, robot, reason))
    moved = None if mover is None else system.robots[mover].id
    return TraceStep(number, system.describe(here), tuple(admitted), refused, moved)


def _why(system: System, here: Configuration, robot: int, reason: Reason) -> str:
    """Return the detail of a refusal that gives none."""
    state = system.next_state(here, robot)
    if state is None or reason not in {Reason.OCCUPIED, Reason.BEHIND}:
        return ""
    if reason is Reason.BEHIND:
        queue = system.occupants(here, system.state_at(here, robot))
        return f"it stands behind {system.robots[queue[queue.index(robot) - 1]].id}"
    inside = " ".join(system.robots[other].id for other in system.occupants(here, state))
    return f"{system.states[state]} is taken by {inside}"


def _deadlock(system: System, here: Configuration, robot: int, detail: str, orders: Orders) -> RefusedMove:
    """Find the deadlock of lowest order that the move would cause; keep the gate's words if there is none."""
    after = system.moved(here, robot)
    state = system.state_at(after, robot)
    found: tuple[int, Circuit] | None = None
    try:
        for circuit in islice(circuits_through(system, after, state), _MOST_CIRCUITS):
            order = orders.of_circuit(after, circuit)
            if order is not None and (found is None or order < found[0]):
                found = (order, circuit)
    except OrderLimitError:
        found = None
    if found is None:
        return RefusedMove(Reason.DEADLOCK, detail)
    order, circuit = found
    names = tuple(system.robots[i].id for i in circuit.robots)
    return RefusedMove(
        Reason.DEADLOCK, f"order-{order} deadlock {describe_circuit(system, circuit)}", order, names
    )
