"""The stops in a route file, and the stopping places in additional files that they name."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree import ElementTree as ET

from loopgate.errors import RouteError
from loopgate.network.additional import read_additional
from loopgate.network.clock import as_number, seconds, time_if_any, time_of
from loopgate.network.loop import Loop
from loopgate.network.road import RoadNetwork
from loopgate.reading import shown

_KINDS = {
    "busStop": "busStop",
    "trainStop": "busStop",
    "parkingArea": "parkingArea",
    "chargingStation": "chargingStation",
    "containerStop": "containerStop",
}
"""Elements of additional files where vehicles stop, and attributes of stops that name one, by SUMO's kind."""

_PASSED_ON = (
    "actType",
    "arrival",
    "expected",
    "extension",
    "line",
    "onDemand",
    "permitted",
    "posLat",
    "tripId",
)
"""Attributes that SUMO gets unchanged."""

REFUSED = {
    "speed": "a point to pass at a speed is no stop; give the road a limit",
    "split": "vehicles that part are not known to a gate; leave it out",
    "join": "vehicles that couple are not known to a gate; leave it out",
    "jump": "a vehicle that jumps is not known to a gate; leave it out",
    "overheadWireSegment": "wires are no places to stop at; name a lane",
}

_TRIGGERS = {
    "true": ("person",),
    "1": ("person",),
    "person": ("person",),
    "container": ("container",),
    "false": (),
    "0": (),
    "": (),
}

STOP_ATTRIBUTES = frozenset(
    {
        *("lane", "edge", "startPos", "endPos", "friendlyPos", "duration", "until", "parking"),
        *("triggered", "expectedTriggered", "containerTriggered"),
        *_KINDS,
        *_PASSED_ON,
        *REFUSED,
    }
)
"""Attributes of ``<stop>`` that are honoured, or refused by name."""

_LEAST_M = 0.1
"""Length of a stop on a lane of which only the end is given [m]: SUMO's."""

_ROUNDING_M = 1e-6


class NotAheadError(RouteError):
    """A stop of a vehicle that drives once is not ahead of it on its route; SUMO refuses that, too."""


@dataclass(frozen=True, slots=True)
class StoppingPlace:
    """A stopping place of an additional file: its kind, lane, position on the lane [m], and file.

    `on_road`: whether the vehicles in a parking area stand on the road. `spaces`: coordinates of those of its
    lots that do not lie along the lane [m]. `lots`: number of those that do. `led_on`: whether a rerouter
    leads vehicles from the full area to another.
    """

    kind: str
    lane: str
    start_m: float
    end_m: float
    file: Path
    on_road: bool = False
    spaces: tuple[tuple[float, float], ...] = ()
    lots: int = 0
    led_on: bool = False


@dataclass(frozen=True, slots=True)
class Stop:
    """A stop that a vehicle makes in every round of its loop."""

    name: str
    """The stopping place, or the lane."""
    kind: str
    """``busStop``, ``parkingArea``, ``chargingStation``, ``containerStop`` or ``lane``."""
    lane: str
    start_m: float
    end_m: float
    """`start_m` and `end_m`: the front must stand between these positions [m]; vehicles drive to `end_m`."""
    duration_s: float = 0.0
    until_s: float | None = None
    """End of the stop in the first round [s]; None for no such time."""
    cycle_s: float = 0.0
    """Increase of `until_s` from round to round [s]."""
    since_depart: bool = False
    """Whether `until_s` is counted from the vehicle's departure."""
    triggers: tuple[str, ...] = ()
    """What the vehicle waits for before it goes on: ``person``, ``container``."""
    parks: bool = False
    """Whether the vehicle stands beside the lane."""
    lot_m: float = 0.0
    """How far before `end_m` the first lot along the lane is [m]: vehicles may stand there too."""
    spaces: tuple[tuple[float, float], ...] = ()
    """Coordinates of the lots that do not lie along the lane: vehicles return from them at `end_m` [m]."""
    told: tuple[tuple[str, str], ...] = ()
    """Further attributes, passed on to SUMO unchanged."""
    any_lane: bool = False
    """Whether the file names only the edge; the stop is then on the lane of the loop."""
    fits: bool = False
    """Whether it is made where the route comes to it, wherever it is written (``index``)."""
    arc_m: float = 0.0
    """Where the front stands, as arc length on the loop [m]."""

    @property
    def edge(self) -> str:
        """The id of the edge of the stop."""
        return self.lane.rpartition("_")[0]

    def in_round(self, number: int) -> Stop:
        """Return the stop of one round, counted from 0, in the form that SUMO gets."""
        later_s = number * self.cycle_s
        if not later_s:
            return self
        told = tuple((k, f"{seconds(v) + later_s:g}" if k == "arrival" else v) for k, v in self.told)
        until_s = None if self.until_s is None else self.until_s + later_s
        return replace(self, until_s=until_s, told=told)

    def at(self, depart_s: float, *, later_s: float = 0.0) -> Stop:
        """Return the stop for a vehicle that departs at a given time [s]."""
        shift_s = depart_s if self.since_depart else later_s
        once = replace(self, cycle_s=shift_s).in_round(1)
        return replace(once, cycle_s=self.cycle_s, since_depart=False)


Places = Mapping[tuple[str, str], StoppingPlace]
"""Stopping places by kind and name: SUMO allows one name in each kind."""


def read_stopping_places(files: Iterable[Path]) -> dict[tuple[str, str], StoppingPlace]:
    """Read the stopping places of additional files, by kind and name.

    Raises `RouteError` if a file cannot be read.
    """
    found: dict[tuple[str, str], StoppingPlace] = {}
    rerouted: set[str] = set()
    for file in dict.fromkeys(files):
        for element in read_additional(file).iter():
            if element.tag == "parkingAreaReroute":
                rerouted.add(element.get("id", ""))
            name, lane = element.get("id", ""), element.get("lane", "")
            if element.tag not in _KINDS or not name or not lane:
                continue
            what = f"{file}: {element.tag} {name}"
            start_m = _metres(what, element, "startPos", 0.0)
            end_m = _metres(what, element, "endPos", float("inf"))
            spaces = tuple(
                (_metres(what, space, "x", 0.0), _metres(what, space, "y", 0.0))
                for space in element.findall("space")
            )
            lots = int(_metres(what, element, "roadsideCapacity", 0.0))
            on_road = element.get("onRoad", "false") in {"true", "1"}
            kind = _KINDS[element.tag]
            found[kind, name] = StoppingPlace(
                kind, lane, start_m, end_m, file, on_road=on_road, spaces=spaces, lots=lots
            )
    for key in {("parkingArea", name) for name in rerouted} & found.keys():
        found[key] = replace(found[key], led_on=True)
    return found


def edge_of_stop(element: ET.Element, places: Places) -> str:
    """Return the edge of a ``<stop>``: that of its lane or of its stopping place; "" if it names none."""
    named = ((kind, element.get(attribute, "")) for attribute, kind in _KINDS.items())
    lane = element.get("lane") or next((places[one].lane for one in named if one in places), "")
    return lane.rpartition("_")[0] if lane else element.get("edge", "")


def read_stops(
    network: RoadNetwork,
    elements: Sequence[ET.Element],
    places: Places,
    *,
    what: str,
    cycle_s: float = 0.0,
    since_depart: bool = False,
) -> tuple[Stop, ...]:
    """Read ``<stop>`` elements in order; `on_loop` finds their positions on a loop.

    Raises `RouteError` if a stop is invalid, or has an attribute that no gate can work with; the text names
    it.

    Parameters
    ----------
    places
        Stopping places by kind and name.
    what
        File and owner, for messages.
    cycle_s, since_depart
        See `Stop`.
    """
    return tuple(
        _stop(network, element, places, f"{what}: stop {number}", cycle_s, since_depart=since_depart)
        for number, element in enumerate(elements, start=1)
    )


_DRIVE = ("passenger", "bus", "tram")


def _stop(
    network: RoadNetwork,
    element: ET.Element,
    places: Places,
    what: str,
    cycle_s: float,
    *,
    since_depart: bool,
) -> Stop:
    for attribute, reason in REFUSED.items():
        if element.get(attribute):
            msg = f"{what}: {attribute} {shown(element.get(attribute))}: {reason}"
            raise RouteError(msg)
    triggers = _triggers(element, what)
    if not triggers and "duration" not in element.attrib and "until" not in element.attrib:
        msg = f"{what}: it says neither duration nor until, so the vehicle would stand for good; give one"
        raise RouteError(msg)
    duration_s, until_s = (time_if_any(element, one, what) for one in ("duration", "until"))
    said = [one for one in ("duration", "until") if one in element.attrib]
    if said and duration_s is None and until_s is None:
        figures = " and ".join(f"{one} {shown(element.get(one))}" for one in said)
        msg = f"{what}: it has {figures}; expected seconds or h:m:s, from 0 on"
        raise RouteError(msg)
    kind, name, lane, start_m, end_m = _where(network, element, places, what)
    area = places.get((kind, name)) if kind == "parkingArea" else None
    parking = element.get("parking", "false")
    if parking not in {"true", "1", "false", "0"}:
        msg = f"{what}: parking is {shown(parking)}; expected true or false"
        raise RouteError(msg)
    return Stop(
        name,
        kind,
        lane,
        start_m,
        end_m,
        duration_s=duration_s or 0.0,
        until_s=until_s,
        cycle_s=cycle_s,
        since_depart=since_depart,
        triggers=triggers,
        parks=not area.on_road if area else parking in {"true", "1"},
        spaces=area.spaces if area else (),
        lot_m=(end_m - start_m) * (1.0 - 1.0 / area.lots) if area and area.lots else 0.0,
        told=_told(element, what),
        any_lane=kind == "lane" and not element.get("lane"),
        fits=element.get("index", "end") != "end",
    )


def _first_lane(network: RoadNetwork, edge: str) -> str:
    """Return the first lane of an edge that is no sidewalk, as SUMO takes it; "" without an edge."""
    lanes = network.edges[edge].lanes if edge in network.edges else ()
    first = next((lane.index for kind in _DRIVE for lane in lanes if kind in lane.allowed), 0)
    return f"{edge}_{first}" if edge else ""


def _told(element: ET.Element, what: str) -> tuple[tuple[str, str], ...]:
    time_of(element, "arrival", what)  # is it one?
    return tuple((name, element.attrib[name]) for name in _PASSED_ON if element.get(name))


def _triggers(element: ET.Element, what: str) -> tuple[str, ...]:
    said = element.get("triggered", element.get("expectedTriggered", ""))
    if said not in _TRIGGERS:
        msg = f"{what}: triggered is {shown(said)}; expected true, person, container or false"
        raise RouteError(msg)
    more = ("container",) if element.get("containerTriggered") in {"true", "1"} else ()
    return tuple(dict.fromkeys((*_TRIGGERS[said], *more)))


def _where(
    network: RoadNetwork, element: ET.Element, places: Places, what: str
) -> tuple[str, str, str, float, float]:
    """Return kind, name, lane, start and end [m] of a stop."""
    for attribute, kind in _KINDS.items():
        name = element.get(attribute)
        if not name:
            continue
        place = places.get((kind, name))
        other = next((one for (_, called), one in places.items() if called == name), None)
        if place is None and other is not None:
            msg = f"{what}: {attribute} {shown(name)}: in {other.file} it is a {other.kind}"
            raise RouteError(msg)
        if place is None:
            msg = (
                f"{what}: {attribute} {shown(name)} is in none of the additional files; name the file in the "
                f"configuration, or by --stops"
            )
            raise RouteError(msg)
        if kind == "parkingArea" and not (place.lots or place.spaces or place.led_on):
            msg = (
                f"{what}: {attribute} {shown(name)}: in {place.file} it has no lots, so the vehicle would "
                f"wait before it for good; give it a roadsideCapacity or a space"
            )
            raise RouteError(msg)
        length_m = _lane_m(network, place.lane, f"{place.file}: {attribute} {name}")
        start_m, end_m = (_from_begin(m, length_m) for m in (place.start_m, place.end_m))
        return kind, name, place.lane, max(0.0, start_m), min(end_m, length_m)
    lane = element.get("lane") or _first_lane(network, element.get("edge", ""))
    if not lane:
        msg = f"{what}: it names no place; give busStop, parkingArea or the like, or lane"
        raise RouteError(msg)
    length_m = _lane_m(network, lane, what)
    end_m = _from_begin(_metres(what, element, "endPos", length_m), length_m)
    least_m = max(0.0, end_m - _LEAST_M) if "endPos" in element.attrib else 0.0  # else as far as it gets
    start_m = _from_begin(_metres(what, element, "startPos", least_m), length_m)
    friendly = element.get("friendlyPos") in {"true", "1"}
    if not friendly and not 0.0 <= start_m < end_m <= length_m:
        msg = f"{what}: from {start_m:g} to {end_m:g} m of lane {lane}, which is {length_m:g} m long"
        raise RouteError(msg)
    end_m = min(max(end_m, _LEAST_M), length_m)
    return "lane", lane, lane, min(max(start_m, 0.0), end_m - _LEAST_M), end_m


def _lane_m(network: RoadNetwork, lane: str, what: str) -> float:
    if lane not in network.lanes:
        msg = f"{what}: lane {shown(lane)} is not in the network {network.name}; correct it"
        raise RouteError(msg)
    return network.lanes[lane].length_m


def _from_begin(position_m: float, length_m: float) -> float:
    return position_m + length_m if position_m < 0 else position_m


def _metres(what: str, element: ET.Element, attribute: str, default: float) -> float:
    text = element.get(attribute)
    metres = default if text is None else as_number(text)
    if math.isnan(metres):
        msg = f"{what}: {attribute} is {shown(text)}; expected metres"
        raise RouteError(msg)
    return metres


def on_loop(loop: Loop, stops: Sequence[Stop], what: str, *, from_m: float = 0.0) -> tuple[Stop, ...]:
    """Return stops in the order of a loop, each with its arc length.

    If the loop passes an edge several times, a stop is made on the first pass after the stop before it, and
    the same stop again on the next pass.

    Raises `RouteError` if a stop is not on the loop, or two are at the same place. On a route that is driven
    once, `NotAheadError` if a stop is not on it, or lies behind the departure or the stop written before it.

    Parameters
    ----------
    from_m
        Where the vehicle departs, as arc length [m]; of no effect on a loop.
    """
    placed: list[Stop] = []
    after_m = 0.0 if loop.closed else from_m
    for stop in stops:
        if stop.edge not in loop.edges:
            way = "loop" if loop.closed else "route"
            msg = (
                f"{what}: the stop at {stop.name} is on edge {stop.edge}, which is not on {way} {loop.id}; "
                f"lead the route over it, or leave the stop out"
            )
            raise (RouteError if loop.closed else NotAheadError)(msg)
        passes = loop.arcs(stop.edge, stop.end_m, after_m=after_m)
        if not loop.closed:
            passes = _ahead(passes, from_m if stop.fits else after_m, stop, what, first=not placed)
        taken = [one.arc_m for one in placed]
        free = (arc_m for arc_m in passes if all(abs(arc_m - other_m) >= _LEAST_M for other_m in taken))
        arc_m = next(free, passes[0])
        after_m = max(after_m, arc_m) if stop.fits else arc_m
        placed.append(replace(stop, arc_m=arc_m))
    placed.sort(key=lambda stop: stop.arc_m)
    made: list[Stop] = []
    for stop in placed:
        if not made or stop.arc_m - made[-1].arc_m >= _LEAST_M:
            made.append(stop)
        elif loop.closed:
            msg = f"{what}: it stops twice at {stop.name}; once is enough, as it does so in every round"
            raise RouteError(msg)
        else:
            made[-1] = _both(made[-1], stop, what)
    return tuple(made)


def _ahead(passes: Sequence[float], after_m: float, stop: Stop, what: str, *, first: bool) -> list[float]:
    """Return those arc lengths of a stop that the vehicle has not passed at `after_m`.

    Raises `NotAheadError` if there is none.
    """
    ahead = [arc_m for arc_m in passes if arc_m >= after_m - _ROUNDING_M]
    if not ahead:
        behind, way_out = (
            ("the departure", "let the vehicle depart before it, or leave the stop out")
            if first or stop.fits
            else ("the stop written before it", "write the stops in driving order")
        )
        msg = f"{what}: on its route the stop at {stop.name} lies behind {behind}; {way_out}"
        raise NotAheadError(msg)
    return ahead


def _both(one: Stop, other: Stop, what: str) -> Stop:
    """Return one stop for two at the same position: it lasts as long as both.

    Raises `RouteError` if one stop cannot do that: the first has to wait for something besides its duration.
    """
    bare, besides = (
        replace(s, duration_s=0.0, until_s=None, arc_m=0.0, told=(), fits=False) for s in (one, other)
    )
    if one.triggers or bare != besides:
        msg = f"{what}: it stops twice at {one.name}, each time in another way; make it one stop"
        raise RouteError(msg)
    # The first ends no sooner than its own end; only then the second begins to last.
    ends = [one.until_s + other.duration_s] if one.until_s is not None else []
    until_s = max([*ends, *([other.until_s] if other.until_s is not None else [])], default=None)
    return replace(other, duration_s=one.duration_s + other.duration_s, until_s=until_s)


def stops_of_one_round(stops: Sequence[Stop], rounds: int) -> tuple[Stop, ...]:
    """Return the stops of one round of a route that is written out for several `rounds`."""
    least = -(-len(stops) // max(1, rounds))
    for number in range(max(1, least), len(stops)):
        if all(stop == stops[k % number] for k, stop in enumerate(stops)):
            return tuple(stops[:number])
    return tuple(stops)


def lanes_of_stops(stops: Iterable[Stop]) -> dict[str, int]:
    """Return for each edge with stops the index of the lane with all of them; -1 if there are several."""
    lanes: dict[str, set[int]] = {}
    for stop in stops:
        on = lanes.setdefault(stop.edge, set())
        if not stop.any_lane:
            on.add(int(stop.lane.rpartition("_")[2]))
    return {edge: min(indices) if len(indices) == 1 else -1 for edge, indices in lanes.items()}
