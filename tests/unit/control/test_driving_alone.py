"""Vehicles on a road without SUMO: which are held, which pass, which are looked at, which come and leave."""

from __future__ import annotations

from dataclasses import replace

import pytest
from fake_traffic import FakeTraffic, FakeVehicle
from shared_road import LAP_M, SharedRoad, track_of, vehicle_at

from loopgate.abstraction.itinerary import DrawnLeg, Round, Track
from loopgate.control import holds
from loopgate.control.driving import Driving
from loopgate.control.layout import PlaceLayout
from loopgate.control.ledger import Ledger
from loopgate.control.places import STANDING_MPS
from loopgate.control.pressure import PressureOrder
from loopgate.control.rules import usual
from loopgate.errors import TrafficError
from loopgate.model import StateId
from loopgate.network.loop import LanePosition


def test_alone_a_vehicle_is_never_held() -> None:
    """Granted in time, it passes every line without slowing down: no stop is ever set."""
    road = SharedRoad(10.0)
    road.drive(300.0)
    assert road.traffic.holds == []
    (laps,) = road.laps()
    assert laps == (road.traffic.fleet["v0"].front_m - 10.0) // LAP_M
    assert len(road.rows("grant")) >= 2 * laps


def test_two_never_hold_the_shared_place_at_once() -> None:
    """From the grant until the rear has left, the place is one vehicle's alone."""
    road = SharedRoad(120.0, 125.0)
    holder: set[str] = set()
    road.drive(600.0)
    for _, vehicle, event, place, _ in road.rows("grant", "leave"):
        if place == "s":
            holder.symmetric_difference_update({vehicle})
            assert len(holder) <= 1
            assert (event == "grant") == (vehicle in holder)
    assert min(road.laps()) > 10
    assert road.traffic.holds, "they arrive together, so one of them is held"
    assert road.driving.brakes.overruns == road.ledger.trespasses == 0


def test_a_refused_vehicle_rests_before_its_line_and_counts_its_hold() -> None:
    """It stops with its front at the end of its place, and hold time runs from rest to release."""
    road = SharedRoad(120.0, 125.0)
    at_s, vehicle, _, place, _ = road.drive_to("hold")
    assert place == "s"
    assert 198.0 <= road.traffic.fleet[vehicle].front_m <= 199.0
    released_s, name, *_ = road.drive_to("go")
    assert name == vehicle
    account = road.driving.diary_of[vehicle]
    assert account.total_hold_s(road.traffic.now_s) == pytest.approx(released_s - at_s)


def test_the_rear_frees_the_place_behind() -> None:
    """The vehicle's own place is left when the rear passes its end, 5 m after the front."""
    road = SharedRoad(10.0)
    assert road.drive_to("leave")[3] == "pv0"
    assert 204.0 <= road.traffic.fleet["v0"].front_m < 204.0 + 10.0


def test_a_vehicle_beyond_its_grant_is_seen() -> None:
    """If the simulator lets a held vehicle run on, the events say so."""
    road = SharedRoad(120.0, 125.0)
    while not road.traffic.holds:
        road.driving.step()
    vehicle = road.traffic.holds[0][1]
    road.traffic.fleet[vehicle].hold_m = None  # the simulator forgets the stop
    for _ in range(40):
        road.driving.step()
    assert road.ledger.trespasses >= 1
    assert any(row[1] == vehicle and row[3:] == ("s", "not granted") for row in road.rows("enter"))


def test_cost_follows_events() -> None:
    """A vehicle far from anything is not looked at: one question for each place that it comes to."""
    road = SharedRoad(10.0)
    road.drive(1000.0)
    (laps,) = road.laps()
    assert 2 * laps <= road.ledger.looked_at <= 2 * laps + 3


def test_a_vehicle_granted_in_the_same_step_does_not_ask_for_the_place_after() -> None:
    """It becomes the first in the place that it may enter when the vehicle there leaves: too early to ask on.

    Both are granted in one go: x leaves p for its own road, y enters p, which is 200 m long.
    """
    states = {"x": ("p", "rx"), "y": ("p", "qy")}
    starts_m = {"x": 198.0, "y": 398.0}
    ways = [
        Track(
            vehicle=name,
            loop=name,
            lap_m=400.0,
            top_speed_mps=10.0,
            legs=(
                DrawnLeg(StateId(first), 0.0, 199.0, line=LanePosition(f"{name}p", 0, 199.0)),
                DrawnLeg(StateId(second), 200.0, 399.0, line=LanePosition(f"{name}q", 0, 199.0)),
            ),
            edges=((0.0, f"{name}p"), (200.0, f"{name}q")),
            position=0 if name == "x" else 1,
            start_m=starts_m[name],
            rounds=(Round(f"{name}p", "round", "first"),),
        )
        for name, (first, second) in states.items()
    ]
    fleet = {
        name: FakeVehicle([(f"{name}p", 200.0), (f"{name}q", 200.0)], front_m)
        for name, front_m in starts_m.items()
    }
    layout = PlaceLayout({"p": 2, "rx": 1, "qy": 1}, [way.legs for way in ways])
    driving = Driving(FakeTraffic(fleet), layout, Ledger(usual()))
    driving.take_in(ways)
    assert [(row[1], row[3]) for row in driving.rows if row[2] == "grant"] == [("x", "rx"), ("y", "p")]


def test_one_that_runs_through_its_stop_is_braked_counted_and_stays_under_the_gate() -> None:
    """SUMO may put a stop a lap later than it was asked for: that is seen in the next step."""
    road = SharedRoad(120.0, 125.0)
    road.traffic.misses_by_m = LAP_M
    while not road.traffic.brakes:
        road.driving.step()
        assert road.traffic.now_s < 100.0
    ((at_s, name),) = road.traffic.brakes
    assert road.driving.brakes.overruns == 1
    assert [row[:2] for row in road.rows("overrun")] == [(at_s, name)]
    road.traffic.misses_by_m = 0.0
    road.drive(600.0)
    assert not road.traffic.fleet[name].still
    assert min(road.laps()) > 10
    assert road.driving.brakes.overruns == 1


def test_a_stop_that_the_simulator_refuses_does_not_end_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """A vehicle that cannot be held is braked at once, as one that runs through."""
    road, refused_s = SharedRoad(120.0, 125.0), list[float]()
    hold = road.traffic.hold

    def refuse(vehicle: str, *_: object) -> bool:
        monkeypatch.setattr(road.traffic, "hold", hold)
        refused_s.append(road.traffic.now_s)
        msg = f"{vehicle}: too close to brake"
        raise TrafficError(msg)

    monkeypatch.setattr(road.traffic, "hold", refuse)
    road.drive(600.0)
    assert road.driving.brakes.overruns == len(road.traffic.brakes) == 1
    assert [at_s for at_s, _ in road.traffic.brakes] == refused_s
    assert road.ledger.trespasses == 0
    assert min(road.laps()) > 10


def test_a_vehicle_that_stops_before_its_line_is_granted_nothing_beyond() -> None:
    """It asks at its line, is refused for its stop, and goes on when that is over; that was no wait."""
    road = SharedRoad(120.0)
    (vehicle,) = road.ledger.vehicles.values()
    vehicle.stop_m = 198.0
    road.drive(60.0)
    assert road.rows("grant") == []
    assert road.ledger.refusals == {"stop": 1}
    account = road.driving.diary_of["v0"]
    assert account.worst_wait_s(road.traffic.now_s) == 0.0
    vehicle.stop_m = 198.0 + LAP_M
    road.ledger.withdraw(vehicle)
    road.ledger.consider(vehicle)
    for _ in range(5):
        road.driving.step()
    assert road.rows("grant")
    assert account.worst_wait_s(road.traffic.now_s) < 5.0


def test_a_vehicle_that_leaves_gives_its_slot_to_one_that_waits() -> None:
    """It holds the shared place and vanishes in it; the one that waits is granted in the next step."""
    road = SharedRoad(120.0, 125.0)
    road.drive_to("hold")
    (body,) = road.driving.paths.places["s"].bodies
    holder = body.vehicle.name
    (other,) = road.ledger.vehicles.keys() - {holder}
    granted = len(road.rows("grant"))
    road.driving.leave(holder)
    assert list(road.ledger.vehicles) == [other]
    road.driving.step()
    assert [row[1] for row in road.rows("grant")[granted:]] == [other]
    assert [one.vehicle.name for one in road.driving.paths.places["s"].bodies] == [other]
    for _ in range(300):
        road.driving.step()
    assert min(road.laps()) > 3
    assert (road.driving.brakes.overruns, road.ledger.trespasses) == (0, 0)


def test_a_vehicle_that_comes_is_held_and_then_let_go() -> None:
    """It begins at rest at the end of its place, and holds that alone; its laps count from there."""
    road = SharedRoad(120.0)
    way = track_of("v1", 125.0)
    road.driving.paths.lay_more(
        {"pv0": 1, "pv1": 1, "s": 1},
        {one.loop: one.legs for one in (*road.tracks, way)},
        road.driving.diaries,
    )
    road.traffic.fleet["v1"] = vehicle_at("v1", 125.0)
    road.traffic.hold("v1", "v1p", 0, 199.0)
    road.drive(20.0)
    road.driving.welcome([replace(way, start_m=road.traffic.fleet["v1"].front_m)])
    road.ledger.vehicles["v1"].held = True
    assert "v1" in road.traffic.gated
    assert ("v1", "start", "pv1") in {row[1:4] for row in road.driving.rows}
    for _ in range(300):
        road.driving.step()
    assert min(road.laps()) > 3
    assert (road.driving.brakes.overruns, road.ledger.trespasses) == (0, 0)


def test_after_the_last_vehicle_has_left_the_counts_stay() -> None:
    road = SharedRoad(120.0)
    road.drive(50.0)
    grants = road.ledger.grants
    road.driving.leave("v0")
    assert not road.ledger.vehicles
    road.driving.step()
    assert road.ledger.grants == grants > 0


def test_a_vehicle_that_comes_is_in_line_by_where_it_is() -> None:
    """Behind those before it on the road, before those behind it."""
    ways = [
        replace(track_of("v0", front_m, own="pv0"), vehicle=f"w{k}")
        for k, front_m in enumerate((100.0, 50.0, 150.0, 75.0))
    ]
    traffic = FakeTraffic({way.vehicle: vehicle_at("v0", way.front_m) for way in ways})
    driving = Driving(traffic, PlaceLayout({"pv0": 4, "s": 1}, [ways[0].legs]), Ledger(usual()))
    for way in ways:
        driving.take_in([way])
    order = ["w2", "w0", "w3", "w1"]
    assert [one.name for one in driving.paths.places["pv0"].line] == order
    assert [body.vehicle.name for body in driving.paths.places["pv0"].bodies] == order


@pytest.mark.parametrize(("most", "edges"), [(0, ["v1p", "v1s"]), (1, [])])
def test_used_stops_are_forgotten_on_two_edges_of_a_round(
    most: int, edges: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Once a vehicle has made more than some, and has no stop ahead; then they are counted anew."""
    monkeypatch.setattr(holds, "_MOST", most)
    forgotten: list[tuple[str, str]] = []

    def forget(traffic: FakeTraffic, vehicle: str, edge: str, route: str, alone: str) -> bool:
        assert traffic.fleet[vehicle].hold_m is None
        if traffic.lane(vehicle)[0] != f"{edge}_0":
            return False
        assert (route, alone) == (("round", "first") if edge.endswith("p") else ("onward", "second"))
        forgotten.append((vehicle, edge))
        return True

    monkeypatch.setattr(FakeTraffic, "forget_stops", forget)
    road = SharedRoad(120.0, 125.0)
    road.drive(900.0)
    assert len(road.rows("hold")) == 1
    assert forgotten == [("v1", edge) for edge in edges]


def changed_every(seconds: float) -> SharedRoad:
    """Drive four vehicles while ways are drawn anew, and ways are added, every so many seconds."""
    road = SharedRoad(120.0, 125.0, 60.0, 10.0)
    ways = {way.loop: way.legs for way in road.tracks}
    while road.traffic.now_s < 600.0:
        road.driving.step()
        if road.traffic.now_s % seconds == 0:
            ways = {loop: tuple(replace(leg) for leg in legs) for loop, legs in ways.items()}
            another = f"another{len(ways)}"
            first, last = ways["v0"]
            ways[another] = (replace(first, state=StateId(another)), last)
            road.driving.paths.lay_more(
                {leg.state: 1 for legs in ways.values() for leg in legs}, ways, road.driving.diaries
            )
            road.driving.answer()
    assert (road.driving.brakes.overruns, road.ledger.trespasses) == (0, 0)
    return road


def test_ways_drawn_anew_change_nothing() -> None:
    """Every ten steps, or never: the same events, and the same calls to the traffic."""
    always, never = changed_every(10.0), changed_every(1e9)
    assert always.driving.rows == never.driving.rows
    assert always.traffic.holds == never.traffic.holds
    assert always.traffic.releases == never.traffic.releases
    assert len(never.driving.rows) > 100
    assert len(always.driving.paths.places) > len(never.driving.paths.places) + 50


@pytest.mark.parametrize(
    ("foreseen", "gives_way", "known"), [(True, False, True), (False, False, False), (True, True, True)]
)
def test_nothing_is_foreseen_of_vehicles_that_drive_otherwise(
    *, foreseen: bool, gives_way: bool, known: bool
) -> None:
    """The caller knows the vehicle types. Among ordinary traffic each grant says whether it holds."""
    way = replace(track_of("v0", 10.0), foreseen=foreseen)
    traffic = FakeTraffic({"v0": vehicle_at("v0", 10.0)})
    traffic.gives_way = gives_way
    slots: dict[str, int] = {leg.state: 1 for leg in way.legs}
    driving = Driving(traffic, PlaceLayout(slots, [way.legs]), Ledger(usual()))
    driving.take_in([way])
    assert driving.ledger.vehicles["v0"].make.foreseen is known


def test_the_stage_that_decided_is_noted_with_the_event() -> None:
    """A grant bears the stage of its decision, and no other event but a refusal does."""
    road = SharedRoad(120.0, 125.0)
    road.drive(300.0)
    staged = {road.driving.rows[number][2] for number in road.driving.stages}
    assert staged <= {"grant", "refuse"}
    granted = [number for number, row in enumerate(road.driving.rows) if row[2] == "grant"]
    assert granted
    assert {road.driving.stages.get(number) for number in granted} == {"chain"}


def test_one_that_leaves_its_loop_leaves_room() -> None:
    """From fuller places on the negotiation keeps vehicles out, the more of them the later."""
    ways = [replace(track_of(f"v{k}", 10.0), rounds=(Round(f"v{k}p", "round", "first"),)) for k in range(2)]
    traffic = FakeTraffic({way.vehicle: vehicle_at(way.vehicle, way.front_m) for way in ways})
    order = PressureOrder()
    slots = {"pv0": 4, "pv1": 4, "s": 2}
    ledger = Ledger(usual(), order=order.order, pressing=order)
    driving = Driving(traffic, PlaceLayout(slots, [way.legs for way in ways]), ledger)
    driving.take_in(ways)
    assert order.crowded == pytest.approx(1.0 - 2 / 10)
    assert driving.once == 0
    driving.leave("v0")
    assert order.crowded == pytest.approx(1.0 - 1 / 6)


def test_the_flow_is_that_of_the_steps_since_it_was_taken() -> None:
    """How many stood on average, metres driven and laps; then it is counted anew."""
    road = SharedRoad(120.0, 125.0)
    fleet, laps, stood_at_all = road.traffic.fleet.values(), 0, 0
    for _ in range(2):
        stood, before_m = 0, sum(one.front_m for one in fleet)
        for _ in range(60):
            road.driving.step()
            stood += sum(one.speed_mps < STANDING_MPS for one in fleet)
        driven_m = sum(one.front_m for one in fleet) - before_m
        there, *flow = road.driving.totals.take_flow(road.driving.diaries)
        assert there == 2
        assert flow == pytest.approx([stood / 60, driven_m, sum(road.laps()) - laps])
        laps, stood_at_all = sum(road.laps()), stood_at_all + stood
    assert stood_at_all
