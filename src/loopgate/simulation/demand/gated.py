"""Which vehicles that drive once are under the gate, and which are ordinary traffic."""

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from xml.etree import ElementTree as ET

from loopgate.abstraction.movements import reach_m
from loopgate.abstraction.queue_layout import lay_out_queues, why_not
from loopgate.abstraction.stretches import narrow_lanes
from loopgate.errors import Refusal, RefusedLoopError, ScenarioError
from loopgate.network import Loop, LoopVehicle, RoadNetwork, VehicleType
from loopgate.network.trips import MIDDLE
from loopgate.network.xml_file import write_xml
from loopgate.reading import is_file, refusing, shown
from loopgate.simulation.scenario import Scenario

_MOST_SHOWN = 5

_ROUNDS = "1000"
"""So often SUMO by itself drives round a loop."""


def choose_gated(
    scenario: Scenario, vehicles: Sequence[LoopVehicle]
) -> tuple[list[LoopVehicle], list[LoopVehicle]]:
    """Return those under the gate, and ordinary ones; who drives on a loop is always under it.

    Raises
    ------
    ScenarioError
        If the scenario names neither a type of theirs nor a file, or that names nobody.
    """
    who = scenario.rule_for_gated
    once = [v for v in vehicles if not v.loop.closed]
    if who == "all" or not once:
        return list(vehicles), []
    names: Collection[str] = ()
    if who != "loops":
        names = {v.id for v in once if v.type.id == who} or _named(who, once)
    mine = [v for v in vehicles if v.loop.closed or v.id in names]
    gated = {v.id for v in mine}
    return mine, [v for v in once if v.id not in gated]


def _named(who: str, vehicles: Sequence[LoopVehicle]) -> Collection[str]:
    kinds = list(dict.fromkeys(v.type.id for v in vehicles))
    if not is_file(who):
        listed = ", ".join(kinds[:_MOST_SHOWN]) + (", ..." if len(kinds) > _MOST_SHOWN else "")
        msg = (
            f"gated: {shown(who)} is neither all nor loops, nor a type of the vehicles that drive once "
            f"({listed}), nor a file with their names"
        )
        raise ScenarioError(msg)
    with refusing(Path(who), "file of names", ScenarioError):
        lines = Path(who).read_text(encoding="utf-8").splitlines()
    known = {v.id for v in vehicles}
    asked = dict.fromkeys(name for line in lines if (name := line.partition("#")[0].strip()))
    unknown = [name for name in asked if name not in known]
    if unknown or not asked:
        what = f"{shown(unknown[0])} is no vehicle that drives once" if unknown else "it names nobody"
        msg = f"gated: {who}: {what}; expected one name in each line"
        raise ScenarioError(msg)
    return asked


def find_unfit(
    network: RoadNetwork, staying: Sequence[LoopVehicle], once: Sequence[LoopVehicle]
) -> dict[str, list[LoopVehicle]]:
    """Return, by reason, those of `once` whose ways do not work as queues beside all others.

    Raises
    ------
    RefusedLoopError
        If one of those `staying` does not.
    """
    unfit: dict[str, list[LoopVehicle]] = {}
    alone: dict[tuple[Loop, VehicleType], Refusal | None] = {(v.loop, v.type): None for v in once}
    edges = dict.fromkeys(span.edge for loop, _ in alone for span in loop.roads)
    lanes = [lane.id for edge in edges for lane in network.edges[edge].lanes]
    near = {
        width_m: narrow_lanes(network, lanes, reach_m=reach_m((width_m,)))
        for width_m in dict.fromkeys(kind.width_m for _, kind in alone)
    }
    for loop, kind in alone:  # first, since it is quick: who is too long makes the rest slow
        alone[loop, kind] = why_not(network, loop, kind, near[kind.width_m])
    for v in once:
        if refusal := alone[v.loop, v.type]:
            unfit.setdefault(refusal.reason, []).append(v)
    fit = [v for v in once if not alone[v.loop, v.type]]
    while fit:
        try:
            lay_out_queues(network, [(v.loop, v.type) for v in (*staying, *fit)])
        except RefusedLoopError as error:
            refused: Mapping[str, Refusal] = error.refused
            if any(v.loop.closed and v.loop.id in refused for v in (*staying, *fit)):
                raise
            for vehicle in fit:
                if vehicle.loop.id in refused:
                    unfit.setdefault(refused[vehicle.loop.id].reason, []).append(vehicle)
            fit = [v for v in fit if v.loop.id not in refused]
        else:
            break
    return unfit


def write_ordinary(vehicles: Sequence[LoopVehicle], file: Path, *, known: Collection[str] = ()) -> None:
    """Write vehicles as a route file for SUMO, which drives them by its own rules; in order of departure.

    Types that SUMO has from additional files are `known`.
    """
    top = ET.Element("routes")
    for kind in {v.type.id: v.type for v in vehicles if v.type.id not in known}.values():
        element = ET.SubElement(top, "vType", {"vClass": kind.vclass, **kind.attributes, "id": kind.id})
        for name, value in kind.parameters.items():
            ET.SubElement(element, "param", key=name, value=value)
    for v in sorted(vehicles, key=lambda v: v.depart_s):
        own = {name: value for name, value in v.attributes.items() if name not in MIDDLE}
        said = {"id": v.id, "type": v.type.id, "depart": f"{v.depart_s:g}", **own}
        if v.edge:
            said["departEdge"] = f"{v.edge}"
        if v.depart_m is not None:
            said["departPos"] = f"{v.depart_m - v.loop.roads[v.edge].begin_m:g}"
        element = ET.SubElement(top, "vehicle", said)
        again = {"repeat": _ROUNDS} if v.loop.closed else {}
        ET.SubElement(element, "route", edges=" ".join(v.loop.edges), attrib=again)
        for name, value in v.parameters.items():
            ET.SubElement(element, "param", key=name, value=value)
    write_xml(top, file)
