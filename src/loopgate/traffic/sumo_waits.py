"""Finds the vehicles that block a standing vehicle: its leader, or foes at the junction."""

from collections.abc import Container, Sequence
from typing import Any

_TOUCHING_M = 3.0
"""A vehicle that stands cannot go on if its leader is within the minimum gap plus this distance [m]."""

_FAR_M = 50.0
"""No vehicle stands at a junction because of a leader farther ahead than this [m]."""

_AT_JUNCTION_M = 15.0
"""A vehicle nearer than this to the end of its lane may stand there because of the junction [m]."""

_VIA, _STATE, _LENGTH = 4, 5, 7  # fields of a next link
_FOE, _FOE_TO_CONFLICT, _EGO_PAST_CONFLICT, _FOE_PAST_CONFLICT, _EGO_YIELDS = 0, 2, 3, 4, 7  # of a foe


class RoadWaits:
    """Reads from a running SUMO simulation which vehicles wait for which.

    Each returned vehicle alone is enough to block the asking vehicle. So a circle of standing vehicles that
    wait for each other can never dissolve. The returned vehicles are the first of these that exist:

    - the leader, if it is within a few metres;
    - the leader beyond the junction, if it leaves no space to clear the junction;
    - unless a light is red, the vehicles that stand inside the junction across the path;
    - the vehicles that have the right of way.

    For a vehicle that has stood for long, these are added:

    - vehicles whose fronts are beyond the junction and whose rears stand on crossing lanes: SUMO reports them
      only as leaders;
    - if nothing else explains the wait, a guess. Inside a junction it is the vehicles on crossing lanes,
      since SUMO can let two vehicles wait for each other there. Before a junction it is the leader beyond,
      for which SUMO keeps the junction clear.

    Parameters
    ----------
    api
        The libsumo module or a traci connection, started.
    held
        The vehicles that stand until they are released: neither they nor the vehicles behind them come.
    """

    def __init__(self, api: Any, held: Container[str] = ()) -> None:  # noqa: ANN401  neither API has types
        self._held = held
        self._vehicle = api.vehicle
        self._lane = api.lane

    def of(self, vehicle: str, *, guess: bool) -> Sequence[str]:
        """Return the vehicles that block `vehicle`; empty if no vehicle on the road does."""
        get = self._vehicle
        if ahead := self._leader(vehicle, _TOUCHING_M):  # checked first: most vehicles stand in a queue
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
        """Return vehicles past the junction whose rears stand on lanes that cross an internal lane."""
        if not lane.startswith(":"):
            return []
        beyond = {link[0] for foe in self._lane.getInternalFoes(lane) for link in self._lane.getLinks(foe)}
        last = [vehicles[0] for out in sorted(beyond) if (vehicles := self._lane.getLastStepVehicleIDs(out))]
        get = self._vehicle
        return [v for v in last if get.getLanePosition(v) < get.getLength(v)]

    def _leader(self, vehicle: str, within_m: float) -> Sequence[str]:
        """Return the vehicle ahead if its rear is within this distance beyond the minimum gap."""
        found = self._vehicle.getLeader(vehicle, within_m + 1.0)
        return (found[0],) if found and found[0] and found[1] <= within_m else ()

    def _guess(self, vehicle: str, lane: str) -> Sequence[str]:
        beside = self._beside(lane) if lane.startswith(":") else ()
        return beside or self._leader(vehicle, _FAR_M)

    def _beside(self, lane: str) -> Sequence[str]:
        """Return the vehicles on lanes that cross an internal lane."""
        return tuple(
            other
            for foe in self._lane.getInternalFoes(lane)
            for other in self._lane.getLastStepVehicleIDs(foe)
        )

    def _stays(self, vehicle: str) -> bool:
        """Return whether the first vehicle on a vehicle's lane is held and stands."""
        lane = self._vehicle.getLaneID(vehicle)
        first = self._lane.getLastStepVehicleIDs(lane)[-1]
        return not lane.startswith(":") and first in self._held and bool(self._vehicle.isStopped(first))

    def _blocks(self, foe: Sequence[Any]) -> bool:
        """Return whether a foe's body is on the conflict area, and the asking vehicle is not past it."""
        within: bool = (
            foe[_FOE_TO_CONFLICT] <= 0.0 < foe[_FOE_PAST_CONFLICT] + self._vehicle.getLength(foe[_FOE])
        )
        return within and bool(foe[_EGO_PAST_CONFLICT] > 0.0)

    def _over(self, links: Sequence[Sequence[Any]]) -> float:
        """Return the length of the path over the next junction with its internal junctions [m]."""
        length, via = float(links[0][_LENGTH]), links[0][_VIA]
        while via:
            following = self._lane.getLinks(via)
            via = following[0][_VIA] if following else ""
            if via:
                length += float(self._lane.getLength(via))
        return length
