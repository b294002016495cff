"""SUMO route files: closed routes are loops; on other routes each vehicle drives once."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from xml.etree import ElementTree as ET

from loopgate.cache import Cache
from loopgate.errors import NobodyGatedError, RouteError
from loopgate.network.additional import FLEET, PERSONS, demand_beside
from loopgate.network.circling import Leads, Led, read_leads
from loopgate.network.clock import as_number, time_of
from loopgate.network.lanes import make_loop
from loopgate.network.loop import Loop
from loopgate.network.road import RoadNetwork, content_identity
from loopgate.network.route_lanes import RouteChoices
from loopgate.network.stops import (
    STOP_ATTRIBUTES,
    NotAheadError,
    Places,
    Stop,
    edge_of_stop,
    lanes_of_stops,
    on_loop,
    read_stopping_places,
    read_stops,
    stops_of_one_round,
)
from loopgate.network.sumo_checks import check_fleet, check_type_names
from loopgate.network.sumo_config import is_sumo_config, read_sumo_config
from loopgate.network.trips import (
    ENDS,
    MIDDLE,
    LedVehicle,
    closes,
    departs_s,
    drives_once,
    lead_trips,
    one_round,
)
from loopgate.network.ungated import Ungated, UngatedFleet, by_kind, take_ungated
from loopgate.network.vehicle_demand import (
    FLOW_ATTRIBUTES,
    Flow,
    RoutesFile,
    VehicleDemand,
    depart_s,
    read_flow,
)
from loopgate.network.vehicle_type import (
    DEFAULT_TYPE,
    VehicleType,
    parts,
    refuse_nothing,
    share_of,
    sumo_attributes,
    vehicle_type,
    vehicle_types_of,
)
from loopgate.network.xml_file import read_xml
from loopgate.reading import as_path, counted, is_file, listed, of_kind, refusing, shown

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
    led: Led = field(default_factory=Led)

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
        depart_m = _depart(what, loop, edge, said.get("departPos", ""))
        from_m = loop.roads[edge].begin_m if depart_m is None else depart_m
        return VehicleDemand(
            name,
            loop,
            way.type,
            depart_m=depart_m,
            depart_s=self.depart_s,
            flow=self.flow,
            edge=edge,
            stops=on_loop(loop, way.stops, what, from_m=from_m),
            attributes={key: said[key] for key in carried if said.get(key)},
            parameters={one.get("key", ""): one.get("value", "") for one in self.element.findall("param")},
            vclass=way.vclass,
            led=self.led,
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
    | {"departLane", "departSpeed", "arrivalLane", "arrivalPos", "arrivalSpeed"}
)
"""Further attributes that loopgate reads of vehicles that drive once."""

_AS_IT_IS = {"departSpeed": 0.0}
"""Attributes with a value that has no effect."""

_MEANS = {
    "departPos": "a vehicle departs where its place has room",
    "departLane": "a vehicle starts on the lane that its loop needs there",
    "departSpeed": "vehicles start from rest",
    "speedFactor": "give it as speedFactor of a vType, so that the gate knows of it",
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
        for (name, as_written), count in found.items():
            means = f": {_MEANS[name]}" if name in _MEANS else ""
            times = f"{count} times, first" if count > 1 else "once,"
            where = f" ({times} in {first[name, as_written]})" if first[name, as_written] else ""
            lines.append(f"{source}: {as_written} is left out{where}{means}")
        lines += [
            f"{source}: SUMO has no attribute {name} of <vType>{where}" for name, where in _of_no_type(top)
        ]
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
        if child.tag in PERSONS and fleet:
            continue
        if child.tag not in _TAKEN:
            if fleet or element.tag != "routes":
                yield (child.tag, f"<{child.tag}>"), owner if element.tag != "routes" else child.get("id", "")
        elif fleet or child.tag not in _FLEET:
            yield from _untaken(child, fleet=fleet, drawn=_DRAWN.get(element.tag, frozenset()))


def _of_no_type(top: ET.Element) -> Iterator[tuple[str, str]]:
    """Yield each attribute that types have and SUMO's schema does not, and where it is."""
    found: dict[str, list[str]] = {}
    for kind in top.iter("vType"):
        for name in kind.attrib.keys() - sumo_attributes("vType"):
            found.setdefault(name, []).append(kind.get("id", ""))
    for name, kinds in sorted(found.items()):
        times = f"{len(kinds)} times, first" if len(kinds) > 1 else "once,"
        yield name, f" ({times} in vType {kinds[0]})"


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


def take_empty_flows(tops: Sequence[tuple[Path, ET.Element]]) -> tuple[str, ...]:
    """Remove flows whose number is 0 from files, as SUMO does, and return a line for each file with some."""
    lines = []
    for source, top in tops:
        names = []
        for one in top.findall("flow"):
            with suppress(RouteError):  # reading the vehicles reports the error
                if read_flow(one, "").number == 0:
                    top.remove(one)
                    names.append(one.get("id", ""))
        if names:
            lines.append(
                f"{source}: {counted(len(names), 'flow')} left out, as number is 0, first {names[0]}"
            )
    return tuple(lines)


def read_loops(
    network: RoadNetwork, file: Path | str, *, stops: Sequence[Path] = (), once: bool = False
) -> RoutesFile:
    """Read the closed routes of a SUMO route file (``.rou.xml``, also gzipped) or of a ``.sumocfg``.

    Types, vehicles and routes may also be in additional files. A route may be inside a vehicle or flow; the
    loop then has the name of the vehicle or flow. A route is closed if its last edge leads to its first edge,
    or is its first edge after others; `repeat` is not needed.

    Raises `RouteError` if the file cannot be read or has no route, or a route is not a loop that its vehicle
    can drive; the message names file, route and edge.

    Parameters
    ----------
    stops
        Further additional files, such as a file of bus stops.
    once
        Whether vehicles may drive their routes once. If the file has an open route or a trip, all vehicles
        drive once, except on routes with ``repeat``; SUMO's router finds the routes of trips.

    Examples
    --------
    >>> from loopgate import RoadNetwork, read_loops
    >>> network = RoadNetwork.open("networks/order2.net.xml")
    >>> file = read_loops(network, "routes/order2.rou.xml")
    >>> len(file.loops)
    5
    """
    path = as_path(file, "route file", RouteError)
    network = of_kind(RoadNetwork, network, "read_loops: the network", RouteError, "a RoadNetwork")
    with refusing(path, "route file", RouteError):
        content = content_identity(path) if network.content and is_file(path) else ""
    if not content:
        return _read(network, path, stops, once=once)
    # Messages and the result name the files, so they are part of the key.
    beside = tuple((str(one), content_identity(one) if is_file(one) else "") for one in stops)
    key = (network.content, str(file), content, beside, once)
    return _KEPT.get(key, lambda: _read(network, path, stops, once=once))


_KEPT: Cache[RoutesFile] = Cache(8)


def _read(network: RoadNetwork, path: Path, stops: Sequence[Path], *, once: bool) -> RoutesFile:
    config = read_sumo_config(path) if is_sumo_config(path) else None
    files = config.route_files if config else (path,)
    beside = (*config.additional_files, *stops) if config else tuple(stops)
    own = [(f, read_xml(f, root="routes", what="route file", error=RouteError)) for f in files]
    more = demand_beside(beside, own)
    tops = [*own, *more]
    empty = take_empty_flows(tops)
    _refuse_no_demand(network, path, tops, empty if once else ())
    asked = any(next(top.iter("stop"), None) is not None for _, top in tops)
    places = read_stopping_places(beside) if asked else {}
    fleet = [(source, one) for source, top in tops for one in top if one.tag in FLEET]
    check_type_names(tops)
    check_fleet(fleet)
    ignores = config is not None and config.is_true("ignore-route-errors")
    found = _Found(network, places, once, ignores)
    found.collect_types([*more, *own])
    found.collect_types_of_network(element.get("type", DEFAULT_TYPE.id) for _, element in fleet)
    leads = _read_leads(network, beside, tops, found)
    if leads is not None:
        found.led = _lead(network, tops, fleet, beside, found)
        found.follow(leads, fleet, tops)
    goes_on = any(led.goes_on for led in found.led_by.values())
    once = found.once = once and (goes_on or drives_once(network, tops, fleet))
    vehicle_files = tuple(file for file, top in more if any(one.tag in FLEET for one in top))
    ungated = take_ungated(tops, own, once=once)
    gone = {id(one.element) for one in ungated.vehicles}
    fleet = [(source, one) for source, one in fleet if id(one) not in gone]
    own_kinds = [kind.get("id", "") for _, top in own for kind in top.iter("vType")]
    found.refuse_types([one.get("type", DEFAULT_TYPE.id) for _, one in fleet] or own_kinds[:1])
    if once and leads is None:
        found.led = _lead(network, tops, fleet, beside, found)
    _leave_out_wayless(path, tops, found.led, alone=not ungated.vehicles)
    for source, top in tops:
        found.collect_routes(source, top)
    for source, top in tops:
        found.collect_vehicles(source, top)
    found.refuse_wrong()
    if not found.routes:
        refuse_nobody(path, ungated)
        msg = f"{path}: no routes in it; expected <route> elements whose last edge leads to the first"
        raise RouteError(msg)
    loops = found.make_loops()
    vehicles, at_routes = found.on_loops({loop.id: loop for loop in loops}, path)
    ungated = found.with_unfit(ungated, own)
    if not vehicles:
        refuse_nobody(path, ungated)
    ways = [way for vehicle in vehicles for way in (vehicle, *(one for one, _ in vehicle.ways))]
    used = {
        (stop.kind, stop.name) for some in (*at_routes.values(), *(v.stops for v in ways)) for stop in some
    }
    return RoutesFile(
        path,
        tuple(loops),
        vehicles,
        found.types,
        default=next((found.types[name] for name in own_kinds if name in found.types), DEFAULT_TYPE),
        stops=at_routes,
        stop_files=tuple(dict.fromkeys(place.file for one, place in places.items() if one in used)),
        vehicle_files=vehicle_files,
        ungated=ungated,
        persons=tuple(_persons(own)),
        left_out=(
            *empty,
            *found.circling(path),
            *wayless(path, found.led),
            *(f"{why}; no vehicle uses it" for why in found.unfit.values()),
            *found.undriven.values(),
            *left_out(tops, fleet=True, once=once),
        ),
        left_out_of_routes=(*found.undriven.values(), *left_out(tops, fleet=False)),
    )


def _refuse_no_demand(network: RoadNetwork, path: Path, tops: Tops, empty: Sequence[str]) -> None:
    """Raise `NobodyGatedError` if a configuration has no vehicles, and no loops for vehicles either.

    The same if `empty` flows, which are left out, were the only ones.
    """
    every = [one for _, top in tops for one in top]
    if empty and not any(one.tag in FLEET for one in every):
        msg = f"{path}: none of its vehicles is gated: number of each flow is 0; or --gate open"
        raise NobodyGatedError(msg)
    routes = [_edges_of(one) for one in every if one.tag == "route"]
    nobody = is_sumo_config(path) and not any(one.tag in FLEET for one in every)
    if not tops or (nobody and not (routes and all(closes(network, edges) for edges in routes))):
        what = "it has no vehicles" if tops else "it names no route files"
        msg = f"{path}: none of its vehicles is gated: {what}; or --gate open"
        raise NobodyGatedError(msg)


def _leave_out_wayless(path: Path, tops: Tops, led: LedVehicle, *, alone: bool) -> None:
    """Remove the trips without a way from files of vehicles.

    Raises `RouteError` if no vehicle is left and there are no others (`alone`).
    """
    lost = {name for name, ways in led.items() if not any(ways.values())}
    fleet = [(top, one) for _, top in tops for one in top if one.tag in FLEET]
    gone = [(top, one) for top, one in fleet if one.get("id", "") in lost]
    if alone and gone and len(gone) == len(fleet):
        msg = (
            f"{path}: no vehicle finds a way between its ends, first {gone[0][1].get('id', '')}; correct its "
            f"ends or its class"
        )
        raise RouteError(msg)
    for top, one in gone:
        top.remove(one)


def _persons(own: Tops) -> Iterator[ET.Element]:
    """Yield the persons and containers of route files, after their types."""
    found = [one for _, top in own for one in top if one.tag in PERSONS]
    kinds = {one.get("type", "") for person in found for one in person.iter()} - {""}
    yield from (one for _, top in own for one in top.iter("vType") if one.get("id") in kinds)
    yield from found


def refuse_nobody(path: Path, ungated: UngatedFleet) -> None:
    """Raise `NobodyGatedError` if there are only vehicles that no gate can drive."""
    if not ungated.vehicles:
        return
    whys = by_kind({one.id: one.why for one in ungated.vehicles})
    told = "; ".join(f"{counted(len(names), 'vehicle')}, first {names[0]}: {why}" for why, names in whys)
    msg = f"{path}: none of its vehicles is gated: {told}; or --gate open"
    raise NobodyGatedError(msg)


Tops = Sequence[tuple[Path, ET.Element]]
"""Files with their topmost elements."""


def _edges_of(route: ET.Element) -> tuple[str, ...]:
    return tuple(route.get("edges", "").split())


def _put_on(element: ET.Element, route: str, at: int) -> None:
    """Let a vehicle, trip or flow drive another route, from its edge number `at` on."""
    for name in (*ENDS, *MIDDLE, "departEdge"):
        element.attrib.pop(name, None)
    for inner in element.findall("route"):
        element.remove(inner)
    element.set("route", route)
    if at:
        element.set("departEdge", f"{at}")


def _does(led: Led) -> str:
    """Return what rerouters do to vehicles, and what loopgate does instead; empty if they change nothing."""
    if led.unknown:
        return ""
    if led.round:
        return "loopgate keeps {} vehicles circling in place of these rerouters"
    if led.goes_on:
        return "{} vehicles led on without end; the way of each is drawn beforehand, as SUMO draws it"
    return "{} vehicles led another way; they drive that from the start" if led.route else ""


def _lead(
    network: RoadNetwork,
    tops: Sequence[tuple[Path, ET.Element]],
    fleet: Sequence[tuple[Path, ET.Element]],
    beside: Sequence[Path],
    found: _Found,
) -> LedVehicle:
    """Return the routes of vehicles whose ends alone are known."""
    kinds = [one for _, top in tops for one in top.iter("vType") if one.get("id") in found.types]
    classes = {name: _first_of_class(spread) for name, spread in found.drawn_types.items()}
    return lead_trips(network, fleet, kinds, beside, classes=classes)


def _read_leads(
    network: RoadNetwork, beside: Sequence[Path], tops: Sequence[tuple[Path, ET.Element]], found: _Found
) -> Leads | None:
    vclasses = {kind.vclass for kind in found.types.values()} | {DEFAULT_TYPE.vclass}
    routes = (one for _, top in tops for one in top.iter("route") if one.get("id"))
    return read_leads(network, beside, routes, sorted(vclasses))


def _first_of_class(spread: Sequence[tuple[VehicleType, float]]) -> dict[str, str]:
    """Return the first type of each class of vehicles in a distribution, by class."""
    return {kind.vclass: kind.id for kind, _ in reversed(spread)}


@dataclass(frozen=True, slots=True)
class _Route:
    id: str
    edges: tuple[str, ...]
    source: Path
    stops: tuple[Stop, ...]
    cycle_s: float
    again: bool
    """Whether vehicles drive it round and round."""

    @property
    def rounds(self) -> int:
        """For how many rounds the file writes it out."""
        return len(self.edges) // len(one_round(self.edges)) if self.again else 1

    def loop(self, network: RoadNetwork, choices: RouteChoices, vclass: str, stops: Sequence[Stop]) -> Loop:
        """Return the route over lanes that a vehicle class may use and that reach all stops."""
        source = str(self.source)
        if not self.again:
            return choices.make(self.id, self.edges, vclass=vclass, source=source)
        lanes = lanes_of_stops((*self.stops, *stops))
        edges = one_round(self.edges)
        return make_loop(network, self.id, edges, vclass=vclass, source=source, on_lanes=lanes)


@dataclass(slots=True)
class _Found:
    """The content of the files read so far: routes, types, vehicles, and distributions."""

    network: RoadNetwork
    places: Places
    once: bool
    ignores: bool = False
    """Whether SUMO leaves out a stop that is not ahead of its vehicle, in place of refusing it."""
    led: LedVehicle = field(default_factory=dict)
    """The edges of trips, found before vehicles are collected."""
    routes: dict[str, _Route] = field(default_factory=dict)
    """The routes, by name."""
    types: dict[str, VehicleType] = field(default_factory=dict)
    unfit: dict[str, str] = field(default_factory=dict)
    """Why a type, or a distribution of types, makes no sense, by name: only its vehicles are refused."""
    drawn_routes: dict[str, tuple[tuple[str, float], ...]] = field(default_factory=dict)
    drawn_types: dict[str, tuple[tuple[VehicleType, float], ...]] = field(default_factory=dict)
    """`drawn_routes` and `drawn_types`: the parts of each distribution with their shares, by name."""
    rounds: set[str] = field(default_factory=set)
    """The routes that rerouters let vehicles drive again and again, by name."""
    led_by: dict[str, Led] = field(default_factory=dict)
    """Where rerouters lead vehicles, trips and flows, by name."""
    unfit_vehicles: list[Ungated] = field(default_factory=list)
    """The vehicles on open routes whose stops no gate can make."""
    undriven: dict[str, str] = field(default_factory=dict)
    """Why a route that no vehicle drives makes no sense, by name."""
    _asked: list[AskedVehicle] = field(default_factory=list)
    _wrong: list[str] = field(default_factory=list)

    def collect_types(self, tops: Sequence[tuple[Path, ET.Element]]) -> None:
        """Collect types and their distributions in SUMO's order: each may name earlier ones."""
        shares: dict[str, float] = {}
        for source, top in tops:
            for element in (one for one in top.iter("vType") if one.get("id")):
                name = element.get("id", "")
                try:
                    self.types[name] = vehicle_type(element, str(source))
                    shares[name] = share_of(element, f"{source}: vType {name}")
                except RouteError as error:
                    self.unfit[name] = str(error)
        for source, top in tops:
            for spread in top.findall("vTypeDistribution"):
                name = spread.get("id", "")
                try:
                    self.drawn_types[name] = self._spread(
                        spread, f"{source}: vTypeDistribution {name}", shares
                    )
                except RouteError as error:
                    self.unfit[name] = str(error)

    def collect_types_of_network(self, used: Iterable[str]) -> None:
        """Collect the types in the network's file, as SUMO does, if a vehicle's type is in no other."""
        missing = {*used} - {*self.types, *self.unfit, *self.drawn_types, DEFAULT_TYPE.id}
        if missing and is_file(self.network.file):
            top = ET.Element("net")
            top.extend(vehicle_types_of(self.network.file))
            self.collect_types([(self.network.file, top)])

    def _spread(
        self, spread: ET.Element, what: str, shares: Mapping[str, float]
    ) -> tuple[tuple[VehicleType, float], ...]:
        """Return the types of a distribution, with their shares."""
        drawn: list[tuple[VehicleType, float]] = []
        for part in parts(spread, what, named="vTypes", tag="vType"):
            share = shares.get(part.name, 1.0) if part.share is None else part.share
            some = self._kinds(what, part.name)
            whole = sum(each for _, each in some)
            drawn += [(kind, share * each / whole) for kind, each in some]
        refuse_nothing([share for _, share in drawn], what)
        return tuple(drawn)

    def refuse_types(self, used: Iterable[str]) -> None:
        """Raise `RouteError` if a type that a vehicle uses makes no sense."""
        wrong = dict.fromkeys(self.unfit[name] for name in used if name in self.unfit)
        if wrong:
            raise RouteError("; ".join(wrong))

    def follow(self, leads: Leads, fleet: Sequence[tuple[Path, ET.Element]], tops: Tops) -> None:
        """Give each vehicle the way on which rerouters lead it, by a new route in its file."""
        routes = {one.get("id", ""): one for _, top in tops for one in top.iter("route") if one.get("id")}
        there = dict(tops)
        made: dict[tuple[str, ...], str] = {}
        left: set[str] = set()  # routes that vehicles do not drive any more
        for source, element in fleet:
            name, on = element.get("id", ""), element.get("route", "")
            inner = element.find("route")
            route = inner if inner is not None else routes.get(on)
            edges = _edges_of(route) if route is not None else self._led_edges(name)
            if not edges:
                continue  # a distribution of routes, or no way at all
            at = int(as_number(element.get("departEdge", "0"), default=0.0)) % len(edges)
            kind = element.get("type", DEFAULT_TYPE.id)
            led = leads.lead(self.network, edges, at, kind, self._vclass(kind), departs_s(element))
            if any(one is not None and one.find("stop") is not None for one in (element, route)):
                led = replace(led, round=())  # it makes its stops once
            if led.route and not self._edges_of_stops(element) <= set(led.route):
                first = f"rerouter {led.rerouters[0]} at {edges[at]}"
                led = Led(led.rerouters, unknown=f"{first}: its way misses stops")
            if led.rerouters:
                self.led_by[name] = led
            own = led.round or led.route
            if own and own not in made:
                made[own] = f"{on}@{'round' if led.round else 'rerouted'}" if on else name
                ET.SubElement(there[source], "route", id=made[own], edges=" ".join(own))
                self.rounds |= {made[own]} if led.round else set()
                left.add(on)
            if own:
                _put_on(element, made[own], led.at)
        driven = {element.get("route", "") for _, element in fleet}
        for _, top in tops:
            for one in [one for one in top.findall("route") if one.get("id", "") in left - driven]:
                top.remove(one)

    def _edges_of_stops(self, element: ET.Element) -> set[str]:
        """Return the edges on which a vehicle stops."""
        return {edge_of_stop(stop, self.places) for stop in element.iter("stop")}

    def _led_edges(self, name: str) -> tuple[str, ...]:
        """Return the edges that SUMO's router has found for a vehicle of one class."""
        ways = list(self.led.get(name, {}).values())
        return tuple(ways[0].split()) if len(ways) == 1 else ()

    def _vclass(self, kind: str) -> str:
        """Return the class of a type, or of the first of a distribution."""
        spread = self.drawn_types.get(kind)
        return (spread[0][0] if spread else self.types.get(kind, DEFAULT_TYPE)).vclass

    def circling(self, path: Path) -> Iterator[str]:
        """Yield how rerouters lead vehicles, a line for each set of rerouters."""
        by_rerouters: dict[tuple[tuple[str, ...], str], list[AskedVehicle]] = {}
        for one in self._asked:
            if does := _does(one.led):
                by_rerouters.setdefault((one.led.rerouters, does), []).append(one)
        for (rerouters, does), some in by_rerouters.items():
            numbers = [one.flow.number if one.flow else 1 for one in some]
            many = "the" if None in numbers else f"{sum(n or 0 for n in numbers)}"
            names = listed([one.element.get("id", "") for one in some], 3)
            yield f"{path}: {names}: {listed(rerouters)}: {does.format(many)}"
        for one in (one for one in self._asked if one.led.unknown and self.routes[one.ways[0].route].again):
            yield f"{path}: {one.element.get('id', '')}: {one.led.unknown}: it leads nobody off a loop"

    def collect_routes(self, source: Path, top: ET.Element) -> None:
        """Collect the routes that are not inside a vehicle."""
        for number, element in enumerate(top.findall("route")):
            self._add(source, element, element.get("id") or f"route{number}")
        for spread in top.findall("routeDistribution"):
            name = spread.get("id", "distribution")
            if name in self.drawn_routes:
                msg = f"{source}: routeDistribution {name}: the id is used twice; rename one"
                raise RouteError(msg)
            self.drawn_routes[name] = self._add_spread(source, spread, name)

    def _add(self, source: Path, element: ET.Element, name: str) -> None:
        """Add a route; raise `RouteError` if its name is taken or it has no edges."""
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
        stops = self._stops(element, what, cycle_s, since_depart=True)
        repeats = name in self.rounds or element.get("repeat", "0") != "0"
        again = not self.once or (repeats and closes(self.network, edges))
        self.routes[name] = _Route(name, edges, source, stops, cycle_s, again)

    def _add_spread(self, source: Path, spread: ET.Element, name: str) -> tuple[tuple[str, float], ...]:
        """Add the routes of a distribution; return their names and shares."""
        what = f"{source}: routeDistribution {name}"
        drawn: list[tuple[str, float]] = []
        own = 0
        for part in parts(spread, what, named="routes", tag="route"):
            route = part.name
            if part.element is not None:
                route = part.name or f"{name}.{own}"
                own += 1
                self._add(source, part.element, route)
            drawn.append((route, 1.0 if part.share is None else part.share))
        refuse_nothing([share for _, share in drawn], what)
        return tuple(drawn)

    def _stops(
        self, element: ET.Element, what: str, cycle_s: float, *, since_depart: bool
    ) -> tuple[Stop, ...]:
        """Return the stops inside a route or vehicle."""
        stops, since = element.findall("stop"), since_depart
        return read_stops(self.network, stops, self.places, what=what, cycle_s=cycle_s, since_depart=since)

    def collect_vehicles(self, source: Path, top: ET.Element) -> None:
        """Collect vehicles and flows, and the routes inside them."""
        for element in (one for one in top if one.tag in FLEET):
            try:
                self._asked.append(self._vehicle(source, element))
            except RouteError as error:
                self._wrong.append(str(error))

    def refuse_wrong(self) -> None:
        """Raise one `RouteError` about all vehicles that are invalid or that no gate can drive."""
        if self._wrong:
            raise RouteError("; ".join(self._wrong))

    def _vehicle(self, source: Path, element: ET.Element) -> AskedVehicle:
        name = element.get("id", "")
        what = f"{source}: {element.tag} {name}"
        types = self._kinds(what, element.get("type", DEFAULT_TYPE.id))
        flow = read_flow(element, what) if element.tag == "flow" else None
        at_s = 0.0 if flow else depart_s(element, what)
        ways = []
        for on, share, vclass in self._ways(source, element, what):
            if on not in self.routes:
                msg = f"{what}: its route {on} is in no route file or additional file; define it"
                raise RouteError(msg)
            route = self.routes[on]
            own = self._stops(element, what, route.cycle_s, since_depart=False)
            kind = next(kind for kind, _ in types if vclass in {"", kind.vclass})
            stops = stops_of_one_round((*route.stops, *own), route.rounds)
            ways.append(RouteChoice(on, share, vclass, kind, stops))
        return AskedVehicle(element, at_s, flow, types, tuple(ways), self.led_by.get(name, Led()))

    def _ways(self, source: Path, element: ET.Element, what: str) -> Iterator[tuple[str, float, str]]:
        """Yield the routes of a vehicle: name, share, and the vehicle class that it is for ("" for all)."""
        name, on = element.get("id", ""), element.get("route", "")
        inner, spread = element.find("route"), element.find("routeDistribution")
        if inner is not None:
            self._add(source, inner, name)
            yield name, 1.0, ""
        elif spread is not None:
            yield from ((one, share, "") for one, share in self._add_spread(source, spread, name))
        elif on:
            yield from ((one, share, "") for one, share in self.drawn_routes.get(on, ((on, 1.0),)))
        elif name in self.led:
            led = self.led[name]
            for vclass, edges in led.items():
                if edges:
                    way = name if len(led) == 1 else f"{name}@{vclass}"
                    self._add(source, ET.Element("route", edges=edges), way)
                    yield way, 1.0, vclass if len(led) > 1 else ""
        else:
            msg = (
                f"{what}: it has no route, only ends between which SUMO would choose a way; "
                f"write its route, closed (duarouter computes routes)"
            )
            raise RouteError(msg)

    def _kinds(self, what: str, name: str) -> tuple[tuple[VehicleType, float], ...]:
        """Return the types that a vehicle may be drawn for, with shares; mostly there is one.

        If a file defines a type with the name of SUMO's default type, that type is used.
        """
        self.refuse_types([name])
        if name in self.drawn_types:
            return self.drawn_types[name]
        if name in self.types or name == DEFAULT_TYPE.id:
            return ((self.types.get(name, DEFAULT_TYPE), 1.0),)
        known = f"; they define {', '.join(list(self.types)[:5])}" if self.types else ""
        msg = f"{what}: its type {shown(name)} is no <vType> of the route files or additional files{known}"
        raise RouteError(msg)

    def make_loops(self) -> list[Loop]:
        """Return the loop of each route, for its first vehicle's class and with all vehicles' stops."""
        kinds: dict[str, VehicleType] = {}
        stops: dict[str, list[Stop]] = {}
        for way in (way for vehicle in self._asked for way in vehicle.ways):
            kinds.setdefault(way.route, way.type)
            stops.setdefault(way.route, []).extend(way.stops)
        choices = RouteChoices(self.network)
        loops = []
        for name, route in self.routes.items():
            vclass = kinds.get(name, DEFAULT_TYPE).vclass
            try:
                loops.append(route.loop(self.network, choices, vclass, stops.get(name, ())))
            except RouteError as error:
                if name in kinds or not kinds:
                    raise
                self.undriven[name] = f"{error}; no vehicle drives it, so it is left out"
        return loops

    def with_unfit(self, ungated: UngatedFleet, own: Tops) -> UngatedFleet:
        """Return the vehicles that no gate can drive, with those whose stops none can make."""
        if not self.unfit_vehicles:
            return ungated
        demand = ungated.demand or tuple(one for _, top in own for one in top if one.tag not in FLEET)
        return UngatedFleet((*ungated.vehicles, *self.unfit_vehicles), demand)

    def on_loops(
        self, loops: Mapping[str, Loop], path: Path
    ) -> tuple[tuple[VehicleDemand, ...], dict[str, tuple[Stop, ...]]]:
        """Return the vehicles with their loops, and the stops of each loop."""
        vehicles = []
        for asked in self._asked:
            try:
                vehicles.append(asked.on_loops(loops, path))
            except RouteError as error:
                refused = isinstance(error, NotAheadError) and not self.ignores
                if refused or any(loops[way.route].closed for way in asked.ways):
                    raise
                why = str(error).removeprefix(f"{path}: vehicle {asked.element.get('id', '')}: ")
                self.unfit_vehicles.append(Ungated(asked.element, why))
        driven = {way.route for asked in self._asked for way in asked.ways}
        at_routes = {}
        for route in (one for one in self.routes.values() if one.stops and one.id in loops):
            loop, what = loops[route.id], f"{route.source}: route {route.id}"
            try:
                at_routes[route.id] = on_loop(loop, stops_of_one_round(route.stops, route.rounds), what)
            except NotAheadError as error:
                if route.id in driven and not self.ignores:
                    raise
                self.undriven[route.id] = f"{error}; its stops are left out"
        return tuple(vehicles), at_routes
