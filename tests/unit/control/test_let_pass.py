"""A vehicle that waits too long for a crossing or a slot that others keep busy is let pass."""

from __future__ import annotations

from collections.abc import Mapping
from random import Random

import pytest
from by_hand import ByHand, by_hand

from builders import system
from loopgate.abstraction.itinerary import Crossing, DrawnLeg
from loopgate.gates import Decision, Gate, Reason, make_gate
from loopgate.model import Configuration, System
from loopgate.negotiation.simple import OldestFirst

X, Y = Crossing("x", frozenset({"y"})), Crossing("y", frozenset({"x"}))


def keeper(robots: System, crossings: Mapping[str, Crossing], gate: Gate | None = None) -> ByHand:
    """Let each vehicle of two places drive from the first to the second over its crossing, if it has one."""
    legs = [
        (
            DrawnLeg(robot.path[0], 0.0, 9.0, (crossings[robot.id],) if robot.id in crossings else ()),
            DrawnLeg(robot.path[1], 10.0, 19.0),
        )
        for robot in robots.robots
    ]
    orders = OldestFirst(Random(1))
    return ByHand(robots, legs, gate or make_gate("collision", robots), orders, serve_after_s=0.0)


def three() -> ByHand:
    """Vehicle a crosses by x; b and c cross by y, one behind the other; x and y exclude each other."""
    return keeper(system({name: f"p{name} q{name}" for name in "abc"}), {"a": X, "b": Y, "c": Y})


@pytest.mark.parametrize(("waited_s", "told"), [(29.0, "granted"), (30.0, "crossing")])
def test_one_in_a_place_that_others_wait_for_is_passed_over_for_ten_seconds_only(
    waited_s: float, told: str
) -> None:
    """Vehicle d waits for the slot that a leaves; once it has for half a minute, c no longer follows b."""
    robots = system({"a": "s qa", "b": "pb qb", "c": "pc qc", "d": "pd s"})
    hand = keeper(robots, {"a": X, "b": Y, "c": Y})
    hand.asks("d", 0.0)
    hand.asks("b", 0.0)
    hand.decide(0.0)
    hand.asks("a", waited_s - 10.0)
    assert hand.decide(waited_s - 10.0) == [("a", "crossing")]
    hand.asks("c", waited_s)
    assert hand.decide(waited_s) == [("c", told)]


@pytest.mark.parametrize("late", [False, True])
def test_after_a_minute_no_vehicle_may_set_out_across_its_way(late: bool) -> None:  # noqa: FBT001  a case
    """While a has waited for 59 s c may follow b, at 60 s no longer: then a goes first, and c waits for a."""
    hand = three()
    hand.asks("b", 0.0)
    hand.decide(0.0)
    hand.asks("a", 1.0)
    assert hand.decide(1.0) == [("a", "crossing")]
    now_s = 61.0 if late else 60.0
    hand.asks("c", now_s)
    assert hand.decide(now_s) == [("c", "crossing" if late else "granted")]
    if not late:
        return
    assert hand.blockers("c") == [["a"]]
    hand.cleared("b")
    assert hand.decide(now_s + 1) == [("a", "granted")]
    assert hand.decide(now_s + 2) == []
    hand.cleared("a")
    assert hand.decide(now_s + 3) == [("c", "granted")]


@pytest.mark.parametrize(("waited_s", "told"), [(9.0, "granted"), (10.0, "crossing")])
def test_one_behind_the_middle_of_its_loop_is_passed_over_for_ten_seconds_only(
    waited_s: float, told: str
) -> None:
    """It is late for the streets of its loop: c follows b before it for so long, then no more."""
    hand = three()
    hand.ledger.keeping.is_behind = lambda vehicle: vehicle.name == "a"
    hand.asks("b", 0.0)
    hand.decide(0.0)
    hand.asks("a", 1.0)
    assert hand.decide(1.0) == [("a", "crossing")]
    hand.asks("c", 1.0 + waited_s)
    assert hand.decide(1.0 + waited_s) == [("c", told)]


def test_one_step_never_sends_two_across_each_others_way() -> None:
    """Both ways are clear when a and b ask; the second finds the first on the way."""
    hand = three()
    hand.asks("a", 0.0)
    hand.asks("b", 0.0)
    assert hand.decide(0.0) == [("a", "granted"), ("b", "crossing")]


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


@pytest.mark.parametrize(("at_s", "told"), [(63.5, "granted"), (70.5, "granted"), (71.0, "crossing")])
def test_one_that_the_gate_refused_keeps_nothing_for_ten_seconds(at_s: float, told: str) -> None:
    """Vehicle d is out of the way of a at 61 s, but the gate refuses a; then b sets out, and c until 71 s."""
    robots = system({name: f"p{name} q{name}" for name in "abcd"})
    hand = keeper(robots, {"a": X, "b": Y, "c": Y, "d": Y}, Refusing(0))
    hand.asks("d", 0.0)
    hand.decide(0.0)
    hand.asks("a", 0.5)
    hand.decide(0.5)
    hand.cleared("d")
    assert hand.decide(61.0) == [("a", "deadlock")]
    hand.asks("b", 61.5)
    assert hand.decide(61.5) == [("b", "granted")]
    assert hand.decide(62.5) == [("a", "crossing")]
    hand.asks("c", at_s)
    assert hand.decide(at_s) == [("c", told)]


def test_of_two_that_were_passed_over_the_older_goes_first() -> None:
    """Both a and d have waited for b for a minute, and are in each other's way."""
    x, y, z = (Crossing(name, frozenset("xyz") - {name}) for name in "xyz")
    robots = system({name: f"p{name} q{name}" for name in "abcd"})
    hand = keeper(robots, {"a": x, "b": z, "d": y})
    hand.asks("b", 0.0)
    hand.decide(0.0)
    hand.asks("a", 1.0)
    hand.asks("d", 2.0)
    hand.decide(2.0)
    hand.decide(63.0)
    hand.cleared("b")
    assert hand.decide(64.0) == [("a", "granted")]


def test_no_way_is_kept_to_a_slot_that_is_kept_for_another() -> None:
    """The last slot of s is for a, which waits for e; c may set out across the way that d cannot use yet."""
    robots = system({"a": "pa s", "b": "s pb", "c": "pc qc", "d": "pd s", "e": "pe qe", "f": "pf qf"})
    pairs = {"a": ("x", "u"), "c": ("z", "y"), "d": ("y", "z"), "f": ("t", "u")}
    crossings = {name: Crossing(mine, frozenset({foe})) for name, (mine, foe) in pairs.items()}
    hand = keeper(robots, {**crossings, "e": Crossing("u", frozenset({"x", "t"}))})
    hand.asks("f", 0.0)
    hand.decide(0.0)
    for name, at_s in (("e", 0.0), ("a", 1.0), ("d", 2.0)):
        hand.asks(name, at_s)
    hand.decide(2.0)
    hand.asks("b", 60.0)
    hand.decide(60.0)
    hand.left("b")
    hand.asks("c", 63.0)
    assert ("c", "granted") in hand.decide(63.0)


def test_no_vehicle_is_said_to_wait_for_one_that_something_else_keeps() -> None:
    """The light of a is red: from the next step on its way is no longer kept clear, and c may go."""
    hand = three()
    hand.asks("b", 0.0)
    hand.decide(0.0)
    hand.asks("a", 1.0)
    hand.decide(1.0)
    hand.asks("c", 61.0)
    assert hand.decide(61.0) == [("c", "crossing")]
    assert hand.blockers("c") == [["a"]]
    hand.cleared("b")
    hand.withhold("red", "a")
    assert hand.decide(62.0) == [("a", "red")]
    assert hand.blockers("c") == []
    assert hand.decide(63.0) == [("c", "granted")]


def test_after_a_minute_no_vehicle_takes_the_slot_that_another_waits_for() -> None:
    """When b leaves the place that a and d want, the way of a is not clear: d, whose way is, waits for a."""
    robots = system({"a": "pa s", "b": "s pb", "c": "pc qc", "d": "pd s"})
    hand = keeper(robots, {"a": X, "c": Y})
    hand.asks("a", 0.0)
    hand.asks("d", 1.0)
    assert hand.decide(1.0) == [("a", "occupied"), ("d", "occupied")]
    hand.asks("b", 60.0)
    hand.asks("c", 60.0)
    assert hand.decide(60.0) == [("b", "granted"), ("c", "granted")]
    hand.left("b")
    assert hand.decide(61.0) == [("a", "crossing")]
    assert hand.blockers("d") == [["a"]]
    hand.cleared("c")
    assert hand.decide(62.0) == [("a", "granted")]


def test_two_that_wait_for_one_slot_never_keep_something_from_each_other() -> None:
    """While the light of a is red slot and way are for d; after that a gets both, and not the slot alone."""
    robots = system({"a": "pa s", "b": "s pb", "c": "pc qc", "d": "pd s"})
    z = Crossing("z", frozenset({"y"}))
    hand = keeper(robots, {"a": X, "c": z, "d": Crossing("y", frozenset({"x", "z"}))})
    hand.asks("a", 0.0)
    hand.asks("d", 1.0)
    hand.decide(1.0)
    hand.asks("b", 60.0)
    hand.asks("c", 60.0)
    hand.decide(60.0)
    hand.left("b")
    hand.withhold("red", "a")
    assert hand.decide(61.0) == [("a", "red")]
    assert hand.decide(62.0) == [("a", "occupied"), ("d", "crossing")]
    hand.withhold()
    assert hand.decide(63.0) == [("a", "granted")]
    hand.cleared("c")
    assert hand.decide(64.0) == [("d", "occupied")]


@pytest.mark.parametrize("gate", ["collision", "certified"])
def test_a_grant_is_withheld_until_it_is_no_more(gate: str) -> None:
    """It is looked at again in each step though nothing in the ledger has changed, and told once."""
    hand = by_hand({"a": "p s", "b": "s p"}, {"p": 3, "s": 3}, gate=gate)
    for reason in ("red", "traffic"):
        hand.withhold(reason, "a")
        hand.asks("a", 0.0)
        assert hand.decide(0.0) == [("a", reason)]
        assert hand.blockers("a") == []
        assert hand.decide(0.5) == []
    hand.withhold()
    assert hand.decide(1.0) == [("a", "granted")]


def test_a_full_place_goes_before_what_is_withheld() -> None:
    """The reason is that of the place, so it is known for which vehicle the other waits."""
    hand = keeper(system({"a": "pa s", "b": "pb s"}), {})
    hand.asks("a", 0.0)
    hand.decide(0.0)
    hand.withhold("red", "b")
    hand.asks("b", 1.0)
    assert hand.decide(1.0) == [("b", "occupied")]
    assert hand.blockers("b") == [["a"]]


@pytest.mark.parametrize("leaving", ["a", "b", "ab"])
def test_a_vehicle_that_leaves_before_it_is_answered_is_looked_at_no_more(leaving: str) -> None:
    """All others are, whether they asked before or after."""
    hand = by_hand({"a": "p s", "b": "q s", "c": "r s"}, dict.fromkeys("pqrs", 3))
    assert hand.decide(5.0) == []
    for name in "abc":
        hand.asks(name, 5.0)
    for name in leaving:
        hand.ledger.leave(hand[name])
    assert len(hand.ledger.waiting) == 3 - len(leaving)
    assert sorted(hand.decide(5.0)) == [(name, "granted") for name in "abc" if name not in leaving]
    assert hand.decide(5.0) == []
