"""Vehicles that drive once, and trips, whose routes SUMO's router finds before a run."""

import importlib.util
import os
import re
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import isfinite
from pathlib import Path
from xml.etree import ElementTree as ET

from loopgate.errors import RouteError
from loopgate.folders import temporary_folder
from loopgate.network.additional import District, read_districts, write_leading
from loopgate.network.clock import as_number, seconds
from loopgate.network.road import RoadNetwork
from loopgate.network.vehicle_type import routes_named
from loopgate.network.xml_file import write_xml
from loopgate.reading import shown

ROUNDS = "1000"
"""SUMO drives a loop this often where no gate drives it: value of ``repeat``."""

ENDS = (
    "from",
    "to",
    "fromJunction",
    "toJunction",
    "fromTaz",
    "toTaz",
    "fromXY",
    "toXY",
    "fromLonLat",
    "toLonLat",
)
"""Attributes with the ends of a trip."""

MIDDLE = ("via", "viaJunctions", "viaXY", "viaLonLat")
"""Attributes with points that a trip must pass."""

JUNCTIONS = ("fromJunction", "toJunction", "viaJunctions")
"""Attributes that name junctions."""

_STARTS = ("fromXY", "fromLonLat", "from", "fromJunction", "fromTaz")
_VIAS = ("viaXY", "viaLonLat", "viaJunctions", "via")
_GOALS = ("toXY", "toLonLat", "to", "toJunction", "toTaz")
"""Attributes that say the same in other words: of those that a trip has, SUMO takes the first."""

_POSITIONS = ("XY", "LonLat")
"""Ends of names of attributes with positions."""

_COORDINATES = (2, 3)
"""How many numbers a position has."""

LedVehicle = Mapping[str, Mapping[str, str]]
"""The edges of each trip, by name and vehicle class; empty if there is no route."""

_CAR = "passenger"

_DISTURBED = 2.0
"""Alternative routes are the quickest ones when travel times are multiplied by random factors up to this."""

_ATTEMPTS = 4
"""Number of searches for alternative routes; more searches find few that are worth it."""

_NO_REASONS = ("Quitting", "Loading", "Success", "Warning")
"""Lines of the router that begin so explain no refusal."""

_LONGEST_S = 600.0
"""If SUMO's router takes longer than this for the trips of a network, it is stopped [s]."""
_AS_CLASS = re.compile(r"@[a-z_0-9]+'")
"""The end of a name in the router's messages that loopgate added: each trip is routed once per vehicle class.
"""


def _has_way(element: ET.Element) -> bool:
    """Return whether a vehicle, trip or flow has a route of its own."""
    inside = any(element.find(tag) is not None for tag in ("route", "routeDistribution"))
    return inside or bool(element.get("route"))


def drives_once(
    network: RoadNetwork, tops: Sequence[tuple[Path, ET.Element]], vehicles: Sequence[tuple[Path, ET.Element]]
) -> bool:
    """Return whether some vehicle drives once: its route is open, or SUMO's router must find it."""
    if not all(_has_way(element) for _, element in vehicles):
        return True
    routes = {route.get("id", ""): route for _, top in tops for route in top.iter("route")}
    named = {element.get("route", "") for _, element in vehicles}
    spreads = [spread for _, top in tops for spread in top.findall("routeDistribution")]
    driven = [spread for spread in spreads if spread.get("id") in named]
    driven += [one for _, element in vehicles for one in element if one.tag in {"route", "routeDistribution"}]
    named |= routes_named(driven)
    driven += [route for name, route in routes.items() if name in named]
    every = (route for one in driven for route in one.iter("route"))
    return not all(closes(network, route.get("edges", "").split()) for route in every)


def closes(network: RoadNetwork, edges: Sequence[str]) -> bool:
    """Return whether a route leads back to its beginning."""
    if not edges or edges[-1] not in network.edges:
        return True
    back = len(edges) > 1 and edges[0] == edges[-1]
    return back or any(c.to_edge == edges[0] for c in network.outgoing(edges[-1]))


def one_round(edges: Sequence[str]) -> tuple[str, ...]:
    """Return one round of a closed route, without repetitions."""
    once = tuple(edges[:-1]) if len(edges) > 1 and edges[0] == edges[-1] else tuple(edges)
    for length in range(1, len(once) // 2 + 1):
        if len(once) % length == 0 and once == once[:length] * (len(once) // length):
            return once[:length]
    return once


def lead_trips(
    network: RoadNetwork,
    elements: Sequence[tuple[Path, ET.Element]],
    types: Sequence[ET.Element],
    beside: Sequence[Path],
    *,
    classes: Mapping[str, Mapping[str, str]],
) -> LedVehicle:
    """Return the quickest route, found by SUMO's router, of each element that names only its ends.

    All vehicles of a flow get one route. SUMO itself would choose the same route on empty roads.

    Raises `RouteError` if an edge, junction, district or position that an element names is not there, or the
    router fails; the text has the router's message.

    Parameters
    ----------
    elements
        Vehicles, trips and flows, with their files.
    types
        The vehicle types of these files.
    beside
        Additional files, for example with districts.
    classes
        For each distribution of types, by name: one type for each vehicle class in it.

    Returns
    -------
    LedVehicle
        The edges of each element, by its name, for each vehicle class that it may have.
    """
    asked = [(source, element) for source, element in elements if not _has_way(element)]
    if not asked:
        return {}
    top = ET.Element("routes")
    driven = {element.get("type", "") for _, element in asked}
    driven |= {kind for name in driven for kind in classes.get(name, {}).values()}
    top.extend(kind for kind in types if kind.get("id") in driven)
    vclasses = {kind.get("id", ""): kind.get("vClass", _CAR) for kind in types}

    def kinds(element: ET.Element) -> Mapping[str, str]:
        name = element.get("type", "")
        return classes.get(name) or {vclasses.get(name, _CAR): name}

    for source, element in asked:
        _check_ends(element, _called(source, element))
    kinds_at = dict.fromkeys(
        (*one, kind)
        for _, element in asked
        for one in _positions(element)
        for kind in kinds(element).values()
    )
    files = ", ".join(dict.fromkeys(str(source) for source, _ in asked))
    on_edges = _on_edges(network, list(top), list(kinds_at), files)
    places = _Places(network, read_districts(beside), _at_junctions(network), on_edges)
    for source, element in sorted(asked, key=lambda one: departs_s(one[1])):
        places.check(element, _called(source, element), kinds(element))
        said = {name: element.attrib[name] for name in (*ENDS, *MIDDLE) if name in element.attrib}
        said["depart"] = f"{departs_s(element):g}"
        for vclass, kind in kinds(element).items():
            more = {"type": kind} if kind else {}
            trip = ET.SubElement(top, "trip", {"id": f"{element.get('id', '')}@{vclass}", **said, **more})
            trip.extend(element.findall("stop"))
    by_junctions = any(places.names_junction(element) for _, element in asked)
    routes = _routed(network, top, beside, seed=1, junctions=by_junctions, files=files)
    led: dict[str, dict[str, str]] = {}
    for _, element in asked:
        name = element.get("id", "")
        for vclass, kind in kinds(element).items():
            edges = routes.get(f"{name}@{vclass}", "")
            found = edges and _leads(network, edges.split(), places.course(element, kind), vclass)
            led.setdefault(name, {})[vclass] = edges if found else ""
    return led


def _called(source: Path, element: ET.Element) -> str:
    """Return the file, kind and name of a trip, for messages."""
    return f"{source}: {element.tag} {element.get('id', '')}"


def _check_ends(element: ET.Element, what: str) -> None:
    """Refuse a trip without ends."""
    if not any(name in element.attrib for name in ENDS) and element.find("stop") is None:
        msg = f"{what}: it has neither a route nor from and to; expected one of them"
        raise RouteError(msg)


def _said(element: ET.Element) -> Iterator[tuple[str, str]]:
    """Yield the attributes by which SUMO leads a trip, and each place in them, in driving order."""
    for names in (_STARTS, _VIAS, _GOALS):
        name = next((name for name in names if name in element.attrib), "")
        for place in element.get(name, "").split():
            yield name, place


def _positions(element: ET.Element) -> Iterator[tuple[str, str]]:
    """Yield the positions in the plane or on the globe that a trip names: the kind, and the text."""
    for name, place in _said(element):
        if kind := _position_in(name):
            yield kind, place


def _position_in(name: str) -> str:
    """Return the kind of position that an attribute has; empty if it has none."""
    return next((kind for kind in _POSITIONS if name.endswith(kind)), "")


@dataclass(frozen=True, slots=True)
class _Course:
    """The edges that a way must pass, in driving order: at each point one of some."""

    points: tuple[frozenset[str], ...] = ()
    begins: bool = False
    ends: bool = False
    """`begins` and `ends`: whether it must begin at the first point, and end at the last."""

    def holds(self, edges: Sequence[str]) -> bool:
        """Return whether a way passes all points, one after another; one edge may be several of them."""
        if not edges or (self.begins and edges[0] not in self.points[0]):
            return False
        at = 0
        for some in self.points:
            at = next((k for k in range(at, len(edges)) if edges[k] in some), len(edges))
        return at < len(edges) and not (self.ends and edges[-1] not in self.points[-1])


@dataclass(frozen=True, slots=True)
class _Places:
    """What trips name: edges and junctions of the network, districts, and positions."""

    network: RoadNetwork
    districts: Mapping[str, District]
    at_junctions: Mapping[str, District]
    """The edges that leave each junction, and those that lead to it."""
    on_edges: Mapping[tuple[str, str, str], str]
    """The edge that SUMO's router finds at a position, by the kind of position, the text and the type."""

    def check(self, element: ET.Element, what: str, kinds: Mapping[str, str]) -> None:
        """Raise `RouteError` if a trip names something that is not there: the router would skip it."""
        for name, place in _said(element):
            if kind := _position_in(name):
                known = any((kind, place, one) in self.on_edges for one in kinds.values())
                why = f"at which SUMO finds no edge of {self.network.name}; correct it"
            elif name in JUNCTIONS:
                known = place in self.network.junctions or place in self.districts
                why = f"which is no junction of {self.network.name}; correct it"
            elif name.endswith("Taz"):
                known = place in self.districts or place in self.network.junctions
                why = (
                    "which is no district of the additional files; correct it, or name the file with it in "
                    "the configuration, or by --stops"
                )
            else:
                known = place in self.network.edges
                why = f"which is no edge of {self.network.name}"
            if not known:
                msg = f"{what}: {name} is {shown(place)}, {why}"
                raise RouteError(msg)

    def names_junction(self, element: ET.Element) -> bool:
        """Return whether a trip names a junction; SUMO lets a district stand for one, and the reverse."""
        return any(
            (name in JUNCTIONS or name.endswith("Taz")) and place not in self.districts
            for name, place in _said(element)
        )

    def course(self, element: ET.Element, kind: str) -> _Course:
        """Return what the way of a trip must pass if its vehicle has a certain type."""
        said = list(_said(element))
        return _Course(
            tuple(self._edges_at(name, place, kind) for name, place in said),
            begins=bool(said) and said[0][0] in _STARTS,
            ends=bool(said) and said[-1][0] in _GOALS,
        )

    def _edges_at(self, name: str, place: str, kind: str) -> frozenset[str]:
        """Return the edges with which a trip is at a place."""
        if how := _position_in(name):
            return frozenset({self.on_edges.get((how, place, kind), "")})
        if name not in JUNCTIONS and not name.endswith("Taz"):
            return frozenset({place})
        begins = name in _STARTS
        there = self.districts.get(place) or self.at_junctions[place]
        return there.sources if begins else there.sinks


def _at_junctions(network: RoadNetwork) -> dict[str, District]:
    """Return the edges that leave each junction, and those that lead to it, by junction."""
    leave: dict[str, list[str]] = {}
    lead: dict[str, list[str]] = {}
    for edge in network.edges.values():
        leave.setdefault(edge.from_junction, []).append(edge.id)
        lead.setdefault(edge.to_junction, []).append(edge.id)
    return {
        name: District(frozenset(leave.get(name, ())), frozenset(lead.get(name, ())))
        for name in network.junctions
    }


def _on_edges(
    network: RoadNetwork, types: Sequence[ET.Element], positions: Sequence[tuple[str, str, str]], files: str
) -> dict[tuple[str, str, str], str]:
    """Return the edge at each position, if there is one, as SUMO's router finds it for a type of vehicle."""
    if not positions:
        return {}
    top = ET.Element("routes")
    top.extend(types)
    for number, (kind, place, of) in enumerate(positions):
        if not _is_position(place):
            continue  # the router would refuse all, by a name that is none of the file
        more = {"type": of} if of else {}
        ET.SubElement(top, "trip", {"id": f"{number}", "depart": "0", f"from{kind}": place, **more})
    routes = _routed(network, top, (), seed=1, files=files)
    return {one: routes[f"{number}"] for number, one in enumerate(positions) if f"{number}" in routes}


def _is_position(text: str) -> bool:
    """Return whether a text is two or three numbers with commas between."""
    parts = text.split(",")
    return len(parts) in _COORDINATES and all(isfinite(as_number(part)) for part in parts)


def ways_between(
    network: RoadNetwork, asked: Sequence[tuple[str, str, str]]
) -> dict[tuple[str, str, str], list[tuple[str, ...]]]:
    """Return alternative routes between two edges, which may be quicker on full roads.

    `asked`: first and last edge, and vehicle class. Raises `RouteError` if SUMO's router fails.

    Returns
    -------
    dict
        For each of these, routes as edges in driving order; there may be one route only, or none.
    """
    if not asked:
        return {}
    top = _between(asked)
    found: dict[tuple[str, str, str], list[tuple[str, ...]]] = {one: [] for one in asked}
    for seed in range(1, _ATTEMPTS + 1):
        routes = _routed(network, top, (), seed, disturbed=_DISTURBED)
        for number, (first, last, vclass) in enumerate(asked):
            edges = tuple(routes.get(f"{number}", "").split())
            ways = found[first, last, vclass]
            if edges not in ways and _leads(network, edges, _from_to(first, last), vclass):
                ways.append(edges)
    return found


def find_ways(
    network: RoadNetwork, asked: Sequence[tuple[str, str, str]]
) -> dict[tuple[str, str, str], tuple[str, ...]]:
    """Return the quickest route between two edges on empty roads, as SUMO chooses it, where there is one.

    `asked`: first and last edge, and vehicle class. Raises `RouteError` if SUMO's router fails.
    """
    found: dict[tuple[str, str, str], tuple[str, ...]] = {o: o[:1] for o in asked if o[0] == o[1]}
    left = [one for one in asked if one not in found]
    if not left:
        return found
    routes = _routed(network, _between(left), (), seed=1)
    for number, (first, last, vclass) in enumerate(left):
        edges = tuple(routes.get(f"{number}", "").split())
        if _leads(network, edges, _from_to(first, last), vclass):
            found[first, last, vclass] = edges
    return found


def _between(asked: Sequence[tuple[str, str, str]]) -> ET.Element:
    """Return trips between two edges each, called by their numbers."""
    top = ET.Element("routes")
    for vclass in sorted({vclass for _, _, vclass in asked}):
        ET.SubElement(top, "vType", id=vclass, vClass=vclass)
    for number, (first, last, vclass) in enumerate(asked):
        ET.SubElement(
            top, "trip", {"id": f"{number}", "depart": "0", "from": first, "to": last, "type": vclass}
        )
    return top


def _from_to(first: str, last: str) -> _Course:
    """Return what a way from one edge to another must pass."""
    return _Course((frozenset({first}), frozenset({last})), begins=True, ends=True)


def _leads(network: RoadNetwork, edges: Sequence[str], course: _Course, vclass: str) -> bool:
    """Return whether a route is what was asked for, and can be driven.

    The router also writes routes with unconnected edges, and skips in silence what it does not find.
    """
    open_to = all(edge in network.edges and network.edges[edge].allows(vclass) for edge in edges)
    follow = open_to and all(network.between(one, other, vclass) for one, other in pairwise(edges))
    return follow and course.holds(edges)


def departs_s(element: ET.Element) -> float:
    """Return when a vehicle, or the first of a flow, departs [s]; 0 if its file gives no time."""
    try:
        return seconds(element.get("begin" if element.tag == "flow" else "depart", "0"))
    except ValueError:
        return 0.0  # reading the departure reports the error


def _router() -> Path:
    """Return the path of SUMO's router in SUMO's package."""
    spec = importlib.util.find_spec("sumo")
    homes = (spec.submodule_search_locations if spec else None) or ()
    found = next((file for home in homes for file in sorted(Path(home, "bin").glob("duarouter*"))), None)
    if found is None:
        msg = "trips are led by SUMO's duarouter, and there is none; pip install eclipse-sumo"
        raise RouteError(msg)
    return found


def _reasons(said: str, code: int) -> str:
    """Return the router's error messages; without any, how it ended."""
    lines = [line.strip().removeprefix("Error: ") for line in said.splitlines()]
    told = [line for line in lines if line and not line.startswith(_NO_REASONS)]
    how = f"signal {-code}" if code < 0 else f"exit code {code}"
    return "; ".join(dict.fromkeys(told)) or f"it ended by {how} and said nothing"


def _routed(
    network: RoadNetwork,
    top: ET.Element,
    beside: Sequence[Path],
    seed: int,
    *,
    disturbed: float = 1.0,
    junctions: bool = False,
    files: str = "",
) -> dict[str, str]:
    """Return the route that SUMO's router finds for each trip in `top`, by its name.

    `junctions`: whether a trip names one; only then the router builds a district for each. `files`: where the
    trips come from, for messages.
    """
    with temporary_folder() as folder:
        trips, found = folder / "trips.xml", folder / "routes.xml"
        write_xml(top, trips)
        more = [file for file in (folder / "leading.add.xml",) if write_leading(beside, file)]
        command = [
            *(str(_router()), "--net-file", str(network.file), "--route-files", str(trips)),
            *("--output-file", str(found), "--alternatives-output", os.devnull, "--seed", str(seed)),
            *("--weights.random-factor", f"{disturbed:g}"),
            *("--ignore-errors", "--no-step-log", "--no-warnings", "--xml-validation", "never"),
            *(("--additional-files", ",".join(map(str, more))) if more else ()),
            *(("--junction-taz",) if junctions else ()),
        ]
        try:
            done = subprocess.run(  # noqa: S603  SUMO's own program
                command, capture_output=True, text=True, timeout=_LONGEST_S, check=False
            )
            said = f"{done.stderr}\n{done.stdout}"
        except (OSError, subprocess.TimeoutExpired) as error:
            done, said = None, str(error)
        if done is None or done.returncode or not found.exists():
            why = _AS_CLASS.sub("'", _reasons(said, done.returncode if done else 0))
            where = f"{files}: " if files else ""
            msg = f"{where}SUMO's duarouter does not lead the trips: {why}"
            raise RouteError(msg)
        routes = ET.parse(found).getroot()  # noqa: S314  SUMO has just written it
    return {
        one.get("id", ""): edges
        for one in routes
        for route in one.iter("route")
        if (edges := route.get("edges"))
    }
