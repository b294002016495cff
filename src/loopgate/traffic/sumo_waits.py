"""Whom a standing vehicle waits for on SUMO's roads: its leader, or foes at the junction."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

__all__ = ["RoadWaits"]

_TOUCHING_M = 3.0
"""A leader at most this far ahead, beyond the minimum gap, leaves a standing vehicle no way on."""

_AT_JUNCTION_M = 15.0
"""A vehicle this near to its lane's end may stand there because of the junction."""

_STANDING_MPS = 0.1

_VIA, _STATE, _LENGTH = 4, 5, 7  # fields of a next link
_FOE, _EGO_YIELDS = 0, 7  # fields of a junction foe


class RoadWaits:
    """Reads the wait-for relation off a running SUMO simulation.

    Each vehicle returned is by itself enough to keep the asking vehicle where it is, so that a circle of
    standing vehicles that wait for each other can never dissolve:

    - the leader, where it is within a few metres;
    - the leader beyond the junction, where it leaves no room to clear the junction;
    - else, unless a light shows red, a vehicle that stands inside the junction across the way, and a
      vehicle that has the right of way.

    Parameters
    ----------
    api
        The libsumo module or a traci connection, started.
    """

    def __init__(self, api: Any) -> None:  # noqa: ANN401  neither API has types
        self._vehicle = api.vehicle
        self._lane = api.lane

    def of(self, vehicle: str) -> Sequence[str]:
        """Return whom `vehicle` waits for; empty if nothing on the road explains why it stands."""
        get = self._vehicle
        lane = get.getLaneID(vehicle)
        to_end = self._lane.getLength(lane) - get.getLanePosition(vehicle)
        links = get.getNextLinks(vehicle)
        inside = lane.startswith(":")
        at_junction = bool(links) and (inside or to_end <= _AT_JUNCTION_M)
        look = _TOUCHING_M
        if at_junction:
            own = get.getLength(vehicle) + get.getMinGap(vehicle)
            look = max(look, to_end + (0.0 if inside else self._over(links)) + own)
        found = get.getLeader(vehicle, look + 1.0)
        if found and found[0] and found[1] <= look:
            return (found[0],)
        if not at_junction or links[0][_STATE] in "ru":
            return ()
        foes = list(self._across(vehicle, links[0][_VIA]))
        foes += [
            foe[_FOE]
            for foe in get.getJunctionFoes(vehicle, to_end + 1.0)
            if foe[_EGO_YIELDS] and foe[_FOE] not in foes
        ]
        return tuple(foes)

    def _over(self, links: Sequence[Sequence[Any]]) -> float:
        """Return the length of the way over the next junction [m], internal junctions included."""
        length, via = float(links[0][_LENGTH]), links[0][_VIA]
        while via:
            following = self._lane.getLinks(via)
            via = following[0][_VIA] if following else ""
            if via:
                length += float(self._lane.getLength(via))
        return length

    def _across(self, vehicle: str, via: str) -> Sequence[str]:
        if not via:
            return ()
        return tuple(
            other
            for lane in self._lane.getInternalFoes(via)
            for other in self._lane.getLastStepVehicleIDs(lane)
            if other != vehicle and self._vehicle.getSpeed(other) <= _STANDING_MPS
        )
