"""The interface of gates: they admit or refuse one robot's next move."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol, runtime_checkable

from loopgate.model import Configuration


class Reason(StrEnum):
    """The reason why a gate admitted or refused a move; traces and summaries contain these words."""

    FREE = "free"
    """Admitted: no rule of the gate refuses the move."""
    STAYS = "stays"
    """Refused: the robot has no next state."""
    BEHIND = "behind"
    """Refused: another robot is ahead in the FIFO state."""
    OCCUPIED = "occupied"
    """Refused: the next state is full."""
    CROSSING = "crossing"
    """Refused: a conflicting movement is passing the junction."""
    RED = "red"
    """Refused for now: a traffic light on the way is not green, or not for long enough."""
    TRAFFIC = "traffic"
    """Refused for now: ordinary traffic, under no gate, fills the next state or is in the way."""
    DEADLOCK = "deadlock"
    """Refused: the move would cause a deadlock, or may lead to one."""
    RESERVE = "reserve"
    """Refused for now by the negotiation, which keeps room free; the reserve shrinks as the robot waits."""
    SERVICE = "service"
    """Refused for now: the next state or the way is kept for another vehicle, which must move so that a
    vehicle with a long wait goes on."""
    SPACING = "spacing"
    """Refused for some seconds: the vehicle is ahead of the middle between its neighbours on the loop."""
    NEGOTIATION = "negotiation"
    """Refused for now: another robot won the negotiation."""
    BUDGET = "budget"
    """Refused: the gate could not decide within its budget."""
    FAULT = "fault"
    """Refused: the witness failed the gate's own check. This is a bug; please report it."""
    STOP = "stop"
    """Refused for now: the vehicle has a stop before the next state, or there is no room behind a vehicle
    that stops there."""
    ANSWER = "answer"
    """Refused for now: vehicles decide by messages, and no granting answer has come."""


@dataclass(frozen=True, slots=True)
class Decision:
    """The answer of a gate to one request: admitted or not, and the reason.

    Attributes
    ----------
    admitted
        Whether the robot may enter its next state now.
    reason
        Why; see `Reason`.
    blockers
        The robots that must move before a refusal can change: in a full state, or in a circle of robots. They
        are the edges of the wait-for graph.
    detail
        One line for people, with robots and states by name; empty if the reason is enough.
    stage
        The stage that decided, for gates with several stages; otherwise empty.
    messages
        Number of messages between robots for the decision, if the gate counts them.
    """

    admitted: bool
    reason: Reason
    blockers: tuple[int, ...] = ()
    detail: str = ""
    stage: str = ""
    messages: int = 0


def refusal(reason: Reason, detail: str = "", stage: str = "", blockers: Iterable[int] = ()) -> Decision:
    """Return the decision to refuse a move; see `Decision`."""
    return Decision(admitted=False, reason=reason, blockers=tuple(blockers), detail=detail, stage=stage)


@runtime_checkable
class Gate(Protocol):
    """The interface of a gate, which admits or refuses moves of robots in one system.

    A gate class is called with the system, and with keyword options that the user may set (``--gate
    name:option=value``). It may have a static method ``check_options``, which takes the same options before a
    run and raises `GateError` on an invalid value. The caller may call `decide` at any time, and calls
    `moved` for each move that really happens, in order.
    """

    def decide(self, configuration: Configuration, robot: int) -> Decision:
        """Return the decision whether `robot` may make its next move in `configuration`.

        The answer depends only on `configuration` and on earlier calls of `moved`. Calling `decide` changes
        no later answer.
        """
        ...

    def moved(self, configuration: Configuration, robot: int) -> None:
        """Tell the gate that `robot` has made an admitted move, which led to `configuration`."""
        ...


@runtime_checkable
class FollowingGate(Gate, Protocol):
    """A gate that keeps track of the configuration itself, so that callers need not pass it.

    `decide_here` and `moved_here` are `decide` and `moved` in the configuration after all known moves. They
    save O(robots) for each move and each decision.
    """

    def decide_here(self, robot: int) -> Decision:
        """Return the decision whether `robot` may make its next move now."""
        ...

    def moved_here(self, robot: int) -> None:
        """Tell the gate that `robot` has made an admitted move."""
        ...


@runtime_checkable
class TimedGate(Gate, Protocol):
    """A gate that limits the time of its decisions, measured with a clock of the caller."""

    def use_clock(self, clock: Callable[[], float]) -> None:
        """Set the function that returns the time [s], from any origin."""
        ...
