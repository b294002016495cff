"""VBanker, the variant of the Banker's algorithm that Zhou et al. 2020 compare with (Section 5.3)."""

from loopgate.gates.algorithm2 import safe_walk
from loopgate.gates.base import Decision, Reason, refusal
from loopgate.gates.collision import collision_decision
from loopgate.gates.following import Follower
from loopgate.model import Placement


class BankerGate(Follower, follows=True):
    """The gate ``banker``: it admits a move if all states up to the robot's next private state have room.

    From a configuration in which every robot but the movers has such a way, it never leads to a deadlock; but
    it forbids much, and where a robot has no private state it never moves at all. (Kalinovcic et al. 2011,
    Reveliotis and Roszkowska 2011.)
    """

    def decide(self, configuration: Placement, robot: int) -> Decision:
        """Decide the next move of `robot`. O(path length * visitors per state)."""
        first = collision_decision(self._system, configuration, robot)
        if not first.admitted or safe_walk(self._system, configuration, robot) is not None:
            return first
        return refusal(Reason.DEADLOCK, "no safe walk to a private state")
