"""Obstacles outside the system delay grants, and do nothing else."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from random import Random

from books import Books

from builders import system
from loopgate.abstraction.itinerary import Leg
from loopgate.gates import Reason, make_gate
from loopgate.model import StateId
from loopgate.negotiation.simple import OldestFirst


@dataclass
class Barrier:
    """Closed for a reason, or open."""

    reason: Reason | None
    names: Sequence[Sequence[str]] = ()
    granted_to: list[int] = field(default_factory=list)

    def in_the_way(self, robot: int) -> Reason | None:
        """Say what a test wants."""
        del robot
        return self.reason

    def granted(self, robot: int) -> None:
        """Take note."""
        self.granted_to.append(robot)

    def blockers(self, robot: int) -> Sequence[Sequence[str]]:
        """Say what a test wants."""
        del robot
        return self.names


def keeper() -> Books:
    """Two robots, each with a private state, and a state that they share."""
    robots = system({"a": "pa s", "b": "pb s"})
    legs = [(Leg(StateId(f"p{name}"), 0.0, 50.0), Leg(StateId("s"), 50.0, 100.0)) for name in ("a", "b")]
    return Books(robots, legs, make_gate("collision", robots), OldestFirst(Random(1)))


def test_an_obstacle_delays_a_grant_until_it_gives_way() -> None:
    """It is asked again every step though nothing in the system has changed, and told of the grant."""
    books, barrier = keeper(), Barrier(Reason.RED)
    books.obstacles = (barrier,)
    books.asks(0, 0.0)
    assert books.decide(0.0) == [(0, False, "red")]
    assert books.decide(0.5) == []
    assert barrier.granted_to == []
    barrier.reason = None
    assert books.decide(1.0) == [(0, True, "free")]
    assert barrier.granted_to == [0]


def test_who_waits_for_an_obstacle_waits_for_no_vehicle_of_the_system() -> None:
    """The wait-for graph has only the vehicles that the obstacle names: a red light names none."""
    books, barrier = keeper(), Barrier(Reason.RED)
    books.obstacles = (barrier,)
    books.asks(0, 0.0)
    books.decide(0.0)
    assert books.blockers(0) == []
    assert books.outside_blockers(0, ()) == []
    barrier.reason, barrier.names = Reason.TRAFFIC, [["car"]]
    books.decide(1.0)
    assert books.blockers(0) == []
    assert books.outside_blockers(0, ()) == [["car"]]


def test_a_full_state_goes_before_an_obstacle() -> None:
    """The reason is the state's, so the wait-for graph keeps its edge."""
    books, barrier = keeper(), Barrier(Reason.RED)
    books.asks(0, 0.0)
    books.decide(0.0)
    books.obstacles = (barrier,)
    books.asks(1, 1.0)
    assert books.decide(1.0) == [(1, False, "occupied")]
    assert books.blockers(1) == [[0]]
    assert books.outside_blockers(1, ()) == []
