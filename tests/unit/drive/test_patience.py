"""Who waits too long for a crossing that others keep busy is let pass."""

from collections.abc import Mapping, Sequence
from random import Random

import pytest
from books import Books

from builders import system
from loopgate.abstraction.itinerary import Crossing, Leg
from loopgate.gates import Decision, Gate, Reason, make_gate
from loopgate.model import Configuration, System
from loopgate.negotiation.simple import OldestFirst

X, Y = Crossing("x", frozenset({"y"})), Crossing("y", frozenset({"x"}))


def keeper(robots: System, crossings: Mapping[str, Crossing], gate: Gate | None = None) -> Books:
    """Let each robot of two states drive from the first to the second over its crossing, if it has one."""
    legs = [
        (
            Leg(robot.path[0], 0.0, 40.0, (crossings[robot.id],) if robot.id in crossings else ()),
            Leg(robot.path[1], 50.0, 100.0),
        )
        for robot in robots.robots
    ]
    return Books(robots, legs, gate or make_gate("collision", robots), OldestFirst(Random(1)))


def three() -> Books:
    """Robot a crosses by x; b and c cross by y, one behind the other; x and y exclude each other."""
    return keeper(system({name: f"p{name} q{name}" for name in "abc"}), {"a": X, "b": Y, "c": Y})


A, B, C, D, E, F = range(6)


@pytest.mark.parametrize(("waited_s", "passed"), [(29.0, True), (30.0, False)])
def test_one_in_a_place_that_others_wait_for_is_passed_over_for_ten_seconds_only(
    waited_s: float,
    passed: bool,  # noqa: FBT001  a case
) -> None:
    """D waits for the slot that A leaves; once it has done so for half a minute, C no longer follows B."""
    robots = system({"a": "s qa", "b": "pb qb", "c": "pc qc", "d": "pd s"})
    books = keeper(robots, {"a": X, "b": Y, "c": Y})
    books.asks(D, 0.0)
    books.asks(B, 0.0)
    books.decide(0.0)
    now = waited_s
    books.asks(A, now - 10.0)
    assert books.decide(now - 10.0) == [(A, False, "crossing")]
    books.asks(C, now)
    assert books.decide(now) == [(C, passed, "free" if passed else "crossing")]


@pytest.mark.parametrize("late", [False, True])
def test_after_a_minute_nobody_may_set_out_across_its_way(late: bool) -> None:  # noqa: FBT001  a case
    """C may follow B while A has waited for 59 s, no longer at 60 s: then A goes first, and C waits for A."""
    books = three()
    books.asks(B, 0.0)
    books.decide(0.0)
    books.asks(A, 1.0)
    assert books.decide(1.0) == [(A, False, "crossing")]
    now = 61.0 if late else 60.0
    books.asks(C, now)
    assert books.decide(now) == [(C, not late, "crossing" if late else "free")]
    if not late:
        return
    assert books.blockers(C) == [[A]]
    books.cleared(B, 0)
    assert books.decide(now + 1) == [(A, True, "free")]
    assert books.decide(now + 2) == []
    books.cleared(A, 0)
    assert books.decide(now + 3) == [(C, True, "free")]


class Red:
    """A light that is red for one robot."""

    def __init__(self, robot: int) -> None:
        self.robot = robot

    def in_the_way(self, robot: int) -> Reason | None:
        """Refuse that one."""
        return Reason.RED if robot == self.robot else None

    def granted(self, robot: int) -> None:
        """Do nothing."""

    def blockers(self, robot: int) -> Sequence[Sequence[str]]:
        """Return nobody."""
        del robot
        return ()


@pytest.mark.parametrize(("waited_s", "passed"), [(9.0, True), (10.0, False)])
def test_one_behind_the_middle_of_its_loop_is_passed_over_for_ten_seconds_only(
    waited_s: float,
    passed: bool,  # noqa: FBT001  a case
) -> None:
    """A is late for the streets of its loop: C follows B before it for so long, then no more."""
    books = three()
    books.columns["spare_s"][A] = -0.5
    books.asks(B, 0.0)
    books.decide(0.0)
    books.asks(A, 1.0)
    assert books.decide(1.0) == [(A, False, "crossing")]
    now = 1.0 + waited_s
    books.asks(C, now)
    assert books.decide(now) == [(C, passed, "free" if passed else "crossing")]


def test_one_step_never_sends_two_across_each_others_way() -> None:
    """Both ways are clear when A and B ask; who comes second finds the first on the way."""
    books = three()
    books.asks(A, 0.0)
    books.asks(B, 0.0)
    assert books.decide(0.0) == [(A, True, "free"), (B, False, "crossing")]


class Refusing:
    """A gate that refuses one robot."""

    def __init__(self, robot: int) -> None:
        self.robot = robot

    def decide(self, configuration: Configuration, robot: int) -> Decision:
        """Refuse that one."""
        del configuration
        refused = robot == self.robot
        return Decision(admitted=not refused, reason=Reason.DEADLOCK if refused else Reason.FREE)

    def moved(self, configuration: Configuration, robot: int) -> None:
        """Take note of nothing."""


@pytest.mark.parametrize(("at_s", "passed"), [(63.5, True), (70.5, True), (71.0, False)])
def test_one_that_the_gate_refused_keeps_nothing_for_ten_seconds(at_s: float, passed: bool) -> None:  # noqa: FBT001  a case
    """D is out of A's way at 61 s, but the gate refuses A; then B sets out: C may follow until 71 s."""
    robots = system({name: f"p{name} q{name}" for name in "abcd"})
    books = keeper(robots, {"a": X, "b": Y, "c": Y, "d": Y}, Refusing(A))
    books.asks(D, 0.0)
    books.decide(0.0)
    books.asks(A, 0.5)
    books.decide(0.5)
    books.cleared(D, 0)
    assert books.decide(61.0) == [(A, False, "deadlock")]
    books.asks(B, 61.5)
    assert books.decide(61.5) == [(B, True, "free")]
    assert books.decide(62.5) == [(A, False, "crossing")]
    books.asks(C, at_s)
    assert books.decide(at_s) == [(C, passed, "free" if passed else "crossing")]


def test_of_two_that_were_passed_over_the_older_goes_first() -> None:
    """A and D have both waited for B for a minute, and are in each other's way."""
    x, y, z = (Crossing(name, frozenset("xyz") - {name}) for name in "xyz")
    robots = system({name: f"p{name} q{name}" for name in "abcd"})
    books = keeper(robots, {"a": x, "b": z, "d": y})
    books.asks(B, 0.0)
    books.decide(0.0)
    books.asks(A, 1.0)
    books.asks(D, 2.0)
    books.decide(2.0)
    books.decide(63.0)
    books.cleared(B, 0)
    assert books.decide(64.0) == [(A, True, "free")]


def test_nobody_keeps_a_way_to_a_slot_that_is_kept_for_another() -> None:
    """The last slot of s is A's, which waits for E; C may set out across D's way, which D cannot use yet."""
    robots = system(
        {"a": "pa s", "b": "s pb", "c": "pc qc", "d": "pd s", "e": "pe qe", "f": "pf qf"},
    )
    pairs = {"a": ("x", "u"), "c": ("z", "y"), "d": ("y", "z"), "f": ("t", "u")}
    crossings = {name: Crossing(mine, frozenset({foe})) for name, (mine, foe) in pairs.items()}
    books = keeper(robots, {**crossings, "e": Crossing("u", frozenset({"x", "t"}))})
    books.asks(F, 0.0)
    books.decide(0.0)
    for robot, at_s in ((E, 0.0), (A, 1.0), (D, 2.0)):
        books.asks(robot, at_s)
    books.decide(2.0)
    books.asks(B, 60.0)
    books.decide(60.0)
    books.left(B, robots.paths[B][0])
    books.asks(C, 63.0)
    assert (C, True, "free") in books.decide(63.0)


def test_nobody_is_said_to_wait_for_one_that_something_else_keeps() -> None:
    """A's light is red: from the next step on its way is no longer kept clear, and C may go."""
    books = three()
    books.asks(B, 0.0)
    books.decide(0.0)
    books.asks(A, 1.0)
    books.decide(1.0)
    books.asks(C, 61.0)
    assert books.decide(61.0) == [(C, False, "crossing")]
    assert books.blockers(C) == [[A]]
    books.cleared(B, 0)
    books.withhold(Reason.RED, A)
    assert books.decide(62.0) == [(A, False, "red")]
    assert books.blockers(C) == []
    assert books.decide(63.0) == [(C, True, "free")]


def test_after_a_minute_nobody_takes_the_slot_that_it_waits_for() -> None:
    """B leaves the place that A and D want, when A's way is not clear: D, whose way is, has to wait for A."""
    robots = system({"a": "pa s", "b": "s pb", "c": "pc qc", "d": "pd s"})
    books = keeper(robots, {"a": X, "c": Y})
    books.asks(A, 0.0)
    books.asks(D, 1.0)
    assert books.decide(1.0) == [(A, False, "occupied"), (D, False, "occupied")]
    books.asks(B, 60.0)
    books.asks(C, 60.0)
    assert books.decide(60.0) == [(B, True, "free"), (C, True, "free")]
    books.left(B, robots.paths[B][0])
    assert books.decide(61.0) == [(A, False, "crossing")]
    assert books.blockers(D) == [[A]]
    books.cleared(C, 0)
    assert books.decide(62.0) == [(A, True, "free")]


def test_two_that_wait_for_one_slot_never_keep_something_from_each_other() -> None:
    """While A's light is red slot and way are kept for D; after that A gets both, and not the slot alone."""
    robots = system({"a": "pa s", "b": "s pb", "c": "pc qc", "d": "pd s"})
    z = Crossing("z", frozenset({"y"}))
    books = keeper(robots, {"a": X, "c": z, "d": Crossing("y", frozenset({"x", "z"}))})
    books.asks(A, 0.0)
    books.asks(D, 1.0)
    books.decide(1.0)
    books.asks(B, 60.0)
    books.asks(C, 60.0)
    books.decide(60.0)
    books.left(B, robots.paths[B][0])
    books.withhold(Reason.RED, A)
    assert books.decide(61.0) == [(A, False, "red")]
    assert books.decide(62.0) == [(A, False, "occupied"), (D, False, "crossing")]
    books.withhold()
    assert sorted(books.decide(63.0)) == [(A, True, "free"), (D, False, "occupied")]
