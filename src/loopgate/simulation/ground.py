"""The ground on which a drive is built, in runs and attached gates alike: lights, other traffic, places."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

from loopgate.abstraction.itinerary import DrawnLeg, Itinerary, PlaceRoom
from loopgate.control.driving import Driving
from loopgate.control.layout import PlaceLayout
from loopgate.control.ledger import Ledger
from loopgate.control.ordinary import traffic as among
from loopgate.control.refusal import Rule
from loopgate.control.slack import Slack
from loopgate.control.spacing import Spacing
from loopgate.network import RoadNetwork
from loopgate.network.stops import Stop
from loopgate.simulation.surroundings.laid_roads import LaidRoads
from loopgate.simulation.surroundings.obeyed import Lamps, ObeyedLights, signals_in
from loopgate.traffic.base import Traffic


class Ground:
    """The roads of a simulation as gated vehicles meet them.

    Parameters
    ----------
    network, traffic
        The roads, and the running simulation.
    obeys
        Whether vehicles wait at red lights.
    others
        Whether there may be ordinary vehicles.
    walkers
        Whether persons may walk; among ordinary vehicles, nothing is foreseen anyway.
    """

    def __init__(
        self, network: RoadNetwork, traffic: Traffic, *, obeys: bool, others: bool, walkers: bool = False
    ) -> None:
        self._traffic, self._obeys = traffic, obeys
        self._driving: Driving | None = None
        self.itineraries: Sequence[Itinerary] = ()
        """The paths of the vehicles, for what is reported of lights."""
        self._lamps = Lamps(traffic)
        lit = obeys or others  # trains are ordinary traffic: before them the road is closed in any case
        self._signals = signals_in(network, self._lamps, rails_only=not obeys) if lit else {}
        self._walked = {c.id for c in network.connections if network.is_walked(c)} if walkers else set()
        self._roads = (
            LaidRoads(network, traffic, self._lamps.__getitem__, everywhere=not obeys) if others else None
        )

    @property
    def is_lit(self) -> bool:
        """Whether some light is to be obeyed."""
        return bool(self._signals)

    @property
    def slack(self) -> Slack | None:
        """The room that ordinary vehicles leave; None without such vehicles."""
        return self._roads.slack if self._roads else None

    @property
    def rules(self) -> list[Rule]:
        """The rules about ordinary vehicles."""
        return [among(self._roads.sight, self._roads.slack)] if self._roads else []

    def layout(
        self,
        slots: Mapping[str, int],
        legs: Iterable[Sequence[DrawnLeg]] = (),
        rooms: Mapping[str, PlaceRoom] = MappingProxyType({}),
    ) -> PlaceLayout:
        """Return the layout of places with so many slots, and of the paths over them; `rooms` as there."""
        every = list({id(path): path for path in legs}.values())
        add = self._roads.add if self._roads else None
        return PlaceLayout(slots, every, self._signals, add, rooms, self._walked)

    def driving(
        self,
        ledger: Ledger,
        layout: PlaceLayout,
        stops: Mapping[str, Sequence[Stop]] = MappingProxyType({}),
        spacing: Spacing | None = None,
    ) -> Driving:
        """Return what drives vehicles here under the rules of a ledger, still without vehicles."""
        roads = self._roads
        room: Callable[[Any], bool] = roads.has_room if roads else lambda _: True
        sight = roads.sight if roads else None
        self._driving = Driving(self._traffic, layout, ledger, sight, stops, room, spacing)
        return self._driving

    def report(self) -> dict[str, Any]:
        """Return the figures of lights and ordinary traffic for ``summary.json``."""
        told: dict[str, Any] = {}
        if self._obeys and self._driving is not None:
            driving = self._driving
            rules = driving.lights, driving.lending
            told |= ObeyedLights(self._lamps, self._signals, self.itineraries, *rules).report()
        return told | (self._roads.report() if self._roads else {})
