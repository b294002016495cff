"""Incidents of a run, from a file: streets closed for a time, vehicles that break down."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from loopgate.errors import ScenarioError
from loopgate.network.clock import time_of_day
from loopgate.network.road import RoadNetwork
from loopgate.reading import check_keys, meant, read_toml, shown

_KEYS = ("closures", "breakdowns")


@dataclass(frozen=True, slots=True)
class Closure:
    """An edge or lane that is closed between two times [s].

    `lane` is empty where the whole edge is closed.
    """

    edge: str
    lane: str
    from_s: float
    to_s: float


@dataclass(frozen=True, slots=True)
class Breakdown:
    """A vehicle that stands still between two times [s]."""

    vehicle: str
    from_s: float
    to_s: float


@dataclass(frozen=True, slots=True)
class Incidents:
    """All closures and breakdowns of a run.

    Examples
    --------
    >>> from loopgate.network.incidents import Closure, Incidents
    >>> planned = Incidents((Closure("e1", "", 60.0, 120.0),))
    >>> [closure.edge for closure in planned.closed_at(60.0)], planned.closed_at(120.0)
    (['e1'], [])
    """

    closures: tuple[Closure, ...] = ()
    breakdowns: tuple[Breakdown, ...] = ()

    def closed_at(self, now_s: float) -> list[Closure]:
        """Return the closures at a time [s]."""
        return [one for one in self.closures if one.from_s <= now_s < one.to_s]

    def broken_at(self, now_s: float) -> list[Breakdown]:
        """Return the breakdowns at a time [s]."""
        return [one for one in self.breakdowns if one.from_s <= now_s < one.to_s]


def read_incidents(network: RoadNetwork, file: Path | str, vehicles: Collection[str]) -> Incidents:
    """Read a TOML file of closures and breakdowns.

    Each entry of ``[[closures]]`` has ``edge``, ``street`` or ``lane``, each of ``[[breakdowns]]`` has
    ``vehicle``; both have ``from`` and may have ``to``, in seconds or as ``h:m`` or ``h:m:s``. Without ``to``
    it lasts to the end. ``street`` closes all edges with this name.

    Parameters
    ----------
    network
        The roads.
    file
        The file.
    vehicles
        Names of the vehicles on loops.

    Raises
    ------
    ScenarioError
        If the file cannot be read, or an entry names no edge, lane or vehicle; the text names the entry.
    """
    data = read_toml(file, "file of incidents", ScenarioError)
    check_keys(data, _KEYS, file, ScenarioError)
    closures = [c for one, what in _entries(data, "closures", file) for c in _closures(network, one, what)]
    breakdowns = []
    for one, what in _entries(data, "breakdowns", file):
        check_keys(one, ("vehicle", "from", "to"), what, ScenarioError)
        vehicle = one.get("vehicle")
        if vehicle not in vehicles:
            some = ", ".join(sorted(vehicles)[:3])
            said = f"vehicle is {shown(vehicle)}" if "vehicle" in one else "the key 'vehicle' is missing"
            msg = f"{what}: {said}; expected the name of a vehicle on a loop, as {some}"
            raise ScenarioError(msg)
        breakdowns.append(Breakdown(str(vehicle), *_times(one, what)))
    return Incidents(tuple(closures), tuple(breakdowns))


def _entries(data: Mapping[str, Any], key: str, file: Path | str) -> list[tuple[Mapping[str, Any], str]]:
    entries = data.get(key, [])
    if not isinstance(entries, list) or not all(isinstance(one, dict) for one in entries):
        msg = f"{file}: {key} is {shown(entries)}; expected tables [[{key}]]"
        raise ScenarioError(msg)
    return [(one, f"{file}: {key} {number}") for number, one in enumerate(entries, start=1)]


def _closures(network: RoadNetwork, one: Mapping[str, Any], what: str) -> list[Closure]:
    kinds = ("edge", "street", "lane")
    check_keys(one, (*kinds, "from", "to"), what, ScenarioError)
    given = [kind for kind in kinds if one.get(kind, "")]
    if len(given) != 1:
        msg = f"{what}: give the edge or the street that is closed, or one lane"
        raise ScenarioError(msg)
    kind, name = given[0], str(one[given[0]])
    times = _times(one, what)
    if kind == "lane" and name in network.lanes:
        return [Closure(name.rpartition("_")[0], name, *times)]
    if kind == "edge" and name in network.edges:
        return [Closure(name, "", *times)]
    if kind == "street" and network.on_street(name):
        return [Closure(edge, "", *times) for edge in network.on_street(name)]
    msg = f"{what}: {kind} is {shown(one[kind])}, which is no {kind} of {network.name}"
    if kind == "edge" and network.on_street(name):
        msg += f'; a street has this name: write street = "{name}"'
    else:
        known = network.lanes if kind == "lane" else network.names()
        msg += meant(name, known)
    raise ScenarioError(msg)


def _times(one: Mapping[str, Any], what: str) -> tuple[float, float]:
    if "from" not in one:
        msg = f"{what}: the key 'from' is missing; expected h:m, h:m:s or seconds, from 0 on"
        raise ScenarioError(msg)
    found = []
    for key in ("from", "to"):
        said = one.get(key, math.inf)
        time_s = -math.inf
        with suppress(ValueError):
            time_s = math.inf if said == math.inf else time_of_day(str(said))
        if time_s < 0.0:
            msg = f"{what}: {key} is {shown(said)}; expected h:m, h:m:s or seconds, from 0 on"
            raise ScenarioError(msg)
        found.append(time_s)
    if not found[0] < found[1]:
        msg = f"{what}: it ends at {found[1]:g} s, but begins at {found[0]:g} s"
        raise ScenarioError(msg)
    return found[0], found[1]
