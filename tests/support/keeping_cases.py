"""What is kept for vehicles that are served, as cases that raise where it is not; see `by_hand`."""

from __future__ import annotations

import random

from by_hand import AFTER_S, ByHand, by_hand
from crossed_roads import CrossedRoads, small_grid
from service_rule import next_mover

from loopgate.abstraction.itinerary import Crossing
from loopgate.gates.certified.occupancy import Occupancy
from loopgate.gates.certified.system_index import SystemIndex
from loopgate.negotiation.pressure import Pressure

X, Y = Crossing("x", frozenset({"y"})), Crossing("y", frozenset({"x"}))


def two_before_one_slot() -> ByHand:
    """Let a wait for long for a slot of s, and d for one second less; b has just left one.

    The light of a is red.
    """
    hand = by_hand({"a": "p s t", "b": "s t", "d": "d s t", "e": "s t"}, {"p": 2, "s": 2, "t": 2, "d": 2})
    hand.asks("a", 0.0)
    hand.asks("d", 1.0)
    assert hand.decide(1.0) == [("a", "occupied"), ("d", "occupied")]
    hand.asks("b", 30.0)
    assert hand.decide(30.0) == [("b", "granted")]
    hand.left("b")
    hand.withhold("red", "a")
    return hand


def nobody_else_takes_the_slot() -> None:
    """However long the light of a is red, d cannot have the slot; and a gets it when it is green."""
    hand = two_before_one_slot()
    for now_s in range(31, 45):
        assert ("d", "granted") not in hand.decide(float(now_s))
    assert hand["d"].reason == "service"
    assert hand.blockers("d") == [["a"]]
    hand.withhold()
    assert ("a", "granted") in hand.decide(45.0)


def the_last_slot_is_kept_and_no_more() -> None:
    """Let d leave its full place for one slot of h, but not f for the other: a needs it."""
    paths = {"a": "p h", "d": "d h", "e": "d h", "f": "f h", "g": "f h"}
    hand = by_hand(paths, {"p": 2, "h": 2, "d": 2, "f": 2})
    hand.withhold("red", "a")
    hand.asks("a", 0.0)
    assert hand.decide(20.0) == [("a", "red")]
    hand.asks("d", 21.0)
    assert hand.decide(21.0) == [("d", "granted")]
    hand.asks("f", 22.0)
    assert hand.decide(22.0) == [("f", "service")]
    hand.withhold()
    assert ("a", "granted") in hand.decide(23.0)


def who_is_first_where_ordinary_vehicles_leave_no_space_moves() -> None:
    """Ordinary vehicles take the slots of q that a waits for: the last slot of t is for h, which leaves q."""
    paths = {"a": "p q t", "h": "q t", "d": "d t", "e": "d t", "x": "t p"}
    hand = by_hand(paths, {"p": 2, "q": 3, "d": 2, "t": 2})
    hand.ledger.keeping.is_too_full = lambda vehicle: vehicle.name == "a"
    hand.withhold("traffic", "a")
    hand.asks("a", 0.0)
    assert hand.decide(1.0) == [("a", "traffic")]
    hand.asks("d", 21.0)
    assert ("d", "service") in hand.decide(21.0)
    hand.asks("h", 22.0)
    assert ("h", "granted") in hand.decide(22.0)


def one_with_room_behind_it_leaves_a_slot_more() -> None:
    """Keep d out of h, though there are slots for both, but not where there is one more."""
    hand = by_hand({"a": "p h", "d": "d h", "e": "d h"}, {"p": 2, "h": 2, "d": 3})
    hand.withhold("red", "a")
    hand.asks("a", 0.0)
    assert hand.decide(20.0) == [("a", "red")]
    hand.asks("d", 21.0)
    assert hand.decide(21.0) == [("d", "service")]
    hand = by_hand({"a": "p h", "d": "d h", "e": "d h"}, {"p": 2, "h": 3, "d": 3})
    hand.withhold("red", "a")
    hand.asks("a", 0.0)
    hand.decide(20.0)
    hand.asks("d", 21.0)
    assert hand.decide(21.0) == [("d", "granted")]


def a_place_off_the_way_is_free() -> None:
    """Since x has driven on to h for a, h is not on the way any more, and d may fill it."""
    hand = by_hand({"a": "p x h", "x": "x h", "y": "x h", "d": "d h"}, {"p": 2, "x": 2, "h": 2, "d": 2})
    hand.asks("a", 0.0)
    assert hand.decide(0.0) == [("a", "occupied")]
    hand.asks("x", 20.0)
    assert hand.decide(20.0) == [("x", "granted")]
    hand.withhold("red", "a")
    hand.asks("d", 21.0)
    assert ("d", "granted") in hand.decide(21.0)


def _round_the_circle(hand: ByHand, names: str) -> None:
    """Refuse a, whose move would close a circle; then let others go, one each second from 20 s on."""
    hand.asks("a", 0.0)
    assert hand.decide(0.0) == [("a", "deadlock")]
    for now_s, name in enumerate(names, 20):
        hand.asks(name, float(now_s))
        assert (name, "granted") in hand.decide(float(now_s))
        hand.cleared(name)
        hand.withhold("red", "a")


def after_a_circle_all_stays_shut() -> None:
    """Let x move, since a would close a circle, and then h: x is off the way now, but d must wait."""
    paths = {"a": "p h", "h": "h x", "x": "x h", "y": "x y", "z": "x y", "d": "d x"}
    hand = by_hand(paths, {"p": 2, "h": 2, "x": 3, "y": 3, "d": 2})
    _round_the_circle(hand, "xhy")
    assert len(hand.place("x").bodies) == 2
    hand.asks("d", 23.0)
    assert ("d", "service") in hand.decide(23.0)
    hand.withhold()
    assert hand.decide(24.0) == [("a", "granted")]
    assert hand.decide(25.0) == [("d", "granted")]


def after_a_circle_no_slot_is_for_others() -> None:
    """Keep d and e out of x, though they leave a full place for two free slots, until a has gone."""
    paths = {"a": "p h", "h": "h x", "x": "x h", "y": "x y", "z": "x y", "d": "d x", "e": "d x"}
    hand = by_hand(paths, {"p": 2, "h": 2, "x": 3, "y": 3, "d": 2})
    _round_the_circle(hand, "xhyz")
    assert len(hand.place("x").bodies) == 1
    hand.asks("d", 24.0)
    assert ("d", "service") in hand.decide(24.0)
    hand.withhold()
    assert hand.decide(25.0) == [("a", "granted")]
    assert hand.decide(26.0) == [("d", "granted")]


def _crossed() -> ByHand:
    """Return a ledger in which b and c, one behind the other, cross the way of a."""
    paths = {"a": "p q", "b": "u v", "c": "u v"}
    return by_hand(paths, dict.fromkeys("pquv", 3), {("p", "q"): X, ("u", "v"): Y})


def nobody_sets_out_across_the_way() -> None:
    """Once a has waited for long c may not follow b; then a goes first."""
    hand = _crossed()
    hand.asks("b", 0.0)
    hand.decide(0.0)
    hand.asks("a", 1.0)
    assert hand.decide(1.0) == [("a", "crossing")]
    hand.asks("c", 21.0)
    assert hand.decide(21.0) == [("c", "service")]
    assert hand.blockers("c") == [["a"]]
    hand.cleared("b")
    assert hand.decide(22.0) == [("a", "granted")]


def no_way_is_cleared_to_a_slot_that_is_not_left_yet() -> None:
    """While b is led to a lane, with its rear where a wants to go, c may cross the way of a; then a goes."""
    paths = {"a": "p q", "b": "q t", "e": "q t", "c": "u v", "f": "u v"}
    capacity = {"p": 2, "q": 2, "t": 3, "u": 3, "v": 3}
    hand = by_hand(paths, capacity, {("p", "q"): X, ("u", "v"): Y})
    hand.asks("a", 0.0)
    assert hand.decide(0.0) == [("a", "occupied")]
    hand.asks("b", 19.0)
    assert hand.decide(19.0) == [("b", "granted")]
    hand["b"].steered = True
    hand.asks("c", 20.0)
    assert hand.decide(20.0) == [("c", "granted")]
    hand.left("b")
    hand.asks("f", 21.0)
    assert sorted(hand.decide(21.0)) == [("a", "crossing"), ("f", "service")]
    hand.cleared("c")
    assert hand.decide(22.0) == [("a", "granted")]


def a_way_is_kept_through_red_in_the_end() -> None:
    """While the light of a is red c may cross its way, but not once a has been to move for two minutes."""
    for at_s, told in ((100.0, "granted"), (142.0, "service")):
        hand = _crossed()
        hand.withhold("red", "a")
        hand.asks("a", 0.0)
        hand.asks("b", 1.0)
        hand.decide(1.0)
        hand.cleared("b")
        hand.decide(20.0)
        hand.decide(21.0)
        hand.asks("c", at_s)
        assert hand.decide(at_s) == [("c", told)]


def the_reserve_holds_nobody_that_must_move() -> None:
    """Let a go after 20 s though the reserve would yield after years only."""
    reserve = Pressure(random.Random(0), crowded=0.01, patience=1e9)
    hand = by_hand({"a": "p s", "b": "s p"}, {"p": 3, "s": 2}, negotiation=reserve)
    hand.asks("a", 0.0)
    assert hand.decide(0.0) == [("a", "reserve")]
    assert hand.decide(AFTER_S - 1.0) == []
    assert hand.decide(AFTER_S) == [("a", "granted")]


def no_negotiation_holds_the_one_that_must_move() -> None:
    """Move two vehicles all the same that it never lets go."""
    world = small_grid(AFTER_S)
    world.drive(300)
    assert min(world.moves) > 0


def movers_seen(world: CrossedRoads, after_s: float, seconds: int) -> int:
    """Drive for some seconds; in each, the mover for the oldest request is the one of the gate's rule.

    Return in how many seconds a request was as old as `after_s`.
    """
    layout, seen = SystemIndex(world.system), 0
    for _ in range(seconds):
        world.let_ask()
        oldest = world.oldest(after_s)
        here = Occupancy.of(layout, world.hand.configuration())
        world.decide()
        if oldest is not None:
            seen += 1
            assert world.vehicles[next_mover(here, oldest)].mover
    return seen


def the_mover_is_the_one_of_the_gates_rule() -> None:
    """In each second, for the oldest request; and every vehicle goes on."""
    world = small_grid(AFTER_S)
    assert movers_seen(world, AFTER_S, 200)
    assert max(world.longest_s) < 10 * AFTER_S


CASES = (
    nobody_else_takes_the_slot,
    the_last_slot_is_kept_and_no_more,
    who_is_first_where_ordinary_vehicles_leave_no_space_moves,
    one_with_room_behind_it_leaves_a_slot_more,
    a_place_off_the_way_is_free,
    after_a_circle_all_stays_shut,
    after_a_circle_no_slot_is_for_others,
    nobody_sets_out_across_the_way,
    no_way_is_cleared_to_a_slot_that_is_not_left_yet,
    a_way_is_kept_through_red_in_the_end,
    the_reserve_holds_nobody_that_must_move,
    no_negotiation_holds_the_one_that_must_move,
    the_mover_is_the_one_of_the_gates_rule,
)
