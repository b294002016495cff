"""Vehicles of trip files that no gate can drive: taken out, and handed to SUMO as they are."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from loopgate import Scenario
from loopgate.errors import LoopgateError, NobodyGatedError
from loopgate.network import RoadNetwork, read_loops
from loopgate.simulation.assembly import assemble
from loopgate.simulation.positions import make_layout
from loopgate.simulation.sumo.input import write_ordinary

GRID = "networks/grid5-priority.net.xml"
WAY = 'from="A0A1" to="A2A3"'
PASSING = '<route id="r" edges="A0A1 A1A2"><stop edge="A1A2" speed="9"/></route>'
SPREAD = f'<routeDistribution id="s">{PASSING}</routeDistribution>'
PLAIN = f'<trip id="plain" depart="5" {WAY}/>'


def file(folder: Path, text: str) -> str:
    """Write a route file."""
    path = folder / "t.rou.xml"
    path.write_text(f"<routes>{text}</routes>", encoding="utf-8")
    return str(path)


def trip(name: str, stop: str) -> str:
    """Return a trip with a stop on its way."""
    return f'<trip id="{name}" depart="9" {WAY}><stop {stop}/></trip>'


@pytest.mark.parametrize(
    ("odd", "why"),
    [
        (trip("odd", 'edge="A1A2" speed="9"'), "stop with speed '9': a point to pass at a speed is no stop"),
        (trip("odd", 'lane="A1A2_0" jump="7" duration="5"'), "stop with jump '7': a vehicle that jumps"),
        (trip("odd", 'lane="A1A2_0" split="x" duration="5"'), "stop with split 'x'"),
        (f'<trip id="odd" depart="triggered" {WAY}/>', "depart is triggered"),
        (f'{PASSING}<vehicle id="odd" depart="9" route="r"/>', "stop with speed '9'"),
        (f'{SPREAD}<flow id="odd" begin="9" number="2" route="s"/>', "stop with speed '9'"),
        ('<vType id="k" tau="0.1"/><trip id="odd" depart="9" type="k" ' + WAY + "/>", "vType k: tau 0.1"),
        (trip("odd", 'lane="A1A2_0" endPos="-0.1" startPos="-0.3" duration="5"'), "beyond the line of place"),
        (trip("odd", 'lane="A1A2_0" endPos="3" duration="5"'), "reach back out of place"),
    ],
)
def test_a_trip_that_no_gate_can_drive_is_ordinary_traffic(tmp_path: Path, odd: str, why: str) -> None:
    """It alone; one warning names it, with the reason."""
    routes = file(tmp_path, PLAIN + odd + trip("fine", 'lane="A1A2_0" endPos="50" duration="5"'))
    made = assemble(Scenario(network=GRID, routes=routes, duration_s=60))
    make_layout(made, 1.0)
    assert sorted(made.names) == ["fine", "plain"]
    assert made.others == ("odd",)
    (said,) = [line for line in made.warnings if "in ordinary traffic" in line]
    assert "odd: " in said
    assert why in said


def test_they_are_named_by_kind_of_reason(tmp_path: Path) -> None:
    """In one line for each kind, with their number; names and figures make no kind."""
    odd = trip("a", 'edge="A1A2" speed="9"') + trip("b", 'edge="A1A2" speed="9"')
    odd += trip("c", 'lane="A1A2_0" endPos="3" duration="5"')
    odd += trip("d", 'lane="A1A2_0" endPos="4" duration="5"')
    made = assemble(Scenario(network=GRID, routes=file(tmp_path, PLAIN + odd), duration_s=60))
    speed, back = [line for line in made.warnings if "in ordinary traffic" in line]
    assert "2 vehicles in ordinary traffic (a flow counts once), a, b: first a: stop with speed '9'" in speed
    assert "2 vehicles in ordinary traffic (a flow counts once), c, d: first c: the stop at A1A2_0" in back


def test_vehicles_on_loops_are_ordinary_too(tmp_path: Path) -> None:
    """If they cannot make their stops; attributes that no gate knows refuse them all in one message."""
    ring = '<route edges="A0A1 A1B1 B1B0 B0A0"/>'
    text = "".join(
        f'<vehicle id="{name}" depart="0">{ring}<stop lane="A1B1_0" endPos="{end}" duration="5"/></vehicle>'
        for name, end in (("a", 3), ("b", 3), ("c", 50))
    )
    made = assemble(Scenario(network=GRID, routes=file(tmp_path, text), duration_s=60))
    assert (made.names, made.others) == (("c",), ("a", "b"))
    assert any("2 vehicles in ordinary traffic" in line for line in made.warnings)
    write_ordinary(made.ordinary, tmp_path / "o.rou.xml")
    route = ET.parse(tmp_path / "o.rou.xml").getroot().findall("vehicle/route")[0]
    assert (route.get("repeat"), len(route.findall("stop"))) == ("1000", 1)


def test_they_drive_round_with_stops_that_no_gate_makes(tmp_path: Path) -> None:
    """SUMO is told to repeat the round, with the stops of route and vehicle in it; shared routes stay."""
    shared = '<route id="r" edges="A0A1 A1B1 B1B0 B0A0 A0A1"/>'
    odd = '<vehicle id="odd" route="r" depart="3"><stop edge="A1B1" speed="9" endPos="50"/></vehicle>'
    fine = '<vehicle id="fine" route="r" depart="0"/>'
    made = assemble(Scenario(network=GRID, routes=file(tmp_path, shared + odd + fine), duration_s=60))
    assert (made.names, made.others) == (("fine",), ("odd",))
    write_ordinary(made.ordinary, tmp_path / "o.rou.xml", ungated=made.ungated)
    (vehicle,) = ET.parse(tmp_path / "o.rou.xml").getroot().findall("vehicle")
    (route,) = vehicle
    assert vehicle.attrib == {"id": "odd", "depart": "3"}
    assert route.attrib == {"edges": "A0A1 A1B1 B1B0 B0A0", "repeat": "1000"}
    assert [stop.get("speed") for stop in route] == ["9"]


def test_nobody_else_is_an_error(tmp_path: Path) -> None:
    """A gate without vehicles is no run."""
    with pytest.raises(NobodyGatedError, match="1 vehicle, first odd: depart is triggered"):
        read_loops(
            RoadNetwork.open(GRID), file(tmp_path, f'<trip id="odd" depart="triggered" {WAY}/>'), once=True
        )


def test_nobody_left_after_their_stops_is_an_error(tmp_path: Path) -> None:
    """All who would be gated stop where they cannot."""
    routes = file(tmp_path, trip("odd", 'lane="A1A2_0" endPos="3" duration="5"'))
    with pytest.raises(LoopgateError, match="is gated: 1 vehicle, first odd: the stop at"):
        assemble(Scenario(network=GRID, routes=routes, duration_s=60))


def test_sumo_is_given_them_as_they_are(tmp_path: Path) -> None:
    """With their types and routes, each once, in order of departure; ordinary ones with their stops."""
    text = (
        '<vTypeDistribution id="d"><vType id="k" length="4"/></vTypeDistribution><vType id="u" tau="0.1"/>'
        '<route id="r" edges="A0A1 A1A2"><stop edge="A1A2" speed="9"/></route><route id="s" edges="A0A1"/>'
        '<vehicle id="late" depart="20" route="r" type="d"/>'
        f'<trip id="first" depart="triggered" {WAY} type="k"/>'
        f'<trip id="unsafe" depart="7" {WAY} type="u"><stop lane="A1A2_0" endPos="50" duration="5"/></trip>'
    )
    made = assemble(Scenario(network=GRID, routes=file(tmp_path, PLAIN + text), duration_s=60))
    write_ordinary(made.ordinary, tmp_path / "o.rou.xml", known={"k9"}, ungated=made.ungated)
    top = ET.parse(tmp_path / "o.rou.xml").getroot()
    fleet = [one for one in top if one.tag in {"vehicle", "trip"}]
    assert [one.get("id") for one in fleet] == ["first", "unsafe", "late"]
    assert sorted(str(one.get("id")) for one in top.iter("vType")) == ["k", "u"]
    assert [one.get("id") for one in top.findall("route")] == ["r"]
    (stop,) = fleet[1].findall("stop")
    assert (stop.get("lane"), stop.get("endPos"), stop.get("duration")) == ("A1A2_0", "50", "5")


def test_whom_a_rerouter_leads_elsewhere_is_ordinary_traffic(tmp_path: Path) -> None:
    """If that depends on how long it waits: SUMO may give it another end, of which no gate is told."""
    beside = tmp_path / "r.add.xml"
    beside.write_text(
        '<additional><rerouter id="r" edges="A1A2" timeThreshold="9"><interval end="1e9">'
        '<destProbReroute id="B2B3"/></interval></rerouter></additional>'
    )
    trips = file(tmp_path, PLAIN + '<trip id="elsewhere" depart="7" from="B0B1" to="B2B3"/>')
    config = tmp_path / "c.sumocfg"
    config.write_text(
        f'<configuration><net-file value="{Path(GRID).resolve()}"/><route-files value="{trips}"/>'
        f'<additional-files value="{beside}"/></configuration>'
    )
    made = assemble(Scenario(network=str(config), duration_s=60))
    assert (made.names, made.others) == (("elsewhere",), ("plain",))
    assert any(
        "plain: rerouter r at A1A2: it acts on vehicles that have waited" in line for line in made.warnings
    )


def test_sumo_is_told_to_know_junctions(tmp_path: Path) -> None:
    """Only where a vehicle that it leads itself names some: without, it does not start."""
    stop = '<stop edge="A1A2" speed="9"/>'
    grid = RoadNetwork.open(GRID)
    for ends, options in {'fromJunction="A0" to="A1A2"': ["--junction-taz"], WAY: []}.items():
        text = f'<trip id="odd" depart="9" {ends}>{stop}</trip>{PLAIN}'
        assert read_loops(grid, file(tmp_path, text), once=True).ungated.options == options
