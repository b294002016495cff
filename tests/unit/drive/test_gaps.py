"""What is foreseen of a vehicle: how long it takes behind one that stands, if it may have to wait."""

import math
from random import Random
from typing import Any, cast

import pytest
from books import Books

from builders import system
from loopgate.abstraction.itinerary import Crossing, Leg
from loopgate.drive import gaps
from loopgate.drive.around import LightRow, SignalRow
from loopgate.drive.gaps import BEFORE, IN_THE_WAY, LATER, PAST
from loopgate.drive.motion import braking_time_s
from loopgate.drive.rows import table
from loopgate.drive.step import SETTLE
from loopgate.drive.tables import Tables
from loopgate.drive.under_way import may_be_held
from loopgate.gates import make_gate
from loopgate.kernel_cache import kernel
from loopgate.model import StateId
from loopgate.negotiation.simple import OldestFirst


@kernel
def relation(i: int, k: int, f: int, other: int, t: Tables) -> int:
    """Ask from Python what only compiled code asks."""
    return gaps.relation(i, k, f, other, t)


@kernel
def together(one: int, other: int) -> int:
    """Ask from Python what only compiled code asks."""
    return gaps.together(one, other)


@pytest.mark.parametrize(
    ("distance", "room", "top"), [(10.0, 12.0, 10.0), (10.0, 60.0, 10.0), (5.0, 5.5, 3.0)]
)
def test_the_time_behind_a_standing_vehicle(distance: float, room: float, top: float) -> None:
    """Driven in small steps at the speed from which a second and the brakes are enough, it takes as long."""
    decel, step_s = 4.5, 1e-4
    driven, time_s = 0.0, 0.0
    while driven < distance:
        gap = room - driven
        driven += min(top, math.sqrt(decel**2 + 2 * decel * gap) - decel) * step_s
        time_s += step_s
    assert braking_time_s(distance, room, top, decel) == pytest.approx(time_s, abs=0.01)


def test_without_room_it_never_gets_there() -> None:
    """It would stop before; and with nobody before it, nothing slows it down."""
    assert braking_time_s(10.0, 10.0, 10.0, 4.5) == math.inf
    assert braking_time_s(10.0, math.inf, 10.0, 4.5) == 0.0


def crossing(  # noqa: PLR0913  a case has many sides
    grants: tuple[int, int],
    fronts_m: tuple[float, ...],
    *,
    foresees: bool = True,
    at_once: bool = True,
    wait_m: float = -math.inf,
    steered: tuple[bool, ...] = (False, False),
    from_m: float = 3.0,
    limits: tuple[tuple[float, float], ...] = (),
    stands_m: float = math.nan,
) -> Tables:
    """Let two vehicles of 5 m, granted in this order, be on ``mine`` and ``theirs``, which share some metres.

    Their first legs end at 50 m, the second begin at 70 m. A third one stands with its front so far inside
    the second place of the second, if that is a number.
    """
    mine = Crossing("mine", frozenset({"theirs"}), {"theirs": (2.0, 9.0)}, 13.9)
    theirs = Crossing(
        "theirs", frozenset({"mine"}), {"mine": (from_m, from_m + 7.0)}, 13.9, 0.0, wait_m, limits
    )
    third = {} if math.isnan(stands_m) else {"c": "qb r"}
    robots = system({"a": "pa qa", "b": "pb qb", **third})
    legs = [
        (Leg(StateId(f"p{name}"), 0.0, 50.0, (across,)), Leg(StateId(f"q{name}"), 70.0, 100.0))
        for name, across in (("a", mine), ("b", theirs))
    ]
    if third:
        legs.append((Leg(StateId("qb"), 0.0, 30.0), Leg(StateId("r"), 50.0, 80.0)))
        fronts_m = *fronts_m, stands_m
        steered = *steered, False
    books = Books(robots, legs, make_gate("collision", robots), OldestFirst(Random(1)))
    books.run["foresees"] = foresees
    books.run["at_once"] = at_once
    columns: dict[str, Any] = {"length_m": 5.0, "accel": 2.6, "decel": 4.5, "top": 13.9, "line_m": 50.0}
    columns["speed"] = [0.0, 10.0, 0.0][: len(fronts_m)]
    for column, value in (columns | {"front": fronts_m}).items():
        books.columns[column] = value
    books.columns["steered"] = steered
    for robot, number in enumerate(grants):
        if number:
            books.do(SETTLE, robot, 1)
            books.tables.numbers[robot, 1] = number
    return books.tables


def first_pass(robot: int, tables: Tables) -> int:
    """Return the row of the crossing behind the first leg of a vehicle."""
    vehicles, legs = cast("Any", tables.vehicles), cast("Any", tables.legs)
    return int(legs["pass_at"][vehicles["leg_at"][robot]])


@pytest.mark.parametrize(("grant", "front_m", "held"), [(1, 60.0, True), (1, 66.0, False), (3, 60.0, False)])
def test_one_may_have_to_wait_for_one_that_was_granted_before_it_and_is_in_its_way(
    grant: int,
    front_m: float,
    held: bool,  # noqa: FBT001  a case
) -> None:
    """Its leg ends at 50 m; 5 m long, it is past what both use, up to 10 m on, with its front at 65.5 m."""
    assert may_be_held(0, 0, crossing((2, grant), (55.0, front_m))) == held


def test_where_vehicles_give_way_to_others_nothing_is_foreseen() -> None:
    """The second is on the shared stretch and fast, the first 30 m away. Past it, it is out of the way."""
    for front_m, foresees, free in ((60.0, True, True), (60.0, False, False), (65.6, False, True)):
        tables = crossing((0, 1), (20.0, front_m), foresees=foresees)
        assert (relation(0, 0, 0, 1, tables) == IN_THE_WAY) != free


def test_whether_something_is_foreseen_is_a_matter_of_each_vehicle() -> None:
    """Who goes first must be foreseen, whoever comes after it."""
    for foreseen, free in (((False, True), True), ((True, False), False)):
        before, later = crossing((0, 1), (20.0, 60.0)), crossing((0, 1), (49.9, -35.0))
        for tables in (before, later):
            cast("Any", tables.vehicles)["foreseen"] = foreseen
        assert (relation(0, 0, 0, 1, before) == BEFORE) == free
        assert (relation(0, 0, 0, 1, later) == LATER) != free


@pytest.mark.parametrize(("length_m", "found"), [(5.0, PAST), (8.0, IN_THE_WAY)])
def test_a_stretch_that_only_longer_vehicles_are_on_is_in_nobody_elses_way(
    length_m: float, found: int
) -> None:
    """The first front is on it 7 m beyond where the last rear leaves it; on either side."""
    for mine, theirs in (((9.0, 2.0), (3.0, 10.0)), ((2.0, 9.0), (10.0, 3.0))):
        tables = crossing((0, 1), (49.9, 50.0))
        foes: Any = tables.foes
        foes["from_m"], foes["to_m"] = zip(mine, theirs, strict=True)
        cast("Any", tables.vehicles)["length_m"] = length_m
        assert relation(0, 0, 0, 1, tables) == found


@pytest.mark.parametrize(
    ("front_m", "light_m", "found"),
    [(20.0, 50.0, BEFORE), (40.0, 50.0, IN_THE_WAY), (20.0, 55.0, IN_THE_WAY)],
)
def test_one_under_way_may_be_past_before_the_other_comes_into_the_junction(
    front_m: float, light_m: float, found: int
) -> None:
    """It has 14.5 m to go from before the stretch; the other 30 m, in 4.8 s, or 10 m, in 2.8 s.

    A light that it has not passed may stop it.
    """
    tables = crossing((0, 1), (front_m, 51.0))
    passes: Any = tables.passes
    its = first_pass(1, tables)
    passes["signal"][its], passes["light_m"][its] = 0, light_m
    assert relation(0, 0, 0, 1, tables) == found


def test_a_stretch_may_begin_before_the_junction() -> None:
    """The other's front comes to it 2 m behind its line, and into the junction 30 m behind that."""
    tables = crossing((0, 1), (49.9, 51.0))
    cast("Any", tables.passes)["light_m"][first_pass(0, tables)] = 80.0
    assert relation(0, 0, 0, 1, tables) == IN_THE_WAY


def test_it_has_to_be_past_when_the_other_comes_into_the_junction_not_when_it_reaches_the_stretch() -> None:
    """The other comes into it after 15 m, in 3.4 s, and to the stretch 25 m later; 3.5 s are needed."""
    tables = crossing((0, 1), (40.0, 51.0))
    cast("Any", tables.foes[0])["from_m"], cast("Any", tables.foes[0])["to_m"] = 30.0, 37.0
    cast("Any", tables.passes[0])["light_m"] = 55.0
    assert relation(0, 0, 0, 1, tables) == IN_THE_WAY


def test_one_that_goes_first_sets_out_weakly_and_the_other_may_drive_above_limits() -> None:
    """At 1.3 m/s2 it takes 4.7 s, and the other comes in 6.2 s; in the second case it takes 1.5 s."""
    standing, hasty = crossing((0, 1), (0.0, 51.0)), crossing((0, 1), (49.9, 51.0))
    cast("Any", standing.vehicles)["speed"] = 0.0
    assert relation(0, 0, 0, 1, standing) == IN_THE_WAY
    for haste, found in ((1.0, BEFORE), (1.2, IN_THE_WAY)):
        cast("Any", hasty.foes[0])["soonest_s"] = 4.0
        cast("Any", hasty.vehicles)["haste"] = haste
        assert relation(0, 0, 0, 1, hasty) == found


@pytest.mark.parametrize(("front_m", "found"), [(60.0, IN_THE_WAY), (66.0, BEFORE)])
def test_one_that_may_have_to_wait_itself_does_not_go_first(front_m: float, found: int) -> None:
    """Somebody was granted before it and is not past yet: here the one that asks, from its next place."""
    tables = crossing((1, 2), (front_m, 51.0))
    cast("Any", tables.foes[0])["soonest_s"] = 100.0
    assert relation(0, 0, 0, 1, tables) == found


@pytest.mark.parametrize(("waited_s", "found"), [(0.0, LATER), (200.0, IN_THE_WAY)])
def test_nobody_goes_first_whom_a_light_may_stop(waited_s: float, found: int) -> None:
    """After a long wait lights let it go that it may not pass."""
    tables = crossing((0, 1), (49.9, -35.0))
    cast("Any", tables.passes[0])["signal"] = 0
    cast("Any", tables.vehicles)["red_since_s"] = cast("Any", tables.run)["now_s"][0] - waited_s
    signals, lights = (cast("Any", table(row, length=1)) for row in (SignalRow, LightRow))
    lit = tables._replace(signals=signals, lights=lights)
    assert relation(0, 0, 0, 1, lit) == found


@pytest.mark.parametrize(("wait_m", "free"), [(8.0, True), (12.0, False), (30.0, True)])
def test_nothing_is_foreseen_of_one_that_may_wait_inside_before_it_is_past(
    wait_m: float,
    free: bool,  # noqa: FBT001  a case
) -> None:
    """It is past 15.5 m behind its line, now 10 m; a waiting point far beyond slows it for nobody."""
    found = relation(0, 0, 0, 1, crossing((0, 1), (20.0, 60.0), wait_m=wait_m))
    assert found == (BEFORE if free else IN_THE_WAY)


def test_nothing_is_foreseen_of_one_that_changes_lanes_on_its_way() -> None:
    """It slows down for that, however fast it is now."""
    for steered in (False, True):
        found = relation(0, 0, 0, 1, crossing((0, 1), (20.0, 60.0), steered=(False, steered)))
        assert found == (IN_THE_WAY if steered else BEFORE)


def test_a_vehicle_that_comes_to_a_foe_by_the_same_movement_is_followed() -> None:
    """Its crossing does not list the movement, though that lists it for vehicles that come otherwise."""
    tables = crossing((0, 1), (49.9, 51.0))
    its = first_pass(1, tables)
    assert relation(0, 0, 0, 1, tables) == IN_THE_WAY
    cast("Any", tables.passes)["foe_end"][its] = cast("Any", tables.passes)["foe_at"][its]
    assert relation(0, 0, 0, 1, tables) == PAST


def test_nothing_is_foreseen_of_one_that_is_held_before_a_junction_to_keep_it_clear() -> None:
    """The vehicle before it in its place stands: its rear is 10 or 2 m inside, 7.5 m are needed."""
    for stands_m, found in ((15.0, BEFORE), (7.0, IN_THE_WAY)):
        tables = crossing((0, 1), (20.0, 50.2), stands_m=stands_m)
        cast("Any", tables.passes)["light_m"][first_pass(1, tables)] = 51.0
        shared: Any = tables.foes
        shared["from_m"], shared["to_m"] = -8.0, -2.0
        assert relation(0, 0, 0, 1, tables) == found


@pytest.mark.parametrize(("front_m", "found"), [(-35.0, LATER), (-25.0, IN_THE_WAY)])
def test_one_that_is_far_away_may_come_later(front_m: float, found: int) -> None:
    """Setting out weakly, the first is past 9 m, rear and all, in 4.3 s; the other drives up to 13.9 m/s."""
    assert relation(0, 0, 0, 1, crossing((0, 1), (49.9, front_m))) == found


@pytest.mark.parametrize(("front_m", "found"), [(50.0, LATER), (68.0, IN_THE_WAY)])
def test_one_that_has_to_drive_slowly_comes_later(front_m: float, found: int) -> None:
    """At 2.8 m/s it takes ten seconds for the 30 m to the stretch that both use, and four from 18 m on."""
    tables = crossing((0, 1), (49.9, front_m), from_m=30.0, limits=((0.0, 2.8),))
    assert relation(0, 0, 0, 1, tables) == found


def test_nobody_goes_first_where_something_may_stop_or_slow_it() -> None:
    """Ordinary traffic, a light, a change of lanes."""
    tables = crossing((0, 1), (49.9, 50.0), from_m=30.0, limits=((0.0, 2.8),), foresees=False)
    assert relation(0, 0, 0, 1, tables) == IN_THE_WAY
    tables = crossing((0, 1), (49.9, 50.0), from_m=30.0, limits=((0.0, 2.8),), at_once=False)
    assert relation(0, 0, 0, 1, tables) == IN_THE_WAY
    tables = crossing((0, 1), (49.9, 50.0), from_m=30.0, limits=((0.0, 2.8),), steered=(True, False))
    assert relation(0, 0, 0, 1, tables) == IN_THE_WAY


def test_one_may_have_to_wait_for_one_that_was_let_go_first() -> None:
    """That has the later grant, and is on the stretch that both use; the other is not there yet."""
    for front_m, held in ((51.0, True), (52.0, False)):
        assert may_be_held(0, 0, crossing((2, 3), (front_m, 60.0))) == held


def test_who_goes_before_some_waits_for_nobody() -> None:
    """Else it might be late for them."""
    assert together(PAST, LATER) == together(LATER, LATER) == LATER
    assert together(-1, BEFORE) == together(PAST, BEFORE) == BEFORE
    assert together(BEFORE, LATER) == together(PAST, IN_THE_WAY) == IN_THE_WAY
