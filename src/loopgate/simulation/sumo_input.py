"""Writes what SUMO needs to put vehicles on endless loops: vehicle types, routes, rerouters."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree as ET

from loopgate.disk import writing
from loopgate.drive.track import Round
from loopgate.errors import RouteError
from loopgate.network import Loop, VehicleType

__all__ = ["Start", "pivot", "round_routes", "rounds", "write_sumo_input"]


@dataclass(frozen=True, slots=True)
class Start:
    """A vehicle at its start.

    Attributes
    ----------
    vehicle
        Its name.
    loop
        Its loop.
    front_m
        Arc length of its front [m].
    type
        Its vehicle type.
    lane
        Index of the lane it stands on; None: the one that its loop names there.
    attributes, parameters
        What else SUMO is told of it: as XML has it, and as ``<param>`` elements by key.
    """

    vehicle: str
    loop: Loop
    front_m: float
    type: VehicleType
    lane: int | None = None
    attributes: Mapping[str, str] = field(default_factory=dict, hash=False)
    parameters: Mapping[str, str] = field(default_factory=dict, hash=False)


def write_sumo_input(
    starts: Sequence[Start], folder: Path, *, beside: Sequence[Path] = (), begin_s: float = 0.0
) -> list[str]:
    """Write the additional file for `starts` into `folder` and return the SUMO options that load it.

    A vehicle's first route leads from its start past an edge of its loop that the loop passes once; a
    rerouter on that edge gives it two rounds that end on the same edge, again and again. So routes keep a
    constant length however long the vehicle drives, and there is always a whole round of it ahead, on which
    the vehicle can be held. Each loop has vehicle types of its own, since a
    rerouter is bound to vehicles by their type. SUMO loads the additional files `beside` first.
    All depart when the simulation begins, at `begin_s` [s].

    Raises
    ------
    RouteError
        If a loop passes each of its edges more than once.
    ResultsError
        If the file cannot be written.
    """
    top = ET.Element("additional")
    kinds: dict[tuple[str, str], str] = {}
    loops: dict[str, Loop] = {}
    for start in starts:
        loops[start.loop.id] = start.loop
        key = (start.loop.id, start.type.id)
        if key not in kinds:
            kinds[key] = f"{start.type.id}@{start.loop.id}"
            kind = ET.SubElement(top, "vType", {**start.type.attributes, "id": kinds[key]})
            for name, value in start.type.parameters.items():
                ET.SubElement(kind, "param", key=name, value=value)
    for loop in loops.values():
        for route, edges in round_routes(loop).items():
            ET.SubElement(top, "route", id=route, edges=" ".join(edges))
        again = rounds(loop)[0]
        types = " ".join(kind for (name, _), kind in kinds.items() if name == loop.id)
        rerouter = ET.SubElement(top, "rerouter", id=f"again@{loop.id}", edges=again.edge, vTypes=types)
        interval = ET.SubElement(rerouter, "interval", begin="0", end="1000000000")
        ET.SubElement(interval, "routeProbReroute", id=again.route)
    for start in starts:
        _add_vehicle(top, start, kinds[start.loop.id, start.type.id], f"{begin_s:g}")
    file = folder / "vehicles.add.xml"
    ET.indent(top)
    with writing(file):
        ET.ElementTree(top).write(file, encoding="utf-8", xml_declaration=True)
    return ["--additional-files", ",".join(str(one) for one in (*beside, file))]


def _add_vehicle(top: ET.Element, start: Start, kind: str, depart: str) -> None:
    loop = start.loop
    place = loop.locate(start.front_m)
    numbers = [
        i for i, begin in enumerate(_edge_begins(loop)) if begin <= start.front_m % loop.length_m + 1e-6
    ]
    here = numbers[-1]
    ahead = loop.edges[here:] + loop.edges * 2 + loop.edges[: pivot(loop) + 1]
    vehicle = ET.SubElement(
        top,
        "vehicle",
        id=start.vehicle,
        type=kind,
        depart=depart,
        departLane=str(place.lane if start.lane is None else start.lane),
        departPos=f"{place.position_m:.3f}",
        departSpeed="0",
        insertionChecks="none",
        attrib=dict(start.attributes),
    )
    ET.SubElement(vehicle, "route", edges=" ".join(ahead))
    for name, value in start.parameters.items():
        ET.SubElement(vehicle, "param", key=name, value=value)


def _edge_begins(loop: Loop) -> list[float]:
    return [span.begin_m for span in loop.spans if not span.internal]


def rounds(loop: Loop) -> tuple[Round, Round]:
    """Return the two rounds from the pivot, and what is left of them from the edge after it."""
    here = pivot(loop)
    following = loop.edges[(here + 1) % len(loop.edges)]
    return (
        Round(loop.edges[here], f"round@{loop.id}", f"first@{loop.id}"),
        Round(following, f"onward@{loop.id}", f"second@{loop.id}"),
    )


def round_routes(loop: Loop) -> dict[str, tuple[str, ...]]:
    """Return the edges of the routes of `rounds`, by name."""
    here = pivot(loop)
    once = loop.edges[here:] + loop.edges[:here]
    first, second = rounds(loop)
    return {
        first.route: (*once, *once, once[0]),
        second.route: (*once[1:], *once, once[0]),
        first.alone: (first.edge,),
        second.alone: (second.edge,),
    }


def pivot(loop: Loop) -> int:
    """Return the number of the first edge that the loop passes only once: where its route is renewed.

    Raises
    ------
    RouteError
        If there is none.
    """
    times = Counter(loop.edges)
    for number, edge in enumerate(loop.edges):
        if times[edge] == 1:
            return number
    msg = f"loop {loop.id}: it passes every edge more than once; split it into simpler loops"
    raise RouteError(msg)
