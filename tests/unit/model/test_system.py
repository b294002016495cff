"""Numbers and names, capacities and FIFO order, moves and what may not move."""

from __future__ import annotations

import pytest

from builders import ring_of_three, robot, system
from loopgate.errors import IllegalMoveError, SystemModelError
from loopgate.model import Configuration, RobotId, StateId, System


def test_states_are_numbered_by_first_appearance() -> None:
    """State numbers follow the robots' paths, so that they do not depend on hashing."""
    s = ring_of_three()
    assert s.states == ("p1", "a", "b", "p2", "c", "p3")
    assert s.paths == ((0, 1, 2), (3, 2, 4), (5, 4, 1))


def test_a_state_of_a_single_robot_is_private() -> None:
    """Also when the robot comes back to it within a round."""
    s = system({"r1": "x a x b", "r2": "a c"})
    assert [name for name, private in zip(s.states, s.private, strict=True) if private] == ["x", "b", "c"]


def test_moves_of_a_ring() -> None:
    """Two robots enter the ring; the third may follow, and then nobody can move."""
    s = ring_of_three()
    c = s.initial
    for i in range(3):
        c = s.move(c, i)
    assert s.describe(c) == ("a", "b", "c")
    assert [s.enabled(c, i) for i in range(3)] == [False, False, False]
    with pytest.raises(IllegalMoveError, match="r1: it cannot move from a to b"):
        s.move(c, 0)


def test_each_visit_of_a_state_is_a_position() -> None:
    """A state that comes back holds one robot, whichever visit it is on."""
    s = system({"r1": "p a q a2 r a", "r2": "z a"})
    c = s.configuration((1, 0))
    assert s.occupants(c, s.states.index(StateId("a"))) == [0]
    assert not s.enabled(c, 1)
    assert not s.enabled(s.configuration((5, 0)), 1)
    assert s.enabled(s.configuration((2, 0)), 1)


def test_capacity_is_room_for_that_many() -> None:
    """The third robot does not fit into a state that holds two."""
    s = system({"r1": "p1 a", "r2": "p2 a", "r3": "p3 a"}, capacity={"a": 2})
    c = s.move(s.move(s.initial, 0), 1)
    assert s.occupancy(c)[s.states.index(StateId("a"))] == 2
    assert not s.enabled(c, 2)
    assert s.enabled(s.move(c, 0), 2)


def test_a_fifo_state_is_left_in_order_of_arrival() -> None:
    """Arrival decides who leaves first, not the robots' order."""
    s = system({"r1": "p1 a", "r2": "p2 a"}, capacity={"a": 2}, fifo=("a",))
    c = s.move(s.move(s.initial, 1), 0)
    assert c == Configuration((1, 1), ((1, 0),))
    assert [s.at_head(c, i) for i in (0, 1)] == [False, True]
    assert [s.enabled(c, i) for i in (0, 1)] == [False, True]
    assert s.move(c, 1) == Configuration((1, 0), ((0,),))


def test_a_private_fifo_state_needs_no_queue() -> None:
    """A queue of one robot is no queue."""
    assert system({"r1": "p1 a", "r2": "p2 a"}, fifo=("p1",)).initial.queues == ()


def test_a_finished_robot_stays() -> None:
    """At the end of an open path there is no next state; a shared terminal state stays occupied."""
    s = system({"r1": "p1 a", "r2": "p2 a"}, closed=False)
    c = s.move(s.initial, 0)
    assert s.finished(c, 0)
    assert s.next_state(c, 0) is None
    assert s.next_position(c, 0) is None
    assert [s.enabled(c, i) for i in (0, 1)] == [False, False]
    with pytest.raises(IllegalMoveError, match="r1: it cannot move from a to nowhere"):
        s.move(c, 0)


def test_robots_are_found_by_name() -> None:
    """An unknown name is answered with the known ones."""
    s = ring_of_three()
    assert s.robot_number(RobotId("r2")) == 1
    with pytest.raises(SystemModelError, match="robot r9: there is no such robot; there are r1, r2, r3"):
        s.robot_number(RobotId("r9"))


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: System(()), "no robots"),
        (lambda: System((robot("r1", "a"), robot("r1", "b"))), "robot r1: the id is used by 2 robots"),
        (lambda: system({"r1": "a b"}, capacity={"z": 2}), "state z: a capacity is given"),
        (
            lambda: system({"r1": "a b"}, capacity={"a": 0}),
            "state a: its capacity is 0; expected 1 to 1000000",
        ),
        (lambda: system({"r1": "a b"}, fifo=("z",)), "state z: it is listed as FIFO"),
        (
            lambda: system({"r1": "a b", "r2": "a c"}),
            "state a: robots r1, r2 start in it, but it holds 1",
        ),
    ],
)
def test_a_bad_system_is_refused(make: object, says: str) -> None:
    """The error names the robot or the state, and what was found."""
    assert callable(make)
    with pytest.raises(SystemModelError) as caught:
        make()
    assert says in str(caught.value)


def test_robots_may_start_together_where_there_is_room() -> None:
    """The check of the start counts capacities."""
    s = system({"r1": "a b", "r2": "a c"}, capacity={"a": 2}, fifo=("a",))
    assert s.initial == Configuration((0, 0), ((0, 1),))
