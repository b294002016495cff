"""The interface of gates: they admit or refuse one robot's next move."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol, Self, runtime_checkable

from loopgate.model import Configuration


class Reason(StrEnum):
    """The reason why a gate or a rule admitted or refused a move; traces and summaries contain these words.

    Attributes
    ----------
    words
        Why a vehicle waits, in the words of the replay and of `Attached.why`.
    for_others
        Whether a vehicle that is refused for it waits for vehicles under the gate. It does not if they cannot
        end the refusal by moving on.
    """

    words: str
    for_others: bool

    def __new__(cls, value: str, words: str, for_others: bool = True) -> Self:  # noqa: FBT001, FBT002  a row
        """Make a reason of its name, its words, and whether a vehicle waits for others."""
        made = str.__new__(cls, value)
        made._value_, made.words, made.for_others = value, words, for_others
        return made

    FREE = "free", "admitted"
    """Admitted: no rule of the gate refuses the move."""
    STAYS = "stays", "it has arrived"
    """Refused: the robot has no next state."""
    BEHIND = "behind", "another stands before it"
    """Refused: another robot is ahead in the FIFO state."""
    OCCUPIED = "occupied", "the next place is full"
    """Refused: the next state is full."""
    CROSSING = "crossing", "a conflicting movement has the crossing"
    """Refused: a conflicting movement is passing the junction."""
    RED = "red", "a traffic light is not green for long enough", False
    """Refused for now: a traffic light on the way is not green, or not for long enough."""
    TRAFFIC = "traffic", "ordinary traffic is in the way", False
    """Refused for now: ordinary traffic, under no gate, fills the next state or is in the way."""
    DEADLOCK = "deadlock", "the move would cause a deadlock, or may lead to one"
    """Refused: the move would cause a deadlock, or may lead to one."""
    RESERVE = "reserve", "a slot is kept free there"
    """Refused for now by the negotiation, which keeps room free; the reserve shrinks as the robot waits."""
    SERVICE = "service", "the slot is kept for a vehicle that has waited long"
    """Refused for now: the next state or the way is kept for another vehicle, which must move so that a
    vehicle with a long wait goes on."""
    SPACING = "spacing", "it is ahead of the middle between its neighbours on the loop", False
    """Refused for some seconds: the vehicle is ahead of the middle between its neighbours on the loop."""
    NEGOTIATION = "negotiation", "another vehicle goes first"
    """Refused for now: another robot won the negotiation."""
    BUDGET = "budget", "the gate could not decide in time"
    """Refused: the gate could not decide within its budget."""
    FAULT = "fault", "the witness failed the gate's own check"
    """Refused: the witness failed the gate's own check. This is a bug; please report it."""
    STOP = "stop", "the vehicle stops before that", False
    """Refused for now: the vehicle has a stop before the next state, or there is no room behind a vehicle
    that stops there."""
    CLOSED = "closed", "the next street is closed", False
    """Refused until the next state is open again."""
    BLOCKED = "blocked", "a vehicle stands there for long"
    """Refused as long as a vehicle that broke down, or stands for another cause, is in the next state or on
    the crossing."""
    ANSWER = "answer", "no answer has come yet"
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
