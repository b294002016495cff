"""Vehicles that drive once, and trips, whose routes SUMO's router finds before a run."""

import importlib.util
import os
import re
import subprocess
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree as ET

from loopgate.errors import RouteError
from loopgate.folders import temporary_folder
from loopgate.network.additional import write_leading
from loopgate.network.clock import seconds
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

    Raises `RouteError` if an edge is not in the network, or the router fails; the text has the router's
    message.

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

    for source, element in sorted(asked, key=lambda one: departs_s(one[1])):
        _check(network, element, f"{source}: {element.tag} {element.get('id', '')}")
        said = {name: element.attrib[name] for name in (*ENDS, *MIDDLE) if name in element.attrib}
        said["depart"] = f"{departs_s(element):g}"
        for vclass, kind in kinds(element).items():
            more = {"type": kind} if kind else {}
            trip = ET.SubElement(top, "trip", {"id": f"{element.get('id', '')}@{vclass}", **said, **more})
            trip.extend(element.findall("stop"))
    routes = _routed(network, top, beside, seed=1)
    led: dict[str, dict[str, str]] = {}
    for _, element in asked:
        name = element.get("id", "")
        for vclass in kinds(element):
            edges = routes.get(f"{name}@{vclass}", "")
            found = edges and _leads(network, edges.split(), element.get("to"), vclass)
            led.setdefault(name, {})[vclass] = edges if found else ""
    return led


def _check(network: RoadNetwork, element: ET.Element, what: str) -> None:
    """Refuse a trip without ends, or with an edge outside the network."""
    if not any(name in element.attrib for name in ENDS) and element.find("stop") is None:
        msg = f"{what}: it has neither a route nor from and to; expected one of them"
        raise RouteError(msg)
    for name in ("from", "to", "via"):
        for edge in element.get(name, "").split():
            if edge not in network.edges:
                msg = f"{what}: {name} is {shown(edge)}, which is no edge of {network.name}"
                raise RouteError(msg)


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
            if edges and edges not in ways and _leads(network, edges, last, vclass):
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
        if edges and _leads(network, edges, last, vclass):
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


def _leads(network: RoadNetwork, edges: Sequence[str], to: str | None, vclass: str) -> bool:
    """Return whether a route reaches its end: the router also writes routes with unconnected edges."""
    open_to = all(edge in network.edges and network.edges[edge].allows(vclass) for edge in edges)
    follow = open_to and all(network.between(one, other, vclass) for one, other in pairwise(edges))
    return follow and to in {None, edges[-1]}


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
    network: RoadNetwork, top: ET.Element, beside: Sequence[Path], seed: int, *, disturbed: float = 1.0
) -> dict[str, str]:
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
            msg = f"SUMO's duarouter does not lead the trips: {why}"
            raise RouteError(msg)
        routes = ET.parse(found).getroot()  # noqa: S314  SUMO has just written it
    return {
        one.get("id", ""): edges
        for one in routes
        for route in one.iter("route")
        if (edges := route.get("edges"))
    }
