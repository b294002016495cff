"""Lists the parts of a route file that loopgate ignores: one line for each kind."""

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from xml.etree import ElementTree as ET

from loopgate.network.clock import as_number
from loopgate.network.departures import FLOW_ATTRIBUTES
from loopgate.network.stops import STOP_ATTRIBUTES
from loopgate.network.trips import LedVehicle
from loopgate.reading import counted

_OF_VEHICLES = {"id", "type", "route", "departEdge", "color", "line", "personNumber", "containerNumber"}

_TAKEN = {
    "routes": set[str](),
    "route": {"id", "edges", "cycleTime"},
    "routeDistribution": {"id", "routes", "probabilities"},
    "vTypeDistribution": {"id", "vTypes", "probabilities"},
    "vehicle": {*_OF_VEHICLES, "depart"},
    "trip": {*_OF_VEHICLES, "depart"},
    "flow": {*_OF_VEHICLES, *FLOW_ATTRIBUTES},
    "stop": STOP_ATTRIBUTES,
}
"""Elements, and their attributes, that loopgate reads; attributes of types are passed on unchanged."""

_DRAWN = {"routeDistribution": frozenset({"probability", "refId"})}
"""Attributes that loopgate reads in inner elements."""

_FLEET = ("vehicle", "flow", "trip")

_ONCE = frozenset(
    {"from", "to", "via", "fromJunction", "toJunction", "viaJunctions", "fromTaz", "toTaz", "repeat"}
    | {"fromXY", "toXY", "viaXY", "fromLonLat", "toLonLat", "viaLonLat"}
    | {"departLane", "departSpeed", "arrivalLane", "arrivalPos", "arrivalSpeed", "arrival"}
)
"""Further attributes that loopgate reads of vehicles that drive once."""

_AS_IT_IS = {"departSpeed": 0.0}
"""Attributes with a value that has no effect."""

_MEANS = {
    "departPos": "a vehicle departs where its place has room",
    "departLane": "a vehicle starts on the lane that its loop needs there",
    "departSpeed": "vehicles start from rest",
    "speedFactor": "give it as speedFactor of a vType, so that the gate knows of it",
    "person": "give persons in the file with the stops, or of ordinary traffic",
    "personFlow": "give persons in the file with the stops, or of ordinary traffic",
    "container": "give containers in the file with the stops",
    "containerFlow": "give containers in the file with the stops",
    "repeat": "every loop is driven round and round",
    "index": "stops are made in the order of the loop",
    "started": "it is what SUMO writes",
    "ended": "it is what SUMO writes",
    **dict.fromkeys(
        ("arrivalPos", "arrivalLane", "arrivalSpeed", "arrivalEdge"), "nobody arrives on a closed loop"
    ),
}


def left_out(files: Sequence[tuple[Path, ET.Element]], *, fleet: bool, once: bool = False) -> tuple[str, ...]:
    """Return a line for each kind of element in route files that loopgate leaves out.

    Parameters
    ----------
    files
        Files with their topmost elements.
    fleet
        Whether the file's own vehicles drive; else only what concerns routes is listed.
    once
        Whether they drive their routes once.
    """
    lines = []
    for source, top in files:
        found: Counter[tuple[str, str]] = Counter()
        first: dict[tuple[str, str], str] = {}
        for what, owner in _untaken(top, fleet=fleet):
            if once and what[0] in _ONCE:
                continue
            found[what] += 1
            first.setdefault(what, owner)
        for (name, shown), count in found.items():
            means = f": {_MEANS[name]}" if name in _MEANS else ""
            times = f"{count} times, first" if count > 1 else "once,"
            where = f" ({times} in {first[name, shown]})" if first[name, shown] else ""
            lines.append(f"{source}: {shown} is left out{where}{means}")
    return tuple(lines)


def _untaken(
    element: ET.Element, *, fleet: bool, drawn: frozenset[str] = frozenset()
) -> Iterator[tuple[tuple[str, str], str]]:
    """Yield the ignored parts of an element: the name, the text to show, and the element."""
    taken = _TAKEN[element.tag] | drawn
    owner = f"{element.tag} {element.get('id', '')}".strip()
    for name, value in element.attrib.items():
        if name in taken or name.startswith(("xmlns", "{")) or _is_done_anyway(name, value):
            continue
        yield (name, f"{name} of <{element.tag}>"), owner
    for child in element:
        if child.tag == "vType" or not isinstance(child.tag, str):
            continue
        if child.tag == "param" and element.tag in _FLEET:
            continue
        if child.tag not in _TAKEN:
            if fleet or element.tag != "routes":
                yield (child.tag, f"<{child.tag}>"), owner if element.tag != "routes" else child.get("id", "")
        elif fleet or child.tag not in _FLEET:
            yield from _untaken(child, fleet=fleet, drawn=_DRAWN.get(element.tag, frozenset()))


def _is_done_anyway(name: str, value: str) -> bool:
    figure = as_number(value)
    return not math.isnan(figure) and (name == "departPos" or _AS_IT_IS.get(name) == figure)


def wayless(path: Path, led: LedVehicle) -> Iterator[str]:
    """Return a line that names the trips without a route between their ends, which are left out."""
    lost = [name for name, ways in led.items() if not any(ways.values())]
    if lost:
        yield f"{path}: {counted(len(lost), 'vehicle')} left out for want of a way, first {lost[0]}"
    some = [name for name, ways in led.items() if any(ways.values()) and not all(ways.values())]
    if some:
        yield (
            f"{path}: {len(some)} trips or flows find no way for all classes of their type, and are left out "
            f"where such a one is drawn, first {some[0]}"
        )
