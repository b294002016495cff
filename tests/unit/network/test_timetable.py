"""A timetable made for loops: vehicles, stops and times."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from loopgate.errors import RouteError
from loopgate.network import RoadNetwork, make_loop
from loopgate.network.timetable import Timetable, timetable_texts, without_stops
from loopgate.network.vehicle_type import DEFAULT_TYPE

NETWORK = RoadNetwork.open(Path(__file__).resolve().parents[3] / "networks/grid5-priority.net.xml")
EDGES = "B2C2", "C2C1", "C1B1", "B1B2"


def test_a_round_takes_as_many_vehicles_as_keep_the_time_between_them() -> None:
    """Four edges of 100 m at 13.89 m/s, driven at two thirds of that, take 43 s; two stops 40 s more."""
    loop = make_loop(NETWORK, "line", EDGES)
    wish = Timetable(("B2C2", "C1B1"), every_s=30.0, first_s=34200.0)
    routes, stops = timetable_texts(NETWORK, [loop], DEFAULT_TYPE, wish)
    route, flow = ET.fromstring(routes)
    assert flow.attrib | {"type": ""} == {
        "id": "line",
        "type": "",
        "route": "line",
        "begin": "34200",
        "period": "30",
        "number": "3",
    }
    assert route.get("cycleTime") == "90"
    first, second = (float(stop.get("until", "")) for stop in route)
    assert 20 < first < 30
    assert second - first == pytest.approx(20 + 1.5 * 200 / 13.89, abs=2)
    assert [stop.get("lane") for stop in ET.fromstring(stops)] == ["B2C2_0", "C1B1_0"]


def test_a_stop_that_no_line_passes_is_told() -> None:
    """With its name, and the way out."""
    with pytest.raises(RouteError, match=r"no loop passes the stop A0A1 .* name it in --via too"):
        timetable_texts(
            NETWORK, [make_loop(NETWORK, "line", EDGES)], DEFAULT_TYPE, Timetable(("A0A1",), 30.0)
        )


def test_lines_without_a_stop_are_found() -> None:
    """Where stops are wished for at all."""
    loops = [make_loop(NETWORK, "line", EDGES), make_loop(NETWORK, "far", ("A0A1", "A1B1", "B1B0", "B0A0"))]
    assert without_stops(NETWORK, loops, Timetable(("B2C2",), 30.0)) == ("far",)
    assert without_stops(NETWORK, loops, Timetable((), 30.0)) == ()
