"""Reads types, routes and vehicles from SUMO's additional files."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree as ET

from loopgate.errors import RouteError
from loopgate.network.vehicle_type import routes_named
from loopgate.network.xml_file import read_xml, write_xml

FLEET = frozenset({"vehicle", "flow", "trip"})
"""Elements that are vehicles."""

PERSONS = frozenset({"person", "personFlow", "container", "containerFlow"})
"""Elements that are persons and containers."""

_TYPES = frozenset({"vType", "vTypeDistribution"})
_ROUTES = frozenset({"route", "routeDistribution"})
"""`_TYPES` and `_ROUTES`: the other elements of route files."""

STOPPING_PLACES = frozenset({"busStop", "trainStop", "parkingArea", "chargingStation", "containerStop"})
"""Elements of additional files at which vehicles stop."""

_ENDS_OF_DISTRICTS = frozenset({"tazSource", "tazSink"})


@dataclass(frozen=True, slots=True)
class District:
    """The edges on which trips begin in a district, and those on which they end in it."""

    sources: frozenset[str]
    sinks: frozenset[str]


_PATHS = ("file", "output", "href", "dest", "imgFile", "osgFile")
"""Attributes with file names, relative to the file that contains them."""

_NO_PATHS = frozenset({"", "-", "nul", "stdout", "stderr"})


def read_additional(file: Path) -> ET.Element:
    """Parse an additional file; its root element may have any name, as in SUMO.

    Raises `RouteError` if it cannot be read, or is a network or a configuration.
    """
    return read_xml(file, root="additional", what="additional file", error=RouteError)


def demand_beside(
    files: Iterable[Path], tops: Sequence[tuple[Path, ET.Element]]
) -> list[tuple[Path, ET.Element]]:
    """Return the types, routes and vehicles of additional files, read as route files.

    Of their routes, only those that a vehicle drives are returned: the others belong to rerouters and the
    like. Without vehicles, all routes are returned.

    Parameters
    ----------
    tops
        The route files that belong to them.
    """
    found = [(file, read_additional(file)) for file in dict.fromkeys(files)]
    vehicles = [one for _, top in (*tops, *found) for one in top if one.tag in FLEET]
    named = {one.get("route", "") for one in vehicles}
    spreads = [one for _, top in (*tops, *found) for one in top.findall("routeDistribution")]
    driven = [one for one in spreads if one.get("id") in named]
    named |= routes_named((*driven, *(one for v in vehicles for one in v.findall("routeDistribution"))))
    demand = []
    for file, top in found:
        mine = ET.Element("routes")
        for one in top:
            is_driven = not vehicles or one.get("id") in named
            if one.tag in FLEET | _TYPES or (one.tag in _ROUTES and is_driven):
                mine.append(one)
        if len(mine):
            demand.append((file, mine))
    return demand


def type_names(files: Iterable[Path]) -> frozenset[str]:
    """Return the types that additional files define, by name."""
    return frozenset(
        one.get("id", "") for file in dict.fromkeys(files) for one in read_additional(file).iter("vType")
    )


def without(file: Path, gone: Callable[[ET.Element], bool], copy: Path) -> Path:
    """Return a copy of an additional file without some of its elements; relative file names still work.

    `gone` may change an element. Return the file itself if it holds for none of them and changes none.

    Raises `RouteError` if it cannot be read,
    `ResultsError` if the copy cannot be written.
    """
    top = read_additional(file)
    before = ET.tostring(top)
    those = [one for one in top if gone(one)]
    if not those and ET.tostring(top) == before:
        return file
    for one in those:
        top.remove(one)
    for element in top.iter():
        for name in (name for name in _PATHS if name in element.attrib):
            element.set(name, _found_anywhere(element.attrib[name], file))
        if element.tag == "param" and element.get("key") == "file":
            element.set("value", _found_anywhere(element.get("value", ""), file))
    write_xml(top, copy)
    return copy


def write_leading(files: Iterable[Path], copy: Path) -> bool:
    """Write the part of additional files that SUMO's router needs: it may refuse the rest.

    The part has districts, with their sources and sinks, and stopping places. Return whether there is any;
    the file is written only then.

    Raises `RouteError` if a file cannot be read, `ResultsError` if the copy cannot be written.
    """
    top = ET.Element("additional")
    for file in dict.fromkeys(files):
        for one in read_additional(file).iter():
            if one.tag == "taz":
                ET.SubElement(top, one.tag, one.attrib).extend(c for c in one if c.tag in _ENDS_OF_DISTRICTS)
            elif one.tag in STOPPING_PLACES and one.get("id") and one.get("lane"):
                ET.SubElement(top, one.tag, {**one.attrib, "friendlyPos": "true"})
    if not len(top):
        return False
    write_xml(top, copy)
    return True


def read_districts(files: Iterable[Path]) -> dict[str, District]:
    """Return the districts (TAZ) of additional files, by name.

    Raises `RouteError` if a file cannot be read.
    """
    found: dict[str, District] = {}
    for file in dict.fromkeys(files):
        for one in read_additional(file).iter("taz"):
            both = one.get("edges", "").split()
            sources, sinks = (
                frozenset([*both, *(end.get("id", "") for end in one.findall(tag))])
                for tag in ("tazSource", "tazSink")
            )
            found[one.get("id", "")] = District(sources, sinks)
    return found


def _found_anywhere(name: str, file: Path) -> str:
    """Return an absolute name for a file that is named relative to another."""
    if name.lower() in _NO_PATHS or ":" in name:  # a port
        return name
    return str(file.resolve().parent / name)
