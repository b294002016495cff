"""Trips, flows and routes that do not close, as a route file has them."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from loopgate.errors import NobodyGatedError, RouteError
from loopgate.network import RoadNetwork, read_loops
from loopgate.network.trips import _Course, _reasons, lead_trips

GRID = "networks/grid5-priority.net.xml"


@pytest.fixture(scope="module")
def grid() -> RoadNetwork:
    return RoadNetwork.open(GRID)


def file(folder: Path, text: str) -> Path:
    path = folder / "t.rou.xml"
    path.write_text(f"<routes>{text}</routes>", encoding="utf-8")
    return path


def test_trips_are_led_by_the_quickest_way(grid: RoadNetwork, tmp_path: Path) -> None:
    """Trips and flows between edges get routes; departures may come in any order."""
    text = (
        '<trip id="b" depart="20" from="A0A1" to="A2A3"/><trip id="a" depart="5" from="A0A1" to="A1A2"/>'
        '<flow id="f" begin="0" end="60" period="20" from="B0B1" to="B1B2"/>'
    )
    found = read_loops(grid, file(tmp_path, text), once=True)
    ways = {loop.id: loop.edges for loop in found.loops}
    assert ways["b"] == ("A0A1", "A1A2", "A2A3")
    assert ways["a"] == ("A0A1", "A1A2")
    assert all(vehicle.once for vehicle in found.vehicles)
    assert found.first_s == 0.0
    flow = next(vehicle for vehicle in found.vehicles if vehicle.id == "f")
    assert [one.depart_s for one in flow.each(10.0, 100.0, 1)] == [20.0, 40.0]


def test_who_departs_outside_of_the_run_does_not(grid: RoadNetwork, tmp_path: Path) -> None:
    """As SUMO has it: a run that begins later leaves out who departed before."""
    found = read_loops(grid, file(tmp_path, '<trip id="a" depart="5" from="A0A1" to="A1A2"/>'), once=True)
    for times, departs in {(0, 60): 1, (6, 60): 0, (0, 5): 0}.items():
        assert len(list(found.vehicles[0].each(*times, 1))) == departs


def test_routes_with_repeat_are_loops_among_them(grid: RoadNetwork, tmp_path: Path) -> None:
    """Where some drive once all do, but those whose route SUMO would repeat."""
    square = "A0A1 A1B1 B1B0 B0A0"
    text = (
        f'<vehicle id="round" depart="0"><route edges="{square}" repeat="10"/></vehicle>'
        f'<vehicle id="once" depart="0"><route edges="{square}"/></vehicle>'
        '<vehicle id="open" depart="0"><route edges="A0A1 A1A2"/></vehicle>'
    )
    found = read_loops(grid, file(tmp_path, text), once=True)
    assert {v.id: v.once for v in found.vehicles} == {"round": False, "once": True, "open": True}
    assert {loop.id: loop.closed for loop in found.loops} == {"round": True, "once": False, "open": False}


def test_files_of_loops_are_read_as_ever(grid: RoadNetwork, tmp_path: Path) -> None:
    """If all routes close they are loops, with or without repeat."""
    text = '<vehicle id="a" depart="0"><route edges="A0A1 A1B1 B1B0 B0A0"/></vehicle>'
    assert read_loops(grid, file(tmp_path, text), once=True).loops[0].closed


def test_who_finds_no_way_is_told(grid: RoadNetwork, tmp_path: Path) -> None:
    """Those are left out, with a count: SUMO's router writes down routes that are none."""
    text = '<trip id="a" depart="0" from="A0A1" to="A1B1"/><trip id="t" depart="0" from="A0A1" to="A1A2"/>'
    closed = grid.without(["A1A2"])
    found = read_loops(closed, file(tmp_path, text), once=True)
    assert [vehicle.id for vehicle in found.vehicles] == ["a"]
    assert any("1 vehicle left out for want of a way, first t" in line for line in found.left_out)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        (
            '<trip id="t" depart="0" from="A0A1" to="nowhere"/>',
            "trip t: to is 'nowhere', which is no edge",
        ),
        ('<trip id="t" depart="0"/>', "trip t: it has neither a route nor from and to"),
        ('<trip id="t" depart="soon" from="A0A1" to="A1A2"/>', "trip t: depart is 'soon'"),
        (
            '<trip id="t" depart="0" fromTaz="zq" to="A1A2"/>',
            "trip t: fromTaz is 'zq', which is no district of",
        ),
        ('<flow id="t" number="2" from="A0A1" toTaz="zz"/>', "flow t: toTaz is 'zz', .* or by --stops"),
        ('<trip id="t" depart="0" from="A0A1" toJunction="Q"/>', "trip t: toJunction is 'Q', .*no junction"),
        (
            '<trip id="t" depart="0" from="A0A1" viaJunctions="A1 Q" to="A2A3"/>',
            "trip t: viaJunctions is 'Q', which is no junction of",
        ),
        ('<trip id="t" depart="0" fromXY="-9e3,0" to="A1A2"/>', "trip t: fromXY is '-9e3,0', at which SUMO"),
        (
            '<trip id="t" depart="0" from="A0A1" viaXY="0,50 -9e3,0" to="A1A2"/>',
            "trip t: viaXY is '-9e3,0', at which SUMO finds no edge of",
        ),
    ],
)
def test_bad_trips(grid: RoadNetwork, tmp_path: Path, text: str, found: str) -> None:
    """One line that names file, trip and what is wrong."""
    with pytest.raises(RouteError, match=found) as error:
        read_loops(grid, file(tmp_path, text), once=True)
    assert "\n" not in str(error.value)


def test_flows_of_a_drawn_type_without_a_way_for_one_class_go_on_without_it(tmp_path: Path) -> None:
    """Who is drawn to be of that class is left out, and that is said; the others drive."""
    text = (
        '<vType id="car"/><vType id="tram" vClass="tram"/><vTypeDistribution id="d" vTypes="car tram"/>'
        '<flow id="f" type="d" begin="0" end="40" period="1" from="A0A1" to="A1A2"/>'
    )
    network = tmp_path / "n.net.xml"
    lane = '<lane id="A1A2_0" index="0"'
    source = Path(GRID).read_text(encoding="utf-8")
    network.write_text(source.replace(lane, f'{lane} disallow="tram"'), encoding="utf-8")
    found = read_loops(RoadNetwork.open(network), file(tmp_path, text), once=True)
    assert any("1 trips or flows find no way for all classes of" in line for line in found.left_out)
    some = list(found.vehicles[0].each(0.0, 40.0, 1))
    assert {one.type.id for one in some} == {"car"}
    assert 10 < len(some) < 30


BESIDE = """<additional>
    <rerouter id="r" edges="A0A1"><interval end="1e9"><destProbReroute id="A1A2"/></interval></rerouter>
    <calibrator id="c" edge="A0A1" pos="0" output="c.xml"><flow begin="0" end="9" route="q"/></calibrator>
    <route id="q" edges="A0A1 A1A2"/>
    <variableSpeedSign id="s" lanes="A0A1_0"><step speed="5"/></variableSpeedSign>
    <laneAreaDetector id="d" lane="nowhere_0" period="9" file="d.xml"/>
    <busStop id="stop" lane="A2A3_0" startPos="10" endPos="9999"><access edge="none"/></busStop>
    <tazs><taz id="west"><tazSource id="A0A1" weight="1"/></taz><taz id="east" edges="A2A3"/></tazs>
</additional>"""


def test_the_router_is_given_only_what_leads_a_way(grid: RoadNetwork, tmp_path: Path) -> None:
    """It reads rerouters, calibrators and detectors by other rules than SUMO."""
    beside = tmp_path / "b.add.xml"
    beside.write_text(BESIDE)
    text = (
        '<trip id="t" depart="0" from="A0A1" to="A1A2"/>'
        '<trip id="d" depart="0" fromTaz="west" toTaz="east"/>'
        '<trip id="b" depart="0" from="A0A1" to="A3A4"><stop busStop="stop" duration="5"/></trip>'
    )
    found = read_loops(grid, file(tmp_path, text), stops=[beside], once=True)
    ways = {loop.id: loop.edges for loop in found.loops}
    assert ways["t"] == ("A0A1", "A1A2")
    assert ways["d"] == ("A0A1", "A1A2")
    assert ways["b"] == ("A0A1", "A1A2", "A2A3", "A3A4")
    assert [v.led.unknown for v in found.vehicles][-1] == "rerouter r at A0A1: its way misses stops"


def test_all_that_the_router_says_is_said(grid: RoadNetwork) -> None:
    """Its last lines often say more than its first; where it says nothing, how it ended."""
    top = ET.fromstring(
        '<routes><vType id="k" accel="x"/><trip id="t" type="k" from="A0A1" to="A1A2"/></routes>'
    )
    with pytest.raises(RouteError, match=r"^t: SUMO's duarouter does not lead the trips: .*accel"):
        lead_trips(grid, [(Path("t"), top[1])], [top[0]], [], classes={})
    assert _reasons("Error: a\nb\nError: a\nQuitting (on error).\n", 1) == "a; b"
    assert _reasons("Loading net ... done\n", -11) == "it ended by signal 11 and said nothing"


def test_what_the_router_refuses_is_told_with_the_file(grid: RoadNetwork, tmp_path: Path) -> None:
    """Here: positions on the globe, where the network has none."""
    trip = '<trip id="t" depart="0" from="A0A1" toLonLat="1,2"/>'
    with pytest.raises(
        RouteError, match=r"t\.rou\.xml: SUMO's duarouter does not lead the trips: Cannot conv"
    ):
        read_loops(grid, file(tmp_path, trip), once=True)


@pytest.mark.parametrize("place", ["x", "1,2,3,4", "nan,1", "9e9,9e9"])
def test_a_position_at_which_no_edge_is_names_its_trip(grid: RoadNetwork, tmp_path: Path, place: str) -> None:
    """Also if it is no position at all."""
    trip = f'<trip id="t" depart="0" from="A0A1" toXY="{place}"/>'
    with pytest.raises(RouteError, match=rf"t\.rou\.xml: trip t: toXY is '{place}', at which SUMO finds no"):
        read_loops(grid, file(tmp_path, trip), once=True)


def test_trips_between_junctions_are_led_over_all_that_they_name(grid: RoadNetwork, tmp_path: Path) -> None:
    """The ways are those of SUMO with its option `junction-taz`."""
    text = (
        '<trip id="ends" depart="0" fromJunction="A0" toJunction="A2"/>'
        '<trip id="mid" depart="0" fromJunction="B1" viaJunctions="C1 C2" to="C3D3"/>'
        '<trip id="as" depart="0" fromTaz="A0" to="A1A2"/>'
        '<flow id="f" begin="0" end="9" number="2" fromJunction="A0" toJunction="A2"/>'
    )
    found = read_loops(grid, file(tmp_path, text), once=True)
    ways = {loop.id: loop.edges for loop in found.loops}
    assert ways == {
        "ends": ("A0A1", "A1A2"),
        "mid": ("B1C1", "C1C2", "C2C3", "C3D3"),
        "as": ("A0A1", "A1A2"),
        "f": ("A0A1", "A1A2"),
    }
    assert not found.left_out


def test_of_several_words_for_one_end_sumos_holds(grid: RoadNetwork, tmp_path: Path) -> None:
    """Files of other tools name districts beside edges, and come without them."""
    text = (
        '<trip id="a" depart="0" from="A0A1" fromTaz="gone" to="A1A2" toTaz="gone"/>'
        '<trip id="b" depart="0" from="A0A1" via="nowhere" viaJunctions="A2" to="A3A4"/>'
        '<trip id="c" depart="0" from="nowhere" fromXY="0,50" to="A1A2"/>'
        '<trip id="d" depart="0" from="A0A1 A1A2" to="A2A3 A3A4"/>'
    )
    found = read_loops(grid, file(tmp_path, text), once=True)
    ways = {loop.id: loop.edges for loop in found.loops}
    assert ways["a"] == ("A0A1", "A1A2")
    assert ways["b"] == ways["d"] == ("A0A1", "A1A2", "A2A3", "A3A4")
    assert ways["c"][-1] == "A1A2"


def test_a_way_without_its_beginning_is_none(grid: RoadNetwork, tmp_path: Path) -> None:
    """SUMO's router skips a district that nobody leaves, and writes the rest of the way."""
    beside = tmp_path / "b.add.xml"
    beside.write_text('<additional><taz id="in"><tazSink id="A1A2" weight="1"/></taz></additional>')
    lost = '<trip id="t" depart="0" fromTaz="in" to="A1A2"/>'
    text = f'{lost}<trip id="u" depart="0" from="A0A1" toTaz="in"/>'
    found = read_loops(grid, file(tmp_path, text), stops=[beside], once=True)
    assert [vehicle.id for vehicle in found.vehicles] == ["u"]
    assert any("1 vehicle left out for want of a way, first t" in line for line in found.left_out)
    with pytest.raises(RouteError, match=r"no vehicle finds a way between its ends, first t; correct"):
        read_loops(grid, file(tmp_path, lost), stops=[beside], once=True)


@pytest.mark.parametrize(
    ("way", "holds"),
    [("a b c", True), ("b c", False), ("a b", False), ("a c", False), ("a b x b c", True), ("", False)],
)
def test_a_way_passes_what_was_asked_for(way: str, *, holds: bool) -> None:
    """From the first point over each further one to the last."""
    course = _Course((frozenset("a"), frozenset("b"), frozenset("c")), begins=True, ends=True)
    assert course.holds(way.split()) is holds


def test_points_come_in_their_order() -> None:
    """Also where nothing says how the way begins and ends; one edge may be two of them."""
    course = _Course((frozenset("bx"), frozenset("xc")))
    assert course.holds(list("abcd"))
    assert course.holds(["x"])
    assert not course.holds(list("acbd"))


def test_flows_of_no_vehicles_are_left_out(grid: RoadNetwork, tmp_path: Path) -> None:
    """As SUMO does it; where they are all, no vehicle is gated."""
    none = '<flow id="v" begin="5" number="0" end="50" from="A0A1" to="A1A2"/>'
    found = read_loops(
        grid, file(tmp_path, f'{none}<trip id="t" depart="0" from="A0A1" to="A1A2"/>'), once=True
    )
    assert [vehicle.id for vehicle in found.vehicles] == ["t"]
    assert any(line.endswith("1 flow left out, as number is 0, first v") for line in found.left_out)
    with pytest.raises(NobodyGatedError, match="number of each flow is 0"):
        read_loops(grid, file(tmp_path, none), once=True)


HERE, THERE = (f'<stop lane="{lane}" endPos="40" duration="5"/>' for lane in ("A0A1_0", "A2A3_0"))


@pytest.mark.parametrize(
    ("said", "stops", "found"),
    [
        ("", HERE.replace("A0A1", "B0B1"), "vehicle u: the stop at B0B1_0 is on edge B0B1, .*not on route u"),
        (
            "",
            THERE + HERE,
            "vehicle u: on its route the stop at A0A1_0 lies behind the stop written before it",
        ),
        ("", THERE + THERE.replace("40", "20"), "A2A3_0 lies behind the stop written before it"),
        ('departEdge="1"', HERE, "the stop at A0A1_0 lies behind the departure"),
        ('departPos="60"', HERE, "the stop at A0A1_0 lies behind the departure"),
    ],
)
def test_stops_that_are_not_ahead_are_refused(
    grid: RoadNetwork, tmp_path: Path, said: str, stops: str, found: str
) -> None:
    """SUMO refuses them, too; on a loop each comes in every round."""
    route = '<route edges="A0A1 A1A2 A2A3"/>'
    text = f'<vehicle id="u" depart="9" {said}>{route}{stops}</vehicle>'
    with pytest.raises(RouteError, match=found):
        read_loops(grid, file(tmp_path, text), once=True)


def test_stops_are_ahead_by_index_and_on_a_later_pass(grid: RoadNetwork, tmp_path: Path) -> None:
    """As in SUMO, which sorts in a stop with `index`."""
    route = '<route edges="A0A1 A1A2 A2A3"/>'
    again = '<route edges="A0A1 A1B1 B1B0 B0A0 A0A1 A1A2"/>'
    fit = HERE.replace("<stop", '<stop index="fit"')
    text = (
        f'<vehicle id="u" depart="9">{route}{THERE}{fit}</vehicle>'
        f'<vehicle id="v" depart="9">{again}{HERE.replace("A0A1", "B1B0")}{HERE}</vehicle>'
    )
    u, v = read_loops(grid, file(tmp_path, text), once=True).vehicles
    assert [stop.edge for stop in u.stops] == ["A0A1", "A2A3"]
    assert [stop.edge for stop in v.stops] == ["B1B0", "A0A1"]
    assert v.stops[1].arc_m > v.stops[0].arc_m


def test_stops_that_sumo_is_told_to_leave_out_make_ordinary_traffic(tmp_path: Path) -> None:
    """With `ignore-route-errors` SUMO drives the vehicle without the stop."""
    route = '<route edges="A0A1 A1A2 A2A3"/>'
    file(
        tmp_path,
        f'<vehicle id="u" depart="9">{route}{THERE}{HERE}</vehicle>'
        '<trip id="t" depart="9" from="A0A1" to="A1A2"/>',
    )
    config = tmp_path / "t.sumocfg"
    config.write_text(
        f'<configuration><net-file value="{Path(GRID).resolve()}"/><route-files value="t.rou.xml"/>'
        '<ignore-route-errors value="true"/></configuration>'
    )
    found = read_loops(RoadNetwork.open(GRID), config, once=True)
    assert [(one.id, one.why[:12]) for one in found.ungated.vehicles] == [("u", "on its route")]


def test_the_stops_of_a_route_that_nobody_drives_stop_nothing(grid: RoadNetwork, tmp_path: Path) -> None:
    """SUMO reads such a route; a warning names it."""
    text = (
        f'<route id="r" edges="A0A1 A1A2 A2A3">{THERE}{HERE}</route>'
        '<trip id="t" depart="0" from="A0A1" to="A1A2"/>'
    )
    found = read_loops(grid, file(tmp_path, text), once=True)
    assert any("route r: on its route" in line and "left out" in line for line in found.left_out)
    assert not found.stops
    driven = text + '<vehicle id="u" depart="9" route="r"/>'
    with pytest.raises(RouteError, match="vehicle u: on its route the stop at A0A1_0"):
        read_loops(grid, file(tmp_path, driven), once=True)
