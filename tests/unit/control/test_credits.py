"""Long vehicles keep their extra metres ahead; slots are as long as a car."""

from loopgate.control.driving import may_turn_off, turn_off
from loopgate.control.ledger import Ledger
from loopgate.control.places import Leg, Make, Place, Vehicle, joined
from loopgate.control.refusal import Refusal
from loopgate.control.rules import usual

CAR = Make(5.0, 2.6, 4.5, 13.9, 1.0, 2.5)
BUS = Make(18.0, 1.2, 4.0, 13.9, 1.0, 2.5)
BUS_M = 20.5


def place(name: str, room_m: float = 60.0) -> Place:
    """Two buses fit into 60 m, or eight cars."""
    return Place(name, int(room_m // BUS_M), room_m, 7.5)


def path_of(places: list[Place], *, closed: bool) -> list[Leg]:
    """Places of 60 m, 40 m apart."""
    legs = [Leg(one, k, 100.0 * k, 100.0 * k + 60.0) for k, one in enumerate(places)]
    return joined(legs, closed=closed)


def put(ledger: Ledger, path: list[Leg], count: int, *, make: Make = CAR, position: int = 0) -> list[Vehicle]:
    """Put vehicles on a path."""
    made = ledger.made
    lap_m = 0.0 if path[-1].after is None else 100.0 * len(path)
    return [ledger.take_in(f"v{made + k}", path, position, make, lap_m) for k in range(count)]


def go(ledger: Ledger, vehicle: Vehicle) -> None:
    """Let a vehicle go on to its next place, with its rear out of the last."""
    ledger.ask(vehicle)
    assert vehicle in ledger.answer()
    vehicle.front_m = vehicle.bodies[-1].begin_m + vehicle.make.length_m
    ledger.passed(vehicle)


def test_slots_are_fewer_while_a_long_vehicle_comes() -> None:
    """13 m less for each bus, but never less than two; given back as its rear leaves each place."""
    a, b, away = place("a"), place("b"), Place("away", 9)
    path = path_of([a, b, away], closed=False)
    ledger = Ledger(usual())
    assert (a.slots, b.slots, a.least) == (8, 8, 2)
    (bus,) = put(ledger, path, 1, make=BUS)
    assert (a.slots, b.slots) == (6, 6)
    others = put(ledger, path_of([place("z", 300.0), a, b, away], closed=False), 4, make=BUS)
    assert (a.slots, b.slots) == (2, 2)
    for other in others:
        ledger.leave(other)
    go(ledger, bus)
    assert (a.slots, b.slots) == (8, 6)
    go(ledger, bus)
    assert (a.slots, b.slots) == (8, 8)


def test_a_place_that_comes_twice_is_kept_until_the_second_time() -> None:
    """And on a loop for as long as the bus is there."""
    a, b, away = place("a"), place("b"), Place("away", 9)
    ledger = Ledger(usual())
    (bus,) = put(ledger, path_of([a, b, a, away], closed=False), 1, make=BUS)
    go(ledger, bus)
    assert a.slots == 6
    go(ledger, bus)
    go(ledger, bus)
    assert (a.slots, b.slots) == (8, 8)
    (round_,) = put(ledger, path_of([a, b], closed=True), 1, make=BUS)
    go(ledger, round_)
    assert a.slots == 6
    ledger.leave(round_)
    assert (a.slots, b.slots) == (8, 8)


def test_a_long_vehicle_comes_only_if_all_others_keep_their_slots() -> None:
    """Far ahead, too; and a vehicle that was refused for want of a slot is woken when one comes up."""
    a, b, c, away = place("a"), place("b"), place("c"), Place("away", 9)
    path = path_of([c, b, a, away], closed=False)
    ledger = Ledger(usual(outside=[lambda car, _: Refusal("stop") if car.leg.place is a else None]))
    cars = put(ledger, path, 7, position=2)
    assert ledger.fits(path[0])
    assert not ledger.fits(path[0], BUS_M)
    assert (a.slots, b.slots, c.slots) == (8, 8, 8)
    ledger.leave(cars[0])
    assert ledger.fits(path[0], BUS_M)
    (bus,) = put(ledger, path, 1, make=BUS)
    assert a.is_full()
    (car,) = put(ledger, path, 1, position=1)
    ledger.ask(car)
    assert not ledger.answer()
    assert car.reason == "occupied"
    ledger.leave(bus)
    assert ledger.answer() == [car]


def test_no_circle_of_full_places_may_arise_by_a_long_vehicle() -> None:
    """Six in each of two places that want the other place: with the bus both would be full."""
    a, b, c, away = place("a"), place("b"), place("c"), Place("away", 9)
    ledger = Ledger(usual())
    (ring, back) = (path_of(some, closed=True) for some in ([a, b], [b, a]))
    put(ledger, ring, 6)
    cars = put(ledger, back, 6)
    way = path_of([c, a, b, away], closed=False)
    assert not ledger.fits(way[0], BUS_M)
    held = ledger.reserve(path_of([c, away], closed=False)[0], BUS_M)
    assert (c.slots, a.slots) == (6, 8)
    ledger.release(held)
    assert c.slots == 8
    ledger.leave(cars[0])
    assert ledger.fits(way[0], BUS_M)
    put(ledger, way, 1, make=BUS)
    assert (len(a.line), a.slots, len(b.line), b.slots) == (6, 6, 5, 6)


def test_a_long_vehicle_turns_only_to_where_its_metres_fit() -> None:
    """It keeps them on the new path then, and no longer on the old one."""
    a, b, c, away = place("a"), place("b"), place("c"), Place("away", 9)
    old, new = (path_of([a, some, away], closed=False) for some in (b, c))
    ledger = Ledger(usual())
    (bus,) = put(ledger, old, 1, make=BUS)
    cars = put(ledger, new, 7, position=1)
    assert not may_turn_off(ledger, bus, new[0])
    ledger.leave(cars[0])
    assert may_turn_off(ledger, bus, new[0])
    turn_off(ledger, bus, new[0], BUS, 0.0)
    assert (a.slots, b.slots, c.slots) == (6, 8, 6)


def test_room_is_collected_place_by_place() -> None:
    """Two places are never free at once; what is kept in one stays kept until the other is free, too."""
    a, b, c, away = place("a"), place("b"), place("c"), Place("away", 9)
    path = path_of([c, b, a, away], closed=False)
    ledger, held = Ledger(usual()), dict[Place, float]()
    there = put(ledger, path, 7, position=2)
    assert ledger.collect(path[0], BUS_M, held) == [a]  # it has one too many
    assert held == {c: 13.0, b: 13.0}
    assert (a.slots, b.slots, c.slots) == (8, 6, 6)
    put(ledger, path, 6, position=1)
    ledger.leave(there[0])
    assert not ledger.fits(path[0], BUS_M, {})
    assert not ledger.collect(path[0], BUS_M, held)
    assert (a.slots, held) == (6, {c: 13.0, b: 13.0, a: 13.0})
    assert ledger.fits(path[0], BUS_M, held)
    ledger.release(held)
    assert (a.slots, b.slots, c.slots) == (8, 8, 8)


def test_nothing_is_collected_where_a_circle_would_close() -> None:
    """Six in each of two places that want the other place."""
    a, b, c, away = place("a"), place("b"), place("c"), Place("away", 9)
    ledger, held = Ledger(usual()), dict[Place, float]()
    for some in ([a, b], [b, a]):
        put(ledger, path_of(some, closed=True), 6)
    ledger.collect(path_of([c, a, b, away], closed=False)[0], BUS_M, held)
    assert held == {c: 13.0, a: 13.0}
    assert (a.slots, b.slots, c.slots) == (6, 8, 6)
