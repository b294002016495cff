"""The content of a route file: loops, and the vehicles and flows on them, without positions."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import count, islice, takewhile
from math import ceil, inf
from pathlib import Path
from random import Random
from xml.etree import ElementTree as ET

from loopgate.errors import RouteError
from loopgate.network.circling import Led
from loopgate.network.clock import as_number, time_of
from loopgate.network.loop import Loop
from loopgate.network.stops import Stop
from loopgate.network.ungated import UngatedFleet
from loopgate.network.vehicle_type import DEFAULT_TYPE, VehicleType, draw
from loopgate.reading import shown

_PER_HOUR = ("vehsPerHour", "perHour")
_OFTEN = ("period", *_PER_HOUR, "probability")

FLOW_ATTRIBUTES = frozenset({"begin", "end", "number", *_OFTEN})
"""Attributes of ``<flow>`` that say when its vehicles depart."""

_BEYOND_COUNTING = 1e18
"""More vehicles than in any run: a period may be so short that their number is infinite."""

_HOUR_S = 3600.0
_WHY = ", since nothing else starts it"


@dataclass(frozen=True, slots=True)
class Flow:
    """Vehicles that depart one after another by a rule."""

    begin_s: float = 0.0
    end_s: float | None = None
    """`begin_s` and `end_s`: first and last time of departures [s]; `end_s` is None for the end of the
    run."""
    number: int | None = None
    """Number of departures; None for no limit."""
    period_s: float | None = None
    """Time between two departures [s]; None to spread `number` departures up to the end."""
    rate_per_s: float | None = None
    """How many depart in a second on average, at random (a Poisson process), instead of every period."""
    probability: float | None = None
    """Of a departure in each second, instead of both."""

    def departures_s(self, since_s: float, run_end_s: float, rng: Random) -> Iterator[tuple[int, float]]:
        """Yield numbers, counted from 0, and times [s] of its departures from a time until the run ends."""
        until_s = self._until_s(run_end_s)
        times: Iterator[float]
        first = 0
        if self.probability is not None:
            draws, probability = int(max(0.0, until_s - self.begin_s)) + 1, self.probability
            times = (self.begin_s + k for k in range(draws) if rng.random() < probability)
        elif self.rate_per_s is not None:
            times = _drawn_s(self.begin_s, self.rate_per_s, rng)
        else:
            period_s = self._every_s(run_end_s)
            first = max(0, self._number_before(since_s, run_end_s) - 1)  # one less, for quotients are rounded
            times = (self.begin_s + k * period_s for k in count(first))
        numbered = enumerate(takewhile(lambda at_s: at_s < until_s, times), first)
        most = None if self.number is None else max(0, self.number - first)
        return ((k, at_s) for k, at_s in islice(numbered, most) if at_s >= since_s)

    def expected(self, since_s: float, run_end_s: float) -> float:
        """Return the number of departures from a time to the end of the run; the mean if they are random."""
        most = inf if self.number is None else float(self.number)
        until_s = self._until_s(run_end_s)
        lasts_s = max(0.0, until_s - max(self.begin_s, since_s))
        if self.probability is not None:
            return min(most, self.probability * lasts_s)
        if self.rate_per_s is not None:
            return min(most, self.rate_per_s * lasts_s)
        before = self._number_before(since_s, run_end_s)
        return max(0.0, min(most, self._number_before(until_s, run_end_s)) - before)

    def scaled(self, scale: float) -> Flow:
        """Return the flow with `scale` times as many departures."""
        return replace(
            self,
            number=None if self.number is None else ceil(self.number * scale),
            period_s=None if self.period_s is None else self.period_s / scale,
            rate_per_s=None if self.rate_per_s is None else self.rate_per_s * scale,
            probability=None if self.probability is None else min(1.0, self.probability * scale),
        )

    def _until_s(self, run_end_s: float) -> float:
        if self.end_s is None or (self._by_number and self.end_s == self.begin_s):
            return run_end_s  # of the latter, as SUMO has it, all depart at once
        return min(self.end_s, run_end_s)

    @property
    def _by_number(self) -> bool:
        return self.period_s is None and self.rate_per_s is None and self.probability is None

    def _every_s(self, run_end_s: float) -> float:
        if self.period_s is not None:
            return self.period_s
        return max(0.0, (run_end_s if self.end_s is None else self.end_s) - self.begin_s) / (self.number or 1)

    def _number_before(self, at_s: float, run_end_s: float) -> int:
        """Return the number of periodic departures before a time."""
        every_s, lasts_s = self._every_s(run_end_s), at_s - self.begin_s
        if lasts_s <= 0.0 or (every_s == 0.0 and self.number is None):
            return 0
        number = min(lasts_s / every_s, _BEYOND_COUNTING) if every_s > 0.0 else _BEYOND_COUNTING
        return ceil(number) if self.number is None else ceil(min(number, self.number))


def _drawn_s(begin_s: float, rate_per_s: float, rng: Random) -> Iterator[float]:
    while True:
        begin_s += rng.expovariate(rate_per_s)
        yield begin_s


def read_flow(element: ET.Element, what: str) -> Flow:
    """Read how often the vehicles of a ``<flow>`` depart.

    Raises `RouteError` if it does not say so, says it twice, or a figure is none.
    """
    said = [name for name in _OFTEN if name in element.attrib]
    number = element.get("number")
    if len(said) > 1 or not (said or number):
        listed = ", ".join(said) or "neither number nor period"
        msg = f"{what}: it says {listed}; expected one of period, vehsPerHour and probability, or a number"
        raise RouteError(msg)
    if said and number and "end" in element.attrib:
        msg = f"{what}: it says {said[0]}, number and end; with the first, SUMO takes one of the others only"
        raise RouteError(msg)
    flow = Flow(
        time_of(element, "begin", what, why=_WHY, from_0=True) or 0.0,
        time_of(element, "end", what, why=_WHY),
        None if number is None else _number(number, what),
    )
    if flow.end_s is not None and flow.end_s < flow.begin_s:
        msg = f"{what}: its end, {flow.end_s:g} s, is before its begin, {flow.begin_s:g} s; correct one"
        raise RouteError(msg)
    if not said:
        return flow
    text = element.attrib[said[0]]
    period_s = rate_per_s = probability = None
    if said[0] == "probability":
        probability = _figure(text, "probability", what, most=1.0)
    elif text.startswith("exp("):
        rate_per_s = _figure(text[4:].rstrip(") "), said[0], what)
    elif said[0] in _PER_HOUR:
        period_s = _HOUR_S / _figure(text, said[0], what)
    else:
        clock_s = time_of(element, said[0], what) if ":" in text else None
        period_s = _figure(text if clock_s is None else str(clock_s), said[0], what)
    return Flow(flow.begin_s, flow.end_s, flow.number, period_s, rate_per_s, probability)


def _number(text: str, what: str) -> int:
    """Return how many vehicles a flow has; SUMO takes 0, too, and skips the flow."""
    return 0 if as_number(text) == 0.0 else int(_figure(text, "number", what, least=1.0))


def depart_s(element: ET.Element, what: str) -> float:
    """Return when a ``<vehicle>`` departs [s].

    Raises `RouteError` if that is missing, or no time from 0 on.
    """
    if element.get("depart") in {"begin", "now"}:
        return 0.0
    at_s = time_of(element, "depart", what, why=_WHY, from_0=True)
    if at_s is None:
        msg = f"{what}: it has no depart; give the seconds or h:m:s{_WHY}"
        raise RouteError(msg)
    return at_s


def _figure(text: str, attribute: str, what: str, *, least: float = 0.0, most: float = 1e9) -> float:
    figure = as_number(text)
    if not least <= figure <= most or figure <= 0.0:
        above = f"from {least:g}" if least else "above 0"
        msg = f"{what}: {attribute} is {shown(text)}; expected a number {above} and up to {most:g}"
        raise RouteError(msg)
    return figure


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
    led: Led = field(default_factory=Led, hash=False)
    """Where rerouters lead it."""

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


def scaled(vehicles: Iterable[VehicleDemand], scale: float) -> Iterator[VehicleDemand]:
    """Yield the vehicles and flows of a file as often as SUMO's option ``scale`` and types of theirs want.

    Copies of a vehicle are called ``ID.1`` and so on, as in SUMO.
    """
    loaded: dict[float, int] = {}
    for vehicle in vehicles:
        times = scale * as_number(vehicle.type.attributes.get("scale", "1"), default=1.0)
        if times == 1.0:
            yield vehicle
        elif vehicle.flow is not None:
            yield from [replace(vehicle, flow=vehicle.flow.scaled(times))] if times > 0.0 else []
        else:
            before = loaded.get(times, 0)
            loaded[times] = before + 1
            number = ceil((before + 1) * times) - ceil(before * times)
            yield from (replace(vehicle, id=f"{vehicle.id}.{k}" if k else vehicle.id) for k in range(number))


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
    persons: tuple[ET.Element, ...] = ()
    """The persons and containers of the route files, with their types: they are left to SUMO."""
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
