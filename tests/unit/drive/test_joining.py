"""Vehicles join and leave the drive: what the others hold, ask for and have done stays as it is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from fake_traffic import FakeTraffic, FakeVehicle
from shared_state import drive, world

from loopgate.drive import step
from loopgate.drive.changing import ChangingEngine
from loopgate.gates import make_gate
from loopgate.kernel_cache import way_in
from loopgate.model import Robot, RobotId, StateId, System

STARTS_M = (120.0, 125.0, 60.0, 10.0)
TRACKS = [driver.track for driver in world(*STARTS_M)[0].drivers]


def new_gate(engine: ChangingEngine) -> None:
    """Let another gate of the same kind decide, for the robots in another order."""
    robots = [
        Robot(RobotId(driver.id), tuple(leg.state for leg in driver.track.legs), start=driver.granted % 2)
        for driver in reversed(engine.drivers)
    ]
    made = System(robots)
    engine.go_by(made, make_gate("collision", made), joined=False)


def rows_with_changes(every_s: float) -> tuple[list[tuple[float, str, str, str]], FakeTraffic]:
    """Return the trace of a run in which gate and ways are made anew now and then, and ways are added."""
    engine, traffic, notes = world(*STARTS_M)
    engine.begin()
    ways = [replace(track, legs=(*track.legs,)) for track in TRACKS]
    while traffic.now_s < 600.0:
        engine.step()
        if traffic.now_s % every_s == 0:
            track = ways[-1]
            legs = (replace(track.legs[0], state=StateId(f"x{len(ways)}")), track.legs[1])
            ways = [replace(way, legs=(*way.legs,)) for way in ways]
            ways.append(replace(track, loop=f"another{len(ways)}", legs=legs))
            engine.lay(ways, {leg.state: 1 for way in ways for leg in way.legs})
            new_gate(engine)
            engine.answer()
    assert (engine.overruns, engine.trespasses) == (0, 0)
    return sorted(notes.rows), traffic


def test_made_anew_gate_and_ways_say_the_same() -> None:
    """Every ten steps, or never: the same trace, and the same calls to the traffic."""
    always, traffic = rows_with_changes(10.0)
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
    (holder,) = engine.holding("s")
    (other,) = engine.driver_of.keys() - {holder.id}
    granted = len(notes.of("grant"))
    engine.leave([holder.id])
    assert [driver.id for driver in engine.drivers] == [other]
    new_gate(engine)
    engine.step()
    assert [row[1] for row in notes.of("grant")[granted:]] == [other]
    assert [driver.id for driver in engine.holding("s")] == [other]
    for _ in range(300):
        engine.step()
    assert (engine.vehicles["laps"] > 3).all()


def test_who_joins_is_held_and_then_let_go() -> None:
    """It begins at rest at the end of its state, and holds that alone; its laps count from there."""
    engine, traffic, notes = world(120.0)
    engine.lay(TRACKS, {leg.state: 1 for track in TRACKS for leg in track.legs})
    traffic.fleet["v1"] = FakeVehicle([("v1p", 200.0), ("v1s", 60.0)], 125.0)
    drive(engine, traffic, 20.0)
    traffic.hold("v1", "v1p", 0, 199.0)
    engine.join([replace(TRACKS[1], start_m=125.0 + traffic.odometer("v1"))])
    new_gate(engine)
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
    engine.leave(["v0"])
    assert engine.drivers == []
    engine.step()
    assert int(engine.run["grants"][0]) == grants > 0


def test_who_is_nearer_to_the_end_comes_first_in_line() -> None:
    """Behind those before it on the road, before those behind it."""
    engine, traffic, _ = world(100.0)
    on_its_road = [replace(TRACKS[0], vehicle=f"w{k}", start_m=m) for k, m in enumerate((50.0, 150.0, 75.0))]
    engine.lay(TRACKS[:1], {"pv0": 4, "s": 1})
    for track in on_its_road:
        traffic.fleet[track.vehicle] = FakeVehicle([("v0p", 200.0), ("v0s", 60.0)], track.start_m)
        engine.join([track])
    assert [driver.id for driver in engine.line("pv0")] == ["w1", "v0", "w2", "w0"]
    assert [driver.id for driver in engine.holding("pv0")] == ["w1", "v0", "w2", "w0"]


def test_new_tables_of_the_same_kind_make_no_new_way_in(monkeypatch: pytest.MonkeyPatch) -> None:
    """The compiler types all tables for each way in, which takes milliseconds at each join and leave."""
    made: list[object] = []

    def count(function: Callable[..., int], *like: object) -> Callable[..., int]:
        made.append(like)
        return way_in(function, *like)

    rows_with_changes(1e9)
    monkeypatch.setattr(step, "way_in", count)
    rows_with_changes(10.0)
    assert not made


def test_tables_of_another_type_make_a_way_in_of_their_own() -> None:
    """A way in takes types for granted: with tables of others the process would end."""
    table = np.zeros((4, 2))
    others = (table.astype(np.int64), table[:, 0], table.T, np.zeros((4, 2))[:, ::2], None)
    read_only = np.zeros((4, 2))
    read_only.setflags(write=False)
    assert step._kind(table) == step._kind(np.ones((7, 2)))
    assert all(step._kind(other) != step._kind(table) for other in (*others, read_only))
