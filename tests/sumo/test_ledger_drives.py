"""Vehicles on the grid, driven in SUMO through the ledger of plain objects."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import heart  # in analysis/
import pytest
from stopping import loops_with_stops

from loopgate.control import ledger, steering
from loopgate.control.places import Vehicle
from loopgate.network import RoadNetwork, generate_loops
from loopgate.simulation.asked_gate import Deciding
from loopgate.simulation.assembly import Assembly, assemble
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario

GRID = Path(__file__).resolve().parents[2] / "networks" / "grid5-priority.net.xml"


@cache
def starts(vehicles: int) -> tuple[Scenario, Assembly]:
    """Return loops on the grid with so many vehicles at their starts."""
    scenario = Scenario(network=str(GRID), vehicles=vehicles, loops=60, duration_s=120, lights="off", seed=1)
    return scenario, assemble(scenario)


def test_nobody_collides_nobody_trespasses_and_nobody_waits_who_could_go() -> None:
    driven = heart.drive(*starts(200), watched=True)
    assert driven.findings == []
    assert (driven.collisions, driven.trespasses, driven.free_to_go) == (0, 0, 0)
    assert driven.km > 80
    assert set(driven.events["reason"]) >= {"crossing", "reserve"}


def test_wakes_let_go_whom_asking_everybody_lets_go() -> None:
    granted = [
        heart.drive(*starts(200), everybody=everybody).events.query("event == 'grant'").to_csv(index=False)
        for everybody in (False, True)
    ]
    assert granted[0] == granted[1]


def test_rules_say_the_same_where_they_are_not_asked_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """After a grant only vehicles are looked at twice near which it has changed something."""
    made, asked = Deciding.ledger, list[int]()

    def far(self: Deciding, *args: Any, **more: Any) -> ledger.Ledger:  # noqa: ANN401  passed on
        found = made(self, *args, **more)
        found.rules_look_near = len(asked) == 1
        found.rules[:] = [counting, *found.rules]
        return found

    def counting(_vehicle: Vehicle, _now_s: float) -> None:
        asked[-1] += 1

    monkeypatch.setattr(Deciding, "ledger", far)
    events = []
    for _ in range(2):
        asked.append(0)
        events.append(heart.drive(*starts(200)).events.to_csv(index=False))
    assert events[0] == events[1]
    assert asked[0] < 0.9 * asked[1]


def test_vehicles_leave_and_come_in_between_the_others() -> None:
    driven = heart.drive(*starts(200), watched=True, turnover_s=2)
    assert driven.joined > 30
    assert (driven.collisions, driven.trespasses, driven.free_to_go) == (0, 0, 0)


@cache
def town(lights: str) -> tuple[Scenario, Assembly]:
    """Return vehicles in a town with lanes to choose from."""
    scenario = Scenario(network="sumo:DRT", vehicles=200, duration_s=120, lights=lights, seed=1)
    return scenario, assemble(scenario)


def test_vehicles_change_lanes_where_their_loops_do(monkeypatch: pytest.MonkeyPatch) -> None:
    changes = list[str]()
    drop = steering.Steering._drop

    def note(self: steering.Steering, way: steering._Guides) -> None:
        changes.append(way.vehicle.name)
        drop(self, way)

    monkeypatch.setattr(steering.Steering, "_drop", note)
    driven = heart.drive(*town("off"), watched=True)
    assert driven.findings == []
    assert (driven.collisions, driven.trespasses, driven.free_to_go) == (0, 0, 0)
    assert driven.km > 150
    assert len(changes) > 20


def test_vehicles_obey_lights() -> None:
    driven = heart.drive(*town("obey"), watched=True)
    assert driven.findings == []
    assert (driven.collisions, driven.trespasses, driven.free_to_go, driven.on_red) == (0, 0, 0, 0)
    assert "red" in set(driven.events["reason"])
    assert driven.km > 130


def test_vehicles_come_and_drive_to_the_ends_of_their_ways(tmp_path: Path) -> None:
    ends = [("A0B0", "D4E4"), ("E4D4", "B0A0"), ("A4A3", "E1E0"), ("E0E1", "A3A4")]
    rows = [
        f'<trip id="t{n}" depart="{n}" from="{ends[n % 4][0]}" to="{ends[n % 4][1]}"/>' for n in range(100)
    ]
    file = tmp_path / "trips.rou.xml"
    file.write_text(f"<routes>{''.join(rows)}</routes>")
    scenario = Scenario(network=str(GRID), routes=str(file), duration_s=240, lights="off", seed=1)
    driven = heart.drive(scenario, assemble(scenario), watched=True)
    assert (driven.collisions, driven.trespasses, driven.free_to_go) == (0, 0, 0)
    assert driven.arrived > 60


@cache
def ordinary(network: str, file: Path) -> str:
    """Draw ordinary traffic into a file."""
    heart.draw_trips(network, 2.0, 150.0, 1, file)
    return str(file)


@cache
def among(network: str, file: Path, lights: str = "off") -> tuple[Scenario, Assembly]:
    """Return vehicles on loops among ordinary traffic."""
    made = Scenario(
        network=network,
        vehicles=100,
        loops=30,
        duration_s=150,
        lights=lights,
        traffic=ordinary(network, file),
        on_deadlock="continue",
        seed=1,
    )
    return made, assemble(made)


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return where ordinary trips are drawn into."""
    return tmp_path_factory.mktemp("ordinary")


@pytest.mark.parametrize("lights", ["off", "obey"])
def test_vehicles_drive_among_ordinary_ones_in_a_town(drawn: Path, lights: str) -> None:
    driven = heart.drive(*among("sumo:DRT", drawn / "town.rou.xml", lights), watched=True)
    assert driven.findings == []
    assert (driven.collisions, driven.trespasses, driven.free_to_go, driven.on_red) == (0, 0, 0, 0)
    assert "traffic" in set(driven.events["reason"])
    assert driven.ordinary > 50
    assert driven.km > 106


def test_vehicles_drive_among_ordinary_ones_on_the_grid(drawn: Path) -> None:
    driven = heart.drive(*among(str(GRID), drawn / "grid.rou.xml"), watched=True)
    assert driven.findings == []
    assert (driven.collisions, driven.trespasses, driven.free_to_go) == (0, 0, 0)
    assert driven.ordinary > 50
    assert driven.km > 50


@pytest.mark.slow
def test_trips_depart_and_arrive_as_in_a_run(tmp_path: Path) -> None:
    """As many depart and arrive, and they drive as far, though some have to wait outside."""
    file = tmp_path / "trips.rou.xml"
    heart.draw_trips("sumo:DRT", 0.6, 120.0, 1, file)
    scenario = Scenario(network="sumo:DRT", routes=str(file), duration_s=180, lights="off", seed=1)
    driven, ran = heart.drive(scenario, assemble(scenario), watched=True), simulate(scenario)
    assert (driven.collisions, driven.trespasses, driven.free_to_go) == (0, 0, 0)
    departed = int((driven.events["event"] == "start").sum())
    assert departed == pytest.approx(ran["departed"], abs=3)
    assert departed > 150
    assert driven.arrived == pytest.approx(ran["arrived"], abs=8)
    assert driven.km == pytest.approx(ran["distance_km"], rel=0.02)


def test_vehicles_are_spaced_on_their_loops() -> None:
    """They drive 81.3 km."""
    scenario = Scenario(network=str(GRID), vehicles=100, loops=20, duration_s=120, spacing="hold", seed=1)
    driven = heart.drive(scenario, assemble(scenario), watched=True)
    assert driven.findings == []
    assert (driven.collisions, driven.trespasses, driven.free_to_go) == (0, 0, 0)
    assert "spacing" in set(driven.events["reason"])
    assert driven.km == pytest.approx(81.3, rel=0.02)


def stopping(folder: Path, routes: str, places: str = "", duration_s: float = 400.0) -> heart.Driven:
    """Drive vehicles with stops on the grid; return what came of it."""
    (folder / "my.rou.xml").write_text(f"<routes>{routes}</routes>")
    (folder / "my.add.xml").write_text(f"<additional>{places}</additional>")
    stops = str(folder / "my.add.xml") if places else ""
    made = Scenario(
        network=str(GRID), routes=str(folder / "my.rou.xml"), stops=stops, duration_s=duration_s, seed=1
    )
    return heart.drive(made, assemble(made), watched=True)


def test_vehicles_stop_all_over_a_busy_grid(tmp_path: Path) -> None:
    """They drive 96.5 km and stop 354 times."""
    loops = generate_loops(RoadNetwork.open(str(GRID)), 14, length_m=(500.0, 1500.0))
    driven = stopping(tmp_path, "".join(loops_with_stops(loops)))
    assert driven.findings == []
    assert (driven.collisions, driven.trespasses, driven.free_to_go, driven.missed) == (0, 0, 0, 0)
    assert driven.km == pytest.approx(96.5, rel=0.02)
    assert driven.served == pytest.approx(354, rel=0.03)


RING = 'edges="B2C2 C2C1 C1B1 B1B2"'


def test_vehicles_park_beside_a_busy_street_and_come_back(tmp_path: Path) -> None:
    """They stop 46 to 50 times, and stand parked for 700 s beyond their stops."""
    places = (
        '<parkingArea id="yard" lane="C2C1_0" startPos="20" endPos="60" roadsideCapacity="3"/>'
        '<parkingArea id="kerb" lane="B1B2_0" startPos="10" endPos="70" roadsideCapacity="6"/>'
    )
    routes = (
        f'<route id="ring" {RING}/>'
        f'<route id="long" {RING}><stop parkingArea="yard" duration="600"/></route>'
        f'<route id="short" {RING}><stop parkingArea="kerb" duration="60"/></route>'
        '<flow id="r" route="ring" begin="0" period="5" number="14"/>'
        '<flow id="s" route="short" begin="2" period="9" number="8"/>'
        '<vehicle id="l" route="long" depart="0"/><vehicle id="m" route="long" depart="20"/>'
    )
    driven = stopping(tmp_path, routes, places, 900.0)
    assert (driven.collisions, driven.trespasses, driven.free_to_go, driven.missed) == (0, 0, 0, 0)
    events = driven.events["event"].value_counts()
    assert driven.served == pytest.approx(48, abs=3)
    assert 0 <= events["park"] - events["return"] <= 10
    assert events["return"] > 39
    assert driven.longest_s < 60.0
    assert driven.late_back_s < 900.0


def test_vehicles_of_which_nothing_is_foreseen_are_woken_in_time(tmp_path: Path) -> None:
    """IDM's vehicles: they are asked again only once others are past, or leave."""
    lines = ['<vType id="long" length="12" carFollowModel="IDM"/>']
    for loop in generate_loops(RoadNetwork.open(str(GRID)), 14, length_m=(500.0, 1500.0)):
        lines.append(f'<route id="{loop.id}" edges="{" ".join(loop.edges)}"/>')
        lines += [f'<vehicle id="{loop.id}.{k}" type="long" route="{loop.id}" depart="0"/>' for k in range(4)]
    assert stopping(tmp_path, "".join(lines), duration_s=60.0).free_to_go == 0
