"""Trips and loops together under the gate, in real simulations: all trips arrive, nothing touches."""

from __future__ import annotations

import json
import re
from pathlib import Path
from random import Random
from typing import Any
from xml.etree import ElementTree as ET

import pandas as pd
import pytest
from click.testing import CliRunner
from full_ring import write_full_ring
from made_networks import netgenerate, short_last_road

from loopgate import Scenario
from loopgate.analysis.rows import read_run_row
from loopgate.cli.main import cli
from loopgate.control import departures
from loopgate.errors import ScenarioError
from loopgate.network import RoadNetwork
from loopgate.simulation.assembly import assemble
from loopgate.simulation.run import simulate

pytestmark = pytest.mark.sumo

GRID = "networks/grid5-priority.net.xml"
TRIPS, LOOPS = 60, 4
SQUARES = ("B1C1 C1C2 C2B2 B2B1", "C2D2 D2D3 D3C3 C3C2", "A0A1 A1B1 B1B0 B0A0", "D3E3 E3E4 E4D4 D4D3")


def demand(folder: Path, *, loops: int = LOOPS) -> Path:
    """Write trips from anywhere to anywhere in two minutes, and some loops among them."""
    rng = Random(5)
    edges = sorted(RoadNetwork.open(GRID).edges)
    rows = ['<vType id="car" length="4.5" speedDev="0.1"/><vType id="slow" length="5" maxSpeed="9"/>']
    rows += [
        f'<vehicle id="round{k}" type="car" depart="0"><route edges="{SQUARES[k]}" repeat="9"/></vehicle>'
        for k in range(loops)
    ]
    for k in range(TRIPS):
        a, b = rng.sample(edges, 2)
        kind = "slow" if k % 6 == 0 else "car"
        rows.append(f'<trip id="t{k}" type="{kind}" depart="{rng.randrange(120)}" from="{a}" to="{b}"/>')
    file = folder / "demand.rou.xml"
    file.write_text(f"<routes>{''.join(rows)}</routes>", encoding="utf-8")
    return file


def run(folder: Path, routes: Path, **more: Any) -> dict[str, Any]:  # noqa: ANN401  a scenario's keys
    scenario = Scenario.from_dict({"network": GRID, "routes": str(routes), "duration_s": 600.0, **more})
    return simulate(scenario, folder, overwrite=True)


def trips_in(folder: Path) -> list[ET.Element]:
    return ET.parse(folder / "tripinfo.xml").getroot().findall("tripinfo")


def test_all_trips_arrive_and_loops_go_on(tmp_path: Path) -> None:
    """Certified, by positions: nobody touches, all trips are at their ends, and the loops make laps."""
    summary = run(tmp_path / "out", demand(tmp_path), positions=True)
    assert summary["audit"] == "clean"
    assert summary["clean"]
    assert (summary["trips"], summary["arrived"], summary["unfinished"]) == (TRIPS, TRIPS, 0)
    assert summary["promise"] == "everyone"
    flow, vehicles = (pd.read_parquet(tmp_path / "out" / f"{name}.parquet") for name in ("flow", "vehicles"))
    assert flow["distance_m"].sum() / 1000.0 == pytest.approx(summary["distance_km"], rel=1e-6)
    told = {one.get("id", ""): float(one.get("departDelay", "")) for one in trips_in(tmp_path / "out")}
    delays = vehicles.set_index("vehicle")["depart_delay_s"]
    assert delays.max() > 1.0
    assert told == {name: pytest.approx(delays[name]) for name in told}
    assert summary["laps"] > LOOPS
    vehicles = pd.read_parquet(tmp_path / "out" / "vehicles.parquet").set_index("vehicle")
    assert vehicles.loc["t1", "arrived"]
    assert not vehicles.loc["round0", "arrived"]
    trips = vehicles[vehicles["loop"].str.startswith("way")]
    delays = trips["time_loss_s"] + trips["depart_delay_s"]
    assert summary["mean_delay_s"] == pytest.approx(delays.mean(), abs=0.01)
    assert summary["worst_delay_s"] == pytest.approx(delays.max(), abs=0.01)


def test_it_ends_when_all_have_arrived_and_the_same_seed_gives_the_same(tmp_path: Path) -> None:
    """Without loops nobody is left to drive after some minutes; alike event by event."""
    routes = demand(tmp_path, loops=0)
    found = run(tmp_path / "a", routes)
    run(tmp_path / "b", routes)
    assert found["arrived"] == TRIPS
    assert found["duration_s"] < 500.0
    row = read_run_row(tmp_path / "a").row
    assert row["km_per_h"] == pytest.approx(found["km_per_h"])
    one, other = (pd.read_parquet(tmp_path / name / "events.parquet") for name in ("a", "b"))
    pd.testing.assert_frame_equal(one, other)


def test_who_departs_ahead_of_another_goes_first(tmp_path: Path) -> None:
    """Put in together, the one behind is not granted the place of the one ahead before that is there."""
    net = tmp_path / "straight.net.xml"
    netgenerate("--grid --grid.x-number=5 --grid.y-number=2 --grid.length=100", net)
    way = "A0B0 B0C0 C0D0 D0E0 E0E1"
    others = "E1D1 D1C1 C1B1 B1A1"
    rows = [
        f'<vehicle id="{name}" depart="{when}" departPos="{at}"><route edges="{edges}"/></vehicle>'
        for name, when, at, edges in (
            *(("before", 0, 20, others), ("behind", 5, 80, way)),
            ("ahead", 5, 20, way[5:]),
        )
    ]
    routes = tmp_path / "three.rou.xml"
    routes.write_text(f"<routes>{''.join(rows)}</routes>", encoding="utf-8")
    summary = run(tmp_path / "out", routes, network=str(net))
    assert (summary["outcome"], summary["arrived"]) == ("done", 3)
    events = pd.read_parquet(tmp_path / "out" / "events.parquet")
    grants = events[(events["event"] == "grant") & (events["place"] == "C0D0_0")]
    assert grants["vehicle"].tolist() == ["ahead", "behind"]


def test_who_comes_upon_a_crowd_waits_outside_and_nobody_else_does(tmp_path: Path) -> None:
    """Two streams cross and ask for more than that takes; in a corner beside them trips depart at once."""
    ways = {"s": "A2B2 B2C2 C2D2 D2E2", "t": "C0C1 C1C2 C2C3 C3C4", "c": "A3A4 A4B4 B4B3"}
    rows = [
        f'<vehicle id="{name}{k}" depart="{2 * k}"><route edges="{edges}"/></vehicle>'
        for k in range(90)
        for name, edges in ways.items()
        if name != "c" or k % 5 == 0
    ]
    routes = tmp_path / "stream.rou.xml"
    routes.write_text(f"<routes>{''.join(rows)}</routes>", encoding="utf-8")
    summary = run(tmp_path / "out", routes)
    assert (summary["outcome"], summary["arrived"]) == ("done", len(rows))
    vehicles = pd.read_parquet(tmp_path / "out" / "vehicles.parquet").set_index("vehicle")
    streams = vehicles.filter(regex="s|t", axis="index")
    assert vehicles["depart_delay_s"].filter(like="c").max() < 5.0
    assert streams["depart_delay_s"].max() > 10.0
    assert streams["time_loss_s"].max() < 100.0  # 127 s, and 58 s in the mean, if nobody waits outside
    assert streams["time_loss_s"].mean() < 25.0


def test_queues_at_red_are_no_crowd(tmp_path: Path) -> None:
    """Two streams cross at lights, which are obeyed; with vehicles that wait outside the delay is 58 s."""
    ways = {"s": "A2B2 B2C2 C2D2 D2E2", "t": "C0C1 C1C2 C2C3 C3C4"}
    rows = [
        f'<vehicle id="{name}{k}" depart="{4 * k}"><route edges="{edges}"/></vehicle>'
        for k in range(60)
        for name, edges in ways.items()
    ]
    routes = tmp_path / "stream.rou.xml"
    routes.write_text(f"<routes>{''.join(rows)}</routes>", encoding="utf-8")
    network = str(Path(GRID).with_name("grid5-actuated.net.xml"))
    summary = run(tmp_path / "out", routes, network=network, lights="obey")
    assert summary["arrived"] == len(rows)
    assert summary["mean_depart_delay_s"] < 5.0
    assert summary["mean_delay_s"] < 52.0


def test_a_dense_stream_that_rolls_is_no_crowd(tmp_path: Path) -> None:
    """Every three seconds one sets out on a long way that nobody crosses: a fourth of its slots are taken."""
    way = "A0B0 B0C0 C0D0 D0E0 E0E1 E1E2 E2E3 E3E4"
    rows = [f'<vehicle id="v{k}" depart="{3 * k}"><route edges="{way}"/></vehicle>' for k in range(80)]
    routes = tmp_path / "stream.rou.xml"
    routes.write_text(f"<routes>{''.join(rows)}</routes>", encoding="utf-8")
    summary = run(tmp_path / "out", routes)
    assert summary["arrived"] == len(rows)
    assert summary["max_depart_delay_s"] < 10.0


def test_who_has_waited_longest_has_its_turn_where_all_ways_are_crowded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Many more trips than the grid takes: without that rule somebody waits outside for longer."""
    rng = Random(8)
    edges = sorted(RoadNetwork.open(GRID).edges)
    rows = [
        f'<trip id="t{k}" depart="{k / 8:g}" from="{a}" to="{b}"/>'
        for k, (a, b) in enumerate(rng.sample(edges, 2) for _ in range(500))
    ]
    routes = tmp_path / "many.rou.xml"
    routes.write_text(f"<routes>{''.join(rows)}</routes>", encoding="utf-8")
    found = []
    for turn in (departures._IN_TURN, len(rows)):
        monkeypatch.setattr(departures, "_IN_TURN", turn)
        found.append(run(tmp_path / f"{turn}", routes))
    assert [one["arrived"] for one in found] == [len(rows)] * 2
    assert found[0]["max_depart_delay_s"] < found[1]["max_depart_delay_s"]


def test_loops_that_fill_a_ring_leave_room_for_who_passes_later(tmp_path: Path) -> None:
    """More would go round one block than it holds; trips that come when it is full pass it all the same."""
    keys = write_full_ring(tmp_path)
    summary = run(tmp_path / "out", Path(keys["routes"]), network=keys["network"], duration_s=500.0)
    assert summary["waiting_to_depart"] > 0
    assert (summary["arrived"], summary["unfinished"]) == (2, 0)


def test_a_trip_stops_where_it_ends(tmp_path: Path) -> None:
    """At the end of its last lane, which is where SUMO has a stop that says only its edge."""
    routes = tmp_path / "stop.rou.xml"
    trip = '<trip id="t" depart="0" from="A0B0" to="C0D0"><stop edge="C0D0" duration="20"/></trip>'
    routes.write_text(f"<routes>{trip}</routes>", encoding="utf-8")
    summary = run(tmp_path / "out", routes)
    assert (summary["arrived"], summary["audit"]) == (1, "clean")
    assert pd.read_parquet(tmp_path / "out" / "vehicles.parquet")["stops"].tolist() == [1]


def test_two_that_sumo_lets_wait_for_each_other_go_on_all_the_same(tmp_path: Path) -> None:
    """Lights are off, and an ordinary vehicle is far away: each of two has to give way, by SUMO's matrix."""
    ways = {
        "left": "-31050360#2 143308552#1 -318210361#3 -318210361#0",
        "straight": "143308542#15 143308542#16 143308552#1 -318210361#3",
        "ordinary": "118262353#0 118262353#1 118262353#2",
    }
    rows = [f'<vehicle id="{v}" depart="5"><route edges="{edges}"/></vehicle>' for v, edges in ways.items()]
    routes, names = tmp_path / "three.rou.xml", tmp_path / "gated.txt"
    routes.write_text(f"<routes>{''.join(rows)}</routes>", encoding="utf-8")
    names.write_text("left\nstraight\n", encoding="utf-8")
    summary = run(tmp_path / "out", routes, network="sumo:DRT", gated=str(names))
    assert (summary["arrived"], summary["others"]["arrived"]) == (2, 1)
    assert summary["worst_delay_s"] < 30.0


@pytest.mark.parametrize("gate", ["certified", "open"])
def test_figures_are_those_of_tripinfo(tmp_path: Path, gate: str) -> None:
    """Of those there, under way and still to depart; what the gate holds is lost and stood, SUMO says."""
    routes = demand(tmp_path, loops=0)
    text = routes.read_text(encoding="utf-8")
    late = "".join(f'<trip id="late{k}" type="car" depart="9{k}" from="A0A1" to="E4D4"/>' for k in range(8))
    routes.write_text(text.replace("</routes>", f"{late}</routes>"), encoding="utf-8")
    summary = run(tmp_path / "out", routes, duration_s=98.0, gate=gate)
    tripinfo = ET.parse(tmp_path / "out" / "tripinfo.xml").getroot()
    names = ("depart", "arrival", "duration", "departDelay", "timeLoss", "waitingTime", "stopTime")
    said = pd.DataFrame(
        {element.get("id"): [float(element.get(name, "")) for name in names] for element in tripinfo},
        index=names,
    ).T
    said = said[said["depart"] >= 0.0]
    arrived = said["arrival"] >= 0.0
    vehicles = pd.read_parquet(tmp_path / "out" / "vehicles.parquet").set_index("vehicle")
    there = vehicles.loc[said.index]
    assert 0 < len(said) < summary["trips"]
    assert 0 < arrived.sum() == summary["arrived"]
    assert (there["arrived"] == arrived).all()
    pd.testing.assert_series_equal(there["arrival_s"], said["arrival"].where(arrived), check_names=False)
    held = said["stopTime"]
    assert held.any() == (gate == "certified")
    for column, figures in {
        "trip_s": said["duration"],
        "waiting_s": said["waitingTime"] + held,
        "time_loss_s": said["timeLoss"] + held,
    }.items():
        assert there[column].tolist() == pytest.approx(figures.tolist(), abs=0.01), column
    outside = vehicles.drop(said.index)
    assert (outside["waiting_s"] + outside["time_loss_s"]).sum() == 0.0
    assert not outside["arrived"].any()
    assert outside["arrival_s"].isna().all()
    assert summary["mean_trip_s"] == pytest.approx(said.loc[arrived, "duration"].mean(), abs=0.001)
    for name, total in {
        "waiting": there["waiting_s"].sum(),
        "time_loss": there["time_loss_s"].sum(),
        "delay": summary["trips"] * (summary["mean_time_loss_s"] + summary["mean_depart_delay_s"]),
    }.items():
        assert summary[f"mean_{name}_s"] == pytest.approx(total / summary["trips"], abs=0.002), name
    row = read_run_row(tmp_path / "out").row
    for name in ("time_loss", "depart_delay", "delay", "waiting", "trip"):
        assert row[f"mean_{name}_s"] == summary[f"mean_{name}_s"] > 0.0


def test_sumo_alone_with_the_same_demand(tmp_path: Path) -> None:
    """The same figures from the same definition, gate or no gate."""
    routes = demand(tmp_path, loops=0)
    open_ = run(tmp_path / "open", routes, gate="open")
    gated = run(tmp_path / "gated", routes)
    keys = {"trips", "arrived", "unfinished", "mean_delay_s", "mean_time_loss_s", "worst_delay_s"}
    assert keys <= open_.keys() & gated.keys()
    assert open_["trips"] == gated["trips"] == TRIPS
    assert open_["mean_delay_s"] == pytest.approx(
        open_["mean_time_loss_s"] + open_["mean_depart_delay_s"], abs=0.002
    )


def test_some_are_gated_and_the_others_are_ordinary(tmp_path: Path) -> None:
    """By type or by a file of names; the others' trips are told of apart."""
    routes = demand(tmp_path)
    slow = run(tmp_path / "slow", routes, gated="slow")
    assert slow["trips"] == TRIPS // 6
    assert slow["others"]["trips"] == TRIPS - TRIPS // 6
    names = tmp_path / "names.txt"
    names.write_text("t1\nt2  # the second\nt9999\n", encoding="utf-8")
    named = run(tmp_path / "named", routes, gated=str(names))
    assert named["trips"] == 2
    assert any("1 of 3 names stand for no vehicle" in line for line in named["warnings"])
    assert "trips" not in run(tmp_path / "loops", routes, gated="loops")


@pytest.mark.parametrize(
    ("more", "found"),
    [
        ({"gated": "bus"}, "gated: 'bus' is neither all nor loops, nor a type of the vehicles"),
        ({"abstraction": "segments"}, "drives its route once: it works on --abstraction queues"),
    ],
)
def test_what_does_not_work_is_said(tmp_path: Path, more: dict[str, str], found: str) -> None:
    """In one line."""
    with pytest.raises(ScenarioError, match=found) as error:
        run(tmp_path / "out", demand(tmp_path), **more)
    assert "\n" not in str(error.value)


def test_who_fits_in_no_place_is_ordinary_and_named(tmp_path: Path) -> None:
    """A vehicle for which no place holds two: the run says so, and goes on with it as ordinary traffic."""
    routes = demand(tmp_path, loops=0)
    long = '<vType id="long" length="150"/><trip id="huge" type="long" depart="9" from="A0A1" to="A3A4"/>'
    routes.write_text(routes.read_text(encoding="utf-8").replace("</routes>", f"{long}</routes>"), "utf-8")
    summary = run(tmp_path / "out", routes)
    assert any("1 vehicle in ordinary traffic, first huge" in line for line in summary["warnings"])
    assert summary["trips"] == TRIPS
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["others"]["trips"] == 1


@pytest.mark.parametrize("lights", ["obey", "off"])
def test_drivers_who_ignore_others_or_lights_are_ordinary_and_named(lights: str, tmp_path: Path) -> None:
    """One that drives at red only where others rely on lights."""
    routes = demand(tmp_path)
    rash = '<vType id="rash" jmDriveAfterRedTime="3"/>'
    rash += '<trip id="late" type="rash" depart="9" from="A0A1" to="A3A4"/>'
    for k in range(2):
        blind = f'<param key="{("carFollowModel", "junctionModel")[k]}.ignoreTypes" value="car"/>'
        rash += f'<trip id="blind{k}" depart="{k}" from="A0A1" to="A3A4">{blind}</trip>'
    rash += f'<vehicle id="round" depart="0">{blind}<route edges="{SQUARES[0]}" repeat="9"/></vehicle>'
    routes.write_text(routes.read_text(encoding="utf-8").replace("</routes>", f"{rash}</routes>"), "utf-8")
    found = assemble(Scenario(network=GRID, routes=str(routes), lights=lights))
    assert {v.id for v in found.ordinary} == {"blind0", "blind1", "round", *["late"] * (lights == "obey")}
    assert sum("Model.ignoreTypes lets it drive into" in line for line in found.warnings) == 2
    assert sum("jmDriveAfterRedTime lets it drive at red" in line for line in found.warnings) == (
        lights == "obey"
    )


def test_nobody_is_kept_on_a_last_road_that_is_too_short_to_wait_on(tmp_path: Path) -> None:
    """A stop leads vehicles to the right one of its lanes; at its end it would be in the way of arriving."""
    network = short_last_road(tmp_path / "short.net.xml")
    assert RoadNetwork.open(network).edges["b-c"].length_m < 7.5
    routes = tmp_path / "short.rou.xml"
    trips = "".join(f'<trip id="t{k}" depart="{5 * k}" from="a-b" to="b-c"/>' for k in range(6))
    routes.write_text(f"<routes>{trips}</routes>", encoding="utf-8")
    summary = run(tmp_path / "out", routes, network=str(network), duration_s=200.0)
    assert (summary["arrived"], summary["unfinished"], summary["clean"]) == (6, 0, True)


def test_stops_on_the_way_are_made_once(tmp_path: Path) -> None:
    """On a trip, on each vehicle of a flow, and at the side of the road; nobody comes there again."""
    file = tmp_path / "stops.rou.xml"
    file.write_text(
        '<routes><vType id="car"/><trip id="a" type="car" depart="0" from="A0A1" to="E4D4">'
        '<stop lane="A1B1_0" endPos="60" duration="20"/></trip>'
        '<flow id="f" type="car" begin="0" end="60" period="20" from="E4E3" to="A0B0">'
        '<stop edge="E3E2" endPos="50" duration="10"/></flow>'
        '<vehicle id="r" type="car" depart="5"><route edges="B1C1 C1C2 C2C3"/>'
        '<stop lane="C1C2_0" startPos="20" endPos="60" duration="30" parking="true"/></vehicle></routes>',
        encoding="utf-8",
    )
    summary = run(tmp_path / "out", file, positions=True, duration_s=400.0)
    assert summary["arrived"] == summary["trips"] == 5
    stops = summary["stops"]
    assert (stops["served"], stops["missed"], stops["under_way"]) == (5, 0, 0)
    assert stops["stopped_s"] == 80.0 + stops["late_back_s"]
    assert summary["audit"] == "clean"


def test_the_same_trips_among_ordinary_traffic_with_a_gate_and_without(tmp_path: Path) -> None:
    """Figures are of the trips, in both; others are counted beside them."""
    others = tmp_path / "others.rou.xml"
    flow = '<flow id="o" begin="0" end="100" period="10" from="A1B1" to="D1E1"/>'
    others.write_text(f"<routes>{flow}</routes>", encoding="utf-8")
    routes = demand(tmp_path, loops=0)
    for gate in ("certified", "open"):
        summary = run(tmp_path / gate, routes, gate=gate, traffic=str(others))
        assert (summary["trips"], summary["arrived"], summary["outcome"]) == (TRIPS, TRIPS, "done")
        assert summary["others"]["vehicles"] == 10


def test_trips_are_led_over_the_lanes_they_stop_on(tmp_path: Path) -> None:
    """Straight on, either of two lanes would do: the one named is taken, and any where only the edge is."""
    net = tmp_path / "lanes.net.xml"
    netgenerate("--grid --grid.x-number=4 --grid.y-number=2 --grid.length=200 -L 2 --no-turnarounds", net)
    stops = {"right": 'lane="B0C0_0"', "left": 'lane="B0C0_1"', "any": 'edge="B0C0"', "end": 'edge="C0D0"'}
    trips = "".join(
        f'<trip id="{name}" depart="{20 * k}" from="A0B0" to="C0D0"><stop {where} duration="5"/></trip>'
        for k, (name, where) in enumerate(stops.items())
    )
    turns = '<trip id="turn" depart="100" from="A0B0" to="C0C1"><stop edge="C0C1" duration="5"/></trip>'
    file = tmp_path / "stops.rou.xml"
    file.write_text(f"<routes>{trips}{turns}</routes>", encoding="utf-8")
    summary = run(tmp_path / "out", file, network=str(net), positions=True)
    assert (summary["arrived"], summary["audit"]) == (5, "clean")
    assert (summary["stops"]["served"], summary["stops"]["missed"]) == (5, 0)


def test_the_first_to_come_is_let_in_however_short_its_way(tmp_path: Path) -> None:
    """Nobody is on the road, so no way is crowded."""
    file = tmp_path / "one.rou.xml"
    file.write_text('<routes><trip id="a" depart="0" from="A0A1" to="A1B1"/></routes>', encoding="utf-8")
    assert run(tmp_path / "out", file, duration_s=60.0)["arrived"] == 1


def test_devices_that_sumo_does_not_have_ask_for_nothing(tmp_path: Path) -> None:
    """As in SUMO, whose reader of route files ignores them."""
    file, param = tmp_path / "one.rou.xml", '<param key="has.Own.device" value="true"/>'
    trip = f'<trip id="a" depart="0" from="A0A1" to="A1B1">{param}</trip>'
    file.write_text(f"<routes>{trip}</routes>", encoding="utf-8")
    assert run(tmp_path / "out", file, duration_s=60.0)["arrived"] == 1


def test_devices_of_single_vehicles_are_those_of_the_file(tmp_path: Path) -> None:
    """Also of those that depart later, each with its own figures; text for no setting of SUMO stays text."""
    rows = ""
    for name, capacity_wh in (("a", 500), ("b", 700), ("c", 500)):
        said = {"has.battery.device": "true", "device.battery.capacity": f"{capacity_wh}"}
        said |= {"laneChangeModel.note": "x", "note": "y"}
        tags = "".join(f'<param key="{key}" value="{value}"/>' for key, value in said.items())
        rows += f'<trip id="{name}" depart="5" from="A0A1" to="A3A4">{tags}</trip>'
    rows += '<trip id="d" depart="5" from="E0E1" to="E3E4"/>'
    file = tmp_path / "own.rou.xml"
    file.write_text(f"<routes>{rows}</routes>", encoding="utf-8")
    summary = run(tmp_path / "out", file, sumo=f"--battery-output {tmp_path / 'battery.xml'}")
    assert summary["arrived"] == 4
    told = ET.parse(tmp_path / "battery.xml").getroot().iter("vehicle")
    assert {one.get("id"): float(one.get("maximumBatteryCapacity", "")) for one in told} == {
        "a": 500.0,
        "b": 700.0,
        "c": 500.0,
    }


@pytest.mark.parametrize("how", ["options", "type", "vehicle"])
def test_who_has_the_rerouting_device_is_led_another_way_between_places(tmp_path: Path, how: str) -> None:
    """By the gate: SUMO's device would lead them into places that nobody granted; the others keep theirs."""
    routes = demand(tmp_path, loops=0)
    text = routes.read_text(encoding="utf-8")
    param = '<param key="has.rerouting.device" value="true"/>'
    kinds = {"car": f'speedDev="0.1">{param}</vType>', "slow": f'maxSpeed="9">{param}</vType>'}
    if how == "type":
        text = text.replace('speedDev="0.1"/>', kinds["car"]).replace('maxSpeed="9"/>', kinds["slow"])
    elif how == "vehicle":
        text = re.sub("(<trip [^>]*)/>", rf"\1>{param}</trip>", text)
    routes.write_text(text, encoding="utf-8")
    words = "--device.rerouting.period 5 --device.rerouting.adaptation-steps 3"
    sumo = words + (" --device.rerouting.probability 1" if how == "options" else "")
    summary = run(tmp_path / "out", routes, sumo=sumo, gated="car", positions=True)
    assert not any("rerouting" in line for line in summary["warnings"])
    assert (summary["trespasses"], summary["unfinished"], summary["audit"]) == (0, 0, "clean")
    assert summary["rerouting"]["vehicles"] == summary["trips"]
    assert summary["rerouting"]["times"] >= summary["rerouting"]["rerouted"] > 0
    events = pd.read_parquet(tmp_path / "out" / "events.parquet")
    turns = events[events["event"] == "reroute"]
    assert len(turns) == summary["rerouting"]["times"]
    log = (tmp_path / "out" / "tripinfo.xml").read_text(encoding="utf-8")
    rerouted = re.findall(r'rerouteNo="(\d+)" devices="([^"]*)" vType="([^"]*)"', log)
    assert {"routing_" in devices for _, devices, kind in rerouted if kind.startswith("car")} == {False}
    assert {"routing_" in devices for _, devices, kind in rerouted if kind.startswith("slow")} == {True}


def test_loops_are_not_led_another_way_and_that_is_said(tmp_path: Path) -> None:
    """They are the watch; so are stops and edges in between, which trips would miss."""
    summary = run(tmp_path / "out", demand(tmp_path), sumo="--device.rerouting.probability 1")
    assert any("gated vehicles go without rerouting devices" in line for line in summary["warnings"])
    assert summary["rerouting"]["vehicles"] == TRIPS
    text = demand(tmp_path, loops=0).read_text(encoding="utf-8")
    through = tmp_path / "through.rou.xml"
    through.write_text(text.replace("<trip ", '<trip via="C2C3" '), encoding="utf-8")
    summary = run(tmp_path / "via", through, sumo="--device.rerouting.probability 1", duration_s=60.0)
    assert "rerouting" not in summary
    assert any("gated vehicles go without rerouting devices" in line for line in summary["warnings"])


def test_no_other_way_is_taken_that_does_not_pay(tmp_path: Path) -> None:
    """SUMO's threshold: an hour less at least. And what is no number is said to be none."""
    words = "--device.rerouting.probability 1 --device.rerouting.threshold.constant"
    summary = run(tmp_path / "out", demand(tmp_path, loops=0), sumo=f"{words} 1:00:00")
    assert summary["rerouting"] == {"vehicles": TRIPS, "rerouted": 0, "times": 0}
    with pytest.raises(ScenarioError, match=r"device.rerouting.threshold.constant is 'often'; expected"):
        run(tmp_path / "out", demand(tmp_path, loops=0), sumo=f"{words} often")


def test_a_device_given_by_name_is_refused(tmp_path: Path) -> None:
    """SUMO's list of names is above all parameters."""
    with pytest.raises(ScenarioError, match=r"device.rerouting.explicit t1 does not go with a gate"):
        run(tmp_path / "out", demand(tmp_path), sumo="--device.rerouting.explicit t1,t2")


def test_a_calibrator_that_takes_trips_away_is_named(tmp_path: Path) -> None:
    """Nothing is wrong with the gate then: the audit knows of it, also by positions."""
    (tmp_path / "c.add.xml").write_text(
        '<additional><vType id="slow"/><route id="r" edges="B1C1"/>'
        '<calibrator id="c" edge="B1C1" pos="20" freq="60">'
        '<flow begin="0" end="900" vehsPerHour="60" speed="8" type="slow" route="r"/>'
        "</calibrator></additional>"
    )
    rows = '<flow id="f" begin="0" end="200" period="4" from="B0B1" to="C1D1" via="B1C1"/>'
    (tmp_path / "d.rou.xml").write_text(f"<routes>{rows}</routes>")
    (tmp_path / "c.sumocfg").write_text(
        f'<configuration><net-file value="{Path(GRID).resolve()}"/><route-files value="d.rou.xml"/>'
        '<additional-files value="c.add.xml"/></configuration>'
    )
    scenario = Scenario(network=str(tmp_path / "c.sumocfg"), duration_s=300.0, positions=True)
    summary = simulate(scenario, tmp_path / "out")
    taken = [one for one in trips_in(tmp_path / "out") if one.get("vaporized") == "calibrator"]
    assert len(taken) > 10
    assert summary["audit"] == "clean"
    assert any(f"({len(taken)} vehicles in all)" in line for line in summary["warnings"])
    assert summary["arrived"] == 50 - len(taken)


def test_names_and_colours_as_sumo_takes_them(tmp_path: Path) -> None:
    """A configuration with an older ending, in a folder with a blank; a colour of three numbers."""
    folder = tmp_path / "my town"
    folder.mkdir()
    (folder / "t.rou.xml").write_text(
        '<routes><trip id="t" depart="0" from="A0A1" to="C1C2" color="0, 0,1"/></routes>'
    )
    config = folder / "t.sumo.cfg"
    config.write_text(
        f'<sumoConfiguration><net-file value="{Path(GRID).resolve()}"/><route-files value="t.rou.xml"/>'
        '<end value="200"/></sumoConfiguration>'
    )
    summary = simulate(Scenario(network=str(config)), tmp_path / "my out")
    assert (summary["arrived"], summary["audit"]) == (1, "clean")


MORE = (
    '</interval></rerouter><rerouter id="r1" edges="{}"><interval end="1e9"><destProbReroute id="{{first}}"/>'
)
FLOW = '<flow id="f" from="{first}" to="{third}"'
TO_THIRD = '<destProbReroute id="{third}"/>'
CIRCLES = {
    "a lap": ('<route id="r" edges="{lap}"/><flow id="f" route="r"', '<routeProbReroute id="lap"/>', 1),
    "two that hand over": (FLOW, TO_THIRD + MORE.format("{third}"), 1),
    "a draw": (FLOW, f'{TO_THIRD}<destProbReroute id="{{second}}"/>' + MORE.format("{second} {third}"), 0),
    "another destination": (FLOW, '<destProbReroute id="B1C1"/>', None),
}
"""Vehicles, a rerouter, and whether they then circle (1), drive on (0), or arrive (None)."""


@pytest.mark.parametrize("name", CIRCLES)
def test_circles_as_people_make_them(tmp_path: Path, name: str) -> None:
    """What rerouters do is worked out before: a loop, a way without end, another way; `inspect` too."""
    fleet, rerouter, circles = CIRCLES[name]
    edges = SQUARES[0].split()
    words = {"lap": SQUARES[0], "first": edges[0], "second": edges[1], "third": edges[2]}
    rerouter = f'<rerouter id="r0" edges="{{first}}"><interval end="1e9">{rerouter}'
    (tmp_path / "r.add.xml").write_text(
        f'<additional><route id="lap" edges="{SQUARES[0]} {edges[0]}"/>{rerouter.format(**words)}'
        "</interval></rerouter></additional>"
    )
    (tmp_path / "r.rou.xml").write_text(
        f'<routes>{fleet.format(**words)} begin="0" end="60" number="3"/></routes>'
    )
    (tmp_path / "r.sumocfg").write_text(
        f'<configuration><net-file value="{Path(GRID).resolve()}"/><route-files value="r.rou.xml"/>'
        '<additional-files value="r.add.xml"/><end value="200"/></configuration>'
    )
    summary = simulate(Scenario(network=str(tmp_path / "r.sumocfg")), tmp_path / "out")
    assert (summary["vehicles"], summary["audit"], summary["collisions"]) == (3, "clean", 0)
    assert (summary["laps"] > 0) == (circles == 1)
    assert (summary.get("arrived", 0) == 3) == (circles is None)
    if circles == 1:
        assert any("keeps 3 vehicles circling" in line for line in summary["warnings"])
    done = CliRunner().invoke(cli, ["inspect", str(tmp_path / "r.sumocfg")])
    assert (done.exit_code, "r0" in done.output) == (0, True)


def test_no_more_vehicles_than_sumo_lets_in(tmp_path: Path) -> None:
    """`max-num-vehicles` and `scale` hold for gated vehicles, too."""
    (tmp_path / "r.rou.xml").write_text(
        f'<routes><route id="lap" edges="{SQUARES[0]}"/>'
        '<flow id="f" route="lap" begin="0" end="60" number="3"/></routes>'
    )
    for options, number in (("--scale 2", 6), ("--scale 4 --max-num-vehicles 5", 5)):
        scenario = Scenario(network=GRID, routes=str(tmp_path / "r.rou.xml"), sumo=options, duration_s=200)
        summary = simulate(scenario, tmp_path / options)
        assert (summary["departed"] + 1, summary["audit"], summary["collisions"]) == (number, "clean", 0)


def test_one_edge_is_a_trip(tmp_path: Path) -> None:
    """A route of one edge that does not lead to itself."""
    one = tmp_path / "one.rou.xml"
    one.write_text('<routes><vehicle id="v" depart="0"><route edges="A0A1"/></vehicle></routes>')
    assert run(tmp_path / "one", one)["arrived"] == 1


@pytest.mark.parametrize("gate", ["certified", "open"])
def test_ordinary_trips_between_junctions_drive(tmp_path: Path, gate: str) -> None:
    """SUMO leads those that no gate can drive, and has to know junctions for that."""
    routes = tmp_path / "t.rou.xml"
    routes.write_text(
        '<routes><trip id="odd" depart="0" fromJunction="A0" toJunction="A2">'
        '<stop edge="A1A2" speed="9" endPos="9"/></trip>'
        '<trip id="t" depart="0" fromJunction="B0" toJunction="B2"/></routes>'
    )
    found = run(tmp_path / "out", routes, duration_s=60, gate=gate)
    assert found["arrived"] == (1 if gate == "certified" else 2)
