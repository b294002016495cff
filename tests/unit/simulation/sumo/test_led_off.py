"""What in additional files leads vehicles off their loops is refused by name."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast
from xml.etree import ElementTree as ET

import pytest

from loopgate.errors import RouteError, ScenarioError
from loopgate.network.circling import Led
from loopgate.network.incidents import Closure
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.sumo.devices import (
    closures_of,
    for_others,
    leading_devices,
    led_off,
    refuse_what_leads_off,
)

LOOP: Any = SimpleNamespace(id="loop3", edges=("a", "b"))


def refuse(folder: Path, text: str) -> None:
    """Write an additional file, and look at it."""
    file = folder / "x.add.xml"
    file.write_text(f"<additional>{text}</additional>")
    refuse_what_leads_off([file], [LOOP])


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('<rerouter id="r"><i><closingReroute id="{}"/></i></rerouter>', "closes a"),
        (
            '<rerouter id="r"><i><closingLaneReroute id="{}_1"/></i></rerouter>',
            "--avoid",
        ),
        ('<calibrator id="r" edge="{}"/>', "takes vehicles out on a, which is on loop loop3"),
        ('<calibrator id="r" lane="{}_0"/>', "takes vehicles out"),
    ],
)
def test_what_leads_off_loops_is_refused(tmp_path: Path, text: str, says: str) -> None:
    """On roads of loops; elsewhere it is not."""
    refuse(tmp_path, text.format("d"))
    with pytest.raises(ScenarioError, match=f" r .*{says}"):
        refuse(tmp_path, text.format("a"))


@pytest.mark.parametrize(
    ("closed", "classes", "found"),
    [
        ('<closingReroute id="a"/>', ("passenger",), Closure("a", "", 60.0, 3600.0)),
        ('<closingLaneReroute id="a_1"/>', ("passenger",), Closure("a", "a_1", 60.0, 3601.0)),
        ('<closingReroute id="a" disallow="all"/>', ("passenger", "bus"), Closure("a", "", 60.0, 3600.0)),
        ('<closingReroute id="a" allow="bus authority"/>', ("passenger",), Closure("a", "", 60.0, 3600.0)),
        ('<closingReroute id="a" allow="bus"/>', ("passenger", "bus"), None),  # to some of them only
        ('<closingReroute id="a" disallow="truck"/>', ("passenger",), None),
        ('<closingReroute id="a"/>', ("authority",), None),
        ('<closingReroute id="d"/>', ("passenger",), None),  # on no loop
    ],
)
def test_a_road_that_a_rerouter_closes_is_a_closure(
    tmp_path: Path, closed: str, classes: tuple[str, ...], found: Closure | None
) -> None:
    """If it is closed to all gated vehicles on loops over it; then it is not refused."""
    file = tmp_path / "x.add.xml"
    times = 'begin="60" end="1:00:00"'
    file.write_text(
        f'<additional><rerouter id="r"><interval {times}>{closed}</interval></rerouter></additional>'
    )
    gated: list[Any] = [SimpleNamespace(loop=LOOP, type=SimpleNamespace(vclass=one)) for one in classes]
    closures = closures_of([file], gated)
    assert closures == (() if found is None else (found,))
    if found is not None:
        refuse_what_leads_off([file], [LOOP], closures)


def test_a_lane_is_closed_until_sumo_takes_routes_over_it(tmp_path: Path) -> None:
    """It opens a lane in the step after; and does nothing at a time between two steps."""
    file = tmp_path / "x.add.xml"
    gated: list[Any] = [SimpleNamespace(loop=LOOP, type=SimpleNamespace(vclass="bus"))]
    text = (
        '<additional><rerouter id="r"><interval begin="60" end="90.5"><closingLaneReroute id="a_1"/>'
        "</interval></rerouter></additional>"
    )
    file.write_text(text)
    (found,) = closures_of([file], gated, 0.5)
    assert found == Closure("a", "a_1", 60.0, 91.0)
    with pytest.raises(RouteError, match=r"x\.add\.xml: interval that closes a_1: end 90\.5 is between two"):
        closures_of([file], gated, 1.0)


@pytest.mark.parametrize(
    "text",
    [
        '<rerouter id="r" edges="a" vTypes="t"><interval><routeProbReroute id="x"/></interval></rerouter>',
        '<rerouter id="r" edges="a"><interval><routeProbReroute id="x"/></interval></rerouter>',
        '<rerouter id="r" edges="a"><interval><parkingAreaReroute id="p"/></interval></rerouter>',
        '<calibrator id="r" edge="a" vTypes="t"/>',
    ],
)
def test_what_is_for_others_is_taken(tmp_path: Path, text: str) -> None:
    """For types of their own, or for those that want to park."""
    refuse(tmp_path, text)


@pytest.mark.parametrize("share", ["0.5", "1"])
@pytest.mark.parametrize(
    ("changed", "said"), [({}, False), ({"stops": ("s",)}, True), ({"attributes": {"via": "b"}}, True)]
)
def test_it_is_said_who_loses_the_rerouting_device(share: str, changed: dict[str, Any], said: bool) -> None:  # noqa: FBT001
    """Not of trips that loopgate reroutes, whether all have the device or a share of them."""
    known = {"loop": SimpleNamespace(closed=False), "type": SimpleNamespace(parameters={})}
    trip = SimpleNamespace(id="t", **known, **{"stops": (), "attributes": {}, "parameters": {}, **changed})
    scenario = Scenario(network="x.net.xml", sumo=f"--device.rerouting.probability {share}")
    devices, warnings = leading_devices(scenario, [cast("Any", trip)])
    assert devices == ("rerouting",)
    assert bool(warnings) == said


@pytest.mark.parametrize(
    ("rerouter", "types"),
    [
        ('edges="a"><i><routeProbReroute id="lap"/></i>', "car truck"),
        ('edges="a" vTypes="car bus"><i><destProbReroute id="b"/></i>', "car"),
        ('edges="a" vTypes="bus"><i><destProbReroute id="b"/></i>', ""),
        ('edges="a"><i><viaProbReroute id="b"/></i>', "car truck"),
        ('edges="a"><i><closingReroute id="b"/></i>', None),
    ],
)
def test_a_rerouter_acts_on_ordinary_vehicles_only(rerouter: str, types: str | None) -> None:
    """If it leads vehicles; without such vehicles it goes."""
    element = ET.fromstring(f'<rerouter id="r" {rerouter}</rerouter>')
    assert for_others(element, {"truck", "car"}) == (types != "")
    assert element.get("vTypes") == types


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ('edges="b"><i><destProbReroute id="x"/></i>', ""),
        ('edges="a"><i><closingReroute id="b"/></i>', "closes b on its way"),
        ('edges="a,c"><i><closingLaneReroute id="b_1"/></i>', "closes b on its way"),
        ('edges="b"><i><closingReroute id="a"/></i>', ""),
        ('edges="a"><i><closingReroute id="c"/></i>', ""),
        ('edges="a" vTypes="u"><i><closingReroute id="b"/></i>', ""),
        ('edges="before"><i><closingReroute id="b"/></i>', ""),
    ],
)
def test_trips_that_sumo_leads_off_are_told(tmp_path: Path, text: str, why: str) -> None:
    """By name, with the rerouter; those on loops are none of them."""
    file = tmp_path / "x.add.xml"
    file.write_text(f'<additional><rerouter id="r" {text}</rerouter></additional>')
    way = {"edges": ("before", "a", "b")}
    trip: Any = SimpleNamespace(
        id="v", edge=1, led=Led(), loop=SimpleNamespace(closed=False, **way), type=SimpleNamespace(id="t")
    )
    loop: Any = SimpleNamespace(id="w", edge=1, loop=SimpleNamespace(closed=True, **way), type=trip.type)
    found = led_off([file], [trip, loop])
    assert list(found) == (["v"] if why else [])
    assert found.get("v", "").startswith(f"rerouter r {why}" if why else "")
    trip.led = Led(("r",), unknown="rerouter r at a: it waits")
    assert led_off([file], [trip])["v"].startswith("rerouter r at a: it waits")
