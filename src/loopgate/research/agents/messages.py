"""Messages between robots."""

from dataclasses import dataclass
from enum import StrEnum

from loopgate.gates.circuits import Circuit
from loopgate.gates.walks import Walk


class Kind(StrEnum):
    """The kinds of messages between agents."""

    VISIT = "visit"
    """Step 2 of Algorithm 1: a chain of risky walks looks for its way back to the asking robot."""
    REPLY = "reply"
    """The circuits found behind a visit."""
    CIRCUIT = "circuit"
    """Step 3: the asking robot makes a circuit known and asks its robots to check it."""
    CHECK = "check"
    """The answer: whether the robot's one-step move would free the circuit."""
    DELAY = "delay"
    """`Neg`: a robot tells the coordinator the delay it has drawn."""
    GRANT = "grant"
    """`Neg`: the coordinator names the robot with the least delay."""
    CLAIM = "claim"
    """The winner asks everybody to stand still for this round."""
    AGREE = "agree"
    """A robot agrees, to one robot a round."""


@dataclass(frozen=True, slots=True)
class Visit:
    """A question to a robot about the circuits through a state: ``(r_j, <r_i, s>, RW, Index)`` in the paper.

    ``visited`` are the collision states of the robots of the walks, for ``S_alpha(W)``.
    """

    asker: int
    state: int
    walks: tuple[Walk, ...]
    visited: tuple[frozenset[int], ...]
    index: frozenset[int]


@dataclass(frozen=True, slots=True)
class Circuits:
    """Answer to the visit with number ``visit``: circuits with their robots' collision states, and costs."""

    visit: int
    circuits: tuple[tuple[Circuit, tuple[frozenset[int], ...]], ...]
    depth: int
    hops: int


@dataclass(frozen=True, slots=True)
class Question:
    """A circuit to check, with the asking robot standing in ``state`` instead of where it is seen."""

    asker: int
    state: int
    circuit: Circuit
    visited: tuple[frozenset[int], ...]


@dataclass(frozen=True, slots=True)
class Verdict:
    """Answer to the question with number ``question``."""

    question: int
    frees: bool


@dataclass(frozen=True, slots=True)
class Claim:
    """Negotiation: the round it is for, the robot concerned, and the delay drawn."""

    round: int
    robot: int
    delay: float = 0.0


Payload = Visit | Circuits | Question | Verdict | Claim


@dataclass(frozen=True, slots=True)
class Message:
    """One message; ``number`` is unique, so that copies are recognised."""

    number: int
    kind: Kind
    sender: int
    receiver: int
    payload: Payload
