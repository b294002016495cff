"""What an exhaustive exploration finds."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from loopgate.errors import LoopgateError
from loopgate.model import RobotId, StateId

__all__ = ["Exploration", "ExplorationLimitError", "Witness"]


class ExplorationLimitError(LoopgateError):
    """The system has more configurations than memory or the user allows."""


@dataclass(frozen=True, slots=True)
class Witness:
    """A shortest way to a configuration that the gate should not have let come about.

    Attributes
    ----------
    kind
        ``unsafe`` (not live), else ``stuck`` (live, but the gate admits nothing).
    moves
        The robots that move, from the start on.
    configuration
        Where the robots stand in the end, robot by robot.
    """

    kind: str
    moves: tuple[RobotId, ...]
    configuration: tuple[StateId, ...]


@dataclass(frozen=True, slots=True)
class Exploration:
    """Figures of all configurations that are reachable from the start under a gate.

    Attributes
    ----------
    configurations
        How many there are; a configuration is the robots' positions (and the order within FIFO states).
    transitions
        Admitted moves among them.
    live
        How many of them are live: every robot can go on for ever, were the gate not there.
    deadlocks
        How many have a circular wait (Def. 3).
    higher_order
        How many are neither live nor a deadlock, by order (Def. 11), with those of no order under
        ``"unordered"``. None where some robot has no private or terminal state.
    stuck
        How many are unfinished though the gate admits nothing.
    unsafe_admitted
        How many are not live though an admitted move leads to them.
    seconds
        Wall-clock time of the exploration [s].
    witness
        A shortest counterexample, if one was asked for and there is one.
    """

    configurations: int
    transitions: int
    live: int
    deadlocks: int
    higher_order: dict[str, int] | None
    stuck: int
    unsafe_admitted: int
    seconds: float
    witness: Witness | None = field(default=None)

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as a JSON object, without the witness."""
        return {
            "configurations": self.configurations,
            "transitions": self.transitions,
            "live": self.live,
            "deadlocks": self.deadlocks,
            "higher_order": self.higher_order,
            "stuck": self.stuck,
            "unsafe_admitted": self.unsafe_admitted,
            "seconds": round(self.seconds, 3),
        }
