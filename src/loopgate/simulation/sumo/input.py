"""Writes SUMO's input: vehicle types, endless routes on loops, and ordinary vehicles."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from xml.etree import ElementTree as ET

from loopgate.abstraction.itinerary import round_routes, rounds
from loopgate.control.start import VehicleStart
from loopgate.network import Loop, VehicleDemand, VehicleType
from loopgate.network.additional import FLEET, without
from loopgate.network.stops import Stop
from loopgate.network.trips import MIDDLE, ROUNDS
from loopgate.network.ungated import Ungated, UngatedFleet
from loopgate.network.xml_file import write_xml
from loopgate.simulation.sumo.devices import for_others, has_leads

_NOBODY = UngatedFleet()


def write_sumo_input(
    starts: Sequence[VehicleStart],
    folder: Path,
    *,
    beside: Sequence[Path] = (),
    begin_s: float = 0.0,
    later: Sequence[VehicleStart] = (),
    renews: bool = True,
    scale: float = 1.0,
) -> list[str]:
    """Write the additional file for `starts` into `folder`; return the SUMO options that load it.

    A vehicle's first route leads from its start past an edge that its loop passes once. A rerouter on that
    edge gives it two rounds that end on the same edge, again and again. So routes keep a constant length, and
    a whole round on which the vehicle can be held is always ahead. Each loop has its own vehicle types, since
    a rerouter finds its vehicles by type. SUMO loads the additional files `beside` first. Vehicles without a
    departure time are there at the beginning, `begin_s` [s]. For vehicles in `later`, only types and routes
    are written. With `renews` False no rerouters are written: loopgate renews the routes itself, since
    vehicles may change to other loops. `scale`: how often SUMO puts in each vehicle that it reads; these
    vehicles it must put in once.

    Raises
    ------
    RouteError
        If a loop passes each of its edges more than once.
    ResultsError
        If the file cannot be written.
    """
    top = ET.Element("additional")
    kinds: dict[str, str] = {}
    loops: dict[str, Loop] = {}
    for start in (*starts, *later):
        loops[start.loop.id] = start.loop
        if start.kind not in kinds:
            kinds[start.kind] = start.loop.id
            more = {"color": start.colour} if start.colour else {}
            more |= _once(start.type, scale)
            kind = ET.SubElement(top, "vType", {**start.type.attributes, **more, "id": start.kind})
            _tell(kind, {**start.type.parameters, **start.devices})
    for loop in (loop for loop in loops.values() if loop.closed):
        for route, edges in round_routes(loop).items():
            ET.SubElement(top, "route", id=route, edges=" ".join(edges))
        if not renews:
            continue
        again = rounds(loop)[0]
        types = " ".join(kind for kind, name in kinds.items() if name == loop.id)
        rerouter = ET.SubElement(top, "rerouter", id=f"again@{loop.id}", edges=again.edge, vTypes=types)
        interval = ET.SubElement(rerouter, "interval", begin="0", end="1000000000")
        ET.SubElement(interval, "routeProbReroute", id=again.route)
    for start in {start.route: start for start in later}.values():
        ET.SubElement(top, "route", id=start.route, edges=" ".join(start.edges))
    for start in starts:
        _add_vehicle(top, start, begin_s)
    file = folder / "vehicles.add.xml"
    ET.indent(top)
    write_xml(top, file)
    return ["--additional-files", ",".join(str(one) for one in (*beside, file))]


def _once(kind: VehicleType, scale: float) -> dict[str, str]:
    """Return the attribute by which SUMO puts in each vehicle of a type once, whatever its own scale is."""
    return {"scale": repr(1.0 / scale)} if scale not in {0.0, 1.0} or "scale" in kind.attributes else {}


_PLANS = frozenset({"WAUT", "wautJunction"})
"""Elements that switch the programs of lights at times of the day."""


def without_vehicles(
    files: Sequence[Path],
    holding: Collection[Path],
    folder: Path,
    ordinary: Collection[str] | None = None,
    *,
    lights_off: bool = False,
) -> tuple[Path, ...]:
    """Return additional files for SUMO; some are copied to `folder` and changed.

    Parameters
    ----------
    files
        The files.
    holding
        Those with vehicles that loopgate puts in: the copies are without them.
    folder
        The folder of the run.
    ordinary
        The types of vehicles that no gate drives: rerouters that lead vehicles act on these only. None
        without a gate.
    lights_off
        Whether lights are off: no plan then switches them on at a time.

    Raises
    ------
    ResultsError
        If one cannot be written.
    """
    found = []
    for number, file in enumerate(files, start=1):
        tags = (FLEET if file in holding else frozenset()) | (_PLANS if lights_off else frozenset())

        def gone(one: ET.Element, tags: Collection[str] = tags) -> bool:
            if one.tag == "rerouter" and ordinary is not None:
                return not for_others(one, ordinary)
            return one.tag in tags

        copied = file in holding or lights_off or (ordinary is not None and has_leads(file))
        found.append(without(file, gone, folder / f"additional{number}.add.xml") if copied else file)
    return tuple(found)


def _add_vehicle(top: ET.Element, start: VehicleStart, begin_s: float) -> None:
    checks = {"insertionChecks": "none"} if start.depart_s is None else {}
    vehicle = ET.SubElement(
        top,
        "vehicle",
        id=start.vehicle,
        type=start.kind,
        depart=f"{begin_s if start.depart_s is None else start.depart_s:g}",
        departLane=str(start.lane_index),
        departPos=f"{start.position_m:.3f}",
        departSpeed="0",
        **checks,
        attrib=dict(start.demand.attributes),
    )
    ET.SubElement(vehicle, "route", edges=" ".join(start.edges))
    _tell(vehicle, start.demand.parameters)


def write_ordinary(
    vehicles: Sequence[VehicleDemand],
    file: Path,
    *,
    known: Collection[str] = (),
    ungated: UngatedFleet = _NOBODY,
    scale: float = 0.0,
) -> None:
    """Write ordinary vehicles as a SUMO route file, in order of departure.

    `known`: types that SUMO gets from additional files. `ungated`: vehicles that are written as their file
    has them. `scale`: how often SUMO puts in each vehicle, where `vehicles` already are so many; else 0.
    """
    top = ET.Element("routes")
    top.extend(ungated.needs(known))
    there = {*known, *(kind.get("id", "") for kind in top.iter("vType"))}
    for kind in {v.type.id: v.type for v in vehicles if v.type.id not in there}.values():
        more = _once(kind, scale) if scale else {}
        element = ET.SubElement(
            top, "vType", {"vClass": kind.vclass, **kind.attributes, **more, "id": kind.id}
        )
        _tell(element, kind.parameters)
    everybody: list[VehicleDemand | Ungated] = [*vehicles, *ungated.vehicles]
    for v in sorted(everybody, key=lambda v: v.depart_s):
        if isinstance(v, Ungated):
            top.append(v.element)
            continue
        own = {name: value for name, value in v.attributes.items() if name not in MIDDLE}
        said = {"id": v.id, "type": v.type.id, "depart": f"{v.depart_s:g}", **own}
        if v.edge:
            said["departEdge"] = f"{v.edge}"
        if v.depart_m is not None:
            said["departPos"] = f"{v.depart_m - v.loop.roads[v.edge].begin_m:g}"
        element = ET.SubElement(top, "vehicle", said)
        again = {"repeat": ROUNDS} if v.loop.closed else {}
        route = ET.SubElement(element, "route", edges=" ".join(v.loop.edges), attrib=again)
        for stop in v.stops:  # in every round of a loop
            ET.SubElement(route if v.loop.closed else element, "stop", _as_said(stop))
        _tell(element, v.parameters)
    write_xml(top, file)


def _as_said(stop: Stop) -> dict[str, str]:
    """Return the attributes of a stop as in a route file."""
    said = {"duration": f"{stop.duration_s:g}"} if stop.duration_s or stop.until_s is None else {}
    if stop.until_s is not None:
        said["until"] = f"{stop.until_s:g}"
    if stop.kind == "lane":
        said |= {"edge": stop.edge} if stop.any_lane else {"lane": stop.lane}
        said |= {"startPos": f"{stop.start_m:g}", "endPos": f"{stop.end_m:g}", "friendlyPos": "true"}
        said["parking"] = "true" if stop.parks else "false"
    else:
        said[stop.kind] = stop.name
    triggers = {"person": "triggered", "container": "containerTriggered"}
    return {**said, **{triggers[one]: "true" for one in stop.triggers}, **dict(stop.told)}


def _tell(element: ET.Element, parameters: Mapping[str, str]) -> None:
    """Write the parameters of a vehicle or type, but not whether SUMO tells of its trip: it tells of all."""
    for name, value in parameters.items():
        if name != "has.tripinfo.device":
            ET.SubElement(element, "param", key=name, value=value)
