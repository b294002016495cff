"""Stops in every round and departures under way, under a gate and under SUMO's own rules."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from random import Random
from typing import Any
from xml.etree import ElementTree as ET

import pandas as pd
import pytest
from made_networks import netgenerate

from loopgate.analysis import compute_stops
from loopgate.errors import NobodyGatedError, ScenarioError
from loopgate.network import RoadNetwork, generate_loops
from loopgate.runs.run import read_run
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario
from loopgate.traffic.sumo import SumoTraffic

pytestmark = pytest.mark.sumo

NET = str(Path(__file__).parents[2] / "networks" / "grid5-priority.net.xml")
PLACES = """<additional>
    <busStop id="market" lane="B2C2_0" startPos="30" endPos="60"/>
    <busStop id="school" lane="D0C0_0" startPos="10" endPos="40"/>
    <parkingArea id="yard" lane="C2C1_0" startPos="20" endPos="60" roadsideCapacity="3"/>
    <chargingStation id="plug" lane="C1C2_0" startPos="20" endPos="60"/>
    <containerStop id="dock" lane="C0C1_0" startPos="20" endPos="60"/>
</additional>"""
LINE = 'edges="B3B2 B2C2 C2C1 C1D1 D1D0 D0C0 C0C1 C1C2 C2C3 C3B3"'
BUS = '<vType id="bus" vClass="bus" length="12" accel="1.2"/>'


def run(folder: Path, routes: str, places: str = PLACES, **options: Any) -> dict[str, Any]:  # noqa: ANN401  keys
    """Run a route file; return the summary."""
    (folder / "my.rou.xml").write_text(f"<routes>{routes}</routes>", encoding="utf-8")
    (folder / "my.add.xml").write_text(places, encoding="utf-8")
    given: dict[str, Any] = {"routes": str(folder / "my.rou.xml"), "stops": str(folder / "my.add.xml")}
    given = {"network": NET, "duration_s": 600.0, **given, **options}
    words = f"--stop-output {folder / 'stops.xml'} --personinfo-output {folder / 'persons.xml'}"
    return simulate(Scenario(sumo=words, **given), folder / "run", overwrite=True)


def made(folder: Path) -> list[dict[str, str]]:
    """Return what SUMO says of the stops that were made; those of the gate are at no stop of the file."""
    told = [dict(one.attrib) for one in ET.parse(folder / "stops.xml").getroot().iter("stopinfo")]
    kinds = ("busStop", "parkingArea", "chargingStation", "containerStop")
    return [one for one in told if any(kind in one for kind in kinds) or one["lane"] == "C1D1_0"]


def vehicles(folder: Path) -> pd.DataFrame:
    return pd.read_parquet(folder / "run" / "vehicles.parquet").set_index("vehicle")


@pytest.mark.parametrize("gate", ["certified", "open"])
def test_a_line_stops_in_every_round(gate: str, tmp_path: Path) -> None:
    """At each of its stops once a round, as SUMO itself counts; bodies and crossings are audited."""
    stops = (
        '<stop busStop="market" duration="20"/><stop busStop="school" duration="10"/>'
        '<stop lane="C1D1_0" startPos="30" endPos="50" duration="5"/>'
    )
    text = f'{BUS}<route id="line" {LINE}>{stops}</route>' + "".join(
        f'<vehicle id="b{k}" type="bus" route="line" depart="0" line="7"/>' for k in range(3)
    )
    summary = run(tmp_path, text, gate=gate, positions=gate != "open", duration_s=900.0)
    seen = made(tmp_path)
    assert summary["stops"]["served"] == len(seen) > 30
    assert summary["stops"]["missed"] == 0
    counts = Counter((one["id"], one.get("busStop", one["lane"])) for one in seen)
    for vehicle, laps in vehicles(tmp_path)["laps"].items():
        for stop in ("market", "school", "C1D1_0"):
            assert laps <= counts[str(vehicle), stop] <= laps + 1
    assert vehicles(tmp_path)["stops"].sum() == len(seen)
    assert summary["collisions"] == 0
    if gate != "open":
        assert summary["audit"] == "clean"
        assert summary["longest_wait_s"] < 20.0


@pytest.mark.parametrize("gate", ["certified", "open"])
def test_a_flow_departs_over_time_and_every_kind_of_stop_is_made(gate: str, tmp_path: Path) -> None:
    """Five of a flow among cars that depart too; parking, charging and loading among their stops."""
    stops = (
        '<stop busStop="market" duration="10"/><stop parkingArea="yard" duration="15"/>'
        '<stop lane="C1D1_0" startPos="20" endPos="50" duration="5" parking="true"/>'
        '<stop containerStop="dock" duration="5"/><stop chargingStation="plug" duration="5"/>'
    )
    text = (
        f'<route id="line" {LINE}>{stops}</route><route id="short" edges="B2C2 C2C1 C1B1 B1B2"/>'
        '<flow id="f" route="line" begin="30" period="60" number="5" color="red">'
        '<param key="a" value="b"/></flow>'
        '<flow id="c" route="short" begin="0" period="9" number="6"/>'
        '<vehicle id="late" route="line" depart="0:01:40" departEdge="3" departPos="60"/>'
    )
    summary = run(tmp_path, text, gate=gate, positions=gate != "open", duration_s=900.0)
    frame = vehicles(tmp_path)
    assert [name for name in frame.index if name.startswith("f")] == [f"f.{k}" for k in range(5)]
    assert (summary["vehicles"], summary["departed"], summary["waiting_to_depart"]) == (12, 11, 0)
    assert summary["max_depart_delay_s"] == frame["depart_delay_s"].max() < 120.0
    assert summary["stops"]["missed"] == 0
    names = {n for one in made(tmp_path) for n in (one.get("busStop"), one.get("parkingArea")) if n}
    assert names == {"market", "yard"}
    assert summary["stops"]["served"] == len(made(tmp_path)) > 40
    if gate != "open":
        assert (summary["audit"], summary["collisions"]) == ("clean", 0)
        again = run(tmp_path, text, gate=gate, duration_s=900.0)
        assert again["distance_km"] == summary["distance_km"]


def test_nobody_is_there_at_the_beginning(tmp_path: Path) -> None:
    """All come later; those that are foreseen and those that come are told apart from nobody."""
    text = f'<route id="line" {LINE}/><flow id="f" route="line" begin="20" period="10" number="12"/>'
    summary = run(tmp_path, text, positions=True)
    assert (summary["audit"], summary["departed"], summary["clean"]) == ("clean", 12, True)
    assert summary["laps"] > 20


def test_a_stop_on_every_road_is_made_where_routes_are_renewed_too(tmp_path: Path) -> None:
    """SUMO puts off a stop that lies just ahead when it renews a route, as it does here on such a road."""
    stops = "".join(
        f'<stop lane="{lane}_0" endPos="{end}" duration="5"/>'
        for lane, end in (("B2C2", 30), ("C2C1", 25), ("C1B1", 40), ("B1B2", 20))
    )
    text = f'<route id="r" edges="B2C2 C2C1 C1B1 B1B2">{stops}</route><vehicle id="v" depart="0" route="r"/>'
    summary = run(tmp_path, text)
    (laps,) = vehicles(tmp_path)["laps"]
    assert summary["stops"]["missed"] == 0
    assert 4 * laps <= summary["stops"]["served"] <= 4 * laps + 4


@pytest.mark.parametrize("gate", ["certified", "open"])
def test_a_stop_that_names_only_an_edge_is_on_no_sidewalk(gate: str, tmp_path: Path) -> None:
    """Lane 0 is a sidewalk there: SUMO stops a vehicle on the first lane for cars, in every round."""
    options = "--grid --grid.number=3 --grid.length=120 --sidewalks.guess --sidewalks.guess.max-speed=20"
    streets = netgenerate(options, tmp_path / "streets.net.xml")
    route = '<route id="r" edges="A0A1 A1B1 B1B0 B0A0"><stop edge="A1B1" endPos="60" duration="5"/></route>'
    text = f'{route}<vehicle id="v" depart="0" route="r"/>'
    summary = run(tmp_path, text, "<additional/>", network=str(streets), gate=gate)
    assert {one.get("lane") for one in ET.parse(tmp_path / "stops.xml").getroot().iter("stopinfo")} >= {
        "A1B1_1"
    }
    (laps,) = vehicles(tmp_path)["laps"]
    assert summary["stops"]["missed"] == 0
    assert laps <= summary["stops"]["served"] <= laps + 1
    assert laps > 5


def test_a_long_stop_is_no_wait_and_no_deadlock(tmp_path: Path) -> None:
    """A car stands for three minutes where others come by; nobody makes room for it meanwhile."""
    text = (
        f'<route id="line" {LINE}><stop lane="C1D1_0" endPos="83" duration="180"/></route>'
        '<vehicle id="v" route="line" depart="0" departEdge="3" departPos="20"/>'
        '<vehicle id="w" route="line" depart="0" departEdge="1"/>'
    )
    summary = run(tmp_path, text, duration_s=300.0, serve_after_s=20.0)
    assert (summary["outcome"], summary["deadlocks"]) == ("done", [])
    assert summary["refusals"].get("service", 0) == 0
    assert summary["longest_waits_s"]["stop"] > 100.0
    assert summary["longest_wait_s"] < 60.0
    assert vehicles(tmp_path).loc["v", "stopped_s"] == pytest.approx(180.0, abs=1.0)


def test_who_parks_lets_others_by_and_comes_back_into_a_busy_street(tmp_path: Path) -> None:
    """Ten minutes beside a street that 24 others drive on, and for a minute in each round of some of them."""
    places = (
        '<additional><parkingArea id="yard" lane="C2C1_0" startPos="20" endPos="60" roadsideCapacity="3"/>'
        '<parkingArea id="kerb" lane="B1B2_0" startPos="10" endPos="70" roadsideCapacity="6"/></additional>'
    )
    text = (
        '<route id="ring" edges="B2C2 C2C1 C1B1 B1B2"/>'
        '<route id="long" edges="B2C2 C2C1 C1B1 B1B2"><stop parkingArea="yard" duration="600"/></route>'
        '<route id="short" edges="B2C2 C2C1 C1B1 B1B2"><stop parkingArea="kerb" duration="60"/></route>'
        '<flow id="r" route="ring" begin="0" period="5" number="14"/>'
        '<flow id="s" route="short" begin="2" period="9" number="8"/>'
        '<vehicle id="l" route="long" depart="0"/><vehicle id="m" route="long" depart="20"/>'
    )
    summary = run(tmp_path, text, places, positions=True, duration_s=1800.0)
    frame = vehicles(tmp_path)
    rounds = frame["laps"].groupby(frame.index.str[0]).min()
    assert (summary["audit"], summary["collisions"], summary["deadlocks"]) == ("clean", 0, [])
    assert (summary["stops"]["missed"], summary["waiting_to_depart"]) == (0, 0)
    assert summary["stops"]["served"] == len(made(tmp_path))
    assert rounds["r"] > 15
    assert rounds["s"] > 8
    assert frame.loc[["l", "m"], "stops"].tolist() == [2, 2]
    assert summary["stops"]["longest_late_back_s"] < 180.0  # with five seeds 69 to 161
    assert not any("parks" in warning for warning in summary["warnings"])
    events = pd.read_parquet(tmp_path / "run" / "events.parquet")
    counts = events["event"].value_counts()
    assert counts["park"] - counts["return"] in range(10)
    assert counts["return"] > 60


def test_who_returns_from_beside_the_road_lets_ordinary_vehicles_by(tmp_path: Path) -> None:
    """SUMO does not ask those who come along the lane whether they can still brake."""
    text, places = beside("lots")
    draw = Random(1)
    ways = [
        (draw.choice(("B0B1", "E4D4", "D4D3")), draw.choice(("C4B4", "D0E0", "C0D0"))) for _ in range(250)
    ]
    trips = "".join(
        f'<trip id="o{k}" depart="{1.6 * k:.1f}" from="{begin}" to="{end}"/>'
        for k, (begin, end) in enumerate(ways)
    )
    others = tmp_path / "others.rou.xml"
    others.write_text(f"<routes>{trips}</routes>", encoding="utf-8")
    summary = run(tmp_path, text, places, traffic=str(others), duration_s=400.0, seed=2)
    assert (summary["collisions"], summary["stops"]["missed"]) == (0, 0)
    assert summary["others"]["vehicles"] > 100
    assert summary["stops"]["served"] > 40


@pytest.mark.parametrize("kind", ["lots", "mid-lane"])
def test_under_other_gates_vehicles_that_park_stand_on_the_road(kind: str, tmp_path: Path) -> None:
    """Another gate knows of no vehicle that is in no place, and beside the road others would pass it."""
    text, places = beside(kind)
    summary = run(tmp_path, text, places, duration_s=200.0, gate="one-step", seed=4)
    assert summary["collisions"] == 0
    assert summary["stops"]["served"] > 30
    assert any("stand on the road meanwhile" in warning for warning in summary["warnings"])


def test_who_parks_comes_back_before_those_that_wait_for_its_space(tmp_path: Path) -> None:
    """A car park with one space: the next in the street is a gap behind it, and goes in when it is out."""
    place = '<additional><parkingArea id="p" lane="C2C1_0" startPos="10" endPos="60" roadsideCapacity="1"/>'
    stop = '<stop parkingArea="p" duration="20"/>'
    text = "".join(
        f'<trip id="t{k}" depart="{5 * k}" from="B2C2" via="C2C1" to="C1B1">{stop}</trip>' for k in range(3)
    )
    summary = run(tmp_path, text, f"{place}</additional>", duration_s=200.0)
    assert (summary["arrived"], summary["audit"], summary["collisions"]) == (3, "clean", 0)


def test_who_waits_for_a_lot_is_known_to(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The first parks; the others stand before its one lot, which is no deadlock, until it is free."""
    place = '<additional><parkingArea id="p" lane="C2C1_0" startPos="10" endPos="60" roadsideCapacity="1"/>'
    stop = '<stop parkingArea="p" duration="400"/>'
    text = "".join(
        f'<trip id="t{k}" depart="{5 * k}" from="B2C2" via="C2C1" to="C1B1">{stop}</trip>' for k in range(3)
    )
    said: dict[str, bool] = {}
    ask = SumoTraffic.awaits_lot

    def noting(traffic: SumoTraffic, vehicle: str) -> bool:
        said[vehicle] = ask(traffic, vehicle)
        return said[vehicle]

    monkeypatch.setattr(SumoTraffic, "awaits_lot", noting)
    summary = run(tmp_path, text, f"{place}</additional>", duration_s=200.0)
    assert summary["deadlocks"] == []
    assert said == {"t1": True, "t2": True}


@pytest.mark.parametrize("length_m", [10, 13, 20])
def test_who_parks_at_a_bus_stop_comes_back_before_those_that_wait_for_it(
    length_m: int, tmp_path: Path
) -> None:
    """The stop has space for one bus: the next stands a gap behind it, and stops there when it is out."""
    place = f'<additional><busStop id="s" lane="C2C1_0" startPos="{60 - length_m}" endPos="60"/></additional>'
    stop = '<stop busStop="s" duration="20" parking="true"/>'
    buses = "".join(
        f'<trip id="b{k}" type="bus" depart="{5 * k}" from="B2C2" via="C2C1" to="C1B1">{stop}</trip>'
        for k in range(3)
    )
    summary = run(tmp_path, BUS + buses, place, duration_s=300.0, positions=True)
    assert (summary["arrived"], summary["audit"], summary["collisions"]) == (3, "clean", 0)


LOTS = {
    "lots": 'startPos="20" endPos="60" roadsideCapacity="5"',
    "two lots": 'startPos="30" endPos="55" roadsideCapacity="2"',
    "on the road": 'startPos="20" endPos="60" roadsideCapacity="4" onRoad="true"',
    "bays": 'startPos="20" endPos="60"',
}


def beside(kind: str) -> tuple[str, str]:
    """Return loops of the grid, each with a stop beside the road of a kind, and the places of the stops."""
    roads, places, routes = RoadNetwork.open(NET), dict[str, str](), [BUS, '<vType id="car" minGap="3.5"/>']
    for number, loop in enumerate(generate_loops(roads, 20, length_m=(800.0, 1600.0), seed=3)):
        edge = loop.edges[1 + number % 3]
        lane = roads.lanes[f"{edge}_0"]
        end_m = {"mid-lane": 40.0, "at the line": lane.length_m - 2.0}.get(kind)
        where = f'lane="{lane.id}" startPos="{(end_m or 9) - 8}" endPos="{end_m}" parking="true"'
        if end_m is None:
            bays = "".join(f'<space x="{x}" y="{y}"/>' for x, y in lane.shape * 3) if kind == "bays" else ""
            places[edge] = f'<parkingArea id="{edge}" lane="{lane.id}" {LOTS[kind]}>{bays}</parkingArea>'
            where = f'parkingArea="{edge}"'
        stop = f'<stop {where} duration="{5 + number % 4 * 5}"/>'
        routes.append(f'<route id="{loop.id}" edges="{" ".join(loop.edges)}">{stop}</route>')
        what = "bus" if number % 4 == 0 and kind == "mid-lane" else "car"
        routes += [
            f'<vehicle id="{loop.id}.{k}" type="{what}" route="{loop.id}" depart="0"/>' for k in range(4)
        ]
    return "".join(routes), f"<additional>{''.join(places.values())}</additional>"


@pytest.mark.parametrize("kind", [*LOTS, "mid-lane", "at the line"])
def test_who_returns_from_beside_the_road_drives_into_nobody(kind: str, tmp_path: Path) -> None:
    """Not into one that returns too, from another lot or from the same spot; and all return."""
    text, places = beside(kind)
    summary = run(tmp_path, text, places, positions=True, seed=4)
    assert (summary["audit"], summary["collisions"], summary["starving"]) == ("clean", 0, [])
    assert summary["stops"]["served"] > 150
    assert summary["stops"]["longest_late_back_s"] < 240.0
    assert ("finds a gap to return" in summary["promise_if"]) is (kind != "on the road")


def test_who_parks_at_the_end_of_a_lane_comes_back_after_those_who_stand_next_to_it(tmp_path: Path) -> None:
    """The next has driven up to the line meanwhile: it goes first, since nobody can come in beside it."""
    text = (
        '<route id="ring" edges="B2C2 C2C1 C1B1 B1B2"/><route id="kerb" edges="B2C2 C2C1 C1B1 B1B2">'
        '<stop lane="C2C1_0" startPos="70" endPos="85.5" duration="25" parking="true"/></route>'
        '<flow id="r" route="ring" begin="0" period="5" number="9"/>'
        '<flow id="s" route="kerb" begin="2" period="9" number="2"/>'
    )
    summary = run(tmp_path, text, "<additional/>", positions=True)
    assert (summary["audit"], summary["collisions"]) == ("clean", 0)
    assert summary["stops"]["served"] > 5
    assert summary["stops"]["longest_late_back_s"] < 300.0


def test_until_grows_by_the_cycle(tmp_path: Path) -> None:
    """As in SUMO: counted from the departure, 200 s later in each round."""
    text = (
        f'<route id="line" {LINE} cycleTime="200"><stop busStop="market" until="80"/></route>'
        '<vehicle id="v" route="line" depart="10"/>'
    )
    run(tmp_path, text, duration_s=700.0)
    assert [float(one["ended"]) for one in made(tmp_path)] == [90.0, 290.0, 490.0, 690.0]


@pytest.mark.parametrize("beside", ["beside", ""])
def test_persons_ride_from_stop_to_stop(beside: str, tmp_path: Path) -> None:
    """They wait for the line that goes where they want to, and get off there; from any route file."""
    person = (
        '<person id="p" type="who" depart="5"><walk edges="B2C2" busStop="market"/>'
        '<ride busStop="school" lines="7"/></person>'
    )
    kind = '<vType id="who" vClass="pedestrian" maxSpeed="2"/>'
    (tmp_path / "persons.rou.xml").write_text(f"<routes>{kind}{person}</routes>", encoding="utf-8")
    text = (
        f'<route id="line" {LINE}><stop busStop="market" duration="9"/>'
        '<stop busStop="school" duration="9"/></route><vehicle id="v" route="line" depart="0" line="7"/>'
    )
    if beside:
        run(tmp_path, text, traffic=str(tmp_path / "persons.rou.xml"))
    else:
        run(tmp_path, kind + text + person)
    loaded = [(one["busStop"], one["loadedPersons"], one["unloadedPersons"]) for one in made(tmp_path)]
    assert ("market", "1", "0") in loaded
    assert ("school", "0", "1") in loaded


@pytest.mark.parametrize(("gate", "first_s"), [("certified", 3), ("open", 3), ("certified", 250)])
def test_persons_who_wait_are_counted(gate: str, first_s: int, tmp_path: Path) -> None:
    """As many on average as SUMO's persons wait in all, over all the time; nobody where none come."""
    text = (
        '<vType id="k" personCapacity="90" boardingDuration="0"/>'
        f'<route id="line" {LINE}><stop busStop="market" duration="2"/><stop busStop="school" duration="2"/>'
        '</route><vehicle id="v" type="k" route="line" depart="0" line="7"/>'
        f'<personFlow id="p" begin="{first_s}" end="430" period="7"><walk edges="B2C2" busStop="market"/>'
        '<ride busStop="school" lines="7"/></personFlow>'
    )
    run(tmp_path, text, gate=gate)
    stops = pd.read_parquet(tmp_path / "run" / "stops.parquet").set_index("stop")
    rides = ET.parse(tmp_path / "persons.xml").getroot().iter("ride")
    waited_s = sum(float(ride.attrib["waitingTime"]) for ride in rides)
    assert float(stops["persons_waiting"]["market"]) == pytest.approx(waited_s / 600.0, rel=0.05)
    assert stops["persons_most"]["market"] in range(5, 40)
    assert stops["persons_waiting"]["school"] == 0.0
    again = read_run(tmp_path / "run")
    again_stops = compute_stops(visits=again.visits, waiting=again.persons).set_index("stop")
    pd.testing.assert_frame_equal(again_stops, stops, check_dtype=False)


@pytest.mark.parametrize(
    ("end", "length", "found"),
    [
        ("85.6", "5", r"the stop at market ends at 85.6 m of lane B2C2_0, beyond the line of place B2C2_0"),
        (
            "9",
            "12",
            r"a vehicle of 12 m would reach back out of place B2C2_0.*let it end at 12.5 m, or later",
        ),
    ],
)
def test_a_stop_in_others_way_is_refused(end: str, length: str, found: str, tmp_path: Path) -> None:
    """With the file, the vehicle, the place, and what would do."""
    places = f'<additional><busStop id="market" lane="B2C2_0" startPos="1" endPos="{end}"/></additional>'
    text = (
        f'<vType id="t" length="{length}"/><route id="line" {LINE}>'
        '<stop busStop="market" duration="9"/></route>'
        '<vehicle id="v" type="t" route="line" depart="0"/>'
    )
    with pytest.raises(ScenarioError, match=rf"my.rou.xml: .* 1 vehicle, first v: .*{found}"):
        run(tmp_path, text, places)
    summary = run(tmp_path, text, places, gate="open")
    assert summary["stops"]["served"] > 2


def test_stops_all_over_a_busy_grid(tmp_path: Path) -> None:
    """Nobody counts on who is to stop, nor drives in behind one where there is no room: bodies keep apart."""
    network = RoadNetwork.open(NET)
    loops, rng = generate_loops(network, 14, length_m=(500.0, 1500.0)), Random(3)
    lines = []
    for number, loop in enumerate(loops):
        stops = ""
        for edge in loop.edges[::3]:
            end = rng.uniform(8.0, 79.0)
            seconds = rng.choice((5, 12, 25))
            stops += f'<stop lane="{edge}_0" startPos="{end - 2}" endPos="{end}" duration="{seconds}"/>'
        lines.append(f'<route id="{loop.id}" edges="{" ".join(loop.edges)}">{stops}</route>')
        lines += [f'<vehicle id="s{number}.{k}" route="{loop.id}" depart="0"/>' for k in range(4)]
        lines.append(f'<flow id="f{number}" route="{loop.id}" period="exp(0.012)" end="400"/>')
    summary = run(tmp_path, "".join(lines), positions=True)
    assert (summary["audit"], summary["stops"]["missed"]) == ("clean", 0)
    assert summary["stops"]["served"] > 400
    assert summary["departed"] > 30
    assert summary["positions"]["stands_in_crossings"] < 14  # with five seeds 7 to 13
    assert not any("nothing is foreseen" in warning for warning in summary["warnings"])


@pytest.mark.parametrize("first", ["near", "off"])
def test_trips_that_stop_where_they_begin(first: str, tmp_path: Path) -> None:
    """Who can stop there starts before its stop and makes it; who cannot is ordinary, and that is said.

    Also if it is the first to depart: the run knows it as ordinary then too.
    """
    stops = {"near": '<stop lane="A0A1_0" endPos="14" duration="5"/>'}
    stops["off"] = '<stop lane="A0A1_0" endPos="5" duration="5"/>'
    stops["far"] = '<stop lane="A1B1_0" endPos="40" duration="5"/>' * 2
    names = sorted(stops, key=lambda name: name != first)
    routes = BUS + "".join(
        f'<vehicle id="{name}" type="bus" depart="{9 * k}" departPos="0">'
        f'<route edges="A0A1 A1B1 B1C1"/>{stops[name]}</vehicle>'
        for k, name in enumerate(names)
    )
    summary = run(tmp_path, routes)
    assert (summary["audit"], summary["arrived"]) == ("clean", 2)
    stopped = [
        (one.get("id"), float(one.get("ended", "")) - float(one.get("started", "")))
        for one in ET.parse(tmp_path / "stops.xml").getroot()
    ]
    assert sorted(stopped) == [("far", 10.0), ("near", 5.0), ("off", 5.0)]
    assert any("off: the stop at A0A1_0" in line for line in summary["warnings"])


FEED = """<route id="line0" edges="A0A1 A1A2 A2A3 A3A4">
    <stop busStop="s0" duration="10" until="0"/><stop busStop="s0" duration="10" until="84"/>
    <stop busStop="s1" arrival="100" duration="10" until="120"/>
    <stop busStop="s2" duration="10" until="160"/>
</route>"""
"""A line as SUMO's gtfs2pt writes it: the first stop twice, `until` since the departure."""


def test_buses_as_gtfs2pt_writes_them(tmp_path: Path) -> None:
    """All can be gated, if stops may move, and wait for their times; else the reason is counted."""
    places = "".join(
        f'<busStop id="s{k}" lane="{edge}_0" startPos="20" endPos="{end}" friendlyPos="true"/>'
        for k, (edge, end) in enumerate((("A0A1", 40.0), ("A1A2", 50.0), ("A3A4", 9999.0)))
    )
    buses = "".join(
        f'<vehicle id="line0.{k}" route="line0" type="bus" depart="{25200 + 300 * k}" line="0"/>'
        for k in range(3)
    )
    files = BUS + FEED + buses, f"<additional>{places}</additional>"
    moved = run(tmp_path, *files, move_stops=True, duration_s=900.0)
    assert (moved["arrived"], moved["stops"]["served"], moved["audit"]) == (3, 9, "clean")
    (told,) = (line for line in moved["warnings"] if "1 stop moved, onto the lane: s2 by -" in line)
    assert told.endswith("for line0.0, line0.1, line0.2")
    visits = pd.read_parquet(tmp_path / "run" / "visits.parquet").query("stop == 's0'")
    assert (visits["due_s"] - visits["came_s"]).gt(0).all()
    assert visits["went_on_s"].sub(visits["due_s"]).abs().le(1.0).all()
    with pytest.raises(NobodyGatedError, match=r"2 vehicles, first line0.0: the stop at s2 .*--move-stops"):
        run(tmp_path, *files)


@pytest.mark.parametrize("gate", ["certified", "open"])
def test_a_vehicle_with_a_timetable_departs_where_its_route_begins(gate: str, tmp_path: Path) -> None:
    """Also one that is there when the run begins: its first stop is the first of its timetable, in time."""
    (tmp_path / "line.rou.xml").write_text(
        '<routes><route id="a" edges="B2C2 C2C1 C1B1 B1B2" cycleTime="300">'
        '<stop lane="B2C2_0" endPos="60" duration="5" until="40"/>'
        '<stop lane="C1B1_0" endPos="60" duration="5" until="120"/></route>'
        '<flow id="x" route="a" begin="0" period="300" number="1"/></routes>',
        encoding="utf-8",
    )
    network = str(Path(__file__).parents[2] / "networks" / "grid5-priority.net.xml")
    routes = str(tmp_path / "line.rou.xml")
    simulate(Scenario(network=network, routes=routes, gate=gate, duration_s=900), tmp_path / "run")
    visits = pd.read_parquet(tmp_path / "run" / "visits.parquet")
    assert len(visits) >= 5
    assert (visits["went_on_s"] - visits["due_s"]).max() < 20.0
    assert visits[visits["vehicle"] == "x.0"]["due_s"].tolist()[:3] == [40.0, 120.0, 340.0]


@pytest.mark.parametrize("beside", ["", '<vehicle id="v" route="r" depart="5"/>'])
def test_a_flow_that_no_gate_drives_counts_beside_ordinary_traffic(beside: str, tmp_path: Path) -> None:
    """Under SUMO's rules, by its vehicles; the run ends with the last of them, not with the others."""
    (tmp_path / "t.rou.xml").write_text(
        '<routes><route id="q" edges="B0B1 B1B2 B2B3"/>'
        '<flow id="o" route="q" begin="0" end="300" period="30"/></routes>'
    )
    flow = '<stop lane="A1A2_0" endPos="60" duration="5" speed="3"/>'
    routes = (
        '<route id="r" edges="A0A1 A1A2 A2A3"/>'
        f'<flow id="f" route="r" begin="0" end="60" period="20">{flow}</flow>{beside}'
    )
    summary = run(tmp_path, routes, gate="open", traffic=str(tmp_path / "t.rou.xml"))
    number = 3 + bool(beside)
    assert (summary["vehicles"], summary["arrived"], summary["others"]["vehicles"]) == (number, number, 3)
    assert summary["duration_s"] < 100
