"""Vehicles that depart: how often their place is shut to the others."""

from types import SimpleNamespace
from typing import Any, cast

import pytest

from loopgate.control.departures import DepartureRules
from loopgate.control.driving import Arrivals, Paths
from loopgate.control.ledger import Ledger
from loopgate.control.places import ConflictGroup, Movement, Place, path_of


def wants(
    name: str, depart_s: float, *, closed: bool = False, needed_m: float = 7.5, goes_on: bool = False
) -> SimpleNamespace:
    """Return a vehicle that wants to depart from a place of its name."""
    return SimpleNamespace(
        track=SimpleNamespace(vehicle=name, position=0),
        demand=SimpleNamespace(depart_s=depart_s, led=SimpleNamespace(goes_on=goes_on)),
        loop=SimpleNamespace(closed=closed),
        type=SimpleNamespace(min_gap_m=2.5, needed_m=needed_m),
        vehicle=name,
        place=name,
        insertion=None,
    )


def shut_at(seconds: int, *, is_clear: bool, inserts: bool) -> list[float]:
    """Let a vehicle try to depart for so many seconds; return when its place was shut to the others."""
    place, now = Place("a", 2), SimpleNamespace(now_s=0.0)
    shut: list[float] = []
    arrivals = SimpleNamespace(missed=[], coming=[], is_clear=lambda *_: is_clear)
    arrivals.let_in = lambda *_: True
    driving = SimpleNamespace(
        arrivals=arrivals,
        ledger=SimpleNamespace(vehicles={}, fits=lambda *_: True, shut=lambda _: shut.append(now.now_s)),
        paths=SimpleNamespace(of=lambda _: path_of([place, Place("b", 2)], closed=True)),
        once=0,
    )
    late = wants("late", 0.0, goes_on=True)
    rules = DepartureRules(cast("Any", now), cast("Any", driving), [cast("Any", late)], 4, {})
    for second in range(seconds):
        now.now_s = float(second)
        rules.look()
        arrivals.missed = [] if inserts else [late.track] * (second in shut)
    return shut


def test_one_that_sumo_never_inserts_does_not_keep_the_others_out_of_its_place() -> None:
    """SUMO may refuse it as long as another vehicle waits behind the place, for as long as that is shut."""
    shut = shut_at(100, is_clear=True, inserts=False)
    assert shut[:3] == [0.0, 1.0, 3.0]
    assert len(shut) == 9


def test_one_whose_place_never_clears_keeps_the_others_out_every_other_twenty_seconds() -> None:
    """Others that come in all the time are in its way; it does not keep them out for good."""
    assert shut_at(80, is_clear=False, inserts=True) == [*range(20, 40), *range(60, 80)]


def test_after_twenty_others_the_one_that_has_waited_longest_departs_onto_a_crowded_path() -> None:
    """It has waited for two minutes; one that SUMO never takes does not count."""
    now, went = SimpleNamespace(now_s=0.0), list[str]()
    full = Place("full", 1)
    Ledger([]).take_in("there", path_of([full, Place("b", 1)], closed=True), 0)
    ledger = SimpleNamespace(vehicles={}, fits=lambda *_: True, shut=lambda _: None)
    arrivals = SimpleNamespace(missed=[], coming=[], is_clear=lambda *_: True)

    def let_in(track: Any, *_: object) -> bool:  # noqa: ANN401  a stand-in
        if track.vehicle != "never":
            went.append(track.vehicle)
        return bool(track.vehicle != "never")

    arrivals.let_in = let_in
    paths = SimpleNamespace(of=lambda _: path_of([full, Place("b", 1)], closed=False))
    driving = SimpleNamespace(arrivals=arrivals, ledger=ledger, paths=paths, once=9)
    due = [
        wants(name, at_s, closed=name != "once")
        for name, at_s in [("once", 0.0), ("never", 0.0), *((f"v{k}", 6.0 * k + 6.0) for k in range(30))]
    ]
    limits = {"full": 10.0, "b": 10.0}
    rules = DepartureRules(cast("Any", now), cast("Any", driving), cast("Any", due), 4, limits)
    for second in range(200):
        now.now_s = float(second)
        rules.look()
    assert went.index("once") == 20


def test_room_is_collected_for_a_long_vehicle_after_two_minutes() -> None:
    """Nobody else collects any meanwhile, and nobody comes into a full place where it lacks room.

    Into one that is not full, but too full for it, nobody comes every other twenty seconds.
    """
    now, asked = SimpleNamespace(now_s=0.0), list[tuple[float, float]]()
    place, full, fuller = (Place(name, 4, room_m=30.0, slot_m=7.5) for name in "abc")
    full.bodies = [cast("Any", None)] * 4
    shut = list[tuple[str, float]]()

    def collect(_leg: object, needed_m: float, _held: object) -> list[Place]:
        asked.append((now.now_s, needed_m))
        return [full, fuller]

    def close(place: Place) -> None:
        shut.append((place.name, now.now_s))

    ledger = SimpleNamespace(vehicles={}, fits=lambda *_: False, collect=collect, shut=close)
    paths = SimpleNamespace(of=lambda _: path_of([place], closed=False))
    arrivals = SimpleNamespace(missed=[], coming=[], is_clear=lambda *_: True)
    driving = SimpleNamespace(arrivals=arrivals, ledger=ledger, paths=paths, once=0)
    lengths_m = {"car": 7.5, "bus": 14.5, "van": 9.0}
    due = [wants(name, 0.0, needed_m=needed_m, goes_on=True) for name, needed_m in lengths_m.items()]
    rules = DepartureRules(cast("Any", now), cast("Any", driving), cast("Any", due), 4, {})
    for second in range(200):
        now.now_s = float(second)
        rules.look()
    assert asked[0] == (120.0, 14.5)
    assert {needed_m for _, needed_m in asked} == {14.5}
    closed_s = {name: [at_s for one, at_s in shut if one == name] for name in "abc"}
    assert closed_s["a"] == []
    assert closed_s["b"] == [float(at_s) for at_s in range(120, 200)]
    assert closed_s["c"] == [float(at_s) for at_s in range(120, 200) if at_s % 40 >= 20]


@pytest.mark.parametrize(
    ("slots", "loops", "goes"), [(100, True, True), (60, True, False), (100, False, False)]
)
def test_few_that_drive_once_depart_onto_crowded_paths_where_others_drive_loops(
    slots: int,
    loops: bool,  # noqa: FBT001  a case
    goes: bool,  # noqa: FBT001  a case
) -> None:
    """A share of all slots, of which three vehicles are a part: their paths are crowded by the loops."""
    now, went, full = SimpleNamespace(now_s=0.0), list[str](), Place("full", 1)
    Ledger([]).take_in("there", path_of([full, Place("b", 1)], closed=True), 0)
    ledger = SimpleNamespace(vehicles={}, fits=lambda *_: True, shut=lambda _: None)
    arrivals = SimpleNamespace(missed=[], coming=[], is_clear=lambda *_: True)

    def let_in(track: Any, *_: object) -> bool:  # noqa: ANN401  a stand-in
        went.append(track.vehicle)
        return True

    arrivals.let_in = let_in
    paths = SimpleNamespace(of=lambda _: path_of([full, Place("b", 1)], closed=False))
    driving = SimpleNamespace(arrivals=arrivals, ledger=ledger, paths=paths, once=3)
    due = [wants("once", 0.0), wants("later", 500.0, closed=loops)]
    limits = {"full": 10.0, "b": 10.0}
    rules = DepartureRules(cast("Any", now), cast("Any", driving), cast("Any", due), slots, limits)
    rules.look()
    assert went == ["once"] * goes


@pytest.mark.parametrize(
    ("front_m", "length_m", "is_clear"),
    [(84.0, 12.0, True), (90.0, 12.0, False), (107.0, 12.0, False), (112.0, 12.0, True), (102.5, 5.0, True)],
)
def test_nobody_departs_beside_a_long_body_that_swings_in(
    front_m: float, length_m: float, *, is_clear: bool
) -> None:
    """A bus comes to the lane beside, which begins at 100 m: its rear is still over both lanes."""
    own, beside = Place("e_0", 3), Place("e_1", 3)
    bus = SimpleNamespace(front_m=front_m, make=SimpleNamespace(length_m=length_m), parks=False)
    beside.bodies.append(cast("Any", SimpleNamespace(vehicle=bus, begin_m=100.0)))
    leg = SimpleNamespace(place=own, begin_m=0.0)
    places = {"e_0": own, "e_1": beside}
    paths = Paths(cast("Any", SimpleNamespace(places=places, movements=(), path=lambda _: [leg])))
    arrivals = Arrivals(cast("Any", None), cast("Any", None), paths)
    track = cast("Any", SimpleNamespace(legs=(), position=0, front_m=5.5))
    assert arrivals.is_clear(track) == is_clear


@pytest.mark.parametrize(("front_m", "is_clear"), [(84.0, True), (86.0, False), (130.0, False)])
def test_nobody_departs_beside_who_drives_over_a_lane_that_is_no_place(
    front_m: float, *, is_clear: bool
) -> None:
    """The lane beside is so short that it belongs to the crossing, which begins at 100 m."""
    junction, own = ConflictGroup(), Place("e_0", 3)
    movement = Movement("d_0>e_1", junction)
    over = SimpleNamespace(movement=movement, ahead_m=0.5)
    bus = SimpleNamespace(front_m=front_m)
    junction.trips.append(cast("Any", SimpleNamespace(vehicle=bus, over=over, line_m=99.5)))
    leg = SimpleNamespace(place=own, begin_m=0.0)
    layout = SimpleNamespace(places={"e_0": own}, movements=(movement,), path=lambda _: [leg])
    arrivals = Arrivals(cast("Any", None), cast("Any", None), Paths(cast("Any", layout)))
    assert arrivals.is_clear(cast("Any", SimpleNamespace(legs=(), position=0, front_m=5.5))) == is_clear
