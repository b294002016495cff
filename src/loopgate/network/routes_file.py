"""SUMO route files: those whose routes close are loops; of others each vehicle drives its route once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from xml.etree import ElementTree as ET

from loopgate.errors import RouteError
from loopgate.keeping import Kept
from loopgate.network.additional import FLEET, demand_beside
from loopgate.network.clock import time_of
from loopgate.network.content import content_identity
from loopgate.network.departures import Flow, depart_s, read_flow
from loopgate.network.lanes import make_loop, make_route
from loopgate.network.left_out import left_out
from loopgate.network.loop import Loop
from loopgate.network.loop_vehicle import LoopVehicle
from loopgate.network.road import RoadNetwork
from loopgate.network.spreads import parts, share_of
from loopgate.network.stops import (
    Stop,
    StoppingPlace,
    lanes_of_stops,
    on_loop,
    read_stopping_places,
    read_stops,
)
from loopgate.network.sumo_config import is_sumo_config, read_sumo_config
from loopgate.network.trips import MIDDLE, Led, closes, drives_once, lead_trips
from loopgate.network.vehicle_type import DEFAULT_TYPE, VehicleType, vehicle_type
from loopgate.network.xml_file import read_xml
from loopgate.reading import is_file, refusing, shown

_BEYOND_M = 10.0
"""Largest distance of a position beyond its edge [m]: the lanes of an edge differ in length."""

_CARRIED = ("color", "line", "personNumber", "containerNumber")
"""Attributes of vehicles that SUMO is told as they are."""

_CARRIED_ONCE = ("departLane", "departSpeed", "arrivalLane", "arrivalPos", "arrivalSpeed", *MIDDLE)
"""The same, of those who drive once."""


@dataclass(frozen=True, slots=True)
class RoutesFile:
    """The content of a route file or configuration."""

    file: Path
    loops: tuple[Loop, ...]
    """One per route, in the file's order."""
    vehicles: tuple[LoopVehicle, ...]
    """Vehicles and flows on them, in the file's order; possibly none."""
    types: dict[str, VehicleType]
    """The vehicle types that it and its additional files define, by id."""
    default: VehicleType = DEFAULT_TYPE
    """That of vehicles of which no type is said: the first of the file itself, else SUMO's."""
    stops: Mapping[str, tuple[Stop, ...]] = field(default_factory=dict)
    """Of routes, by loop: those of whoever drives on it."""
    stop_files: tuple[Path, ...] = ()
    """The additional files that stops name places of."""
    vehicle_files: tuple[Path, ...] = ()
    """The additional files that hold some of its vehicles."""
    left_out: tuple[str, ...] = ()
    left_out_of_routes: tuple[str, ...] = ()
    """`left_out` and `left_out_of_routes`: what the file says that is not taken over, a line for each kind of
    thing; and without what it says of its vehicles, for those who put others on its loops."""

    @property
    def first_s(self) -> float:
        """When the first vehicle departs [s]."""
        return min((v.flow.begin_s if v.flow else v.depart_s for v in self.vehicles), default=0.0)

    def longest_vehicle(self) -> tuple[float, float]:
        """Return length and minimum gap [m], the largest of the file's vehicles; SUMO's if it has none."""
        drawn = [kind for v in self.vehicles for kind, _ in v.types]
        kinds = [*drawn, *(v.type for v in self.vehicles)] or [self.default]
        return max(kind.length_m for kind in kinds), max(kind.min_gap_m for kind in kinds)

    def drawn(self, seed: int) -> RoutesFile:
        """Return the same with what is drawn of each vehicle or flow as a run's seed has it."""
        return replace(self, vehicles=tuple(one for v in self.vehicles for one in v.drawn(v.id, seed)))

    def robots(self) -> tuple[list[str], list[Loop], dict[str, float]]:
        """Return names and loops of the file's vehicles, or else of its loops, one robot on each.

        The mapping says where the file wants vehicles to start, as arc length [m] by name.
        """
        if not self.vehicles:
            return [loop.id for loop in self.loops], list(self.loops), {}
        starts = {v.id: v.depart_m for v in self.vehicles if v.depart_m is not None}
        return [v.id for v in self.vehicles], [v.loop for v in self.vehicles], starts

    def robot_types(self) -> list[VehicleType]:
        """Return the type of each robot of `robots`: its own, else the file's `default`."""
        if self.vehicles:
            return [vehicle.type for vehicle in self.vehicles]
        return [self.default] * len(self.loops)


@dataclass(frozen=True, slots=True)
class _Route:
    id: str
    edges: tuple[str, ...]
    source: Path
    stops: tuple[Stop, ...]
    cycle_s: float
    again: bool


@dataclass(frozen=True, slots=True)
class _Way:
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
    ways: tuple[_Way, ...]

    def on_loops(self, loops: Mapping[str, Loop], path: Path) -> LoopVehicle:
        """Return it with where it departs and where it stops."""
        ways = tuple((self._on(loops[way.route], way, path), way.share) for way in self.ways)
        first = ways[0][0]
        return replace(
            first,
            types=self.types if len(self.types) > 1 else (),
            ways=ways if len(ways) > 1 or first.vclass else (),
        )

    def _on(self, loop: Loop, way: _Way, path: Path) -> LoopVehicle:
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
class _Found:
    """The content of the files read so far; `users` are the types of the first vehicle of each route."""

    network: RoadNetwork
    places: Mapping[str, StoppingPlace]
    once: bool
    led: Led
    types: dict[str, VehicleType] = field(default_factory=dict)
    drawn_types: dict[str, tuple[tuple[VehicleType, float], ...]] = field(default_factory=dict)
    routes: dict[str, _Route] = field(default_factory=dict)
    drawn_routes: dict[str, tuple[tuple[str, float], ...]] = field(default_factory=dict)
    vehicles: list[_Asked] = field(default_factory=list)
    users: dict[str, VehicleType] = field(default_factory=dict)

    def add(self, source: Path, element: ET.Element, name: str) -> None:
        if name in self.routes:
            other = self.routes[name].source
            msg = f"{source}: route {name}: the id is used twice (also in {other}); rename one"
            raise RouteError(msg)
        edges = tuple(element.get("edges", "").split())
        if not edges:
            msg = f"{source}: route {name}: it lists no edges"
            raise RouteError(msg)
        what = f"{source}: route {name}"
        cycle_s = time_of(element, "cycleTime", what) or 0.0
        stops = self.stops(element, what, cycle_s, since_depart=True)
        again = not self.once or (element.get("repeat", "0") != "0" and closes(self.network, edges))
        self.routes[name] = _Route(name, edges, source, stops, cycle_s, again)

    def stops(
        self, element: ET.Element, what: str, cycle_s: float, *, since_depart: bool
    ) -> tuple[Stop, ...]:
        found = element.findall("stop")
        return read_stops(
            self.network, found, self.places, what=what, cycle_s=cycle_s, since_depart=since_depart
        )


def read_loops(
    network: RoadNetwork, file: Path | str, *, stops: Sequence[Path] = (), once: bool = False
) -> RoutesFile:
    """Read the closed routes of a SUMO route file (``.rou.xml``, also gzipped) or of a ``.sumocfg``.

    Types, vehicles and the routes that they name may stand in additional files, too.

    Routes stand for themselves or inside a vehicle or flow (the loop then bears its name). A route closes
    if its last edge leads to its first, or is its first (as netedit draws loops); `repeat` is not needed.

    Raises `RouteError` if the file cannot be read, holds no route, or a route is no loop that its vehicle can
    drive; the text names file, route and edge.

    Parameters
    ----------
    stops
        Additional files, with the places that its stops name for example, besides those of a configuration.
    once
        Whether vehicles may drive their routes once. If some have to, since these do not close or are trips,
        all do but those whose route has ``repeat``; trips are led by SUMO's router.

    Examples
    --------
    >>> from loopgate import RoadNetwork, read_loops
    >>> network = RoadNetwork.open("networks/order2.net.xml")
    >>> file = read_loops(network, "routes/order2.rou.xml")
    >>> len(file.loops)
    5
    """
    path = Path(file)
    with refusing(path, "route file", RouteError):
        content = content_identity(path) if network.content and is_file(path) else ""
    if not content:
        return _read(network, path, stops, once=once)
    # Messages and the result name the files, so they are part of the key.
    beside = tuple((str(one), content_identity(one) if is_file(one) else "") for one in stops)
    key = (network.content, str(file), content, beside, once)
    return _KEPT.get(key, lambda: _read(network, path, stops, once=once))


_KEPT: Kept[RoutesFile] = Kept(8)


def _read(network: RoadNetwork, path: Path, stops: Sequence[Path], *, once: bool) -> RoutesFile:
    config = read_sumo_config(path) if is_sumo_config(path) else None
    files = config.route_files if config else (path,)
    beside = (*config.additional_files, *stops) if config else tuple(stops)
    own = [(f, read_xml(f, root="routes", what="route file", error=RouteError)) for f in files]
    more = demand_beside(beside, own)
    tops = [*own, *more]
    if not tops:
        msg = f'{path}: the configuration names no route files; expected <route-files value="..."/>'
        raise RouteError(msg)
    asked = any(next(top.iter("stop"), None) is not None for _, top in tops)
    places = read_stopping_places(beside) if asked else {}
    fleet = [(source, one) for source, top in tops for one in top if one.tag in FLEET]
    once = once and drives_once(network, tops, fleet)
    found = _Found(network, places, once, {})
    _collect_types([*more, *own], found)
    if once:
        kinds = [one for _, top in tops for one in top.iter("vType") if one.get("id")]
        classes = {name: _first_of_class(spread) for name, spread in found.drawn_types.items()}
        found.led = lead_trips(network, fleet, kinds, beside, classes=classes)
    lost = {name for name, ways in found.led.items() if not any(ways.values())}
    for _, top in tops:
        for one in [one for one in top if one.tag in FLEET and one.get("id", "") in lost]:
            top.remove(one)
    for source, top in tops:
        _collect_routes(source, top, found)
    for source, top in tops:
        _collect_vehicles(source, top, found)
    if not found.routes:
        msg = f"{path}: no routes in it; expected <route> elements whose last edge leads to the first"
        raise RouteError(msg)
    loops = [_loop(network, route, found) for route in found.routes.values()]
    by_id = {loop.id: loop for loop in loops}
    vehicles = tuple(vehicle.on_loops(by_id, path) for vehicle in found.vehicles)
    ways = [way for vehicle in vehicles for way in (vehicle, *(one for one, _ in vehicle.ways))]
    at_routes = {
        route.id: on_loop(by_id[route.id], route.stops, f"{route.source}: route {route.id}")
        for route in found.routes.values()
        if route.stops
    }
    own_kinds = (kind.get("id", "") for _, top in own for kind in top.iter("vType"))
    used = {stop.name for some in (*at_routes.values(), *(v.stops for v in ways)) for stop in some}
    return RoutesFile(
        path,
        tuple(loops),
        vehicles,
        found.types,
        default=next((found.types[name] for name in own_kinds if name in found.types), DEFAULT_TYPE),
        stops=at_routes,
        stop_files=tuple(dict.fromkeys(place.file for name, place in places.items() if name in used)),
        vehicle_files=tuple(file for file, top in more if any(one.tag in FLEET for one in top)),
        left_out=(*_wayless(path, found.led), *left_out(tops, fleet=True, once=once)),
        left_out_of_routes=left_out(tops, fleet=False),
    )


def _loop(network: RoadNetwork, route: _Route, found: _Found) -> Loop:
    if not route.again:
        vclass = found.users.get(route.id, DEFAULT_TYPE).vclass
        return make_route(network, route.id, route.edges, vclass=vclass, source=str(route.source))
    ways = (way for vehicle in found.vehicles for way in vehicle.ways)
    stops = [stop for way in ways if way.route == route.id for stop in way.stops]
    return make_loop(
        network,
        route.id,
        one_round(route.edges),
        vclass=found.users.get(route.id, DEFAULT_TYPE).vclass,
        source=str(route.source),
        on_lanes=lanes_of_stops((*route.stops, *stops)),
    )


def _depart(what: str, loop: Loop, edge: int, position: str) -> float | None:
    """Return the arc length of a position on an edge by number, or None if it is no number."""
    try:
        position_m = float(position)
    except ValueError:
        return None  # "base", "random", "free": SUMO would choose
    span = [span for span in loop.spans if not span.internal][edge]
    if not abs(position_m) <= span.length_m + _BEYOND_M:
        msg = f"{what}: departPos is {shown(position)}; edge {span.edge} is {span.length_m:g} m long"
        raise RouteError(msg)
    return span.begin_m + (position_m if position_m >= 0 else span.length_m + position_m)


def _collect_routes(source: Path, top: ET.Element, found: _Found) -> None:
    for number, element in enumerate(top.findall("route")):
        found.add(source, element, element.get("id") or f"route{number}")
    for spread in top.findall("routeDistribution"):
        name = spread.get("id", "distribution")
        found.drawn_routes[name] = _drawn_routes(source, spread, name, found)


def _drawn_routes(
    source: Path, spread: ET.Element, name: str, found: _Found
) -> tuple[tuple[str, float], ...]:
    """Take note of the routes of a distribution; return their names and shares."""
    what = f"{source}: routeDistribution {name}"
    drawn: list[tuple[str, float]] = []
    own = 0
    for part in parts(spread, what, named="routes", tag="route"):
        route = part.name
        if part.element is not None:
            route = part.name or f"{name}.{own}"
            own += 1
            found.add(source, part.element, route)
        drawn.append((route, 1.0 if part.share is None else part.share))
    _refuse_nothing(what, [share for _, share in drawn])
    return tuple(drawn)


def _refuse_nothing(what: str, shares: Sequence[float]) -> None:
    if not any(shares):
        msg = f"{what}: nothing can be drawn from it; name something with a probability above 0"
        raise RouteError(msg)


def _collect_types(tops: Sequence[tuple[Path, ET.Element]], found: _Found) -> None:
    """Take note of types, and of their distributions in SUMO's order: one may name those before it."""
    shares: dict[str, float] = {}
    for source, top in tops:
        for element in (one for one in top.iter("vType") if one.get("id")):
            kind = vehicle_type(element, str(source))
            found.types[kind.id] = kind
            shares[kind.id] = share_of(element, f"{source}: vType {kind.id}")
    for source, top in tops:
        for spread in top.findall("vTypeDistribution"):
            name = spread.get("id", "")
            what = f"{source}: vTypeDistribution {name}"
            drawn: list[tuple[VehicleType, float]] = []
            for part in parts(spread, what, named="vTypes", tag="vType"):
                share = shares.get(part.name, 1.0) if part.share is None else part.share
                some = _kinds(what, part.name, found)
                whole = sum(each for _, each in some)
                drawn += [(kind, share * each / whole) for kind, each in some]
            _refuse_nothing(what, [share for _, share in drawn])
            found.drawn_types[name] = tuple(drawn)


def _first_of_class(spread: Sequence[tuple[VehicleType, float]]) -> dict[str, str]:
    """Return the first type of each class of vehicles in a distribution, by class."""
    return {kind.vclass: kind.id for kind, _ in reversed(spread)}


def _wayless(path: Path, led: Led) -> Iterator[str]:
    """Say which trips are left out since there is no way between their ends."""
    lost = [name for name, ways in led.items() if not any(ways.values())]
    if lost:
        yield f"{path}: {len(lost)} vehicles find no way and are left out, first {lost[0]}"
    some = [name for name, ways in led.items() if any(ways.values()) and not all(ways.values())]
    if some:
        yield (
            f"{path}: {len(some)} trips or flows find no way for all classes of their type, and are left out "
            f"where such a one is drawn, first {some[0]}"
        )


def _collect_vehicles(source: Path, top: ET.Element, found: _Found) -> None:
    for element in top:
        if element.tag not in FLEET:
            continue
        name = element.get("id", "")
        what = f"{source}: {element.tag} {name}"
        types = _kinds(what, element.get("type", DEFAULT_TYPE.id), found)
        flow = read_flow(element, what) if element.tag == "flow" else None
        at_s = 0.0 if flow else depart_s(element, what)
        ways = []
        for on, share, vclass in _ways(source, element, what, found):
            if on not in found.routes:
                msg = f"{what}: its route {on} is in no route file or additional file; define it"
                raise RouteError(msg)
            route = found.routes[on]
            own = found.stops(element, what, route.cycle_s, since_depart=False)
            kind = next(kind for kind, _ in types if vclass in {"", kind.vclass})
            ways.append(_Way(on, share, vclass, kind, (*route.stops, *own)))
            found.users.setdefault(on, kind)
        found.vehicles.append(_Asked(element, at_s, flow, types, tuple(ways)))


def _ways(source: Path, element: ET.Element, what: str, found: _Found) -> Iterator[tuple[str, float, str]]:
    """Yield the routes of a vehicle: names, shares, and the classes that they are for, if not for all."""
    name, on = element.get("id", ""), element.get("route", "")
    inner, spread = element.find("route"), element.find("routeDistribution")
    if inner is not None:
        found.add(source, inner, name)
        yield name, 1.0, ""
    elif spread is not None:
        yield from ((one, share, "") for one, share in _drawn_routes(source, spread, name, found))
    elif on:
        yield from ((one, share, "") for one, share in found.drawn_routes.get(on, ((on, 1.0),)))
    elif name in found.led:
        led = found.led[name]
        for vclass, edges in led.items():
            if edges:
                way = name if len(led) == 1 else f"{name}@{vclass}"
                found.add(source, ET.Element("route", edges=edges), way)
                yield way, 1.0, vclass if len(led) > 1 else ""
    else:
        msg = (
            f"{what}: it has no route, only ends between which SUMO would choose a way; "
            f"write its route, closed (duarouter computes routes)"
        )
        raise RouteError(msg)


def _kinds(what: str, name: str, found: _Found) -> tuple[tuple[VehicleType, float], ...]:
    """Return the types from which that of a vehicle is drawn, with shares: mostly one."""
    return found.drawn_types.get(name) or ((_kind(what, name, found.types), 1.0),)


def _kind(what: str, name: str, types: Mapping[str, VehicleType]) -> VehicleType:
    """Return the type of this name; what a file says of SUMO's own default type holds."""
    if name in types or name == DEFAULT_TYPE.id:
        return types.get(name, DEFAULT_TYPE)
    known = f"; they define {', '.join(list(types)[:5])}" if types else ""
    msg = f"{what}: its type {shown(name)} is no <vType> of the route files or additional files{known}"
    raise RouteError(msg)


def one_round(edges: Sequence[str]) -> tuple[str, ...]:
    """Return one round of a route: without the first edge at its end, and without whole repetitions."""
    once = tuple(edges[:-1]) if len(edges) > 1 and edges[0] == edges[-1] else tuple(edges)
    for length in range(1, len(once) // 2 + 1):
        if len(once) % length == 0 and once == once[:length] * (len(once) // length):
            return once[:length]
    return once
