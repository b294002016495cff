"""Files of ordinary traffic: a route file or configuration that SUMO gets unchanged."""

import math
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from xml.etree import ElementTree as ET

from loopgate.errors import RouteError
from loopgate.network.clock import seconds
from loopgate.network.sumo_config import is_sumo_config, read_sumo_config
from loopgate.network.vehicle_demand import Flow, read_flow
from loopgate.network.vehicle_type import DEFAULT_TYPE, vehicle_type
from loopgate.network.xml_file import check_included, open_xml, read_xml

_VEHICLES = ("vehicle", "trip", "flow")
_PERSONS = ("person", "personFlow", "container", "containerFlow")
_FLOWS = ("flow", "personFlow", "containerFlow")

MOST_OF_SUMO = 1_000_000
"""Most vehicles and persons of flows in one run; SUMO makes them when they are due, and they take gigabytes.
"""


@dataclass(frozen=True, slots=True)
class Names(AbstractSet[str]):
    """Names of vehicles, trips and flows; the vehicles of a flow are among them, as `FLOW.0`, `FLOW.1`."""

    ids: frozenset[str]
    flows: Mapping[str, Flow] = field(default_factory=dict, hash=False)

    def __contains__(self, vehicle: object) -> bool:
        flow, _, number = str(vehicle).rpartition(".")
        return vehicle in self.ids or (number.isdecimal() and flow in self.flows)

    def __iter__(self) -> Iterator[str]:
        return iter(self.ids)

    def __len__(self) -> int:
        return len(self.ids)

    def departing(self, end_s: float) -> Iterator[str]:
        """Yield the names of all vehicles that depart before a time [s].

        A flow whose departures SUMO draws stands for its vehicles, since nobody knows their number.
        """
        yield from self.ids - self.flows.keys()
        for name, flow in self.flows.items():
            if flow.rate_per_s is not None or flow.probability is not None:
                yield name
            else:
                yield from (f"{name}.{k}" for k, _ in flow.departures_s(-math.inf, end_s, Random(0)))


@dataclass(frozen=True, slots=True)
class TrafficFile:
    """A file of ordinary vehicles and persons."""

    file: Path
    """The path as given."""
    route_files: tuple[Path, ...]
    additional_files: tuple[Path, ...]
    """`route_files` and `additional_files`: the files for SUMO to load."""
    ids: frozenset[str]
    """Names of vehicles, trips and flows."""
    departs_s: tuple[tuple[float, float], ...]
    """Earliest and latest departure of each vehicle or person [s]."""
    flows: tuple[tuple[str, Flow], ...] = ()
    """The names of the flows."""

    def options(self) -> list[str]:
        """Return the SUMO options that load the route files, without additional files."""
        return ["--route-files", ",".join(str(file) for file in self.route_files)]

    def absent(self, begin_s: float, end_s: float) -> tuple[str, ...]:
        """Return a warning if no vehicle departs during a run; additional files are not read."""
        if self.additional_files or any(s < end_s and until_s >= begin_s for s, until_s in self.departs_s):
            return ()
        first_s, last_s = min(s for s, _ in self.departs_s), max(until_s for _, until_s in self.departs_s)
        when = f"from {begin_s:g} to {end_s:g} s, the time of the run, but from {first_s:g} to {last_s:g} s"
        return (f"{self.file}: no vehicle departs {when}: give a .sumocfg that begins then as NETWORK",)

    @property
    def names(self) -> Names:
        """The names of its vehicles, those of flows included."""
        return Names(self.ids, {name: flow for name, flow in self.flows if name in self.ids})

    def check_names(self, vehicles: AbstractSet[str]) -> None:
        """Raise `RouteError` if a vehicle of `vehicles` has the name of an ordinary vehicle or a flow's."""
        mine = self.names
        twice = next((v for v in vehicles if v in mine), next((v for v in mine if v in vehicles), None))
        if twice is not None:
            msg = f"{self.file}: vehicle {twice}: a vehicle on a loop has that name too; rename one"
            raise RouteError(msg)


def read_traffic(file: Path | str) -> TrafficFile:
    """Read a route file (``.rou.xml``, also gzipped) or ``.sumocfg`` with ordinary vehicles.

    Its routes need not close, and trips may leave their ways to SUMO.

    Raises `RouteError` if the file cannot be read, has no vehicles, or a vehicle type makes no sense; the
    text names it.
    """
    path = Path(file)
    if is_sumo_config(path):
        config = read_sumo_config(path)
        routes, additional = config.route_files, config.additional_files
    else:
        routes, additional = (path,), ()
    ids: set[str] = set()
    departs_s: list[tuple[float, float]] = []
    flows: list[tuple[str, Flow]] = []
    persons = False
    for source in routes:
        top = read_xml(source, root="routes", what="route file", error=RouteError)
        spreads = [one.get("vTypes", "").split() for one in top.iter("vTypeDistribution")]
        used = {DEFAULT_TYPE.id, *(one.get("type") for one in top.iter()), *(n for s in spreads for n in s)}
        inner = {id(one) for spread in top.iter("vTypeDistribution") for one in spread}
        for element in top.iter("vType"):
            if element.get("id") in used or id(element) in inner:
                vehicle_type(element, str(source))
        ids.update(element.get("id", "") for tag in _VEHICLES for element in top.iter(tag))
        persons |= any(next(top.iter(tag), None) is not None for tag in _PERSONS)
        departing = (one for tag in (*_VEHICLES, *_PERSONS) for one in top.iter(tag))
        departs_s += map(_departs_s, departing)
        flows += read_flows(one for tag in _FLOWS for one in top.iter(tag))
    if not ids and not persons:
        msg = f"{path}: no vehicles in it; expected <vehicle>, <trip> or <flow> elements as ordinary traffic"
        raise RouteError(msg)
    return TrafficFile(path, routes, additional, frozenset(ids), tuple(departs_s), tuple(flows))


def read_flows(elements: Iterable[ET.Element]) -> Iterator[tuple[str, Flow]]:
    """Yield names and departures of flows; SUMO judges those that say nothing of use."""
    for element in elements:
        with suppress(RouteError):
            yield element.get("id", ""), read_flow(element, "")


def flows_in(files: Iterable[Path]) -> list[tuple[str, Flow]]:
    """Return the flows in SUMO's files and included files; unreadable files are skipped.

    Raises `RouteError` if an include has no name, or is endless.
    """
    return [flow for _, one in elements_in(files) if one.tag in _FLOWS for flow in read_flows([one])]


def elements_in(files: Iterable[Path]) -> Iterator[tuple[Path, ET.Element]]:
    """Yield the elements of SUMO's files and included files, as they end; unreadable files are skipped.

    Raises `RouteError` if an include has no name, or is endless.
    """
    unreadable = (OSError, EOFError, zlib.error, ET.ParseError, ValueError, LookupError)
    every = dict.fromkeys(one for file in files for one in check_included(file, RouteError))
    for file in every:
        with suppress(*unreadable), open_xml(file) as stream:
            for _, element in ET.iterparse(stream):  # noqa: S314  expat refuses entities without bounds
                yield file, element
                if element.tag in {*_VEHICLES, *_PERSONS}:
                    element.clear()


def check_flows(flows: Sequence[tuple[str, Flow]], begin_s: float, end_s: float, source: Path | str) -> None:
    """Raise `RouteError` if more than `MOST_OF_SUMO` vehicles of flows depart in a run."""
    numbers = {name: flow.expected(begin_s, end_s) for name, flow in flows}
    total = sum(numbers.values())
    if total > MOST_OF_SUMO:
        first = max(numbers, key=lambda name: numbers[name])
        msg = (
            f"{source}: about {total:.0f} vehicles and persons of flows depart from {begin_s:g} to "
            f"{end_s:g} s, {numbers[first]:.0f} of them of {first}; expected at most {MOST_OF_SUMO}: lower "
            f"number or rate, or shorten the run (--duration)"
        )
        raise RouteError(msg)


def _departs_s(element: ET.Element) -> tuple[float, float]:
    """Return the earliest and latest departure [s]; any time if SUMO decides it."""
    with suppress(ValueError):
        depart, end = element.get("depart"), element.get("end")
        if depart:
            return seconds(depart), seconds(depart)
        return seconds(element.get("begin", "0")), seconds(end) if end else math.inf
    return -math.inf, math.inf
