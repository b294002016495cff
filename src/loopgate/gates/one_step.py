"""The yardstick for looking ahead: refuses only the move that closes a circular wait."""

from loopgate.gates.base import Decision, Reason, refusal
from loopgate.gates.collision import collision_decision
from loopgate.gates.deadlocks import deadlocked_robots
from loopgate.gates.following import Follower
from loopgate.model import Placement


class OneStepGate(Follower, follows=True):
    """Admits a move iff it is collision-free and leads to no deadlock in the sense of Definition 3.

    So it never drives into a circular wait, but it does drive into deadlocks of higher order (Definition 4):
    there, some robots are refused for ever, because each of their moves would close a circle. It shows what
    the other gates look ahead for.
    """

    def decide(self, configuration: Placement, robot: int) -> Decision:
        """Decide the next move of `robot`; the blockers are the robots that it would lock up.

        O(robots^2 * occupants) where the move fills a state, or the robot behind finds none with room.
        """
        system = self._system
        first = collision_decision(system, configuration, robot)
        if not first.admitted:
            return first
        left = system.state_at(configuration, robot)
        trial = self._trial(configuration)
        position = system.make(trial, robot)
        after = deadlocked_robots(system, trial) if self._may_lock(trial, robot, left) else frozenset()
        system.take_back(trial, robot, position)
        locked = after - deadlocked_robots(system, trial) - {robot} if after else after
        return refusal(Reason.DEADLOCK, blockers=sorted(locked)) if locked else first

    def _may_lock(self, after: Placement, robot: int, left: int) -> bool:
        """Return whether a robot that did not wait before waits after the move."""
        system = self._system
        if not system.has_room(after, system.state_at(after, robot)):
            return True
        head = system.head(after, left)
        return head is not None and not system.enabled(after, head)
