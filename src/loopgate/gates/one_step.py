"""The yardstick for looking ahead: refuses only the move that closes a circular wait."""

from dataclasses import replace

from loopgate.gates.base import Decision, Reason, refusal
from loopgate.gates.collision import collision_decision
from loopgate.gates.deadlocks import deadlocked_robots
from loopgate.model import Configuration, System


class OneStepGate:
    """Admits a move iff it is collision-free and leads to no deadlock in the sense of Definition 3.

    So it never drives into a circular wait, but it does drive into deadlocks of higher order (Definition 4):
    there, some robots are refused for ever, because each of their moves would close a circle. It shows what
    the other gates look ahead for.
    """

    def __init__(self, system: System) -> None:
        self._system = system

    def decide(self, configuration: Configuration, robot: int) -> Decision:
        """Decide the next move of `robot`; the blockers are the robots that it would lock up.

        O(robots^2 * occupants) where the move fills a state, or the robot behind finds none with room.
        """
        first = collision_decision(self._system, configuration, robot)
        if not first.admitted:
            return first
        moved = self._system.moved(configuration, robot)
        admitted = replace(first, after=moved)
        if not self._may_lock(configuration, moved, robot):
            return admitted
        before = deadlocked_robots(self._system, configuration)
        after = deadlocked_robots(self._system, moved)
        locked = after - before - {robot}
        if not locked:
            return admitted
        return refusal(Reason.DEADLOCK, blockers=sorted(locked))

    def _may_lock(self, configuration: Configuration, after: Configuration, robot: int) -> bool:
        """Return whether somebody waits after the move who did not: for the robot, or as the next head."""
        system = self._system
        if not system.has_room(after, system.state_at(after, robot)):
            return True
        head = system.head(after, system.state_at(configuration, robot))
        return head is not None and not system.enabled(after, head)

    def moved(self, configuration: Configuration, robot: int) -> None:
        """Do nothing: the gate has no memory."""
