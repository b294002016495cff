"""Systems without roads and clocks: exhaustive exploration, single traces, Monte Carlo rounds."""

import loopgate.kernel_cache  # noqa: F401  says where compiled code is kept, before there is any
from loopgate.untimed.checking import verify_everywhere, verify_walks
from loopgate.untimed.exploration import Exploration, ExplorationLimitError, Witness
from loopgate.untimed.montecarlo import Rounds, run_rounds
from loopgate.untimed.native import explore
from loopgate.untimed.path_change import PathChangeError, change_path
from loopgate.untimed.plain import explore_plainly
from loopgate.untimed.trace import Refusal, Step, trace_moves
from loopgate.untimed.variety import any_shape, any_system
from loopgate.untimed.verification import Counterexample, Verification

__all__ = [
    "Counterexample",
    "Exploration",
    "ExplorationLimitError",
    "PathChangeError",
    "Refusal",
    "Rounds",
    "Step",
    "Verification",
    "Witness",
    "any_shape",
    "any_system",
    "change_path",
    "explore",
    "explore_plainly",
    "run_rounds",
    "trace_moves",
    "verify_everywhere",
    "verify_walks",
]
