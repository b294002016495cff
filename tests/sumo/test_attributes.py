"""The page on attributes of route files names each of SUMO's schema, and what it says of them is so."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree as ET

import pytest
import sumo

from loopgate.abstraction.itinerary import Track, rounds
from loopgate.control.start import VehicleStart
from loopgate.errors import LoopgateError, NobodyGatedError, ScenarioError
from loopgate.network import RoadNetwork
from loopgate.network.routes_file import read_loops
from loopgate.network.vehicle_demand import RoutesFile
from loopgate.simulation.settings import check_types
from loopgate.simulation.sumo.input import write_sumo_input

pytestmark = pytest.mark.sumo

ROOT = Path(__file__).parents[2]
XSD = "{http://www.w3.org/2001/XMLSchema}"
SCHEMA = ET.parse(Path(sumo.SUMO_HOME) / "data" / "xsd" / "types" / "route.xsd").getroot()
TYPES = {kind.get("name", ""): kind for kind in SCHEMA.iter(f"{XSD}complexType")}
ELEMENTS = ("route", "routeDistribution", "vehicle", "flow", "trip", "stop", "vType", "vTypeDistribution")

ROUND = "B3B2 B2C2 C2C1 C1D1 D1D0 D0C0 C0C1 C1C2 C2C3 C3B3"
BASE: dict[str, dict[str, str]] = {
    "vType": {"id": "k"},
    "route": {"id": "r", "edges": ROUND},
    "vehicle": {"id": "v", "type": "k", "route": "r", "depart": "0"},
    "flow": {"id": "v", "type": "k", "route": "r", "begin": "0", "number": "2"},
    "trip": {"id": "v", "type": "k", "depart": "0", "from": "B3B2", "to": "C3B3"},
    "stop": {"lane": "B2C2_0", "endPos": "50", "duration": "10"},
    "routeDistribution": {"id": "d"},
    "vTypeDistribution": {"id": "k"},
}
VALUES: dict[str, dict[str, str]] = {
    "": {
        "color": "green",
        "id": "q",
        "type": "other",
        "route": "other",
        "until": "100",
        "begin": "10",
        "period": "20",
    },
    "route": {"edges": "A0A1 A1B1 B1B0 B0A0"},
    "vehicle": {"depart": "20", "departEdge": "2", "departPos": "30"},
    "flow": {"probability": "0.1", "vehsPerHour": "60", "perHour": "60", "number": "3", "end": "90"},
    "stop": {"lane": "C2C1_0", "edge": "C2C1", "endPos": "60", "startPos": "20", "friendlyPos": "true"},
    "vType": {"carFollowModel": "IDM", "vClass": "bus", "speedFactor": "1.1"},
}
VALUES["vTypeDistribution"] = {"vTypes": "other in", "probabilities": "1 2"}
VALUES["routeDistribution"] = {"routes": "other d.0", "probabilities": "1 2"}
VALUES["flow"] |= {"departEdge": "2", "departPos": "30"}
VALUES["stop"] |= {"duration": "7", "parking": "true", "triggered": "person", "containerTriggered": "true"}
PLACES = ("busStop", "trainStop", "parkingArea", "chargingStation", "containerStop")
BAD = {
    "carFollowModel": "W99",
    "tau": "0.1",
    "actionStepLength": "5",
    "minGap": "0.1",
    "jmIgnoreJunctionFoeProb": "0.5",
    "jmDriveAfterRedTime": "3",
    "timeToTeleport": "20",
    "timeToTeleportBidi": "20",
}
"""Of types: what no gate can work with."""


class Row(NamedTuple):
    """A row of the table."""

    element: str
    attributes: tuple[str, ...]
    what: str


def _rows() -> list[Row]:
    page = (ROOT / "docs" / "attributes.md").read_text(encoding="utf-8")
    cells = [line.split("|")[1:4] for line in page.splitlines() if line.startswith("| `<")]
    rows = [
        Row(element.strip(" `<>"), tuple(re.findall(r"`(\w+)`", names)), what.strip())
        for element, names, what in cells
    ]
    return [
        row._replace(attributes=_others(row.element, rows))
        if names.strip() in ("every attribute", _OTHERS)
        else row
        for row, (_, names, _) in zip(rows, cells, strict=True)
    ]


_OTHERS = "every other attribute"


def _others(element: str, rows: list[Row]) -> tuple[str, ...]:
    """Return the attributes of an element that no row names."""
    named = {name for row in rows if row.element == element for name in row.attributes}
    return tuple(sorted(_schema(TYPES[f"{element}Type"]) - named))


def _schema(kind: ET.Element) -> set[str]:
    """Return the attributes of a type of the schema, with those of what it extends."""
    found = {one.get("name", "") for one in kind.iter(f"{XSD}attribute")}
    for base in kind.iter(f"{XSD}extension"):
        found |= _schema(TYPES[base.get("base", "")]) if base.get("base") in TYPES else set()
    return found


ROWS = _rows()


@pytest.mark.parametrize("element", ELEMENTS)
def test_each_attribute_of_the_schema_is_named_once(element: str) -> None:
    """No more and no less."""
    named = [name for row in ROWS if row.element == element for name in row.attributes]
    assert sorted(named) == sorted(_schema(TYPES[f"{element}Type"]))


def _document(element: str, name: str, value: str) -> str:
    said = {key: dict(one) for key, one in BASE.items()}
    if name:
        said[element][name] = value
        if element == "stop" and (name in PLACES or name == "edge"):
            del said["stop"]["lane"]
        if name == "friendlyPos":
            said["stop"]["endPos"] = "500"
    top = ET.Element("routes")
    inside = ET.SubElement(top, element, said[element]) if element.endswith("Distribution") else top
    ET.SubElement(top if element == "routeDistribution" else inside, "vType", said["vType"])
    route = ET.SubElement(inside if element == "routeDistribution" else top, "route", said["route"])
    if element == "routeDistribution":
        del route.attrib["id"]
    if element == "route" and name == "cycleTime":
        ET.SubElement(route, "stop", lane="B2C2_0", endPos="50", until="100")
    ET.SubElement(top, "vType", id="other", color="red")
    ET.SubElement(top, "route", id="other", edges="A0A1 A1B1 B1B0 B0A0")
    rider = ET.SubElement(top, element if element in {"flow", "trip"} else "vehicle")
    rider.attrib.update(said[rider.tag])
    if element in {"route", "routeDistribution"}:
        rider.set("route", said[element]["id"])
    if element == "vType":
        rider.set("type", said[element]["id"])
    if element == "stop":
        ET.SubElement(rider, "stop", said["stop"])
    if element.endswith("Distribution"):
        _spread(top, inside, name)
    return ET.tostring(top, encoding="unicode")


def _spread(top: ET.Element, spread: ET.Element, name: str) -> None:
    """Give a distribution what it can be seen by: shares need names, and its own name another type."""
    of_types = spread.tag == "vTypeDistribution"
    if of_types:
        spread[0].set("id", "in")
    if of_types and name == "id":
        ET.SubElement(top, "vType", id="k", color="blue")
    if name == "probabilities":
        spread.set(*("vTypes", "other in") if of_types else ("routes", "other d.0"))


def _read(folder: Path, element: str, name: str = "", value: str = "") -> RoutesFile:
    where = 'lane="B2C2_0" startPos="20" endPos="45"'
    lots = {"parkingArea": 'roadsideCapacity="1"'}
    places = "".join(f'<{kind} id="{kind}1" {where} {lots.get(kind, "")}/>' for kind in PLACES)
    (folder / "a.add.xml").write_text(f"<additional>{places}</additional>")
    file = folder / "x.rou.xml"
    file.write_text(_document(element, name, value))
    network = RoadNetwork.open(ROOT / "networks" / "grid5-priority.net.xml")
    return read_loops(network, file, stops=[folder / "a.add.xml"])


def _value(element: str, name: str) -> str:
    if name in PLACES:
        return f"{name}1"
    return VALUES.get(element, {}).get(name) or VALUES[""].get(name, "1")


def _said(routes: RoutesFile) -> tuple[Any, ...]:
    """Return what is compared: mappings are not, where they are parts of what is hashed."""
    vehicles = [(v, dict(v.attributes), dict(v.parameters)) for v in routes.vehicles]
    return [loop.id for loop in routes.loops], [loop.edges for loop in routes.loops], vehicles, routes.stops


def _sumo_is_told(folder: Path, element: str, name: str, value: str, routes: RoutesFile) -> bool:
    """Return whether SUMO gets an attribute of the first vehicle as the file has it."""
    vehicle, loop = routes.vehicles[0], routes.loops[0]
    if element == "stop":
        return (name, value) in vehicle.stops[0].told
    track = Track(vehicle.id, loop.id, loop.lap_m, 20.0, 10.0, rounds(loop), ())
    start = VehicleStart(vehicle, track)
    write_sumo_input([start], folder)
    top = ET.parse(folder / "vehicles.add.xml").getroot()
    (found,) = top.iter(element if element == "vType" else "vehicle")
    return found.get(name) == value or (name == "id" and found.get(name, "").startswith(f"{value}@"))


WAYS = {
    "vehicle": {"depart": "0", "route": "r"},
    "trip": {"depart": "0", "from": "A0A1", "to": "B2B3"},
    "flow": {"begin": "0", "end": "100", "number": "3", "from": "A0A1", "to": "B2B3"},
}
"""By element of a vehicle that drives once: what it needs."""
ONCE = {"via": "A1A2", "type": "k", "departEdge": "0", "departPos": "3", "color": "red"}
ONCE |= {"arrivalSpeed": "3", "departSpeed": "3", "departLane": "0", "arrivalLane": "0"}
FOUND = ("from", "to", "via", "period", "vehsPerHour", "perHour", "probability", "route")
"""How attributes begin that make no sense beside those of `WAYS`."""


@pytest.mark.parametrize("element", WAYS)
def test_what_the_page_says_of_vehicles_that_drive_once_is_so(element: str, tmp_path: Path) -> None:
    """Each attribute of the schema has one row, and is told if it is left out, or else SUMO is told."""
    says = {name: row.what for row in ROWS if row.element == "once" for name in row.attributes}
    network = RoadNetwork.open(ROOT / "networks" / "grid5-priority.net.xml")
    assert _schema(TYPES[f"{element}Type"]) <= says.keys()
    for name in _schema(TYPES[f"{element}Type"]) - WAYS[element].keys() - {"id"}:
        if name.startswith(FOUND) and name != "via":
            continue
        given = {"id": "v", **WAYS[element], name: ONCE.get(name, "1")}
        top = ET.Element("routes")
        ET.SubElement(top, "vType", id="k", length="6")
        ET.SubElement(top, "route", id="r", edges="A0A1 A1A2")
        ET.SubElement(top, element, given)
        file = tmp_path / "x.rou.xml"
        file.write_text(ET.tostring(top, encoding="unicode"))
        read = read_loops(network, file, once=True)
        told = [line for line in read.left_out if f": {name} of <{element}> is left out" in line]
        assert bool(told) == (says[name] == "left out"), name
        assert (name in read.vehicles[0].attributes) == (says[name] == "passed on"), name


TRIED = [(row.element, name, row.what) for row in ROWS for name in row.attributes if row.element != "once"]


@pytest.mark.parametrize(("element", "name", "what"), TRIED, ids=[f"{e}-{n}" for e, n, _ in TRIED])
def test_what_the_page_says_is_so(tmp_path: Path, element: str, name: str, what: str) -> None:
    """A route file with that attribute, for each."""
    value = _value(element, name)
    if what.endswith("refused") and element != "vType":
        with pytest.raises(LoopgateError, match=name if element == "stop" else r"no route|no <vType>"):
            _read(tmp_path, element, name, value)
        return
    if what == "ordinary":
        with pytest.raises(NobodyGatedError, match=f"stop with {name}"):
            _read(tmp_path, element, name, value)
        return
    routes = _read(tmp_path, element, name, value)
    left_out = [line for line in routes.left_out if f": {name} of <{element}> is left out" in line]
    assert len(left_out) == (1 if what == "left out" else 0)
    if what == "honoured":
        assert _said(routes) != _said(_read(tmp_path, element))
    if what.startswith("passed on"):
        assert _sumo_is_told(tmp_path, element, name, value, routes)
    if what.endswith("refused"):
        kind = replace(_read(tmp_path, element, name, BAD[name]).vehicles[0].type)
        with pytest.raises(ScenarioError, match=name):
            check_types({kind: 13.9}, step_s=1.0, obeys=True, source="x.rou.xml")
