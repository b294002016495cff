"""The content of a route file: loops, and the vehicles and flows on them, without positions."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from math import inf
from pathlib import Path
from random import Random

from loopgate.network.departures import Flow
from loopgate.network.distributions import draw
from loopgate.network.loop import Loop
from loopgate.network.stops import Stop
from loopgate.network.ungated import UngatedFleet
from loopgate.network.vehicle_type import DEFAULT_TYPE, VehicleType


@dataclass(frozen=True, slots=True)
class VehicleDemand:
    """A vehicle, or a flow of vehicles, that drives on one loop."""

    id: str
    loop: Loop
    type: VehicleType
    depart_m: float | None = None
    """Position of the front at the departure, as arc length on the loop [m], if the file has a number for
    ``departPos``."""
    depart_s: float = 0.0
    flow: Flow | None = None
    """`depart_s` and `flow`: time of the departure [s]; for a flow, the rule of its departures."""
    edge: int = 0
    """Index on the loop of the edge on which the vehicle departs."""
    stops: tuple[Stop, ...] = ()
    """The vehicle's stops in every round, in the order of the loop."""
    attributes: Mapping[str, str] = field(default_factory=dict, hash=False)
    parameters: Mapping[str, str] = field(default_factory=dict, hash=False)
    """`attributes` and `parameters`: further attributes, and ``<param>`` elements by key, passed on to
    SUMO."""
    types: tuple[tuple[VehicleType, float], ...] = ()
    """The types from which the vehicle's type is drawn, with shares; `type` is the first. Empty if no type is
    drawn."""
    ways: tuple[tuple[VehicleDemand, float], ...] = ()
    """The same vehicle on each route from which its route is drawn, with shares."""
    vclass: str = ""
    """The vehicle class that the route requires; empty for any class."""

    @property
    def once(self) -> bool:
        """Whether the vehicle drives its route only once, not round and round."""
        return not self.loop.closed or any(way.once for way, _ in self.ways)

    def each(self, begin_s: float, end_s: float, seed: int) -> Iterator[VehicleDemand]:
        """Yield the vehicles that depart during a run; earlier departures count at the start.

        A vehicle on a trip departs only within the run. Random draws depend on the seed and the vehicle's
        name.
        """
        for one in self._each(begin_s, end_s, seed):
            if not one.once or begin_s <= one.depart_s < end_s:
                yield one

    def number(self, begin_s: float, end_s: float) -> float:
        """Return the number of vehicles that `each` yields; the mean if departures are random."""
        since_s = self._since_s(begin_s)
        if self.flow is not None:
            return self.flow.expected(since_s, end_s)
        return float(since_s <= self.depart_s < end_s or not self.once)

    def _since_s(self, begin_s: float) -> float:
        """Return the time from which a departed vehicle is on the road [s]."""
        ways = [way.loop for way, _ in self.ways] or [self.loop]
        return -inf if any(way.closed for way in ways) else begin_s

    def _each(self, begin_s: float, end_s: float, seed: int) -> Iterator[VehicleDemand]:
        names: Iterable[tuple[str, float]] = [(self.id, self.depart_s)]
        first_s = self.depart_s
        if self.flow is not None:
            times_s = self.flow.departures_s(self._since_s(begin_s), end_s, Random(f"{seed} {self.id}"))
            names, first_s = ((f"{self.id}.{k}", at_s) for k, at_s in times_s), self.flow.begin_s
        for name, at_s in names:
            for one in self.drawn(name, seed):
                depart_s = at_s if one.once else max(begin_s, at_s)
                stops = tuple(stop.at(depart_s, later_s=at_s - first_s) for stop in one.stops)
                yield replace(one, depart_s=depart_s, flow=None, stops=stops)

    def drawn(self, name: str, seed: int) -> Iterator[VehicleDemand]:
        """Yield a vehicle with its drawn type and route; nothing if the type has no route."""
        if not self.types and not self.ways:
            yield replace(self, id=name)
            return
        rng = Random(f"{seed} {name}")
        kind = draw(self.types, rng) if self.types else self.type
        ways = [(way, share) for way, share in self.ways if way.vclass in {"", kind.vclass}]
        if ways or not self.ways:
            way = draw(ways, rng) if ways else self
            yield replace(way, id=name, type=kind, types=(), ways=())


@dataclass(frozen=True, slots=True)
class RoutesFile:
    """The vehicles, flows, loops and types of a route file or SUMO configuration."""

    file: Path
    loops: tuple[Loop, ...]
    """The loops of the file's routes, in the file's order."""
    vehicles: tuple[VehicleDemand, ...]
    """Vehicles and flows on the loops, in the file's order; may be empty."""
    types: dict[str, VehicleType]
    """The vehicle types of the file and its additional files, by id."""
    default: VehicleType = DEFAULT_TYPE
    """The type of vehicles without a type: the file's first type, otherwise SUMO's default."""
    stops: Mapping[str, tuple[Stop, ...]] = field(default_factory=dict)
    """The stops of routes, by loop; all vehicles of a loop make them."""
    stop_files: tuple[Path, ...] = ()
    """The additional files with stopping places."""
    vehicle_files: tuple[Path, ...] = ()
    """The additional files that contain vehicles of `vehicles`."""
    ungated: UngatedFleet = field(default_factory=UngatedFleet)
    """The vehicles on trips that no gate can drive; `vehicles` does not contain them."""
    left_out: tuple[str, ...] = ()
    left_out_of_routes: tuple[str, ...] = ()
    """`left_out` and `left_out_of_routes`: elements that loopgate ignores, a line for each kind; in all, and
    without elements of vehicles."""

    def __repr__(self) -> str:
        return f"<RoutesFile {self.file}: {len(self.loops)} loops, {len(self.vehicles)} vehicles and flows>"

    @property
    def first_s(self) -> float:
        """The departure time of the first vehicle [s]."""
        theirs = [v.depart_s for v in self.ungated.vehicles if v.element.get("depart") != "triggered"]
        mine = [v.flow.begin_s if v.flow else v.depart_s for v in self.vehicles]
        return min([*mine, *theirs], default=0.0)

    def longest_vehicle(self) -> tuple[float, float]:
        """Return the largest length and the largest `minGap` [m]; SUMO's defaults without vehicles."""
        drawn = [kind for v in self.vehicles for kind, _ in v.types]
        kinds = [*drawn, *(v.type for v in self.vehicles)] or [self.default]
        return max(kind.length_m for kind in kinds), max(kind.min_gap_m for kind in kinds)

    def drawn(self, seed: int) -> RoutesFile:
        """Return a copy in which each vehicle has one type and one route, drawn from its distributions."""
        return replace(self, vehicles=tuple(one for v in self.vehicles for one in v.drawn(v.id, seed)))

    def robots(self) -> tuple[list[str], list[Loop], dict[str, float]]:
        """Return names and loops of the file's vehicles; of one vehicle per loop if it has none.

        The mapping gives the start positions in the file, as arc length [m] by vehicle.
        """
        if not self.vehicles:
            return [loop.id for loop in self.loops], list(self.loops), {}
        starts = {v.id: v.depart_m for v in self.vehicles if v.depart_m is not None}
        return [v.id for v in self.vehicles], [v.loop for v in self.vehicles], starts

    def robot_types(self) -> list[VehicleType]:
        """Return the vehicle type of each robot of `robots`: its own, or the file's default type."""
        if self.vehicles:
            return [vehicle.type for vehicle in self.vehicles]
        return [self.default] * len(self.loops)
