"""The search among what a gate lets come about."""

from __future__ import annotations

from loopgate.gates import Decision, Reason
from loopgate.model import Configuration, Robot, RobotId, StateId, System
from loopgate.research.state_space import StateSpace
from loopgate.research.state_space.reach import Reach, ask_gate


class _Patient:
    """Lets r1 move only while r2 is away from where it began."""

    def decide(self, configuration: Configuration, robot: int) -> Decision:
        return Decision(robot == 1 or configuration.positions[1] == 1, Reason.FREE)

    def moved(self, configuration: Configuration, robot: int) -> None:
        del configuration, robot


def test_a_way_is_shortest_under_the_gate() -> None:
    """r1 goes to its end, r2 round and round; without the gate (1, 0) comes before (1, 1), with it after."""
    one = Robot(RobotId("r1"), (StateId("a"), StateId("b")), closed=False)
    system = System([one, Robot(RobotId("r2"), (StateId("c"), StateId("d")))])
    space = StateSpace(system)
    reach = Reach(space, ask_gate(space, _Patient()))
    found = [space.configuration(number).positions for number in reach.order.tolist()]
    assert found == [(0, 0), (0, 1), (1, 1), (1, 0)]
    assert space.number(Configuration((1, 0))) < space.number(Configuration((1, 1)))
    assert reach.way(space.number(Configuration((1, 1)))) == [1, 0]
    assert reach.way(space.number(Configuration((1, 0)))) == [1, 0, 1]
    assert reach.ways.sum() == 5
