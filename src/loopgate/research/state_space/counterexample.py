"""Where a gate breaks its promise, and what it promises."""

from dataclasses import dataclass

from loopgate.gates import Gate
from loopgate.model import RobotId, StateId


@dataclass(frozen=True, slots=True)
class Counterexample:
    """A way to where a gate breaks its promise."""

    kind: str
    """``unsafe``: the last move was admitted though it is not safe. ``stuck``: nothing is admitted there
    though not all have finished. ``disabled``: the last move breaks a capacity or an order."""
    moves: tuple[RobotId, ...]
    """The robots that move, from the start on; where all configurations are looked at, no way is shorter."""
    configuration: tuple[StateId, ...]
    """The states in which the robots then stand."""


def promise_of(gate: Gate) -> str:
    """Return what `gate` is judged by: ``everyone`` or ``somebody`` can go on for ever.

    Its attribute ``promise`` says which; a gate that does not say is taken to promise everyone.
    """
    return str(getattr(gate, "promise", "everyone"))
