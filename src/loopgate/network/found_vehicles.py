"""Vehicle types, vehicles and flows as route files have them, until they are put on their loops."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from xml.etree import ElementTree as ET

from loopgate.errors import RouteError
from loopgate.network.additional import FLEET
from loopgate.network.departures import Flow, depart_s, read_flow
from loopgate.network.found_routes import FoundRoutes
from loopgate.network.loop import Loop
from loopgate.network.loop_vehicle import LoopVehicle
from loopgate.network.spreads import parts, refuse_nothing, share_of
from loopgate.network.stops import Stop, on_loop
from loopgate.network.trips import MIDDLE, Led
from loopgate.network.vehicle_type import DEFAULT_TYPE, VehicleType, vehicle_type
from loopgate.reading import shown

_BEYOND_M = 10.0
"""Largest distance of a position beyond its edge [m]: the lanes of an edge differ in length."""

_CARRIED = ("color", "line", "personNumber", "containerNumber")
"""Attributes of vehicles that SUMO is told as they are."""

_CARRIED_ONCE = ("departLane", "departSpeed", "arrivalLane", "arrivalPos", "arrivalSpeed", *MIDDLE)
"""The same, of those who drive once."""


@dataclass(frozen=True, slots=True)
class _RouteChoice:
    """A route that a vehicle is drawn to, with its share, and its first type and all its stops on it."""

    route: str
    share: float
    vclass: str
    type: VehicleType
    stops: tuple[Stop, ...]


@dataclass(frozen=True, slots=True)
class _Asked:
    """A vehicle or flow whose loops are not made yet."""

    element: ET.Element
    depart_s: float
    flow: Flow | None
    types: tuple[tuple[VehicleType, float], ...]
    ways: tuple[_RouteChoice, ...]

    def on_loops(self, loops: Mapping[str, Loop], path: Path) -> LoopVehicle:
        """Return it with where it departs and where it stops."""
        ways = tuple((self._on(loops[way.route], way, path), way.share) for way in self.ways)
        first = ways[0][0]
        return replace(
            first,
            types=self.types if len(self.types) > 1 else (),
            ways=ways if len(ways) > 1 or first.vclass else (),
        )

    def _on(self, loop: Loop, way: _RouteChoice, path: Path) -> LoopVehicle:
        name, said = self.element.get("id", ""), self.element.attrib
        what = f"{path}: vehicle {name}"
        try:
            edge = int(said.get("departEdge") or 0) % len(loop.edges)
        except ValueError:
            edge = 0  # "random" and the like
        carried = _CARRIED if loop.closed else (*_CARRIED, *_CARRIED_ONCE)
        return LoopVehicle(
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


@dataclass(slots=True)
class FoundVehicles:
    """The types and vehicles of the files read so far, on the routes found there."""

    routes: FoundRoutes
    led: Led = field(default_factory=dict)
    """The ways of trips: to be known before vehicles are collected."""
    types: dict[str, VehicleType] = field(default_factory=dict)
    drawn_types: dict[str, tuple[tuple[VehicleType, float], ...]] = field(default_factory=dict)
    _asked: list[_Asked] = field(default_factory=list)

    def collect_types(self, tops: Sequence[tuple[Path, ET.Element]]) -> None:
        """Take note of types, and of their distributions in SUMO's order: one may name those before it."""
        shares: dict[str, float] = {}
        for source, top in tops:
            for element in (one for one in top.iter("vType") if one.get("id")):
                kind = vehicle_type(element, str(source))
                self.types[kind.id] = kind
                shares[kind.id] = share_of(element, f"{source}: vType {kind.id}")
        for source, top in tops:
            for spread in top.findall("vTypeDistribution"):
                name = spread.get("id", "")
                what = f"{source}: vTypeDistribution {name}"
                drawn: list[tuple[VehicleType, float]] = []
                for part in parts(spread, what, named="vTypes", tag="vType"):
                    share = shares.get(part.name, 1.0) if part.share is None else part.share
                    some = self._kinds(what, part.name)
                    whole = sum(each for _, each in some)
                    drawn += [(kind, share * each / whole) for kind, each in some]
                refuse_nothing([share for _, share in drawn], what)
                self.drawn_types[name] = tuple(drawn)

    def collect(self, source: Path, top: ET.Element) -> None:
        """Take note of vehicles and flows, and of routes inside them."""
        for element in top:
            if element.tag not in FLEET:
                continue
            name = element.get("id", "")
            what = f"{source}: {element.tag} {name}"
            types = self._kinds(what, element.get("type", DEFAULT_TYPE.id))
            flow = read_flow(element, what) if element.tag == "flow" else None
            at_s = 0.0 if flow else depart_s(element, what)
            ways = []
            for on, share, vclass in self._ways(source, element, what):
                if on not in self.routes.by_name:
                    msg = f"{what}: its route {on} is in no route file or additional file; define it"
                    raise RouteError(msg)
                route = self.routes.by_name[on]
                own = self.routes.stops(element, what, route.cycle_s, since_depart=False)
                kind = next(kind for kind, _ in types if vclass in {"", kind.vclass})
                ways.append(_RouteChoice(on, share, vclass, kind, (*route.stops, *own)))
            self._asked.append(_Asked(element, at_s, flow, types, tuple(ways)))

    def _ways(self, source: Path, element: ET.Element, what: str) -> Iterator[tuple[str, float, str]]:
        """Yield the routes of a vehicle: names, shares, and the classes that they are for, if not for all."""
        name, on = element.get("id", ""), element.get("route", "")
        inner, spread = element.find("route"), element.find("routeDistribution")
        if inner is not None:
            self.routes.add(source, inner, name)
            yield name, 1.0, ""
        elif spread is not None:
            yield from ((one, share, "") for one, share in self.routes.add_spread(source, spread, name))
        elif on:
            yield from ((one, share, "") for one, share in self.routes.drawn.get(on, ((on, 1.0),)))
        elif name in self.led:
            led = self.led[name]
            for vclass, edges in led.items():
                if edges:
                    way = name if len(led) == 1 else f"{name}@{vclass}"
                    self.routes.add(source, ET.Element("route", edges=edges), way)
                    yield way, 1.0, vclass if len(led) > 1 else ""
        else:
            msg = (
                f"{what}: it has no route, only ends between which SUMO would choose a way; "
                f"write its route, closed (duarouter computes routes)"
            )
            raise RouteError(msg)

    def _kinds(self, what: str, name: str) -> tuple[tuple[VehicleType, float], ...]:
        """Return the types from which that of a vehicle is drawn, with shares: mostly one.

        Where a file describes SUMO's own default type, that counts.
        """
        if name in self.drawn_types:
            return self.drawn_types[name]
        if name in self.types or name == DEFAULT_TYPE.id:
            return ((self.types.get(name, DEFAULT_TYPE), 1.0),)
        known = f"; they define {', '.join(list(self.types)[:5])}" if self.types else ""
        msg = f"{what}: its type {shown(name)} is no <vType> of the route files or additional files{known}"
        raise RouteError(msg)

    def make_loops(self) -> list[Loop]:
        """Return the loop of each route, for its first vehicle's class and with the stops of them all."""
        kinds: dict[str, VehicleType] = {}
        stops: dict[str, list[Stop]] = {}
        for way in (way for vehicle in self._asked for way in vehicle.ways):
            kinds.setdefault(way.route, way.type)
            stops.setdefault(way.route, []).extend(way.stops)
        return [
            route.loop(
                self.routes.network, vclass=kinds.get(name, DEFAULT_TYPE).vclass, stops=stops.get(name, ())
            )
            for name, route in self.routes.by_name.items()
        ]

    def on_loops(self, loops: Mapping[str, Loop], path: Path) -> tuple[LoopVehicle, ...]:
        """Return the vehicles on loops by name, with where they depart and where they stop."""
        return tuple(vehicle.on_loops(loops, path) for vehicle in self._asked)


def _depart(what: str, loop: Loop, edge: int, position: str) -> float | None:
    """Return the arc length of a position on an edge by number, or None if it is no number."""
    try:
        position_m = float(position)
    except ValueError:
        return None  # "base", "random", "free": SUMO would choose
    span = loop.roads[edge]
    if not abs(position_m) <= span.length_m + _BEYOND_M:
        msg = f"{what}: departPos is {shown(position)}; edge {span.edge} is {span.length_m:g} m long"
        raise RouteError(msg)
    return span.begin_m + (position_m if position_m >= 0 else span.length_m + position_m)
