"""Vehicles join and leave the drive: what the others hold, ask for and have done stays as it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from fake_traffic import FakeTraffic, FakeVehicle
from shared_state import drive, world

from loopgate.drive.books import Books
from loopgate.drive.changing import ChangingEngine
from loopgate.gates import make_gate
from loopgate.model import Robot, RobotId, System

STARTS_M = (120.0, 125.0, 60.0, 10.0)
ROOM = {**{f"pv{number}": 1 for number in range(9)}, "s": 1}


def change(engine: ChangingEngine, books: Books, *, joining: tuple[str, ...] = ()) -> None:
    """Go on with those who are in the books; those who join stand where their tracks begin."""
    tracks = []
    for vehicle in books.everybody:
        track = engine.driver_of[vehicle].track if vehicle not in joining else TRACKS[vehicle]
        tracks.append(track)
    robots = [
        Robot(
            RobotId(track.vehicle),
            tuple(leg.state for leg in track.legs),
            start=(engine.driver_of[track.vehicle].granted % 2 if track.vehicle not in joining else 0),
        )
        for track in tracks
    ]
    made = System(robots)
    engine.change(tracks, books, system=made, gate=make_gate("collision", made), room=ROOM)


TRACKS = {driver.id: driver.track for driver in world(*STARTS_M)[0].drivers}


def rows_with_changes(every_s: float) -> tuple[list[tuple[float, str, str, str]], FakeTraffic]:
    """Return the trace of a run in which the tables are made anew now and then, for the same vehicles."""
    engine, traffic, notes = world(*STARTS_M)
    engine.begin()
    while traffic.now_s < 600.0:
        engine.step()
        if traffic.now_s % every_s == 0:
            change(engine, engine.books())
    assert (engine.overruns, engine.trespasses) == (0, 0)
    return sorted(notes.rows), traffic


def test_made_anew_the_tables_say_the_same() -> None:
    """After every step, or never: the same trace, and the same calls to the traffic."""
    always, traffic = rows_with_changes(1.0)
    never, other = rows_with_changes(1e9)
    assert always == never
    assert sorted(traffic.holds) == sorted(other.holds)
    assert sorted(traffic.releases) == sorted(other.releases)
    assert len(never) > 100


def test_who_leaves_gives_its_slot_to_who_waits() -> None:
    """One holds the shared state and vanishes in it; who waits for it is granted in the next step."""
    engine, _, notes = world(120.0, 125.0)
    engine.begin()
    while np.isnan(engine.vehicles["halted_s"]).all():
        engine.step()
    (holder,) = engine.books().holders["s"]
    (other,) = engine.driver_of.keys() - {holder}
    granted = len(notes.of("grant"))
    books = engine.books()
    books.strike([holder])
    change(engine, books)
    assert [driver.id for driver in engine.drivers] == [other]
    engine.step()
    assert [row[1] for row in notes.of("grant")[granted:]] == [other]
    assert engine.books().holders["s"] == [other]


def test_who_joins_is_held_and_then_let_go() -> None:
    """It begins at rest at the end of its state, and holds that alone; its laps count from there."""
    engine, traffic, notes = world(120.0)
    traffic.fleet["v1"] = FakeVehicle([("v1p", 200.0), ("v1s", 60.0)], 125.0)
    drive(engine, traffic, 20.0)
    traffic.hold("v1", "v1p", 0, 199.0)
    books = engine.books()
    books.enter("v1", "pv1", 74.0, lambda _: 0.0)
    TRACKS["v1"] = replace(TRACKS["v1"], start_m=125.0 + traffic.odometer("v1"))
    change(engine, books, joining=("v1",))
    assert "v1" in traffic.gated
    assert ("v1", "start", "pv1") in {row[1:] for row in notes.rows}
    assert engine.driver_of["v1"].row["held"]
    for _ in range(300):
        engine.step()
    assert (engine.vehicles["laps"] > 3).all()
    assert (engine.overruns, engine.trespasses) == (0, 0)


def test_nobody_is_left() -> None:
    """Counts stay; the next who joins is the first."""
    engine, traffic, _ = world(120.0)
    drive(engine, traffic, 50.0)
    grants = int(engine.run["grants"][0])
    engine.clear()
    assert engine.drivers == []
    engine.step()
    assert int(engine.run["grants"][0]) == grants > 0


def test_who_is_nearer_to_the_end_comes_first_in_line() -> None:
    """Behind those before it on the road, before those behind it, be they on their way still."""
    books = Books({"s": ["a", "b", "c"]}, {"s": ["b", "c"]}, {"m": ["c"]})
    left = {"a": -3.0, "b": 20.0, "c": 60.0}
    books.enter("x", "s", 40.0, left.__getitem__)
    assert books.holders == {"s": ["a", "b", "x", "c"]}
    assert books.lines == {"s": ["b", "x", "c"]}
    books.enter("y", "t", 1.0, left.__getitem__)
    assert books.everybody == ["b", "x", "c", "y"]
    books.strike(["b", "c"])
    assert (books.holders["s"], books.everybody, books.passing) == (["a", "x"], ["x", "y"], {"m": []})
