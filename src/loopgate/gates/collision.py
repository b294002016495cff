"""Collision avoidance alone (Zhou et al. 2020, Section 4.1): mutual exclusion, no look-ahead."""

from loopgate.gates.base import Decision, Reason, refusal
from loopgate.gates.following import Follower
from loopgate.model import Placement, System

_FREE = Decision(admitted=True, reason=Reason.FREE)


def collision_decision(system: System, configuration: Placement, robot: int) -> Decision:
    """Decide the next move of `robot` by capacities and FIFO order alone: ``Sign(next) == 0``.

    Every gate but `open` begins with this. O(visitors of the next state).
    """
    state = system.next_state(configuration, robot)
    if state is None:
        return refusal(Reason.STAYS)
    if not system.at_head(configuration, robot):
        queue = system.occupants(configuration, system.state_at(configuration, robot))
        ahead = queue[queue.index(robot) - 1]
        return refusal(Reason.BEHIND, blockers=(ahead,))
    if not system.has_room(configuration, state):
        return refusal(Reason.OCCUPIED, blockers=system.occupants(configuration, state))
    return _FREE


class CollisionGate(Follower, follows=True):
    """Admits every move into a private state or a state with a free slot. It avoids no deadlocks."""

    def decide(self, configuration: Placement, robot: int) -> Decision:
        """Admit the move iff the robot is movable: its next state is private or has room."""
        return collision_decision(self._system, configuration, robot)
