"""All configurations of a system without roads and clocks that a gate reaches, and whether they are safe."""

from loopgate.research.state_space.exploration import ExplorationFigures, explore, verify_walks
from loopgate.research.state_space.reach import Counterexample
from loopgate.research.state_space.space import ExplorationLimitError, StateSpace
from loopgate.research.state_space.verification import Verification, verify_everywhere, verify_space

__all__ = [
    "Counterexample",
    "ExplorationFigures",
    "ExplorationLimitError",
    "StateSpace",
    "Verification",
    "explore",
    "verify_everywhere",
    "verify_space",
    "verify_walks",
]
