"""Stops and departures of route files: what is read, and what is refused by name."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from roads import roads

from loopgate.errors import NobodyGatedError, RouteError
from loopgate.network import read_loops
from loopgate.network.stops import read_stopping_places, read_stops
from loopgate.network.vehicle_demand import RoutesFile, VehicleDemand

NET = roads(
    {"a": (100, 2), "b": (50, 2), "c": (100, 2)},
    ["a_0>b_0", "a_1>b_1", "b_0>a_0", "b_0>c_0", "b_1>c_1", "c_0>a_0", "c_1>a_1"],
    buses_only=[],
)
OPEN = roads({"a": (100, 1), "b": (50, 1), "c": (100, 1)}, ["a_0>b_0", "b_0>c_0"], buses_only=[])
PLACES = """<additional>
    <busStop id="school" lane="b_0" startPos="20" endPos="-10"/>
    <parkingArea id="yard" lane="a_1" startPos="30" endPos="60" roadsideCapacity="2"/>
    <parkingArea id="kerb" lane="a_1" startPos="30" endPos="60"/>
</additional>"""


def fleet(
    tmp_path: Path, inside: str, *, end_s: float = 1000.0, begin_s: float = 0.0, seed: int = 1
) -> tuple[RoutesFile, list[VehicleDemand]]:
    """Return the file's content, and its vehicles in a run."""
    file, places = tmp_path / "x.rou.xml", tmp_path / "places.add.xml"
    file.write_text(f"<routes>{inside}</routes>", encoding="utf-8")
    places.write_text(PLACES, encoding="utf-8")
    read = read_loops(NET, file, stops=[places])
    return read, [one for v in read.vehicles for one in v.each(begin_s, end_s, seed)]


def test_stops_of_routes_and_vehicles_in_the_order_of_the_loop(tmp_path: Path) -> None:
    """`until` of a route counts from the departure, that of a vehicle from the beginning of the run."""
    read, (v,) = fleet(
        tmp_path,
        '<route id="r" edges="a b c" cycleTime="0:05:00">'
        '<stop busStop="school" until="80" duration="9"/></route>'
        '<vehicle id="v" route="r" depart="0:01:40" line="7">'
        '<stop lane="a_0" startPos="10" endPos="30" until="500" '
        'triggered="person" parking="true" tripId="x"/>'
        "</vehicle>",
    )
    first, second = v.stops
    assert (first.kind, first.start_m, first.end_m, first.arc_m) == ("lane", 10.0, 30.0, 30.0)
    assert (first.until_s, first.triggers, first.parks, first.told) == (
        500.0,
        ("person",),
        True,
        (("tripId", "x"),),
    )
    assert (second.name, second.kind, second.lane, second.end_m, second.arc_m) == (
        "school",
        "busStop",
        "b_0",
        40.0,
        140.0,
    )
    assert (second.until_s, second.duration_s, second.cycle_s, second.parks) == (180.0, 9.0, 300.0, False)
    assert v.depart_s == 100.0
    assert v.attributes == {"line": "7"}
    assert [stop.name for stop in read.stops["r"]] == ["school"]
    assert read.stop_files == (tmp_path / "places.add.xml",)


def test_a_loop_takes_the_lanes_on_which_it_stops(tmp_path: Path) -> None:
    """Else a stop on the second lane would not be on the way."""
    read, (v,) = fleet(
        tmp_path,
        '<route id="r" edges="a b c"/><vehicle id="v" route="r" depart="0">'
        '<stop parkingArea="yard" duration="5"/></vehicle>',
    )
    assert [span.lane for span in read.loops[0].spans] == [1, 1, 1]
    assert (v.stops[0].kind, v.stops[0].parks) == ("parkingArea", True)


@pytest.mark.parametrize(
    ("said", "times"),
    [
        ('begin="10" end="400" period="100"', [10, 110, 210, 310]),
        ('begin="10" end="100" number="3"', [10, 40, 70]),
        ('vehsPerHour="60" number="4"', [0, 60, 120, 180]),
        ('begin="100" number="3"', [100, 400, 700]),
    ],
)
def test_flows_depart_as_in_sumo(tmp_path: Path, said: str, times: list[float]) -> None:
    """The first three were looked up in SUMO's output; without an end they are spread over the run."""
    _, found = fleet(tmp_path, f'<route id="r" edges="a b c"/><flow id="f" route="r" {said}/>')
    assert [one.depart_s for one in found] == times
    assert [one.id for one in found] == [f"f.{k}" for k in range(len(times))]


def test_times_drawn_at_random_follow_the_seed(tmp_path: Path) -> None:
    """About as many as were asked for, and the same ones again."""
    for said in ('probability="0.1"', 'period="exp(0.1)"'):
        text = f'<route id="r" edges="a b c"/><flow id="f" route="r" {said}/>'
        times = [[one.depart_s for one in fleet(tmp_path, text, seed=seed)[1]] for seed in (1, 1, 2)]
        assert times[0] == times[1] != times[2]
        assert 70 < len(times[0]) < 130


def test_stops_of_a_flow_are_later_for_later_vehicles(tmp_path: Path) -> None:
    """Each waits until its own time, as in SUMO."""
    _, found = fleet(
        tmp_path,
        '<route id="r" edges="a b c"/><flow id="f" route="r" begin="10" period="100" number="2">'
        '<stop busStop="school" until="80"/></flow>',
    )
    assert [one.stops[0].until_s for one in found] == [80.0, 180.0]


def test_who_departs_before_the_run_begins_is_there_at_its_beginning(tmp_path: Path) -> None:
    """Closed loops have no beginning that could be missed."""
    _, found = fleet(
        tmp_path, '<route id="r" edges="a b c"/><vehicle id="v" route="r" depart="3"/>', begin_s=50.0
    )
    assert found[0].depart_s == 50.0


@pytest.mark.parametrize(
    ("edges", "stops", "arcs_m"),
    [
        ("a b", ("b_0", "b_0"), None),
        ("a b a b", ("b_0", "b_0"), [150.0]),
        ("a b a b", ("a_0", "b_0", "a_0", "b_0"), [100.0, 150.0]),
        ("a b a b a b", ("a_0", "b_0", "a_0", "b_0", "a_0"), [100.0, 150.0]),
        ("a b c a b", ("b_0", "b_0"), [150.0, 400.0]),
        ("a b c a b", ("b_0", "c_0", "b_0"), [150.0, 250.0, 400.0]),
        ("a b c a b a b c a b", ("b_0",) * 4, [150.0, 400.0]),
    ],
)
def test_the_same_stop_again(
    tmp_path: Path, edges: str, stops: tuple[str, ...], arcs_m: list[float] | None
) -> None:
    """It is made on the next pass of the round; of a route for several rounds, the stops of one count."""
    text = "".join(f'<stop lane="{lane}" duration="3"/>' for lane in stops)
    text = f'<route id="r" edges="{edges}"/><vehicle id="v" route="r" depart="0">{text}</vehicle>'
    if arcs_m is None:
        with pytest.raises(RouteError, match="it stops twice at b_0; once is enough"):
            fleet(tmp_path, text)
    else:
        assert [stop.arc_m for stop in fleet(tmp_path, text)[1][0].stops] == arcs_m


def test_a_trip_stops_twice_at_one_place(tmp_path: Path) -> None:
    """One stop that lasts as long as both; if the first waits for something else too, it is refused."""
    stops = '<stop lane="b_0" {}/><stop lane="b_0" {}/>'
    text = f'<vehicle id="v" depart="0"><route edges="a b c"/>{stops}</vehicle>'
    file = tmp_path / "x.rou.xml"
    for first, second, lasts in (
        ('duration="5"', 'duration="8"', (13.0, None)),
        ('duration="5"', 'until="90"', (5.0, 90.0)),
        ('until="60"', 'duration="8"', (8.0, 68.0)),
        ('until="60" duration="5"', 'duration="8" until="90"', (13.0, 90.0)),
        ('duration="5"', 'duration="8" parking="true"', None),
    ):
        file.write_text(f"<routes>{text.format(first, second)}</routes>")
        if lasts:
            (stop,) = read_loops(OPEN, file, once=True).vehicles[0].stops
            assert (stop.duration_s, stop.until_s) == lasts
        else:
            with pytest.raises(NobodyGatedError, match="it stops twice at b_0, each time in another way"):
                read_loops(OPEN, file, once=True)


def test_a_full_parking_area_from_which_a_rerouter_leads_may_have_no_lots(tmp_path: Path) -> None:
    """SUMO leads vehicles on to the other area; without a rerouter they would stand for good."""
    others = '<parkingAreaReroute id="kerb"/><parkingAreaReroute id="yard"/>'
    rerouter = f'<rerouter id="on" edges="c"><interval>{others}</interval></rerouter>'
    places = tmp_path / "places.add.xml"
    for more, led_on in (("", False), (rerouter, True)):
        places.write_text(PLACES.replace("</additional>", f"{more}</additional>"))
        found = read_stopping_places([places])
        assert [found["parkingArea", name].led_on for name in ("kerb", "yard")] == [led_on, led_on]
        stop = [ET.fromstring('<stop parkingArea="kerb" duration="3"/>')]
        if led_on:
            assert [one.name for one in read_stops(NET, stop, found, what="v")] == ["kerb"]
        else:
            with pytest.raises(RouteError, match="it has no lots"):
                read_stops(NET, stop, found, what="v")


STOP = '<route id="r" edges="a b c"/><vehicle id="v" route="r" depart="0">{}</vehicle>'


@pytest.mark.parametrize(
    ("inside", "found"),
    [
        (STOP.format('<stop busStop="school"/>'), "vehicle v: stop 1: it says neither duration nor until"),
        (STOP.format('<stop busStop="x" duration="3"/>'), "busStop 'x' is in none of the additional files"),
        (STOP.format('<stop busStop="yard" duration="3"/>'), "busStop 'yard': in .* it is a parkingArea"),
        (
            STOP.format('<stop parkingArea="kerb" duration="3"/>'),
            "places.add.xml it has no lots, ",
        ),
        (STOP.format('<stop duration="3"/>'), "it names no place; give busStop"),
        (STOP.format('<stop lane="z_0" duration="3"/>'), "lane 'z_0' is not in the network"),
        (STOP.format('<stop lane="a_0" endPos="300" duration="3"/>'), "to 300 m of lane a_0, which is 100 m"),
        (STOP.format('<stop lane="a_0" endPos="x" duration="3"/>'), "endPos is 'x'; expected metres"),
        (STOP.format('<stop lane="a_0" duration="x"/>'), "duration is 'x'; expected seconds"),
        (STOP.format('<stop lane="a_0" triggered="join"/>'), "triggered is 'join'; expected true, person"),
        (
            STOP.format('<stop lane="a_0" duration="3" parking="x"/>'),
            "parking is 'x'; expected true or false",
        ),
        ('<route id="r" edges="a b"/><vehicle id="v" route="r" depart="x"/>', "depart is 'x'; expected sec"),
        (
            '<route id="r" edges="a b c"/><flow id="f" route="r"/>',
            "flow f: it says neither number nor period",
        ),
        (
            '<route id="r" edges="a b c"/><flow id="f" route="r" period="0"/>',
            "period is '0'; expected a numb",
        ),
        (
            '<route id="r" edges="a b c"/><flow id="f" route="r" period="3" number="3" end="9"/>',
            "it says period, number and end; with the first, SUMO takes one of the others only",
        ),
        ('<route id="r" edges="a b c" cycleTime="x"/>', "route r: cycleTime is 'x'; expected seconds"),
    ],
)
def test_what_makes_no_sense_is_refused_by_name(tmp_path: Path, inside: str, found: str) -> None:
    """Nothing of it reaches SUMO."""
    with pytest.raises(RouteError, match=found):
        fleet(tmp_path, inside)


def test_a_stop_beside_the_loop_is_refused(tmp_path: Path) -> None:
    """With the stop, its road, and what to do."""
    with pytest.raises(RouteError, match=r"stop at c_0 is on edge c, which is not on loop r; lead the route"):
        fleet(
            tmp_path,
            '<route id="r" edges="a b"/><vehicle id="v" route="r" depart="0">'
            '<stop lane="c_0" duration="3"/></vehicle>',
        )


@pytest.mark.parametrize(
    ("said", "lasts_s", "until_s"),
    [
        ('duration="-5"', None, None),
        ('until="-5"', None, None),
        ('duration="-5" triggered="true"', None, None),
        ('duration="-5" until="50"', 0.0, 50.0),
        ('duration="10" until="-5"', 10.0, None),
        ('duration="0"', 0.0, None),
    ],
)
def test_figures_below_0_are_none(
    tmp_path: Path, said: str, lasts_s: float | None, until_s: float | None
) -> None:
    """As in SUMO, one of them has to be a time from 0 on."""
    stop = f'<stop busStop="school" {said}/>'
    text = f'<route id="r" edges="a b c"/><vehicle id="v" depart="0" route="r">{stop}</vehicle>'
    if lasts_s is None:
        with pytest.raises(RouteError, match=r"vehicle v: stop 1: it has (duration|until) '-5'; expected"):
            fleet(tmp_path, text)
        return
    (made,) = fleet(tmp_path, text)[1][0].stops
    assert (made.duration_s, made.until_s) == (lasts_s, until_s)


def test_places_of_two_kinds_may_have_one_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """SUMO looks a stopping place up by kind and name."""
    twin = '<chargingStation id="yard" lane="c_1" startPos="5" endPos="15"/></additional>'
    monkeypatch.setitem(globals(), "PLACES", PLACES.replace("</additional>", twin))
    stops = '<stop parkingArea="yard" duration="5"/><stop chargingStation="yard" duration="5"/>'
    text = f'<route id="r" edges="a b c"/><vehicle id="v" depart="0" route="r">{stops}</vehicle>'
    read, (v,) = fleet(tmp_path, text)
    assert [(stop.kind, stop.lane) for stop in v.stops] == [
        ("parkingArea", "a_1"),
        ("chargingStation", "c_1"),
    ]
    assert read.stop_files == (tmp_path / "places.add.xml",)
    with pytest.raises(RouteError, match=r"busStop 'yard': in .* it is a parkingArea"):
        fleet(tmp_path, text.replace("chargingStation=", "busStop="))
