"""The surroundings of the gated vehicles of a run: lights they obey, traffic under no gate."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from loopgate.abstraction.itinerary import Itinerary
from loopgate.drive.driver import Driver
from loopgate.drive.engine import Engine
from loopgate.drive.gatekeeper import Gatekeeper
from loopgate.drive.timetable import Timetable
from loopgate.drive.track import Track
from loopgate.network import RoadNetwork
from loopgate.simulation.around.circles import Circles
from loopgate.simulation.around.coming import Coming
from loopgate.simulation.around.crossing_ways import CrossingWays, Place, Way
from loopgate.simulation.around.lights import Lights
from loopgate.simulation.around.others import Others
from loopgate.simulation.around.sight import Sight
from loopgate.simulation.around.yielding import Yielding
from loopgate.traffic.base import Traffic

__all__ = ["Surroundings"]


class Surroundings:
    """Puts up the obstacles that are asked for, and tells what they did.

    Parameters
    ----------
    network, traffic
        The roads, and the running simulation.
    engine, keeper
        Made for it.
    timetable
        What lights show; they are obeyed if it is the keeper's.
    others
        Whether there is traffic under no gate.
    """

    def __init__(
        self,
        network: RoadNetwork,
        traffic: Traffic,
        engine: Engine,
        keeper: Gatekeeper,
        timetable: Timetable,
        *,
        others: bool,
    ) -> None:
        self._find = CrossingWays(network) if others else None
        self._ways: dict[str, tuple[Way, ...]] = {}
        self._lights = Lights(engine, timetable) if keeper.timetable is not None else None
        sight = Sight(network, traffic, engine.drivers)
        self._circles = Circles(network, keeper, engine.drivers, self._ways, sight)
        self._others = (
            Others(
                engine.drivers,
                self._ways,
                keeper,
                sight,
                Yielding(traffic, engine, self._ways, timetable, sight, Coming(network, sight)),
                self._circles,
            )
            if others
            else None
        )
        keeper.obstacles += (self._others,) if self._others is not None else ()

    def plan(self, itineraries: Iterable[Itinerary], tracks: Iterable[Track]) -> None:
        """Take over what the vehicles drive by, the first time or anew.

        Parameters
        ----------
        itineraries
            Of all loops, once or several times.
        tracks
            At least one of each loop.
        """
        if self._lights is not None:
            self._lights.plan(itineraries)
        if self._find is not None:
            self._ways.clear()
            places: dict[str, Place] = {}
            for track in {track.loop: track for track in tracks}.values():
                self._ways[track.loop] = self._find.of(track)
                for position, leg in enumerate(track.legs):
                    places.setdefault(str(leg.state), self._find.place(track, position))
            self._circles.plan(places)

    def has_room(self, driver: Driver) -> bool:
        """Return whether a vehicle that is to come back into its place has room among ordinary ones."""
        return self._others is None or self._others.has_room(driver)

    @property
    def each_step(self) -> list[Callable[[], None]]:
        """Functions to be called after each step."""
        return [self._others.look] if self._others is not None else []

    def report(self) -> dict[str, Any]:
        """Return what the obstacles add to ``summary.json``; call before the simulation is closed."""
        found: dict[str, Any] = {}
        if self._lights is not None:
            found |= {"at_lights": self._lights.figures(), "warnings": self._lights.warnings()}
        if self._others is not None:
            found["others"] = self._others.figures()
        return found
