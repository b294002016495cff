"""What the service in the drive has to do, as cases that raise where it does not; see `little_roads`."""

from __future__ import annotations

import random
from collections.abc import Mapping
from itertools import pairwise
from typing import Any

from books import Books
from little_roads import LittleRoads, Unfair
from small_roads import one_way_grid, road_system

from builders import system
from loopgate.abstraction.itinerary import Crossing, Leg
from loopgate.gates import Reason, make_gate
from loopgate.gates.certified.occupancy import Occupancy
from loopgate.gates.certified.service import next_mover
from loopgate.gates.certified.system_index import SystemIndex
from loopgate.negotiation.base import Negotiation
from loopgate.negotiation.pressure import Pressure

AFTER_S = 20.0


def books(
    paths: Mapping[str, str],
    capacity: Mapping[str, int],
    crossings: Mapping[tuple[str, str], Crossing] | None = None,
    negotiation: Negotiation | None = None,
) -> Books:
    """Return books under the chain rule for vehicles that start in the first of their places.

    Unless said otherwise nothing is kept in reserve.
    """
    robots = system(paths, capacity=capacity, fifo=tuple(capacity))
    over = crossings or {}
    legs = [
        [
            Leg(here, 10.0 * k, 10.0 * k + 9.0, (over[here, there],) if (here, there) in over else ())
            for k, (here, there) in enumerate(pairwise((*robot.path, robot.path[0])))
        ]
        for robot in robots.robots
    ]
    gate = make_gate("certified", robots)
    orders = negotiation or Pressure(random.Random(0), crowded=1.0)
    return Books(robots, legs, gate, orders, serve_after_s=AFTER_S)


def two_who_want_one_slot() -> tuple[Books, list[int]]:
    """Return books in which A has waited for long for a slot of s, and D for one second less.

    B has just left a slot there; A's light is red.
    """
    book = books({"a": "p s t", "b": "s t", "d": "d s t", "e": "s t"}, {"p": 2, "s": 2, "t": 2, "d": 2})
    a, b, d, e = range(4)
    book.asks(a, 0.0)
    book.asks(d, 1.0)
    assert book.decide(1.0) == [(a, False, "occupied"), (d, False, "occupied")]
    book.asks(b, 30.0)
    assert book.decide(30.0) == [(b, True, "free")]
    book.left(b, book.system.paths[b][0])
    book.withhold(Reason.RED, a)
    return book, [a, b, d, e]


def nobody_else_takes_the_slot() -> None:
    """However long A's light is red, D cannot have the slot; and A gets it when it is green."""
    book, (a, _, d, _) = two_who_want_one_slot()
    for now_s in range(31, 45):
        said = book.decide(float(now_s))
        assert (d, True, "free") not in said
    assert book.columns["reason"][d] == list(Reason).index(Reason.SERVICE) + 1
    assert book.blockers(d) == [[a]]
    book.withhold()
    assert (a, True, "free") in book.decide(45.0)


def the_last_slot_is_kept_and_no_more() -> None:
    """Let D leave its full place for one slot of h, but not F for the other: A needs it."""
    paths = {"a": "p h", "d": "d h", "e": "d h", "f": "f h", "g": "f h"}
    book = books(paths, {"p": 2, "h": 2, "d": 2, "f": 2})
    a, d, _, f, _ = range(5)
    book.withhold(Reason.RED, a)
    book.asks(a, 0.0)
    assert book.decide(20.0) == [(a, False, "red")]
    book.asks(d, 21.0)
    assert book.decide(21.0) == [(d, True, "free")]
    book.asks(f, 22.0)
    assert book.decide(22.0) == [(f, False, "service")]
    book.withhold()
    assert (a, True, "free") in book.decide(23.0)


def who_has_room_behind_lets_others_in() -> None:
    """Keep D out of h, though there are slots for both, but not where there is one more."""
    book = books({"a": "p h", "d": "d h", "e": "d h"}, {"p": 2, "h": 2, "d": 3})
    a, d = range(2)
    book.withhold(Reason.RED, a)
    book.asks(a, 0.0)
    assert book.decide(20.0) == [(a, False, "red")]
    book.asks(d, 21.0)
    assert book.decide(21.0) == [(d, False, "service")]
    book = books({"a": "p h", "d": "d h", "e": "d h"}, {"p": 2, "h": 3, "d": 3})
    book.withhold(Reason.RED, a)
    book.asks(a, 0.0)
    book.decide(20.0)
    book.asks(d, 21.0)
    assert book.decide(21.0) == [(d, True, "free")]


def what_is_off_the_way_is_free() -> None:
    """X has driven on to h for A's sake; h is not on the way any more, and D may fill it."""
    book = books({"a": "p x h", "x": "x h", "y": "x h", "d": "d h"}, {"p": 2, "x": 2, "h": 2, "d": 2})
    a, x, _, d = range(4)
    book.asks(a, 0.0)
    assert book.decide(0.0) == [(a, False, "occupied")]
    book.asks(x, 20.0)
    assert book.decide(20.0) == [(x, True, "free")]
    book.withhold(Reason.RED, a)
    book.asks(d, 21.0)
    assert book.decide(21.0) == [(d, True, "free")]


def after_a_circle_all_stays_shut() -> None:
    """Let X move, since A would close a circle, and then H: x is off the way now, but D must wait."""
    paths = {"a": "p h", "h": "h x", "x": "x h", "y": "x y", "z": "x y", "d": "d x"}
    book = books(paths, {"p": 2, "h": 2, "x": 3, "y": 3, "d": 2})
    a, h, x, y, _, d = range(6)
    state = {str(name): k for k, name in enumerate(book.system.states)}
    book.asks(a, 0.0)
    assert book.decide(0.0) == [(a, False, "deadlock")]
    for now_s, robot in ((20.0, x), (21.0, h), (22.0, y)):
        book.asks(robot, now_s)
        assert (robot, True, "free") in book.decide(now_s)
        book.left(robot, book.system.paths[robot][0])
        book.withhold(Reason.RED, a)
    assert book.room(state["x"]) == 1
    book.asks(d, 23.0)
    assert book.decide(23.0) == [(d, False, "service")]
    book.withhold()
    assert book.decide(24.0) == [(a, True, "free")]
    assert book.decide(25.0) == [(d, True, "free")]


def _crossed() -> tuple[Books, list[int]]:
    """Return books in which A's way is crossed by those of B and C, one behind the other."""
    x, y = Crossing("x", frozenset({"y"})), Crossing("y", frozenset({"x"}))
    paths = {"a": "p q", "b": "u v", "c": "u v"}
    return books(paths, dict.fromkeys("pquv", 3), {("p", "q"): x, ("u", "v"): y}), [0, 1, 2]


def nobody_sets_out_across_the_way() -> None:
    """C may not follow B once A has waited for long; then A goes first."""
    book, (a, b, c) = _crossed()
    book.asks(b, 0.0)
    book.decide(0.0)
    book.asks(a, 1.0)
    assert book.decide(1.0) == [(a, False, "crossing")]
    book.asks(c, 21.0)
    assert book.decide(21.0) == [(c, False, "service")]
    assert book.blockers(c) == [[a]]
    book.cleared(b, 0)
    assert book.decide(22.0) == [(a, True, "free")]


def no_way_is_cleared_to_a_slot_that_is_not_left_yet() -> None:
    """While the rear of B is still in the place that A wants, C may cross A's way; then A goes first."""
    x, y = Crossing("x", frozenset({"y"})), Crossing("y", frozenset({"x"}))
    paths = {"a": "p q", "b": "q t", "e": "q t", "c": "u v", "f": "u v"}
    capacity = {"p": 2, "q": 2, "t": 3, "u": 3, "v": 3}
    book = books(paths, capacity, {("p", "q"): x, ("u", "v"): y})
    a, b, _, c, f = range(5)
    book.asks(a, 0.0)
    assert book.decide(0.0) == [(a, False, "occupied")]
    book.asks(b, 19.0)
    assert book.decide(19.0) == [(b, True, "free")]
    book.asks(c, 20.0)
    assert book.decide(20.0) == [(c, True, "free")]
    book.left(b, book.system.paths[b][0])
    book.asks(f, 21.0)
    assert sorted(book.decide(21.0)) == [(a, False, "crossing"), (f, False, "service")]
    book.cleared(c, 0)
    assert book.decide(22.0) == [(a, True, "free")]


def a_way_is_kept_through_red_in_the_end() -> None:
    """While A's light is red C may cross its way, but not once A has been the one to move for two minutes."""
    for at_s, passes in ((100.0, True), (142.0, False)):
        book, (a, b, c) = _crossed()
        book.withhold(Reason.RED, a)
        book.asks(a, 0.0)
        book.asks(b, 1.0)
        book.decide(1.0)
        book.cleared(b, 0)
        book.decide(20.0)
        book.decide(21.0)
        book.asks(c, at_s)
        assert book.decide(at_s) == [(c, passes, "free" if passes else "service")]


def the_reserve_holds_nobody_who_must_move() -> None:
    """Let A go after 20 s, in the compiled drive, though the reserve would yield after years only."""
    reserve = Pressure(random.Random(0), crowded=0.01, patience=1e9)
    book = books({"a": "p s", "b": "s p"}, {"p": 3, "s": 2}, negotiation=reserve)
    assert book.compiled
    book.asks(0, 0.0)
    assert book.decide(0.0) == [(0, False, "reserve")]
    assert book.decide(AFTER_S - 1.0) == []
    assert book.decide(AFTER_S) == [(0, True, "free")]


def no_negotiation_holds_who_must_move() -> None:
    """One that never lets two vehicles go."""
    world = _grid()
    world.drive(300)
    assert min(world.moves) > 0


def whose_move_it_is() -> None:
    """Whose move it is says the gate's own rule for the oldest request; and everybody goes on."""
    world = _grid()
    layout, seen = SystemIndex(world.system), 0
    for _ in range(200):
        world.let_ask()
        oldest = oldest_late(world, AFTER_S)
        here = Occupancy.of(layout, world.books.configuration())
        world.decide()
        if oldest is not None:
            seen += 1
            assert world.column["mover"][next_mover(here, oldest)]
    assert seen
    assert max(world.longest_s) < 10 * AFTER_S


def _grid() -> LittleRoads:
    """Return a small grid with hardly a slot free, and two vehicles that the negotiation never lets go."""
    system = road_system(one_way_grid(), 13, 2, seed=5)
    return LittleRoads(system, 1, serve_after_s=AFTER_S, negotiation=Unfair({3, 8}))


def oldest_late(world: LittleRoads, after_s: float) -> int | None:
    """Return whose request is the oldest, if it is as old as that [s]."""
    entries: Any = world.books.tables.entries
    waiting = entries["waiting"][: int(world.books.run["waiting"][0])].tolist()
    late = [i for i in waiting if world.now_s - world.column["since_s"][i] >= after_s]
    return late[0] if late else None


CASES = (
    nobody_else_takes_the_slot,
    the_last_slot_is_kept_and_no_more,
    who_has_room_behind_lets_others_in,
    what_is_off_the_way_is_free,
    after_a_circle_all_stays_shut,
    nobody_sets_out_across_the_way,
    no_way_is_cleared_to_a_slot_that_is_not_left_yet,
    a_way_is_kept_through_red_in_the_end,
    the_reserve_holds_nobody_who_must_move,
    no_negotiation_holds_who_must_move,
    whose_move_it_is,
)
