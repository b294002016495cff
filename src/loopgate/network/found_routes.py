"""Routes as route files have them, and the loop or way that is made of each."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree as ET

from loopgate.errors import RouteError
from loopgate.network.clock import time_of
from loopgate.network.lanes import make_loop
from loopgate.network.loop import Loop
from loopgate.network.road import RoadNetwork
from loopgate.network.route_lanes import make_route
from loopgate.network.spreads import parts, refuse_nothing
from loopgate.network.stops import Stop, StoppingPlace, lanes_of_stops, read_stops
from loopgate.network.trips import closes


@dataclass(frozen=True, slots=True)
class _Route:
    id: str
    edges: tuple[str, ...]
    source: Path
    stops: tuple[Stop, ...]
    cycle_s: float
    again: bool
    """Whether it is driven round and round."""

    def loop(self, network: RoadNetwork, *, vclass: str, stops: Sequence[Stop]) -> Loop:
        """Return it over lanes that a class of vehicles may use and from which all its stops are reached."""
        source = str(self.source)
        if not self.again:
            return make_route(network, self.id, self.edges, vclass=vclass, source=source)
        lanes = lanes_of_stops((*self.stops, *stops))
        edges = one_round(self.edges)
        return make_loop(network, self.id, edges, vclass=vclass, source=source, on_lanes=lanes)


@dataclass(slots=True)
class FoundRoutes:
    """The routes of the files read so far, by name, and those that distributions draw from, with shares."""

    network: RoadNetwork
    places: Mapping[str, StoppingPlace]
    once: bool
    by_name: dict[str, _Route] = field(default_factory=dict)
    drawn: dict[str, tuple[tuple[str, float], ...]] = field(default_factory=dict)

    def collect(self, source: Path, top: ET.Element) -> None:
        """Take note of routes that stand for themselves."""
        for number, element in enumerate(top.findall("route")):
            self.add(source, element, element.get("id") or f"route{number}")
        for spread in top.findall("routeDistribution"):
            name = spread.get("id", "distribution")
            self.drawn[name] = self.add_spread(source, spread, name)

    def add(self, source: Path, element: ET.Element, name: str) -> None:
        """Take note of a route; raise `RouteError` if its name is taken or it has no edges."""
        if name in self.by_name:
            other = self.by_name[name].source
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
        self.by_name[name] = _Route(name, edges, source, stops, cycle_s, again)

    def add_spread(self, source: Path, spread: ET.Element, name: str) -> tuple[tuple[str, float], ...]:
        """Take note of the routes of a distribution; return their names and shares."""
        what = f"{source}: routeDistribution {name}"
        drawn: list[tuple[str, float]] = []
        own = 0
        for part in parts(spread, what, named="routes", tag="route"):
            route = part.name
            if part.element is not None:
                route = part.name or f"{name}.{own}"
                own += 1
                self.add(source, part.element, route)
            drawn.append((route, 1.0 if part.share is None else part.share))
        refuse_nothing([share for _, share in drawn], what)
        return tuple(drawn)

    def stops(
        self, element: ET.Element, what: str, cycle_s: float, *, since_depart: bool
    ) -> tuple[Stop, ...]:
        """Return the stops inside a route or vehicle."""
        found = element.findall("stop")
        return read_stops(
            self.network, found, self.places, what=what, cycle_s=cycle_s, since_depart=since_depart
        )


def one_round(edges: Sequence[str]) -> tuple[str, ...]:
    """Return one round of a route: without the first edge at its end, and without whole repetitions."""
    once = tuple(edges[:-1]) if len(edges) > 1 and edges[0] == edges[-1] else tuple(edges)
    for length in range(1, len(once) // 2 + 1):
        if len(once) % length == 0 and once == once[:length] * (len(once) // length):
            return once[:length]
    return once
