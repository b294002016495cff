"""SUMO route files: those whose routes close are loops; of others each vehicle drives its route once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from loopgate.errors import RouteError
from loopgate.keeping import Kept
from loopgate.network.additional import FLEET, demand_beside
from loopgate.network.content import content_identity
from loopgate.network.left_out import left_out
from loopgate.network.loop import Loop
from loopgate.network.loop_vehicle import LoopVehicle
from loopgate.network.road import RoadNetwork
from loopgate.network.route_elements import RouteElements
from loopgate.network.stops import Stop, read_stopping_places
from loopgate.network.sumo_config import is_sumo_config, read_sumo_config
from loopgate.network.trips import Led, drives_once, lead_trips
from loopgate.network.vehicle_type import DEFAULT_TYPE, VehicleType
from loopgate.network.xml_file import read_xml
from loopgate.reading import counted, is_file, refusing


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
    found = RouteElements(network, places, once)
    found.collect_types([*more, *own])
    if once:
        kinds = [one for _, top in tops for one in top.iter("vType") if one.get("id")]
        classes = {name: _first_of_class(spread) for name, spread in found.drawn_types.items()}
        found.led = lead_trips(network, fleet, kinds, beside, classes=classes)
    lost = {name for name, ways in found.led.items() if not any(ways.values())}
    for _, top in tops:
        for one in [one for one in top if one.tag in FLEET and one.get("id", "") in lost]:
            top.remove(one)
    for source, top in tops:
        found.collect_routes(source, top)
    for source, top in tops:
        found.collect_vehicles(source, top)
    if not found.routes:
        msg = f"{path}: no routes in it; expected <route> elements whose last edge leads to the first"
        raise RouteError(msg)
    loops = found.make_loops()
    vehicles, at_routes = found.on_loops({loop.id: loop for loop in loops}, path)
    ways = [way for vehicle in vehicles for way in (vehicle, *(one for one, _ in vehicle.ways))]
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


def _first_of_class(spread: Sequence[tuple[VehicleType, float]]) -> dict[str, str]:
    """Return the first type of each class of vehicles in a distribution, by class."""
    return {kind.vclass: kind.id for kind, _ in reversed(spread)}


def _wayless(path: Path, led: Led) -> Iterator[str]:
    """Say which trips are left out since there is no way between their ends."""
    lost = [name for name, ways in led.items() if not any(ways.values())]
    if lost:
        yield f"{path}: {counted(len(lost), 'vehicle')} left out for want of a way, first {lost[0]}"
    some = [name for name, ways in led.items() if any(ways.values()) and not all(ways.values())]
    if some:
        yield (
            f"{path}: {len(some)} trips or flows find no way for all classes of their type, and are left out "
            f"where such a one is drawn, first {some[0]}"
        )
