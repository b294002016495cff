"""Vehicles that no gate can drive; they become ordinary traffic."""

import re
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree as ET

from loopgate.network.additional import FLEET
from loopgate.network.clock import seconds
from loopgate.network.stops import REFUSED
from loopgate.network.trips import JUNCTIONS, ROUNDS, one_round
from loopgate.network.vehicle_type import routes_named
from loopgate.reading import counted, listed, shown

SUDDEN = ("triggered", "containerTriggered", "split")
"""Values of ``depart`` with which an event, not a time, lets a vehicle depart."""

_TYPES = ("vType", "vTypeDistribution")
_MOST_SHOWN = 6

_OWN = re.compile(r"(?:\b(?:loop|place|lane|edge|stop at|vType|rerouter) )\S+|\S*\d\S*")
"""What differs between reasons of one kind: names and figures."""


@dataclass(frozen=True, slots=True)
class Ungated:
    """A vehicle, trip or flow that no gate can drive, and the reason."""

    element: ET.Element
    why: str

    @property
    def id(self) -> str:
        """The name of the vehicle, trip or flow."""
        return self.element.get("id", "")

    @property
    def depart_s(self) -> float:
        """The departure time [s]; 0 if the file gives no time."""
        with suppress(ValueError):
            return seconds(self.element.get("begin" if self.element.tag == "flow" else "depart", "0"))
        return 0.0


@dataclass(frozen=True, slots=True)
class UngatedFleet:
    """All vehicles of a file that no gate can drive, with the types and routes that they may need."""

    vehicles: tuple[Ungated, ...] = ()
    demand: tuple[ET.Element, ...] = field(default=(), hash=False)

    @property
    def options(self) -> list[str]:
        """The option of SUMO that these vehicles need: it knows junctions as ends of trips only with it."""
        named = any(name in one.element.attrib for one in self.vehicles for name in JUNCTIONS)
        return ["--junction-taz"] if named else []

    def needs(self, known: Iterable[str]) -> list[ET.Element]:
        """Return the types not `known` by name, and the routes, that these vehicles use."""
        if not self.vehicles:
            return []
        named = {one.element.get("route", "") for one in self.vehicles}
        spreads = [one for one in self.demand if one.tag == "routeDistribution" and one.get("id") in named]
        named |= routes_named(spreads)
        there = set(known)
        types = [one for one in self.demand if one.tag in _TYPES and one.get("id") not in there]
        return types + [one for one in self.demand if one.tag not in _TYPES and one.get("id") in named]


def take_ungated(
    tops: Sequence[tuple[Path, ET.Element]], own: Sequence[tuple[Path, ET.Element]], *, once: bool
) -> UngatedFleet:
    """Remove vehicles that no gate can drive from files of vehicles, and return them.

    Parameters
    ----------
    tops
        All files with vehicles.
    own
        The route files among them. From the other files, SUMO itself loads types and routes.
    once
        Whether the files say trips. Else a vehicle drives its route round and round, with its stops in every
        round; SUMO is told so in its words. One that draws among routes stays in the file, to be refused.
    """
    routes = {one.get("id", ""): one for _, top in tops for one in top.iter("route") if one.get("id")}
    spreads = {one.get("id", ""): one for _, top in tops for one in top.findall("routeDistribution")}
    found: list[Ungated] = []
    for _, top in tops:
        for one in [one for one in top if one.tag in FLEET]:
            ways = _ways(one, routes, spreads)
            why = _why(one, ways)
            if why and (once or len(ways) == 1):
                top.remove(one)
                found.append(Ungated(one if once else _round_and_round(one, ways[0]), why))
    if not found:
        return UngatedFleet()
    demand = tuple(one for _, top in own for one in top if one.tag not in FLEET)
    left = {
        id(way) for _, top in tops for one in top if one.tag in FLEET for way in _ways(one, routes, spreads)
    }
    bad = {name for name, route in routes.items() if _why_stop(route) and id(route) not in left}
    for _, top in tops:
        for one in [one for one in top if one.tag in {"route", "routeDistribution"}]:
            its = {one.get("id", ""), *routes_named([one]), *(r.get("id", "") for r in one.iter("route"))}
            if its & bad:  # the vehicles with this route have been removed
                top.remove(one)
    return UngatedFleet(tuple(found), demand)


def _round_and_round(element: ET.Element, way: ET.Element) -> ET.Element:
    """Return a vehicle or flow on a loop in SUMO's words: its one round is repeated, with all stops in it."""
    said = {name: value for name, value in element.attrib.items() if name != "route"}
    vehicle = ET.Element(element.tag, said)
    vehicle.extend(one for one in element if one.tag not in {"route", "stop"})
    edges = " ".join(one_round(way.get("edges", "").split()))
    route = ET.SubElement(vehicle, "route", edges=edges, repeat=ROUNDS)
    route.extend([*way.findall("stop"), *element.findall("stop")])
    return vehicle


def _ways(
    element: ET.Element, routes: Mapping[str, ET.Element], spreads: Mapping[str, ET.Element]
) -> list[ET.Element]:
    """Return the routes that a vehicle may drive, as far as the files have them."""
    on = element.get("route", "")
    some = [spread for spread in (spreads.get(on), element.find("routeDistribution")) if spread is not None]
    inner = [*element.findall("route"), *(route for spread in some for route in spread.iter("route"))]
    return [*inner, *(routes[name] for name in (on, *routes_named(some)) if name in routes)]


def _why(element: ET.Element, ways: Iterable[ET.Element]) -> str:
    depart = element.get("depart", "")
    if depart in SUDDEN:
        return f"depart is {depart}, of which no gate is told"
    return next((why for one in (element, *ways) if (why := _why_stop(one))), "")


def _why_stop(element: ET.Element) -> str:
    """Return why no gate can make a stop inside an element; empty if every stop works."""
    return next(
        (
            f"stop with {name} {shown(stop.get(name))}: {reason}"
            for stop in element.findall("stop")
            for name, reason in REFUSED.items()
            if stop.get(name)
        ),
        "",
    )


def by_kind(whys: Mapping[str, str]) -> list[tuple[str, list[str]]]:
    """Return the kinds of reasons, each as its first vehicle has it, with the names; the most frequent first.

    Reasons are of one kind if they differ only in names and figures.

    >>> by_kind({"a": "lane x_0 is 3 m long", "b": "it stands", "c": "lane y_1 is 4 m long"})
    [('lane x_0 is 3 m long', ['a', 'c']), ('it stands', ['b'])]
    """
    kinds: dict[str, tuple[str, list[str]]] = {}
    for name, why in whys.items():
        kinds.setdefault(_OWN.sub("", why), (why, []))[1].append(name)
    return sorted(kinds.values(), key=lambda kind: -len(kind[1]))


def in_ordinary_traffic(source: Path | str, whys: Mapping[str, str]) -> tuple[str, ...]:
    """Return a line for each kind of reason why no gate can drive vehicles, with their number and names."""
    return tuple(
        f"{source}: {counted(len(names), 'vehicle')} in ordinary traffic (a flow counts once), "
        f"{listed(names, _MOST_SHOWN)}: {f'first {names[0]}: ' if len(names) > 1 else ''}{why}"
        for why, names in by_kind(whys)
    )
