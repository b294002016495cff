"""A vehicle or flow of a route file, before the loops of its routes are made."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree import ElementTree as ET

from loopgate.errors import RouteError
from loopgate.network.departures import Flow
from loopgate.network.loop import Loop
from loopgate.network.stops import Stop, on_loop
from loopgate.network.trips import MIDDLE
from loopgate.network.vehicle_demand import VehicleDemand
from loopgate.network.vehicle_type import VehicleType
from loopgate.reading import shown

_BEYOND_M = 10.0
"""Largest distance of a position beyond its edge [m]: the lanes of an edge differ in length."""

_CARRIED = ("color", "line", "personNumber", "containerNumber")
"""Attributes of vehicles that SUMO gets unchanged."""

_CARRIED_ONCE = ("departLane", "departSpeed", "arrivalLane", "arrivalPos", "arrivalSpeed", *MIDDLE)
"""Further such attributes, for vehicles that drive once."""


@dataclass(frozen=True, slots=True)
class RouteChoice:
    """A route that a vehicle may be drawn for: its share, the first fitting type, and all stops on it."""

    route: str
    share: float
    vclass: str
    type: VehicleType
    stops: tuple[Stop, ...]


@dataclass(frozen=True, slots=True)
class AskedVehicle:
    """A vehicle or flow of the file, before its loops are made."""

    element: ET.Element
    depart_s: float
    flow: Flow | None
    types: tuple[tuple[VehicleType, float], ...]
    ways: tuple[RouteChoice, ...]

    def on_loops(self, loops: Mapping[str, Loop], path: Path) -> VehicleDemand:
        """Return the vehicle with its departure position and its stops."""
        ways = tuple((self._on(loops[way.route], way, path), way.share) for way in self.ways)
        first = ways[0][0]
        return replace(
            first,
            types=self.types if len(self.types) > 1 else (),
            ways=ways if len(ways) > 1 or first.vclass else (),
        )

    def _on(self, loop: Loop, way: RouteChoice, path: Path) -> VehicleDemand:
        name, said = self.element.get("id", ""), self.element.attrib
        what = f"{path}: vehicle {name}"
        try:
            edge = int(said.get("departEdge") or 0) % len(loop.edges)
        except ValueError:
            edge = 0  # "random" and the like
        carried = _CARRIED if loop.closed else (*_CARRIED, *_CARRIED_ONCE)
        return VehicleDemand(
            name,
            loop,
            way.type,
            depart_m=_depart(what, loop, edge, said.get("departPos", "")),
            depart_s=self.depart_s,
            flow=self.flow,
            edge=edge,
            stops=on_loop(loop, way.stops, what),
            attributes={key: said[key] for key in carried if said.get(key)},
            parameters={one.get("key", ""): one.get("value", "") for one in self.element.findall("param")},
            vclass=way.vclass,
        )


def _depart(what: str, loop: Loop, edge: int, position: str) -> float | None:
    """Return the arc length of a departure position; None if the position is no number."""
    try:
        position_m = float(position)
    except ValueError:
        return None  # "base", "random", "free": SUMO would choose
    span = loop.roads[edge]
    if not abs(position_m) <= span.length_m + _BEYOND_M:
        msg = f"{what}: departPos is {shown(position)}; edge {span.edge} is {span.length_m:g} m long"
        raise RouteError(msg)
    return span.begin_m + (position_m if position_m >= 0 else span.length_m + position_m)
