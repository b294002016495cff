"""The engine on traffic without SUMO: who holds, who passes, who is looked at."""

from collections import Counter
from random import Random

import pytest
from fake_traffic import FakeTraffic, FakeVehicle
from shared_state import Notes, drive, world

from builders import system
from loopgate.abstraction.itinerary import Leg
from loopgate.abstraction.track import Round, Track
from loopgate.drive.engine import Engine
from loopgate.drive.gatekeeper import Gatekeeper
from loopgate.errors import TrafficError
from loopgate.gates import make_gate
from loopgate.model import StateId
from loopgate.negotiation.simple import OldestFirst
from loopgate.network.loop import LanePosition


def test_alone_a_vehicle_is_never_held() -> None:
    """Granted in time, it passes every gate without slowing: no stop is ever set."""
    engine, traffic, notes = world(10.0)
    drive(engine, traffic, 300.0)
    assert traffic.holds == []
    assert engine.vehicles["laps"][0] == (traffic.fleet["v0"].front_m - 10.0) // 260.0
    assert len(notes.of("grant")) >= 2 * engine.vehicles["laps"][0]


def test_two_never_hold_the_shared_state_at_once() -> None:
    """From the grant until the rear has left, the state is one vehicle's alone."""
    engine, traffic, notes = world(120.0, 125.0)
    holder: set[str] = set()
    drive(engine, traffic, 600.0)
    for _, vehicle, event, place in notes.of("grant", "leave"):
        if place == "s":
            holder.symmetric_difference_update({vehicle})
            assert len(holder) <= 1
            assert (event == "grant") == (vehicle in holder)
    assert (engine.vehicles["laps"] > 10).all()
    assert traffic.holds, "they arrive together, so one of them is held"
    assert engine.overruns == engine.trespasses == 0


def test_the_stage_that_decided_is_in_the_trace_and_in_the_times() -> None:
    """A grant bears the stage of its decision, no other event does, and each decision is timed once."""
    engine, traffic, notes = world(120.0, 125.0, gate="certified")
    drive(engine, traffic, 300.0)
    granted = Counter(stage for event, stage in notes.stages if event == "grant")
    assert granted["replay"] > 0
    assert "" not in granted
    assert {stage for event, stage in notes.stages if event not in {"grant", "refuse"}} == {""}
    keeper = engine._gatekeeper
    assert keeper is not None
    times = keeper.decision_us
    assert {stage: h.count for stage, h in times.items()} == granted  # the only refusals are a taken state
    assert sum(h.count for h in times.values()) == sum(granted.values())


def test_nothing_is_foreseen_where_vehicles_give_way_or_drive_otherwise() -> None:
    """They may stand on a junction for ordinary traffic; and the caller knows the vehicle types."""
    engine, traffic, notes = world(120.0)
    keeper = engine._gatekeeper
    tracks = [driver.track for driver in engine.drivers]
    assert engine.run["foresees"][0]
    other = Engine(traffic, tracks, keeper, notes, foresees=False)  # type: ignore[arg-type]  # as in `world`
    assert not other.run["foresees"][0]
    assert engine.vehicles["foreseen"].all()
    some = Engine(traffic, tracks, keeper, notes, unforeseen={tracks[0].vehicle})  # type: ignore[arg-type]  # as in `world`
    some.begin()
    assert [bool(one.row["foreseen"]) for one in some.drivers] == [False] * len(tracks)
    traffic.gives_way = True
    assert not Engine(traffic, tracks, keeper, notes).run["foresees"][0]  # type: ignore[arg-type]  # as in `world`


def test_a_refused_vehicle_rests_before_its_line_and_counts_its_hold() -> None:
    """It stops with its front at the end of its state, and hold time runs from rest to release."""
    engine, traffic, notes = world(120.0, 125.0)
    engine.begin()
    while not notes.of("hold"):
        engine.step()
    (at, vehicle, _, place), *_ = notes.of("hold")
    front = traffic.fleet[vehicle].front_m
    assert place == "s"
    assert 198.0 <= front <= 199.0
    while not notes.of("go"):
        engine.step()
    (released, who, _, _), *_ = notes.of("go")
    assert who == vehicle
    driver = next(d for d in engine.drivers if d.id == vehicle)
    assert driver.total_hold_s(traffic.now_s) == pytest.approx(released - at)


def test_the_rear_frees_the_state_behind() -> None:
    """The private state is left when the rear passes its end, 5 m after the front."""
    engine, traffic, notes = world(10.0)
    engine.begin()
    while not notes.of("leave"):
        engine.step()
    (_, _, _, place), *_ = notes.of("leave")
    assert place == "pv0"
    assert 204.0 <= traffic.fleet["v0"].front_m < 204.0 + 10.0


def test_a_vehicle_beyond_its_grant_is_seen() -> None:
    """If the simulator lets a held vehicle run on, the trace says so."""
    engine, traffic, notes = world(120.0, 125.0)
    engine.begin()
    while not traffic.holds:
        engine.step()
    vehicle = traffic.holds[0][1]
    traffic.fleet[vehicle].hold_m = None  # the simulator forgets the stop
    for _ in range(40):
        engine.step()
    assert engine.trespasses >= 1
    assert any(v == vehicle for _, v, _, place in notes.of("enter") if place == "s")


def test_cost_follows_events(monkeypatch: pytest.MonkeyPatch) -> None:
    """A vehicle far from anything is not looked at: fewer questions to the gate than steps by far."""
    engine, traffic, _ = world(10.0)
    keeper = engine._gatekeeper
    assert keeper is not None
    asked = Counter[str]()
    decide = keeper._decide

    def counting() -> None:
        asked["times"] += 1
        decide()

    monkeypatch.setattr(keeper, "_decide", counting)
    drive(engine, traffic, 1000.0)
    legs = 2 * int(engine.vehicles["laps"][0])
    assert legs <= asked["times"] <= 2 * legs + 3
    assert asked["times"] < 300


def test_a_vehicle_granted_in_the_same_step_does_not_ask_for_the_state_after() -> None:
    """It becomes the head of the state it may enter when the vehicle there leaves: too early to ask on.

    Both are granted in one go: x leaves p for its own road, y enters p, which is 200 m long.
    """
    paths = {"x": ("p", "rx"), "y": ("p", "qy")}
    robots = system(
        {name: " ".join(states) for name, states in paths.items()},
        starts={"x": 0, "y": 1},
        capacity={"p": 2},
        fifo=("p",),
    )
    starts = {"x": 198.0, "y": 398.0}
    tracks = [
        Track(
            vehicle=name,
            loop=name,
            lap_m=400.0,
            start_m=starts[name],
            top_speed_mps=10.0,
            rounds=(Round(f"{name}p", "round", "first"), Round("", "onward", "second")),
            edges=((0.0, f"{name}p"), (200.0, f"{name}q")),
            legs=(
                Leg(StateId(states[0]), 0.0, 199.0, line=LanePosition(f"{name}p", 0, 199.0)),
                Leg(StateId(states[1]), 200.0, 399.0, line=LanePosition(f"{name}q", 0, 199.0)),
            ),
            start_position=0 if name == "x" else 1,
        )
        for name, states in paths.items()
    ]
    fleet = {
        name: FakeVehicle([(f"{name}p", 200.0), (f"{name}q", 200.0)], start) for name, start in starts.items()
    }
    keeper = Gatekeeper(OldestFirst(Random(1)))
    keeper.change(robots, make_gate("collision", robots))
    notes = Notes()
    engine = Engine(FakeTraffic(fleet), tracks, keeper, notes)  # type: ignore[arg-type]  # as in `world`
    engine.begin()
    assert [(vehicle, place) for _, vehicle, _, place in notes.of("grant")] == [("x", "rx"), ("y", "p")]


def test_one_that_runs_through_its_stop_is_braked_counted_and_stays_under_the_gate() -> None:
    """SUMO may put a stop a lap later than it was asked for: the engine sees it in the next step."""
    engine, traffic, notes = world(120.0, 125.0)
    engine.begin()
    traffic.misses_by_m = 260.0
    while not traffic.brakes:
        engine.step()
        assert traffic.now_s < 100.0
    ((at_s, name),) = traffic.brakes
    assert engine.overruns == 1
    assert [(time, vehicle) for time, vehicle, _, _ in notes.of("overrun")] == [(at_s, name)]
    traffic.misses_by_m = 0.0
    while traffic.now_s < 600.0:
        engine.step()
    assert not traffic.fleet[name].still
    assert engine.vehicles["laps"].min() > 10
    assert engine.overruns == 1


def test_a_stop_that_the_simulator_refuses_does_not_end_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever cannot be held is braked, as one that runs through."""
    engine, traffic, _ = world(120.0, 125.0)
    engine.begin()
    hold = traffic.hold

    def refuse(vehicle: str, *_: object) -> bool:
        monkeypatch.setattr(traffic, "hold", hold)
        msg = f"{vehicle}: too close to brake"
        raise TrafficError(msg)

    monkeypatch.setattr(traffic, "hold", refuse)
    while traffic.now_s < 600.0:
        engine.step()
    assert engine.overruns == len(traffic.brakes) == 1
    assert engine.vehicles["laps"].min() > 10
