"""Systems without roads and clocks: exhaustive exploration, single traces, Monte Carlo rounds."""

from loopgate.untimed.exploration import Exploration, ExplorationLimitError, Witness
from loopgate.untimed.plain import explore_plainly

__all__ = ["Exploration", "ExplorationLimitError", "Witness", "explore_plainly"]
