"""Where SUMO's rerouters lead vehicles, worked out before a run.

People let vehicles drive in circles by rerouters: one that gives the next lap, two that hand over, or some
that draw among several routes. What a rerouter does to a vehicle is settled by the edge and by draws, so a
vehicle's whole way is known before it departs: a loop, an open route, or a course that is drawn as far as a
run needs it.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from xml.etree import ElementTree as ET

from loopgate.network.additional import read_additional
from loopgate.network.clock import as_number, seconds
from loopgate.network.road import RoadNetwork
from loopgate.network.trips import closes, find_ways

LEADS = ("destProbReroute", "routeProbReroute")
"""Elements of rerouters that give a vehicle another way."""

_ENDS, _KEEPS = "terminateRoute", "keepDestination"
"""Destinations by which a vehicle arrives at once, or keeps its own."""

_MOST_STEPS = 100_000
"""A vehicle that has passed so many edges without coming back is taken to draw its way."""


@dataclass(frozen=True, slots=True)
class Target:
    """Another way that a rerouter may give: a destination, or the edges of a route."""

    share: float
    edge: str = ""
    route: tuple[str, ...] = ()
    stops: bool = False
    """Whether the route has stops."""


@dataclass(frozen=True, slots=True)
class Rerouter:
    """A rerouter that leads vehicles another way at its edges.

    Attributes
    ----------
    types
        The vehicle types for which it is; empty for all.
    targets
        What it gives to a vehicle, with shares; drawn if there are several.
    share
        How probable it is that it acts at all.
    begin_s, end_s
        When it acts [s].
    unknown
        Why nobody can say before the run what it does; empty if one can.
    """

    id: str
    edges: frozenset[str]
    types: frozenset[str]
    targets: tuple[Target, ...]
    share: float = 1.0
    begin_s: float = 0.0
    end_s: float = math.inf
    unknown: str = ""

    @property
    def draws(self) -> bool:
        """Whether chance decides what it does."""
        return self.share < 1.0 or len(self.targets) > 1

    def acts_on(self, kind: str, at_s: float) -> bool:
        """Return whether it acts on a vehicle of a type that departs at a time [s]."""
        return (not self.types or kind in self.types) and at_s < self.end_s


@dataclass(frozen=True, slots=True)
class Course:
    """A way that rerouters prolong without end, or draw anew from time to time.

    Attributes
    ----------
    edges, at
        The first route, and the index on it of the edge on which the vehicle departs.
    kind, vclass
        The name of the vehicle's type and its class.
    depart_s
        When the vehicle departs, or the first of its flow [s].
    """

    leads: Leads = field(hash=False, compare=False)
    edges: tuple[str, ...]
    at: int
    kind: str
    vclass: str
    depart_s: float

    def drawn(self, rng: Random, enough_s: float, times_s: Mapping[str, float]) -> tuple[str, ...]:
        """Return the edges from the first route's beginning on, until driving them takes `enough_s` [s].

        `times_s`: the least time to drive each edge [s].
        """
        found = list(self.edges[: self.at])
        spent_s = 0.0
        for edge, _ in self.leads.follow(self.edges, self.at, self.kind, self.vclass, self.depart_s, rng):
            found.append(edge)
            spent_s += times_s[edge]
            if spent_s > enough_s:
                break
        return tuple(found)


@dataclass(frozen=True, slots=True)
class Led:
    """Where rerouters lead a vehicle.

    Attributes
    ----------
    rerouters
        Those that act on it.
    round
        The round that it drives again and again; empty if it drives none.
    at
        The index on the round of the edge on which it departs.
    route
        The route that it drives instead of its own; empty if chance decides, or it drives rounds.
    course
        Its way, if chance decides, it comes to its round from elsewhere, or it drives rounds.
    unknown
        Why its way cannot be known; empty if it can.
    """

    rerouters: tuple[str, ...] = ()
    round: tuple[str, ...] = ()
    at: int = 0
    route: tuple[str, ...] = ()
    course: Course | None = None
    unknown: str = ""

    @property
    def goes_on(self) -> bool:
        """Whether its way is prolonged as far as a run needs it."""
        return self.course is not None and not self.round


class Leads:
    """The rerouters of a run that lead vehicles another way.

    Parameters
    ----------
    rerouters
        In the order of their files: on one edge they act in this order.
    ways
        The edges from a rerouter's edge to a destination, by both and vehicle class.
    """

    def __init__(
        self, rerouters: Sequence[Rerouter], ways: Mapping[tuple[str, str, str], tuple[str, ...]]
    ) -> None:
        self._ways = ways
        self._at: dict[str, list[Rerouter]] = {}
        for one in rerouters:
            for edge in one.edges:
                self._at.setdefault(edge, []).append(one)

    def met(self, edges: Iterable[str], kind: str, at_s: float) -> list[Rerouter]:
        """Return the rerouters on edges that act on a vehicle type."""
        there = (one for edge in edges for one in self._at.get(edge, ()))
        return [one for one in dict.fromkeys(there) if one.acts_on(kind, at_s)]

    def follow(
        self, edges: tuple[str, ...], index: int, kind: str, vclass: str, at_s: float, rng: Random
    ) -> Iterator[tuple[str, tuple[tuple[str, ...], int]]]:
        """Yield each edge that a vehicle enters, with its route and index on it after rerouting there."""
        while index < len(edges):
            edge = edges[index]
            for one in self._at.get(edge, ()):
                if one.unknown or not one.acts_on(kind, at_s):
                    continue
                if one.share >= 1.0 or rng.random() < one.share:
                    edges, index = self._turned(one, edges, index, vclass, rng)
            yield edge, (edges, index)
            index += 1

    def _turned(
        self, one: Rerouter, edges: tuple[str, ...], index: int, vclass: str, rng: Random
    ) -> tuple[tuple[str, ...], int]:
        """Return the route, and the index on it, that a rerouter gives to a vehicle on an edge."""
        target = one.targets[0]
        if len(one.targets) > 1:
            target = rng.choices(one.targets, [each.share for each in one.targets])[0]
        edge = edges[index]
        if target.route:  # SUMO takes the first pass of the edge, and keeps a vehicle whose edge is not on it
            return (target.route, target.route.index(edge)) if edge in target.route else (edges, index)
        if target.edge == _ENDS:
            return edges[: index + 1], index
        way = self._ways.get((edge, target.edge, vclass), ())
        return (way, 0) if way and target.edge != _KEEPS else (edges, index)

    def lead(
        self, network: RoadNetwork, edges: Sequence[str], at: int, kind: str, vclass: str, depart_s: float
    ) -> Led:
        """Return where rerouters lead a vehicle that departs on edge `at` of a route."""
        route = tuple(edges)
        driven: list[str] = []
        seen: dict[tuple[tuple[str, ...], int], int] = {}
        acted: dict[str, None] = {}
        course = Course(self, route, at, kind, vclass, depart_s)
        for edge, state in self.follow(route, at, kind, vclass, depart_s, Random(0)):
            for one in self.met([edge], kind, depart_s):
                acted[one.id] = None
                unknown = one.unknown or (
                    f"acts only from {one.begin_s:g} s on" if one.begin_s > depart_s else ""
                )
                if unknown:
                    return Led(tuple(acted), unknown=f"rerouter {one.id} at {edge}: {unknown}")
                if one.draws:
                    return Led(self._names(), course=course)
            if acted and state in seen:
                return self._round(network, driven, seen[state], tuple(acted), course)
            if len(driven) >= _MOST_STEPS:
                return Led(tuple(acted), course=course)
            seen.setdefault(state, len(driven))
            driven.append(edge)
        found = (*route[:at], *driven)
        return Led(tuple(acted), route=found if found != route else ()) if acted else Led()

    def _names(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(one.id for some in self._at.values() for one in some))

    def _round(
        self, network: RoadNetwork, driven: Sequence[str], since: int, names: tuple[str, ...], course: Course
    ) -> Led:
        """Return the round that is driven since the edge number `since`, if the vehicle starts on it."""
        before, lap = driven[:since], tuple(driven[since:])
        on_it = all(before[-1 - k] == lap[-1 - k % len(lap)] for k in range(len(before)))
        if not on_it or not closes(network, lap):
            return Led(names, course=course)
        return Led(names, round=lap, at=-len(before) % len(lap), course=course)


def read_leads(
    network: RoadNetwork,
    files: Iterable[Path],
    routes: Iterable[ET.Element],
    vclasses: Collection[str],
) -> Leads | None:
    """Return the rerouters of additional files that lead vehicles another way; None if there are none.

    `routes`: the routes of route files. `vclasses`: classes of the vehicles, whose ways differ.

    Raises `RouteError` if a file cannot be read or SUMO's router fails.
    """
    tops = [read_additional(file) for file in dict.fromkeys(files)]
    found: list[Rerouter] = []
    named = {one.get("id", ""): one for one in routes}
    named |= {one.get("id", ""): one for top in tops for one in top.iter("route")}
    for element in (one for top in tops for one in top.iter("rerouter")):
        found += _rerouters(element, named)
    if not found:
        return None
    asked = {
        (edge, target.edge, vclass)
        for one in found
        for edge in one.edges
        for target in one.targets
        for vclass in vclasses
        if edge in network.edges and target.edge in network.edges
    }
    return Leads(found, find_ways(network, sorted(asked)))


def _rerouters(element: ET.Element, routes: Mapping[str, ET.Element]) -> Iterator[Rerouter]:
    """Yield a rerouter once for each of its intervals in which it leads vehicles another way."""
    if any(element.get(name, "false") in {"true", "1"} for name in ("off", "optional")):
        return
    for interval in element:
        leading = [one for one in interval if one.tag in LEADS]
        by_way = interval.find("viaProbReroute") is not None
        if not leading and not by_way:
            continue
        on_routes = [one for one in leading if one.tag == "routeProbReroute"]  # SUMO looks at routes first
        every = (_target(one, routes) for one in on_routes or leading)
        targets = tuple(one for one in every if one.share > 0.0)
        also = [one.tag for one in interval if one.tag not in LEADS]
        unknown = f"it also has {also[0]}" if also else ""
        if as_number(element.get("timeThreshold", "0")) > 0.0:
            unknown = "it acts on vehicles that have waited long (timeThreshold)"
        if any(one.stops for one in targets):
            unknown = "its routes have stops"
        if not targets and not by_way:
            continue
        yield Rerouter(
            element.get("id", ""),
            frozenset(words(element, "edges")),
            frozenset(words(element, "vTypes")),
            targets,
            as_number(element.get("probability", "1"), default=1.0),
            _time(interval, "begin", -math.inf),
            _time(interval, "end", math.inf),
            unknown,
        )


def _target(one: ET.Element, routes: Mapping[str, ET.Element]) -> Target:
    share = as_number(one.get("probability", "1"), default=1.0)
    name = one.get("id", "")
    if one.tag == "destProbReroute":
        return Target(share, edge=name)
    route = routes.get(name)
    edges = tuple(route.get("edges", "").split()) if route is not None else ()
    stops = route is not None and route.find("stop") is not None
    return Target(share if edges else 0.0, route=edges, stops=stops)


def _time(element: ET.Element, name: str, default: float) -> float:
    with suppress(ValueError):
        return seconds(element.get(name, ""))
    return default


def words(element: ET.Element, name: str) -> list[str]:
    """Return the names that an attribute lists, with blanks or commas between them."""
    return element.get(name, "").replace(",", " ").split()
