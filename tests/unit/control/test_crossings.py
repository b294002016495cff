"""Whether one vehicle under way is in the way of another: what is foreseen of both."""

from __future__ import annotations

from math import inf
from typing import Any, Final

import pytest
from fake_traffic import FakeTraffic

from loopgate.abstraction.itinerary import Crossing, DrawnLeg
from loopgate.control import crossings
from loopgate.control.crossings import in_the_way
from loopgate.control.lamps import Lamp, Signal
from loopgate.control.layout import PlaceLayout
from loopgate.control.ledger import Ledger
from loopgate.control.places import Foe, GrantedPass, Leg, Make, Pass, Vehicle, shared_by
from loopgate.control.roads import RoadEdge, RoadLane, RoadStretch
from loopgate.control.rules import crossing
from loopgate.model import StateId
from loopgate.traffic.base import Light, Phase, Program

PAST: Final = "past"
BEFORE: Final = "before"
LATER: Final = "later"
IN_THE_WAY: Final = "in the way"

NEVER: Final = -1000.0


class Crossed:
    """Two vehicles of 5 m, `a` and `b`, on ``mine`` and ``theirs``, which share some metres.

    Their first legs end at 50 m, the second begin at 70 m. `c` stands with its front so far inside the second
    place of `b`, if `stands_m` is a number.

    `grants`: which of the two were let go, in this order. `fronts_m`: where they are. `shared`, `theirs`: the
    metres behind the line that both use, for `a` and for `b`.
    """

    def __init__(  # noqa: PLR0913  a case has many sides
        self,
        grants: str,
        fronts_m: tuple[float, float],
        *,
        shared: tuple[float, float] = (2.0, 9.0),
        theirs: tuple[float, float] = (3.0, 10.0),
        length_m: float = 5.0,
        speed: float = 10.0,
        haste: float = 1.0,
        foreseen: tuple[bool, bool] = (True, True),
        wait_m: float = -inf,
        ahead_m: tuple[float, float] = (0.0, 0.0),
        limits: tuple[tuple[float, float], ...] = (),
        stands_m: float = NEVER,
        lit: str = "",
    ) -> None:
        mine = Crossing("mine", frozenset({"theirs"}), {"theirs": shared}, 13.9, ahead_m[0])
        other = Crossing("theirs", frozenset({"mine"}), {"mine": theirs}, 13.9, ahead_m[1], wait_m, limits)
        ways = [
            (DrawnLeg(StateId(f"p{name}"), 0.0, 50.0, (across,)), DrawnLeg(StateId(f"q{name}"), 70.0, 100.0))
            for name, across in (("a", mine), ("b", other))
        ]
        ways.append((DrawnLeg(StateId("qb"), 0.0, 30.0), DrawnLeg(StateId("r"), 50.0, 80.0)))
        traffic = FakeTraffic({})
        traffic.lights["t"] = Light("G", 1000.0, "p", 0)
        traffic.programs["t"] = Program((Phase("G", 1000.0, 1), Phase("r", 1000.0, 0)), fixed=True)
        names = {"a": "mine", "b": "theirs"}
        signals = {names[name]: Signal(Lamp("t", traffic), 0, 13.9) for name in lit}
        places = dict.fromkeys(("pa", "qa", "pb", "qb", "r"), 3)
        layout = PlaceLayout(places, ways, signals)
        self.ledger = Ledger([lambda *_: None])
        if stands_m != NEVER:
            self._put("c", layout, ways[2], stands_m, 0.0, length_m, 1.0, foreseen=True)
        self.a = self._put("a", layout, ways[0], fronts_m[0], 0.0, length_m, haste, foreseen=foreseen[0])
        self.b = self._put("b", layout, ways[1], fronts_m[1], speed, length_m, haste, foreseen=foreseen[1])
        for name in grants:
            self.ledger.ask(self.ledger.vehicles[name])
            assert self.ledger.answer(0.0)

    def _put(
        self,
        name: str,
        layout: PlaceLayout,
        way: tuple[DrawnLeg, DrawnLeg],
        front_m: float,
        speed: float,
        length_m: float,
        haste: float,
        *,
        foreseen: bool,
    ) -> Vehicle:
        make = Make(length_m, 2.6, 4.5, 13.9, haste, foreseen=foreseen)
        one = self.ledger.take_in(name, layout.path(way), 0, make, lap_m=1000.0)
        one.front_m, one.speed = front_m, speed
        return one

    @property
    def trip(self) -> GrantedPass:
        """The way of `b` over its crossing."""
        return self.b.trips[0]

    @property
    def over(self) -> Pass:
        """The crossing before `a`."""
        return self.a.leg.passes[0]

    def let_reach(self, soonest_s: float) -> None:
        """Let `a` reach the stretch that both use in so many seconds at the limits."""
        movement = self.trip.over.movement
        foe = self.over.foes[movement]
        self.over.foes[movement] = Foe(movement, foe.from_m, foe.to_m, soonest_s, foe.least, foe.mean)

    def found(self, now_s: float = 0.0) -> str:
        """Return what `b` is to `a`: past, before it, later, or in its way."""
        if in_the_way(self.a, now_s) is not None:
            return IN_THE_WAY
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(crossings, "_comes_later", lambda *_: False)
            if in_the_way(self.a, now_s) is not None:
                return LATER
            patch.setattr(crossings, "_passes_first", lambda *_: False)
            patch.setattr(crossings, "_relation", lambda *_: crossings.IN_THE_WAY)
            return BEFORE if in_the_way(self.a, now_s) is not None else PAST

    def may_be_held(self, one: Vehicle) -> bool:
        """Return whether SUMO may let a vehicle under way wait on the junction."""
        trip = one.trips[0]
        return crossings._may_be_held(trip, one.front_m - trip.line_m)


@pytest.mark.parametrize(
    ("grants", "front_m", "held"), [("ba", 60.0, True), ("ba", 66.0, False), ("ab", 60.0, False)]
)
def test_one_may_have_to_wait_for_one_that_was_granted_before_it_and_is_in_its_way(
    grants: str,
    front_m: float,
    held: bool,  # noqa: FBT001  a case
) -> None:
    """Its leg ends at 50 m; 5 m long, it is past what both use, up to 10 m on, with its front at 65.5 m."""
    scene = Crossed(grants, (55.0, front_m))
    assert scene.may_be_held(scene.a) == held


@pytest.mark.parametrize(("front_m", "held"), [(51.0, True), (52.0, False)])
def test_one_may_have_to_wait_for_one_that_was_let_go_later(front_m: float, held: bool) -> None:  # noqa: FBT001  a case
    """That is on the stretch that both use; the first is not there yet."""
    scene = Crossed("ab", (front_m, 60.0))
    assert scene.may_be_held(scene.a) == held


@pytest.mark.parametrize(
    ("front_m", "foreseen", "free"),
    [(60.0, True, True), (60.0, False, False), (65.4, False, False), (65.6, False, True)],
)
def test_where_vehicles_give_way_to_others_nothing_is_foreseen(
    front_m: float,
    foreseen: bool,  # noqa: FBT001  a case
    free: bool,  # noqa: FBT001  a case
) -> None:
    """`b` is on the shared stretch and fast, `a` 30 m away. Past it, it is out of the way."""
    scene = Crossed("b", (20.0, front_m), foreseen=(foreseen, foreseen))
    assert (scene.found() != IN_THE_WAY) == free


def test_nothing_is_foreseen_of_one_into_whose_way_an_ordinary_vehicle_may_come() -> None:
    """Until it has: `b` would be past, and `a` could go first."""
    scene, later = Crossed("b", (20.0, 60.0)), Crossed("b", (49.9, -35.0))
    scene.trip.quiet = False
    later.a.leg.stretch = RoadStretch(
        RoadLane("", RoadEdge(1.0, 1.0), 1.0, 1.0, inside=False), 0.0, 1.0, [], []
    )
    assert (scene.found(), later.found()) == (IN_THE_WAY, IN_THE_WAY)
    assert not later.a.leg.is_quiet(0.0)  # it does not lead on by road


def test_nothing_is_foreseen_of_one_that_may_wait_for_persons() -> None:
    """`b` would be past; and `a`, which could go first, waits if persons may cross its own way."""
    scene, later = Crossed("b", (20.0, 60.0)), Crossed("b", (49.9, -35.0))
    assert (scene.found(), later.found()) == (BEFORE, LATER)
    scene.trip.over.walked = later.over.walked = True
    assert (scene.found(), later.found()) == (IN_THE_WAY, IN_THE_WAY)


def test_a_vehicle_of_which_nothing_is_foreseen_wakes_the_other_when_it_is_past() -> None:
    """It is in the way until its front is 15.5 m behind its line, or the place behind is clear of it."""
    scene = Crossed("b", (20.0, 60.0), foreseen=(False, False))
    found = in_the_way(scene.a, 0.0)
    assert found is not None
    assert (found.vehicle, found.until_m) == (scene.b, 65.5)


@pytest.mark.parametrize(("ahead_m", "found"), [(16.0, IN_THE_WAY), (60.0, BEFORE)])
def test_one_slows_down_for_a_lower_limit_farther_on_its_crossing(ahead_m: float, found: str) -> None:
    """`b` is fast and has 6 m to go, but brakes for a curve right behind; not for one far on."""
    scene = Crossed("b", (49.98, 59.5))
    assert scene.found() == BEFORE
    scene.trip.leg.passes.append(Pass(scene.trip.over.movement, 5.0, -inf, ahead_m, first=False))
    assert scene.found() == found


@pytest.mark.parametrize(("foreseen", "free"), [((False, True), True), ((True, False), False)])
def test_a_vehicle_is_foreseen_by_itself(foreseen: tuple[bool, bool], free: bool) -> None:  # noqa: FBT001  a case
    """The one that goes first must be foreseen, whichever comes after it."""
    before = Crossed("b", (20.0, 60.0), foreseen=foreseen)
    later = Crossed("b", (49.9, -35.0), foreseen=foreseen)
    assert (before.found() == BEFORE) == free
    assert (later.found() == LATER) != free


@pytest.mark.parametrize(("length_m", "found"), [(5.0, PAST), (8.0, IN_THE_WAY)])
@pytest.mark.parametrize(("shared", "theirs"), [((9.0, 2.0), (3.0, 10.0)), ((2.0, 9.0), (10.0, 3.0))])
def test_a_stretch_that_only_longer_vehicles_are_on_is_in_no_other_ones_way(
    shared: tuple[float, float], theirs: tuple[float, float], length_m: float, found: str
) -> None:
    """The first front is on it 7 m beyond where the last rear leaves it; on either side."""
    scene = Crossed("b", (49.9, 50.0), shared=shared, theirs=theirs, length_m=length_m)
    assert scene.found() == found


@pytest.mark.parametrize(
    ("front_m", "light_m", "found"),
    [(20.0, 0.0, BEFORE), (40.0, 0.0, IN_THE_WAY), (20.0, 5.0, IN_THE_WAY)],
)
def test_one_under_way_may_be_past_before_the_other_comes_into_the_junction(
    front_m: float, light_m: float, found: str
) -> None:
    """It has 14.5 m to go from before the stretch; the other 30 m, in 4.8 s, or 10 m, in 2.8 s.

    A light that it has not passed may stop it.
    """
    scene = Crossed("b", (front_m, 51.0), ahead_m=(0.0, light_m), lit="b")
    assert scene.found() == found


def test_a_stretch_may_begin_before_the_junction() -> None:
    """The front of `a` comes to it 2 m behind its line, and into the junction 30 m behind that."""
    assert Crossed("b", (49.9, 51.0), ahead_m=(30.0, 0.0)).found() == IN_THE_WAY


def test_it_has_to_be_past_when_the_other_comes_into_the_junction_not_when_that_reaches_the_stretch() -> None:
    """`a` comes into it after 15 m, in 3.4 s, and to the stretch 25 m later; 3.5 s are needed."""
    scene = Crossed("b", (40.0, 51.0), shared=(30.0, 37.0), ahead_m=(5.0, 0.0))
    assert scene.found() == IN_THE_WAY


def test_one_that_goes_first_sets_out_weakly_and_the_other_may_drive_above_limits() -> None:
    """At 1.3 m/s2 it takes 4.7 s, and the other comes in 6.2 s; in the second case it takes 1.5 s."""
    assert Crossed("b", (0.0, 51.0), speed=0.0).found() == IN_THE_WAY
    for haste, found in ((1.0, BEFORE), (1.2, IN_THE_WAY)):
        hasty = Crossed("b", (49.9, 51.0), haste=haste)
        hasty.let_reach(4.0)
        assert hasty.found() == found


@pytest.mark.parametrize("inside_m", [1.0, 10.0])
def test_one_that_lends_its_crossing_may_be_held_so_it_does_not_go_first(inside_m: float) -> None:
    """Before the stretch that both use, and on it."""
    scene = Crossed("b", (20.0, 50.0 + inside_m))
    scene.let_reach(100.0)
    before = scene.found()
    scene.b.lends = True
    assert (before, scene.found()) == (BEFORE, IN_THE_WAY)


@pytest.mark.parametrize(("front_m", "found"), [(60.0, IN_THE_WAY), (66.0, BEFORE)])
@pytest.mark.parametrize("inside_m", [1.0, 10.0])
def test_one_that_may_have_to_wait_itself_does_not_go_first(
    front_m: float, found: str, inside_m: float
) -> None:
    """Another was granted before it and is not past yet: here on the way over another junction.

    It is before the stretch that both use, or on it.
    """
    scene = Crossed("b", (20.0, 50.0 + inside_m))
    ahead = Crossed("ab", (front_m, 51.0))
    scene.let_reach(100.0)
    assert scene.found() == BEFORE
    trip = ahead.a.trips[0]
    scene.trip.over.foes[trip.over.movement] = ahead.trip.over.foes[trip.over.movement]
    trip.over.foes[scene.trip.over.movement] = trip.over.foes[ahead.trip.over.movement]
    trip.number = 0  # before all others
    scene.trip.over.movement.junction.trips.append(trip)
    assert scene.found() == found


@pytest.mark.parametrize(("waited_s", "found"), [(0.0, LATER), (200.0, IN_THE_WAY)])
def test_a_vehicle_that_a_light_may_stop_does_not_go_first(waited_s: float, found: str) -> None:
    """After a long wait lights let it go that it may not pass."""
    scene = Crossed("b", (49.9, -35.0), lit="a")
    scene.a.refused_s["red"] = 300.0 - waited_s
    assert scene.found(300.0) == found


@pytest.mark.parametrize(("wait_m", "found"), [(8.0, BEFORE), (12.0, IN_THE_WAY), (30.0, BEFORE)])
def test_nothing_is_foreseen_of_one_that_may_wait_inside_before_it_is_past(wait_m: float, found: str) -> None:
    """It is past 15.5 m behind its line, now 10 m; a waiting point far beyond slows it for no other."""
    assert Crossed("b", (20.0, 60.0), wait_m=wait_m).found() == found


@pytest.mark.parametrize(
    ("guide_m", "found"), [(inf, BEFORE), (80.0, BEFORE), (64.0, IN_THE_WAY), (-inf, IN_THE_WAY)]
)
def test_nothing_is_foreseen_of_one_beyond_the_stop_that_leads_it_to_a_lane(
    guide_m: float, found: str
) -> None:
    """It is past with its front at 65.5 m; nothing is known of one that is led back to its lane."""
    scene = Crossed("b", (20.0, 60.0))
    scene.b.steered, scene.b.guide_m = True, guide_m
    assert scene.found() == found


@pytest.mark.parametrize(
    ("length_m", "found"), [(4.0, PAST), (5.0, PAST), (8.0, IN_THE_WAY), (12.0, IN_THE_WAY), (20.0, PAST)]
)
def test_only_long_vehicles_share_a_stretch(length_m: float, found: str) -> None:
    """Up to 5 m they touch nowhere; one that is longer than any known counts as any."""
    scene = Crossed("b", (49.9, 51.0), length_m=length_m, shared=(2.0, -20.0), theirs=(3.0, -20.0))
    for over in (scene.over, scene.trip.over):
        ((movement, foe),) = over.foes.items()
        whole = Foe(movement, 2.0, 9.0, foe.soonest_s, foe.least, foe.mean)
        foe.sizes, foe.among = [5.0, 12.0], [[None, None], [None, whole]]
    assert scene.found() == found


def test_a_vehicle_that_comes_to_a_foe_by_the_same_movement_is_followed() -> None:
    """Its crossing does not list the movement, though that lists it for vehicles that come otherwise."""
    scene = Crossed("b", (49.9, 51.0))
    assert scene.found() == IN_THE_WAY
    scene.trip.over.foes.clear()
    assert scene.found() == PAST


@pytest.mark.parametrize(("stands_m", "found"), [(15.0, BEFORE), (7.0, IN_THE_WAY)])
def test_nothing_is_foreseen_of_one_that_is_held_before_a_junction_to_keep_it_clear(
    stands_m: float, found: str
) -> None:
    """The vehicle before it in its place stands: its rear is 10 or 2 m inside, 7.5 m are needed."""
    stretch = (-8.0, -2.0)
    scene = Crossed("b", (20.0, 50.2), shared=stretch, theirs=stretch, ahead_m=(0.0, 1.0), stands_m=stands_m)
    assert scene.found() == found


@pytest.mark.parametrize(("front_m", "found"), [(-35.0, LATER), (-25.0, IN_THE_WAY)])
def test_one_that_is_far_away_may_come_later(front_m: float, found: str) -> None:
    """Setting out weakly, `a` is past 9 m, rear and all, in 4.3 s; the other drives up to 13.9 m/s."""
    assert Crossed("b", (49.9, front_m)).found() == found


SLOW: Final = ((0.0, 2.8),)


@pytest.mark.parametrize(("front_m", "found"), [(50.0, LATER), (68.0, IN_THE_WAY)])
def test_one_that_has_to_drive_slowly_comes_later(front_m: float, found: str) -> None:
    """At 2.8 m/s it takes ten seconds for the 30 m to the stretch that both use, and four from 18 m on."""
    assert Crossed("b", (49.9, front_m), theirs=(30.0, 37.0), limits=SLOW).found() == found


def test_no_vehicle_goes_first_where_something_may_stop_or_slow_it() -> None:
    """Ordinary traffic, a light that is far away, a change of lanes."""
    where: dict[str, Any] = {"theirs": (30.0, 37.0), "limits": SLOW}
    assert Crossed("b", (49.9, 50.0), **where).found() == LATER
    assert Crossed("b", (49.9, 50.0), foreseen=(False, False), **where).found() == IN_THE_WAY
    assert Crossed("b", (49.9, 50.0), lit="a", ahead_m=(60.0, 0.0), **where).found() == IN_THE_WAY
    guided = Crossed("b", (49.9, 50.0), **where)
    guided.a.leg.guided, guided.a.leg.guide_m = True, 40.0
    assert guided.found() == LATER
    guided.a.leg.guide_m = 14.0
    assert guided.found() == IN_THE_WAY
    steered = Crossed("b", (49.9, 50.0), **where)
    steered.a.steered = True
    assert steered.found() == IN_THE_WAY


def test_no_vehicle_goes_first_to_a_place_that_others_must_leave_before() -> None:
    """They may wait for one that it goes before."""
    scene = Crossed("b", (49.9, -35.0))
    wanted = scene.a.wanted()
    assert wanted is not None
    wanted.slots = 1
    assert scene.found() == LATER
    scene.ledger.take_in("last", [Leg(wanted)], 0)
    assert scene.found() == IN_THE_WAY


def test_a_vehicle_that_is_to_stop_by_itself_on_its_way_is_in_the_way() -> None:
    """However far it is from what both use."""
    scene = Crossed("b", (20.0, 60.0))
    assert scene.found() == BEFORE
    scene.b.stop_m = 90.0
    assert scene.found() == IN_THE_WAY


def test_a_vehicle_that_goes_before_some_waits_for_none() -> None:
    """Else it might be late for the others: one is before it on its way, and another would come later."""
    scene, far = Crossed("b", (49.9, -35.0)), Crossed("b", (20.0, 60.0))
    assert scene.found() == LATER
    trip, movement = far.trip, far.trip.over.movement
    scene.over.foes[movement] = far.over.foes[movement]
    trip.over.foes[scene.over.movement] = trip.over.foes[far.over.movement]
    scene.over.movement.junction.trips.append(trip)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(crossings, "_relation", lambda _v, _f, t, *_: 1 if t is trip else crossings.IN_THE_WAY)
        assert scene.found() == IN_THE_WAY
        scene.over.movement.junction.trips.remove(scene.trip)
        assert in_the_way(scene.a, 0.0) is None


def test_two_that_cross_are_let_go_one_after_the_other() -> None:
    """Both ways are clear when they ask; the second finds the first on the way, and goes after it."""
    scene = Crossed("", (49.0, 49.0), shared=(0.0, inf), theirs=(0.0, inf), speed=0.0)
    scene.ledger.rules[:] = [crossing]
    scene.ledger.ask(scene.a)
    scene.ledger.ask(scene.b)
    assert scene.ledger.answer(1.0) == [scene.a]
    assert scene.b.reason == "crossing"
    for front_m in (60.0, 74.9):
        scene.a.front_m = front_m
        scene.ledger.passed(scene.a)
        assert scene.ledger.answer() == []
    scene.a.front_m = 75.0  # its rear is where the place behind begins
    scene.ledger.passed(scene.a)
    assert scene.ledger.answer() == [scene.b]


def test_a_vehicle_that_leaves_with_a_crossing_held_frees_it() -> None:
    """It vanishes on the junction; the other goes in the next answer."""
    scene = Crossed("", (49.0, 49.0), shared=(0.0, inf), theirs=(0.0, inf), speed=0.0)
    scene.ledger.rules[:] = [crossing]
    scene.ledger.ask(scene.a)
    scene.ledger.ask(scene.b)
    assert scene.ledger.answer(1.0) == [scene.a]
    scene.a.front_m = 60.0
    scene.ledger.passed(scene.a)
    scene.ledger.leave(scene.a)
    assert not scene.b.leg.passes[0].movement.junction.trips
    assert scene.ledger.answer() == [scene.b]


def test_a_vehicle_behind_one_that_left_its_place_another_way_does_not_go_first() -> None:
    """It may have to wait behind that one, which is still on the junction."""
    scene, aside = Crossed("b", (49.9, -35.0)), Crossed("a", (55.0, 0.0))
    trip = aside.a.trips[0]
    scene.over.movement.junction.trips.append(trip)
    assert scene.found() == LATER
    scene.over.movement.beside = [trip.over.movement]
    assert scene.found() == IN_THE_WAY


def test_one_that_stands_for_good_on_a_crossing_blocks_it() -> None:
    """The other is refused for that, and asked again in each step."""
    scene = Crossed("b", (49.0, 60.0), shared=(0.0, inf), theirs=(0.0, inf))
    scene.b.stands = "breakdown"
    refusal = crossing(scene.a, 0.0)
    assert refusal is not None
    assert (refusal.reason, refusal.each_step, refusal.cause) == ("blocked", True, "breakdown")


@pytest.mark.parametrize(
    ("mine_m", "theirs_m", "whole"), [(20.0, 4.0, True), (4.0, 20.0, True), (4.0, 4.0, False)]
)
def test_one_longer_than_any_known_counts_as_any(mine_m: float, theirs_m: float, whole: bool) -> None:  # noqa: FBT001
    """Whichever of the two it is."""
    foe = next(iter(Crossed("b", (20.0, 60.0)).over.foes.values()))
    foe.sizes, foe.among = [5.0], [[None]]
    assert shared_by(foe, mine_m, theirs_m) is (foe if whole else None)


def test_the_last_vehicle_in_the_place_ahead_is_the_one_that_may_stand() -> None:
    """Its rear is 3 m inside, that of the first 23 m; the place begins 20 m behind the line."""
    scene = Crossed("", (49.9, -35.0), stands_m=NEVER)
    after = scene.a.leg.after
    assert after is not None
    for name, front_m in (("first", 28.0), ("last", 8.0)):
        one = scene.ledger.take_in(name, [after], 0, scene.a.make, 1000.0)
        one.front_m = one.bodies[0].begin_m + front_m
    room_m = crossings._room_ahead_m(scene.a)
    assert room_m == pytest.approx(50.0 - 49.9 + 20.0 + 3.0 - 2.5)


@pytest.mark.parametrize(("now_s", "found"), [(0.0, BEFORE), (999.5, IN_THE_WAY)])
def test_nothing_is_foreseen_of_one_that_a_light_inside_may_stop_with_its_rear_on_the_stretch(
    now_s: float, found: str
) -> None:
    """`b` is on the stretch, 3 m before a light that is green up to 1000 s; its rear has 6 m to go."""
    scene = Crossed("b", (20.0, 59.0), ahead_m=(0.0, 12.0), lit="b")
    scene.trip.leg.inner = list(scene.trip.leg.passes)
    scene.trip.lit = False
    assert scene.found(now_s) == found
