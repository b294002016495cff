"""The surroundings of the gated vehicles of a run: lights they obey, traffic under no gate."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from loopgate.abstraction.itinerary import Itinerary
from loopgate.drive.driver import Driver
from loopgate.drive.engine import Engine
from loopgate.drive.gatekeeper import Gatekeeper
from loopgate.drive.track import Track
from loopgate.network import RoadNetwork
from loopgate.simulation.around.circles import Circles
from loopgate.simulation.around.coming import Coming
from loopgate.simulation.around.crossing_ways import CrossingWays, Place, Way
from loopgate.simulation.around.lights import Lights, Signal, signals_of
from loopgate.simulation.around.others import Others
from loopgate.simulation.around.sight import Sight
from loopgate.simulation.around.timetable import Timetable
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
    lights, others
        Whether lights are obeyed, and whether there is traffic under no gate.
    """

    def __init__(
        self,
        network: RoadNetwork,
        traffic: Traffic,
        engine: Engine,
        keeper: Gatekeeper,
        *,
        lights: bool,
        others: bool,
    ) -> None:
        self._network = network
        self._find = CrossingWays(network) if others else None
        self._signals: dict[str, tuple[tuple[Signal, ...], ...]] = {}
        self._ways: dict[str, tuple[Way, ...]] = {}
        timetable = Timetable(traffic)
        self._lights = Lights(traffic, engine.drivers, self._signals, timetable) if lights else None
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
        keeper.obstacles += tuple(one for one in (self._lights, self._others) if one is not None)

    def plan(self, itineraries: Iterable[Itinerary], tracks: Iterable[Track]) -> None:
        """Take over what the vehicles drive by, the first time or anew.

        Parameters
        ----------
        itineraries
            Of all loops, once or several times.
        tracks
            At least one of each loop.
        """
        loops = {itinerary.loop: itinerary for itinerary in itineraries}
        if self._lights is not None:
            self._signals.clear()
            self._signals.update(signals_of(self._network, list(loops.values())))
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
    def lights_each_step(self) -> list[Callable[[], None]]:
        """Those of them that tell no vehicle how fast to drive."""
        return [self._lights.look] if self._lights is not None else []

    @property
    def each_step(self) -> list[Callable[[], None]]:
        """Functions to be called after each step."""
        return [one.look for one in (self._lights, self._others) if one is not None]

    def report(self) -> dict[str, Any]:
        """Return what the obstacles add to ``summary.json``; call before the simulation is closed."""
        found: dict[str, Any] = {}
        if self._lights is not None:
            found |= {"at_lights": self._lights.figures(), "warnings": self._lights.warnings()}
        if self._others is not None:
            found["others"] = self._others.figures()
        return found
