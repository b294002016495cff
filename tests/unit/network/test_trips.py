"""Trips, flows and routes that do not close, as a route file has them."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from loopgate.errors import RouteError
from loopgate.network import RoadNetwork, read_loops
from loopgate.network.trips import _reasons, lead_trips

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
    with pytest.raises(RouteError, match=r"duarouter does not lead the trips: .*accel"):
        lead_trips(grid, [(Path("t"), top[1])], [top[0]], [], classes={})
    assert _reasons("Error: a\nb\nError: a\nQuitting (on error).\n", 1) == "a; b"
    assert _reasons("Loading net ... done\n", -11) == "it ended by signal 11 and said nothing"


def test_the_router_names_trips_as_the_file_does(grid: RoadNetwork, tmp_path: Path) -> None:
    """Not with the class for which it has led them."""
    with pytest.raises(RouteError, match=r"the id 't' exists"):
        read_loops(grid, file(tmp_path, 2 * '<trip id="t" depart="0" from="A0A1" to="A1A2"/>'), once=True)
