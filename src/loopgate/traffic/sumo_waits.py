"""The vehicles that block a standing vehicle: its leader, or foes at the junction."""

from collections.abc import Container, Sequence
from typing import Any

_TOUCHING_M = 3.0
"""A leader at most this far ahead, beyond the minimum gap, leaves a standing vehicle no way on."""

_FAR_M = 50.0
"""Nobody stands at a junction for a leader farther ahead than this."""

_AT_JUNCTION_M = 15.0
"""A vehicle this near to its lane's end may stand there because of the junction."""

_VIA, _STATE, _LENGTH = 4, 5, 7  # fields of a next link
_FOE, _FOE_TO_CONFLICT, _EGO_PAST_CONFLICT, _FOE_PAST_CONFLICT, _EGO_YIELDS = 0, 2, 3, 4, 7  # of a foe


class RoadWaits:
    """Reads the wait-for relation off a running SUMO simulation.

    Each vehicle returned is by itself enough to keep the asking vehicle where it is, so that a circle of
    standing vehicles that wait for each other can never dissolve:

    - the leader, where it is within a few metres;
    - the leader beyond the junction, where it leaves no room to clear the junction;
    - else, unless a light shows red, the vehicles that stand inside the junction across its way;
    - else the vehicles that have the right of way;
    - where one has stood for long, also those whose rears are on the ways that cross its own, their fronts
      beyond the junction: SUMO tells of them only where they are the leader;
    - where nothing of this explains it, a guess: inside a junction the vehicles on the ways that cross its
      own (SUMO can let two wait for each other there, for ever or for a minute or two), before one the
      leader beyond, for which SUMO keeps it clear.

    Parameters
    ----------
    api
        The libsumo module or a traci connection, started.
    held
        The vehicles that are to stand somewhere until they are released: neither they nor those behind come.
    """

    def __init__(self, api: Any, held: Container[str] = ()) -> None:  # noqa: ANN401  neither API has types
        self._held = held
        self._vehicle = api.vehicle
        self._lane = api.lane

    def of(self, vehicle: str, *, guess: bool) -> Sequence[str]:
        """Return the vehicles that block `vehicle`; empty if no vehicle on the road does."""
        get = self._vehicle
        if ahead := self._leader(vehicle, _TOUCHING_M):  # asked first: most stand in a queue
            return ahead
        lane = get.getLaneID(vehicle)
        to_end = self._lane.getLength(lane) - get.getLanePosition(vehicle)
        links = get.getNextLinks(vehicle)
        inside = lane.startswith(":")
        if not links or not (inside or to_end <= _AT_JUNCTION_M):
            return ()
        room = get.getLength(vehicle) + get.getMinGap(vehicle)
        if ahead := self._leader(vehicle, to_end + (0.0 if inside else self._over(links)) + room):
            return ahead
        if links[0][_STATE] in "ru":
            return ()
        foes = get.getJunctionFoes(vehicle, to_end + 1.0)
        across = [foe[_FOE] for foe in foes if self._blocks(foe)]
        across = across or [foe[_FOE] for foe in foes if foe[_EGO_YIELDS] and not self._stays(foe[_FOE])]
        if guess:
            across += self._rears(lane if inside else links[0][_VIA])
        return tuple(dict.fromkeys(across)) or (self._guess(vehicle, lane) if guess else ())

    def faces_red(self, vehicle: str) -> bool:
        """Return whether a vehicle is near the end of its lane, and a light there is red for it."""
        lane, links = self._vehicle.getLaneID(vehicle), self._vehicle.getNextLinks(vehicle)
        to_end = self._lane.getLength(lane) - self._vehicle.getLanePosition(vehicle) if lane else 0.0
        return bool(links) and to_end <= _AT_JUNCTION_M and links[0][_STATE] in "ru"

    def _rears(self, lane: str) -> list[str]:
        """Return vehicles past the junction whose rears stand on foes of an internal lane."""
        if not lane.startswith(":"):
            return []
        beyond = {link[0] for foe in self._lane.getInternalFoes(lane) for link in self._lane.getLinks(foe)}
        last = [vehicles[0] for out in sorted(beyond) if (vehicles := self._lane.getLastStepVehicleIDs(out))]
        get = self._vehicle
        return [v for v in last if get.getLanePosition(v) < get.getLength(v)]

    def _leader(self, vehicle: str, within_m: float) -> Sequence[str]:
        """Return the vehicle ahead if its rear is that near, beyond the minimum gap."""
        found = self._vehicle.getLeader(vehicle, within_m + 1.0)
        return (found[0],) if found and found[0] and found[1] <= within_m else ()

    def _guess(self, vehicle: str, lane: str) -> Sequence[str]:
        beside = self._beside(lane) if lane.startswith(":") else ()
        return beside or self._leader(vehicle, _FAR_M)

    def _beside(self, lane: str) -> Sequence[str]:
        """Return the vehicles on foes of an internal lane."""
        return tuple(
            other
            for foe in self._lane.getInternalFoes(lane)
            for other in self._lane.getLastStepVehicleIDs(foe)
        )

    def _stays(self, vehicle: str) -> bool:
        """Return whether the first vehicle on the lane is held and stands."""
        lane = self._vehicle.getLaneID(vehicle)
        first = self._lane.getLastStepVehicleIDs(lane)[-1]
        return not lane.startswith(":") and first in self._held and bool(self._vehicle.isStopped(first))

    def _blocks(self, foe: Sequence[Any]) -> bool:
        """Return whether a foe's body is where the two ways conflict, and the asker has not passed there."""
        within: bool = (
            foe[_FOE_TO_CONFLICT] <= 0.0 < foe[_FOE_PAST_CONFLICT] + self._vehicle.getLength(foe[_FOE])
        )
        return within and bool(foe[_EGO_PAST_CONFLICT] > 0.0)

    def _over(self, links: Sequence[Sequence[Any]]) -> float:
        """Return the length of the way over the next junction [m], internal junctions included."""
        length, via = float(links[0][_LENGTH]), links[0][_VIA]
        while via:
            following = self._lane.getLinks(via)
            via = following[0][_VIA] if following else ""
            if via:
                length += float(self._lane.getLength(via))
        return length
