"""The ledger by hand: lines, wakes, joining and leaving."""

from __future__ import annotations

import pytest
from fake_traffic import FakeTraffic

from loopgate.control.chain import circle_from, closes, closes_by_entering, closes_by_returning
from loopgate.control.departures import AT_LIGHTS, is_crowded
from loopgate.control.lamps import Lamp, Signal
from loopgate.control.ledger import Ledger
from loopgate.control.parking import come_back, has_slot_for, line_up, mend_order, put_in_order
from loopgate.control.places import (
    ConflictGroup,
    GrantedPass,
    Leg,
    Make,
    Movement,
    Pass,
    Place,
    Vehicle,
    joined,
    path_of,
)
from loopgate.control.refusal import Refusal
from loopgate.control.rules import usual


def triangle() -> list[Place]:
    """Return three places that hold two each."""
    return [Place(name, 2) for name in "abc"]


def test_a_move_that_closes_a_circle_is_refused_and_woken_when_one_leaves() -> None:
    a, b, c = places = triangle()
    ledger, loop = Ledger(usual()), path_of(places, closed=True)
    cars = [ledger.take_in(f"v{n}", loop, at) for n, at in enumerate((0, 0, 1, 2, 2))]
    away = ledger.take_in("away", path_of([b, Place("home", 2)], closed=False), 0)
    outside = ledger.take_in("outside", path_of([Place("d", 2), b], closed=False), 0)
    b.line.reverse()  # the one that leaves heads its line
    ledger.ask(outside)
    assert ledger.answer() == []
    assert outside.reason == "occupied"
    ledger.ask(away)
    assert ledger.answer() == [away]
    assert ledger.answer() == []
    assert outside.reason == "deadlock"  # woken by the slot, and seen to close the circle
    assert closes(outside) == [b, c, a]
    ledger.leave(cars[3])
    assert ledger.answer() == [outside]


def test_a_newcomer_that_closes_a_circle_is_told_before() -> None:
    places = triangle()
    ledger, loop = Ledger(usual()), path_of(places, closed=True)
    for number, at in enumerate((0, 0, 1, 1, 2)):
        ledger.take_in(f"v{number}", loop, at)
    assert closes_by_entering(loop[2])
    assert not closes_by_entering(path_of([Place("d", 1), *places], closed=False)[0])
    assert circle_from(places[0]) == []
    ledger.take_in("last", loop, 2)
    assert circle_from(places[0]) == places


def test_a_path_that_ends_is_left() -> None:
    a = Place("a", 1)
    ledger = Ledger(usual())
    car = ledger.take_in("car", path_of([a], closed=False), 0)
    ledger.ask(car)
    assert ledger.answer() == [car]
    assert not a.line
    assert not ledger.vehicles


def test_vehicles_that_come_are_in_line_where_they_are() -> None:
    a = Place("a", 3)
    ledger, path = (
        Ledger(usual()),
        joined([Leg(a, 0, 0.0, 100.0), Leg(Place("b", 3), 1, 100.0, 200.0)], closed=True),
    )
    for name, front_m in (("middle", 50.0), ("first", 80.0), ("last", 20.0)):
        come = ledger.take_in(name, path, 0)
        come.front_m = front_m
        put_in_order(ledger, come)
    assert [one.name for one in a.line] == ["first", "middle", "last"]
    assert [body.vehicle.name for body in a.bodies] == ["first", "middle", "last"]
    assert mend_order(ledger, [a]) == 0
    ledger.vehicles["last"].front_m = 95.0
    assert mend_order(ledger, [a]) == 1
    assert a.line[0].name == "last"


def test_a_trespass_counts_once_until_it_is_over() -> None:
    ledger, path = (
        Ledger(usual()),
        joined([Leg(Place(p, 2), n, 100.0 * n, 100.0 * n + 100.0) for n, p in enumerate("abc")], closed=True),
    )
    car = ledger.take_in("car", path, 0)
    for car.front_m in (50.0, 101.0, 110.0):
        ledger.passed(car)
    assert ledger.trespasses == 1
    ledger.ask(car)
    assert ledger.answer() == [car]
    car.front_m = 201.0
    ledger.passed(car)
    assert ledger.trespasses == 2


def test_nobody_is_taken_in_twice_or_into_a_full_place() -> None:
    ledger, path = Ledger(usual()), path_of([Place("a", 1)], closed=False)
    ledger.take_in("car", path, 0)
    with pytest.raises(ValueError, match="vehicle car is there already, in place a"):
        ledger.take_in("car", path, 0)
    with pytest.raises(ValueError, match="vehicle bus does not fit into place a: its 1 slots are taken"):
        ledger.take_in("bus", path, 0)


def test_nobody_is_let_go_before_a_stop_of_its_own_nor_behind_one_that_leaves_no_room() -> None:
    a, b = Place("a", 4), Place("b", 4)
    path = path_of([a, b], closed=True)
    for leg, begin_m in zip(path, (0.0, 40.0), strict=True):
        leg.begin_m, leg.end_m, leg.slot_m = begin_m, begin_m + 30.0, 7.5  # type: ignore[misc]
    ledger = Ledger(usual())
    stops, follows = (
        ledger.take_in("stops", path, 0, lap_m=80.0),
        ledger.take_in("follows", path, 0, lap_m=80.0),
    )
    stops.stop_m = 60.0  # 20 m into b: two slots
    ledger.ask(stops)
    assert ledger.answer() == [stops]
    ledger.ask(stops)
    assert ledger.answer() == []
    assert stops.reason == "stop"
    ledger.ask(follows)
    assert ledger.answer() == [follows]
    third = ledger.take_in("third", path, 0, lap_m=80.0)
    ledger.ask(third)
    assert ledger.answer() == []
    assert third.reason == "stop"
    stops.stop_m = 140.0
    assert ledger.answer() == [third]
    assert ledger.answer() == [stops]


def test_one_that_parks_gives_up_its_slot_and_comes_back_where_it_stands() -> None:
    a, b = Place("a", 3), Place("b", 2)
    path = path_of([a, b], closed=True)
    for leg, begin_m in zip(path, (0.0, 40.0), strict=True):
        leg.begin_m, leg.end_m = begin_m, begin_m + 30.0  # type: ignore[misc]
    ledger = Ledger(usual())
    cars = [ledger.take_in(name, path, 0, lap_m=80.0) for name in ("first", "parks", "last")]
    for car, front_m in zip(cars, (28.0, 20.0, 10.0), strict=True):
        car.front_m = front_m
    first, parks, last = cars
    ledger.ask(first)
    assert ledger.step_aside(parks)
    assert (a.line, len(a.bodies)) == ([first, last], 2)
    assert ledger.answer() == [first]
    ledger.shut(b)
    ledger.ask(last)
    assert (ledger.answer(), last.reason) == ([], "occupied")
    ledger.open_up()
    assert has_slot_for(parks)
    come_back(ledger, parks)
    assert a.line == [parks, last]
    assert not last.asks  # it is first no longer
    last.front_m = 25.0
    line_up(ledger, parks)
    assert a.line == [parks, last]  # the order that the rules allowed, whoever drives past meanwhile
    assert ledger.step_aside(parks)  # SUMO has not let it onto the road: the one behind goes first again
    assert (a.line, len(a.bodies)) == ([last], 2)  # the first has not left it yet
    ledger.ask(last)
    assert ledger.answer() == [last]


def test_nobody_comes_back_whose_slot_would_close_a_circle() -> None:
    a, b = Place("a", 2), Place("b", 1)
    path = path_of([a, b], closed=True)
    ledger = Ledger(usual())
    parks = ledger.take_in("parks", path, 0)
    ledger.take_in("stays", path, 0)
    ledger.take_in("other", path, 1)
    assert ledger.step_aside(parks)
    assert not has_slot_for(parks)


def test_a_way_is_crowded_where_slots_are_taken_by_vehicles_that_are_slow() -> None:
    places = [Place("a", 10), Place("b", 10)]
    limits = dict.fromkeys(places, 10.0)
    ledger, path = Ledger(usual()), path_of(places, closed=True)
    cars = [ledger.take_in(f"v{number}", path, 0) for number in range(4)]
    assert not is_crowded(limits)  # a fifth is taken, by vehicles that stand
    cars.append(ledger.take_in("v4", path, 0))
    assert is_crowded(limits)
    for car in cars:
        car.speed = 7.0
    assert not is_crowded(limits)  # they roll
    assert not is_crowded(limits, AT_LIGHTS)
    for car in cars:
        car.speed = 0.0
    assert not is_crowded(limits, AT_LIGHTS)
    cars += [ledger.take_in(f"more{number}", path, 0) for number in range(5)]
    assert is_crowded(limits, AT_LIGHTS)
    cars[0].asks, cars[0].reason = True, "red"
    assert not is_crowded(limits, AT_LIGHTS)  # a queue at a red light


def test_a_full_ring_goes_before_a_longer_queue() -> None:
    """One of one slot against three of nine: shares count, so that a short ring empties before it fills."""
    road, ring, goal = Place("road", 9), Place("ring", 1), Place("goal", 1)
    ledger = Ledger(usual())
    entry = path_of([road, goal], closed=True)
    one = ledger.take_in("one", entry, 0)
    for name in ("two", "three"):
        ledger.take_in(name, entry, 0)
    other = ledger.take_in("other", path_of([ring, goal], closed=True), 0)
    ledger.ask(one)
    ledger.ask(other)
    assert ledger.answer() == [other]
    assert one.reason == "occupied"


def test_a_place_stays_shut_for_one_answer_after_it_was_shut() -> None:
    a, b = Place("a", 2), Place("b", 2)
    ledger = Ledger(usual())
    car = ledger.take_in("car", path_of([a, b], closed=True), 0)
    ledger.ask(car)
    ledger.shut(b)
    ledger.open_up()  # the answer is yet to come
    assert ledger.answer() == []
    ledger.open_up()
    assert ledger.answer() == [car]


def test_a_slot_is_looked_at_anew_when_a_place_ahead_fills() -> None:
    make = Make(5.0, 2.6, 4.5, 14.0, 1.0)
    a, b = Place("a", 2), Place("b", 2)
    places = [Leg(a, 0, 0.0, 20.0), Leg(b, 1, 40.0, 60.0), Leg(Place("c", 2), 2, 80.0, 100.0)]
    ledger, path = Ledger(usual()), joined(places, closed=True)
    leaves, stays, goes = (
        ledger.take_in(name, path, at, make, 120.0) for name, at in (("leaves", 0), ("stays", 0), ("goes", 1))
    )
    ledger.ask(leaves)
    assert ledger.answer() == [leaves]
    assert leaves.back_m == 25.0  # a was full when it had its grant: the slot is free once its rear is out
    ledger.leave(stays)
    assert leaves.back_m == 25.0  # nobody has looked since
    ledger.ask(goes)
    assert ledger.answer() == [goes]
    ledger.leave(goes)
    ledger.take_in("fills", path, 1, make, 120.0)
    assert leaves.back_m == 45.0  # a has a slot free: it keeps its own until its rear is over the junction


def leaving(slots: int = 2) -> tuple[Ledger, Vehicle, Vehicle]:
    """Let the second of three places be full, with one vehicle on its way out; two come."""
    make = Make(5.0, 2.6, 4.5, 14.0, 1.0)
    places = [Place("a", 2), Place("b", slots), Place("c", 2)]
    path = joined([Leg(one, k, 40.0 * k, 40.0 * k + 20.0) for k, one in enumerate(places)], closed=True)
    ledger = Ledger(usual())
    for name, at in [*[("goes", 1), ("stays", 1)][:slots], ("comes", 0), ("more", 0)]:
        ledger.take_in(name, path, at, make, 120.0)
    goes, comes = ledger.vehicles["goes"], ledger.vehicles["comes"]
    ledger.ask(goes)
    assert ledger.answer() == [goes]
    return ledger, goes, comes


def test_the_slot_of_one_that_surely_leaves_is_free_and_no_more() -> None:
    ledger, goes, comes = leaving()
    b, more = goes.bodies[0].place, ledger.vehicles["more"]
    assert (b.free(), b.is_full()) == (1, True)
    ledger.ask(comes)
    assert ledger.answer() == [comes]
    ledger.ask(more)
    assert (ledger.answer(), more.reason, b.free()) == ([], "occupied", 0)
    goes.front_m = goes.bodies[0].out_m
    ledger.passed(goes)
    assert (ledger.answer(), b.free()) == ([], 0)


@pytest.mark.parametrize(
    "kept",
    [
        ("steered", True),
        ("lends", True),
        ("behind", True),
        ("stands", "b"),
        ("stop_m", 90.0),
        ("parks", True),
    ],
    ids=lambda kept: str(kept[0]),
)
def test_the_slot_of_one_that_something_may_keep_is_free_once_that_ends(kept: tuple[str, object]) -> None:
    """The one that comes is looked at in each step."""
    ledger, goes, comes = leaving()
    name, value = kept
    before = getattr(goes, name)
    setattr(goes, name, value)
    ledger.ask(comes)
    assert (ledger.answer(), comes.reason) == ([], "occupied")
    setattr(goes, name, before)
    assert ledger.answer() == [comes]


@pytest.mark.parametrize(("light_m", "free"), [(59.0, 0), (66.0, 1)])
def test_a_light_keeps_one_that_has_not_passed_it_with_its_rear_in_the_place(
    light_m: float, free: int
) -> None:
    """Its rear is out with its front at 65 m."""
    _, goes, _ = leaving()
    signal = Signal(Lamp("t", FakeTraffic({})), 0, 14.0)
    over = Pass(Movement("m", ConflictGroup()), 14.0, 0.0, light_m - 60.0, signal)
    trip = GrantedPass(goes.bodies[1], Leg(goes.bodies[0].place), over, 1, 60.0, 85.0)
    goes.trips.append(trip)
    before = goes.bodies[0].place.free()
    trip.lit = True
    assert (before, goes.bodies[0].place.free()) == (free, 1)
    trip.quiet = False  # an ordinary vehicle is near its way
    assert goes.bodies[0].place.free() == 0


def test_a_place_for_one_is_free_only_once_a_rear_has_left_it() -> None:
    ledger, goes, comes = leaving(1)
    ledger.ask(comes)
    assert (ledger.answer(), comes.reason) == ([], "occupied")
    goes.front_m = goes.bodies[0].out_m
    ledger.passed(goes)
    assert ledger.answer() == [comes]


def test_a_time_wakes_at_that_time() -> None:
    def early(_vehicle: Vehicle, now_s: float) -> Refusal | None:
        return Refusal("early", at_s=20.0) if now_s < 20.0 else None

    path = path_of([Place("a", 2), Place("b", 2)], closed=True)
    ledger = Ledger(usual(outside=[early]))
    car = ledger.take_in("car", path, 0)
    ledger.ask(car)
    assert [len(ledger.answer(now_s)) for now_s in (18.0, 19.0, 20.0)] == [0, 0, 1]


def test_a_refusal_is_noted_anew_when_its_cause_changes() -> None:
    a, b = Place("a", 2), Place("b", 2)
    ledger = Ledger(usual())
    car = ledger.take_in("car", path_of([a, b], closed=True), 0)
    ledger.ask(car)
    for cause in ("b, until 400 s", "b, until 400 s", "b, until 500 s"):
        ledger.close(b, "closed", cause)
        assert (ledger.answer(), car.reason, car.cause) == ([], "closed", cause)
    assert [reason for what, _, _, reason, _ in ledger.log if what == "refused"] == ["closed", "closed"]
    ledger.close(b, "", "")
    assert ledger.answer() == [car]


@pytest.mark.parametrize(("there", "free"), [(1, 2), (2, 1), (3, 0)])
def test_one_beside_the_road_returns_into_free_slots(there: int, free: int) -> None:
    """The last one may be kept for another; one that is to go before that may have it all the same."""
    place = Place("a", 3)
    ledger, path = Ledger(usual()), path_of([place, Place("b", 9)], closed=True)
    parked = ledger.take_in("parked", path, 0)
    assert ledger.step_aside(parked)
    others = [ledger.take_in(f"v{number}", path, 0) for number in range(there)]
    assert has_slot_for(parked) == (free > 0)
    place.kept_for = others[0]
    assert (has_slot_for(parked), has_slot_for(parked, first=True)) == (free > 1, free > 0)
    for name in ("shut", "closed"):
        setattr(place, name, True)
        assert not has_slot_for(parked, first=True)
        setattr(place, name, False)


def test_one_that_is_not_wholly_in_one_place_keeps_its_slots() -> None:
    """Nor does one step aside that is beside the road."""
    a, b = Place("a", 2), Place("b", 2)
    ledger, path = Ledger(usual()), path_of([a, b], closed=True)
    car = ledger.take_in("car", path, 0, Make(5.0, 2.6, 4.5, 10.0, 1.0), 100.0)
    ledger.ask(car)
    assert ledger.answer()
    assert len(held := list(car.bodies)) > 1
    assert not ledger.step_aside(car)
    assert car.bodies == held
    ledger.leave(car)
    other = ledger.take_in("other", path, 0)
    assert ledger.step_aside(other)
    assert not ledger.step_aside(other)


@pytest.mark.parametrize(("there", "closes_it"), [(1, False), (2, True)])
def test_one_that_returns_closes_a_circle_only_if_it_fills_its_place(there: int, closes_it: bool) -> None:  # noqa: FBT001
    """The other places of the ring are full; a holds three."""
    a, b = Place("a", 3), Place("b", 2)
    ledger, path = Ledger(usual()), path_of([a, b], closed=True)
    first, *_ = (ledger.take_in(f"a{k}", path, 0) for k in range(there))
    for k in range(2):
        ledger.take_in(f"b{k}", path, 1)
    assert closes_by_returning(a, first) == closes_it


@pytest.mark.parametrize(
    ("reason", "named"), [("crossing", []), ("deadlock", ["c0", "a0", "b0"]), ("red", [])]
)
def test_the_chain_rule_names_a_circle_to_those_that_it_refused(reason: str, named: list[str]) -> None:
    """Not to one that another rule refused, though a circle would close."""
    places = triangle()
    ledger, loop = Ledger(usual()), path_of(places, closed=True)
    for at, name in enumerate("abc"):
        for number in range(2 - (at == 0)):
            ledger.take_in(f"{name}{number}", loop, at)
    one = ledger.take_in("one", path_of([Place("d", 2), *places], closed=False), 0)
    one.reason = reason
    assert sorted(ledger.gate.blockers(one)) == sorted(named)


def test_one_that_comes_to_head_its_line_asks_if_it_must_brake_soon() -> None:
    """SUMO let it pass the other; that asks no more, since it is behind."""
    ledger = Ledger([lambda *_: Refusal("closed", at_s=1e9)])
    places = Place("a", 3), Place("b", 3)
    legs = [Leg(place, n, 100.0 * n, 100.0 * n + 90.0) for n, place in enumerate(places)]
    path, make = joined(legs, closed=True), Make(5.0, 2.6, 4.5, 10.0, 1.0)
    late, fast = (ledger.take_in(name, path, 0, make, 200.0) for name in ("late", "fast"))
    for one, front_m in ((late, 70.0), (fast, 88.0)):
        one.front_m, one.speed = front_m, 0.0
    ledger.ask(late)
    line_up(ledger, fast)
    assert places[0].line == [fast, late]
    assert (fast.asks, late.asks) == (True, False)


@pytest.mark.parametrize("crosses_two", [True, False])
def test_rules_are_asked_again_after_a_grant_that_may_hold_up_another_on_its_way(crosses_two: bool) -> None:  # noqa: FBT001
    """Another is on the first junction, and the grant is for the second, which it comes to next."""
    near, far = ConflictGroup(), ConflictGroup()
    ledger = Ledger([])
    vehicles = []
    for name, groups in (("other", [near, far][: 1 + crosses_two]), ("one", [near])):
        path = path_of([Place(f"{name} a", 2), Place(f"{name} b", 2)], closed=True)
        path[0].passes = [Pass(Movement(f"{name} {n}", group), 10.0, 0.0) for n, group in enumerate(groups)]
        vehicles.append(ledger.take_in(name, path, 0, Make(5.0, 2.6, 4.5, 10.0, 1.0), 200.0))
    ledger.ask(vehicles[0])
    ledger.answer()
    ledger.rules_look_near, ledger._gave_back = True, False
    ledger._changed = {far}
    assert ledger._may_differ(vehicles[1]) == crosses_two


def test_one_that_asks_again_at_once_is_answered_at_once_even_if_woken_before() -> None:
    """Another came in behind it, in the same answer and before its grant: it was woken for the next one."""
    z, a, b, c = (Place(name, slots) for name, slots in zip("zabc", (1, 3, 2, 1), strict=True))
    make = Make(5.0, 2.6, 4.5, 20.0, 1.0)
    ends_m = {"z": 50.0, "a": 100.0, "b": 115.0, "c": 200.0}

    def path(*places: Place) -> list[Leg]:
        begins_m = [ends_m[place.name] - 10.0 for place in places]
        legs = [
            Leg(p, n, begin_m, ends_m[p.name])
            for n, (p, begin_m) in enumerate(zip(places, begins_m, strict=True))
        ]
        return joined(legs, closed=False)

    ledger = Ledger(usual())
    one = ledger.take_in("one", path(a, b, c), 0, make)
    behind = ledger.take_in("behind", path(z, a, b), 0, make)
    ledger.take_in("ahead", path(c), 0, make)
    one.front_m, one.speed = 80.0, 18.0
    for vehicle in (one, behind):
        ledger.ask(vehicle)
    assert ledger.answer() == [behind, one]
    assert one.leg.place is b
    assert one.reason == "occupied"
    assert ledger.answer() == []
