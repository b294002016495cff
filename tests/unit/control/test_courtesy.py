"""Vehicles with grants give way to ordinary ones before junctions, without SUMO."""

from __future__ import annotations

import pytest
from among_others import CAR, Scene

from loopgate.control.courtesy import Courtesy
from loopgate.control.roads import Across, Lookout, Other

Arrivals = list[tuple[float, float]]
"""Vehicles that come to the turn across: how far before it they are [m], and how fast [m/s]."""

COMES: Arrivals = [(40.0, 10.0)]


class Way(Scene):
    """The vehicle has its grant; the junction begins at 100 m."""

    def __init__(self) -> None:
        super().__init__()
        self.ledger.ask(self.car)
        assert self.ledger.answer(0.0) == [self.car]
        self.courtesy = Courtesy(self.told)  # type: ignore[arg-type]
        self.courtesy.look([self.car])

    def tells(self, arrivals: Arrivals, *, front_m: float, speed: float) -> list[float | None]:
        """Return what the vehicle is told in a step."""
        self.turn.coming.clear()
        for left_m, other_speed in arrivals:
            other = Other("o", 5.0, 2.6, 4.5, 1.0)
            other.speed = other_speed
            self.let_come(other, left_m)
        self.car.front_m, self.car.speed = front_m, speed
        self.told.now_s += 1.0
        self.told.kept.clear()
        self.courtesy.look([])
        return [limit for _, limit in self.told.kept]

    def look_out(self, *, unseen: bool = False, wait_m: float = 0.0, waits_in_way: bool = False) -> None:
        """Let the movement be another one."""
        before = self.path[0].passes[0].lookout
        assert before is not None
        across = [Across(self.foe, 15.0, unseen=unseen)]
        self.path[0].passes[0].lookout = Lookout(
            across, before.approaches, 0.0, 20.0, 10.0, wait_m, waits_in_way=waits_in_way
        )

    def goes_first(self) -> bool:
        """Return whether the vehicle has been told to keep no right of way."""
        return self.told.first.get("car", False)


def test_a_vehicle_that_stands_at_its_line_sets_out_when_no_other_comes() -> None:
    """SUMO's right of way, which stopped it, may let both go at once; after a minute it decides alone."""
    way = Way()
    assert way.tells([], front_m=98.0, speed=0.0) == []
    assert way.tells(COMES, front_m=98.0, speed=0.0) == [0.0]
    assert way.tells(COMES, front_m=98.0, speed=0.0) == []
    assert way.tells([], front_m=98.0, speed=0.0) == [None]
    assert way.tells(COMES, front_m=98.0, speed=0.0) == [0.0]
    way.told.now_s += 60.0
    assert way.tells(COMES, front_m=98.0, speed=0.0) == [None]
    assert way.tells(COMES, front_m=98.0, speed=0.0) == []


def test_a_vehicle_far_before_its_line_is_not_told_to_stand() -> None:
    """It stands in a queue, and not to set out."""
    way = Way()
    assert way.tells(COMES, front_m=60.0, speed=0.0) == []
    assert way.tells(COMES, front_m=98.0, speed=0.0) == [0.0]


def test_a_vehicle_slows_down_as_late_as_it_can_and_stops_before_the_junction() -> None:
    """At 10 m/s it needs 11 m to brake; one that can no more drives on, and one that is alone too."""
    way = Way()
    assert way.tells(COMES, front_m=70.0, speed=10.0) == []
    assert way.tells([], front_m=84.0, speed=10.0) == []
    assert way.tells(COMES, front_m=95.0, speed=10.0) == []
    way = Way()
    front_m, speed = 80.0, 10.0
    for _ in range(12):
        (told,) = way.tells([(22.5, 2.5)], front_m=front_m, speed=speed) or [speed]
        assert told is not None
        assert told >= speed - 4.5 - 1e-9
        speed, front_m = told, front_m + told
    assert front_m == pytest.approx(99.5)
    assert way.tells([], front_m=front_m, speed=speed) == [None]


def test_a_vehicle_under_way_gives_way_to_one_that_sumo_does_not_see() -> None:
    """One that stands across the way is SUMO's to see, unless it does not know that the two ways touch."""
    way = Way()
    way.put("foe", 3.0)
    assert way.tells([], front_m=84.0, speed=10.0) == []
    way.look_out(unseen=True)
    (told,) = way.tells([], front_m=84.0, speed=10.0)
    assert told is not None
    assert told < 10.0


def test_a_vehicle_that_drove_in_when_no_other_came_does_not_wait_inside() -> None:
    """Where it would be in the way of one that departs just then; not where it drove in by right of way."""
    way = Way()
    way.look_out(wait_m=8.0, waits_in_way=True)
    assert way.tells([], front_m=98.0, speed=0.0) == []
    assert way.tells(COMES, front_m=99.5, speed=6.0) == []
    assert not way.goes_first()
    way.tells(COMES, front_m=102.0, speed=4.0)
    assert way.goes_first()
    way.tells([(10.0, 10.0)], front_m=103.0, speed=4.0)  # it cannot stop any more
    assert not way.goes_first()
    way.tells(COMES, front_m=104.0, speed=4.0)
    assert way.goes_first()
    way.tells(COMES, front_m=108.5, speed=4.0)
    assert not way.goes_first()


def test_a_vehicle_that_drove_in_by_sumos_right_of_way_keeps_that_inside() -> None:
    """It gave way for a minute before."""
    way = Way()
    way.look_out(wait_m=8.0, waits_in_way=True)
    assert way.tells(COMES, front_m=98.0, speed=0.0) == [0.0]
    way.told.now_s += 60.0
    assert way.tells(COMES, front_m=98.0, speed=0.0) == [None]
    way.tells(COMES, front_m=102.0, speed=4.0)
    assert not way.goes_first()


def test_a_vehicle_goes_as_without_ordinary_ones_while_none_comes_into_its_way() -> None:
    """From its grant on; until one comes, for which it gives way where it can still stop."""
    way = Way()
    (trip,) = way.car.trips
    assert (way.goes_first(), trip.quiet) == (True, True)
    way.tells(COMES, front_m=70.0, speed=10.0)
    assert (way.goes_first(), trip.quiet) == (False, False)
    way.turn.came_s = way.told.now_s  # it has gone into the junction
    way.tells([], front_m=71.0, speed=1.0)
    assert not way.goes_first()
    way.told.now_s += 30.0
    way.tells([], front_m=80.0, speed=10.0)
    assert (way.goes_first(), trip.quiet) == (True, True)
    (told,) = way.tells(COMES, front_m=87.0, speed=10.0)
    assert told is not None
    assert not trip.quiet


@pytest.mark.parametrize("where", ["next", "foe", "coming", "turn", ""])
def test_ordinary_vehicles_near_its_way_keep_a_vehicle_from_that(where: str) -> None:
    """In the place that it drives to, on the junction, about to drive there, or on the way across."""
    way = Way()
    if where == "coming":
        way.edges["next"].coming[Other("o", 5.0, 2.6, 4.5, 1.0)] = None
    elif where in {"next", "foe"}:
        way.put(where, 10.0)
    way.tells(COMES if where == "turn" else [], front_m=60.0, speed=10.0)
    assert way.goes_first() == (not where)


def test_a_vehicle_that_leaves_is_told_nothing_more() -> None:
    way = Way()
    assert way.tells(COMES, front_m=98.0, speed=0.0) == [0.0]
    way.courtesy.forget(way.car)
    assert way.tells([], front_m=98.0, speed=0.0) == []


def test_a_vehicle_that_gives_way_goes_on_to_while_the_other_is_there() -> None:
    """Also once it is so slow that it need not brake yet; a vehicle that begins to is told nothing there."""
    way = Way()
    (told,) = way.tells([(22.5, 2.5)], front_m=84.0, speed=10.0)
    assert told is not None
    assert None not in way.tells([(22.5, 2.5)], front_m=85.0, speed=1.0)
    assert Way().tells([(22.5, 2.5)], front_m=85.0, speed=1.0) == []


def test_a_vehicle_let_go_first_stays_so_until_it_is_past() -> None:
    """It waited only for vehicles under the gate; it sets out, and nobody is there, but one behind it."""
    way = Way()
    way.edges["next"].coming[Other("o", 5.0, 2.6, 4.5, 1.0)] = None
    for _ in range(40):
        way.tells([], front_m=98.0, speed=0.0)
    assert way.goes_first()
    for front_m in (98.5, 101.0, 105.0, 119.0):
        way.tells([], front_m=front_m, speed=3.0)
        assert way.goes_first()
    way.tells([], front_m=121.0, speed=3.0)
    assert not way.goes_first()


def test_one_far_away_keeps_nobody_else_from_being_looked_at() -> None:
    """It has its grant before the other, which stands at the line."""
    way = Way()
    assert way.tells(COMES, front_m=20.0, speed=0.0) == []
    other = way.ledger.take_in("other", way.path, 0, CAR, 220.0)
    other.front_m, other.speed = 98.0, 0.0
    way.ledger.ask(other)
    assert way.ledger.answer(0.0)
    way.courtesy.look([other])
    assert way.told.kept == [("other", 0.0)]


@pytest.mark.parametrize(("speed", "told"), [(0.3, [0.0]), (3.0, [])])
def test_one_that_creeps_at_its_line_lets_the_rear_of_another_pass(speed: float, told: list[float]) -> None:
    """SUMO lets it go beside a bus that still swings out; a faster one could not stop before the junction."""
    way = Way()
    way.put("foe", 8.0).speed = 8.0
    assert way.tells([], front_m=99.9, speed=speed) == told
