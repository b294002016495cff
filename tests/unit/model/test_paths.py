"""A robot's path is checked when it is made, and says what follows what."""

import pytest

from builders import robot
from loopgate.errors import SystemModelError
from loopgate.model import Robot, RobotId, StateId


def test_a_closed_path_goes_round() -> None:
    """The last position is followed by the first."""
    r = robot("r1", "a b c")
    assert [r.next_position(p) for p in range(3)] == [1, 2, 0]


def test_an_open_path_ends_where_the_robot_stays() -> None:
    """Nothing follows the terminal state."""
    r = robot("r1", "a b c", closed=False)
    assert [r.next_position(p) for p in range(3)] == [1, 2, None]


def test_a_single_state_is_never_left() -> None:
    """A closed path of one state has no move, for a move changes the state."""
    assert robot("r1", "a").next_position(0) is None


def test_a_state_may_come_back_within_a_round() -> None:
    """Each visit is a position of its own."""
    assert robot("r1", "a b a c").path == ("a", "b", "a", "c")


@pytest.mark.parametrize(
    ("path", "closed", "start", "name", "says"),
    [
        ("", True, 0, "r1", "r1: its path is empty"),
        ("a b", True, 2, "r1", "r1: start 2 is not a position on its path (0 to 1)"),
        ("a b", True, -1, "r1", "r1: start -1"),
        ("a b b c", True, 0, "r1", "r1: state b follows itself"),
        ("a b a", True, 0, "r1", "r1: state a follows itself"),
        ("a b", True, 0, "", "empty id"),
    ],
)
def test_a_bad_robot_is_refused(path: str, *, closed: bool, start: int, name: str, says: str) -> None:
    """The error names the robot, what was found and what was expected."""
    with pytest.raises(SystemModelError) as caught:
        robot(name, path, closed=closed, start=start)
    assert says in str(caught.value)


def test_the_ends_of_an_open_path_may_be_the_same_state() -> None:
    """Only neighbours on the path must differ; an open path does not close over its ends."""
    assert robot("r1", "a b a", closed=False).next_position(2) is None


@pytest.mark.parametrize("closed", [True, False])
@pytest.mark.parametrize("path", [("",), ("", "a"), ("a", "")])
def test_an_empty_state_name_is_refused(path: tuple[str, ...], *, closed: bool) -> None:
    """A state without a name could not be told from another, wherever on the path it stands."""
    with pytest.raises(SystemModelError, match="empty id"):
        Robot(RobotId("r1"), tuple(StateId(s) for s in path), closed=closed)
