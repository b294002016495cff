"""The surroundings of the gated vehicles of a run: lights they obey, traffic under no gate."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from loopgate.abstraction.itinerary import Itinerary
from loopgate.abstraction.track import Track
from loopgate.drive.driver import Driver
from loopgate.drive.engine import Engine
from loopgate.drive.gatekeeper import Gatekeeper
from loopgate.drive.timetable import Timetable
from loopgate.network import RoadNetwork
from loopgate.simulation.around.crossing_ways import CrossingWays
from loopgate.simulation.around.laid_roads import PROMISE
from loopgate.simulation.around.lights import Lights
from loopgate.simulation.around.roads import Roads
from loopgate.simulation.around.sight import Sight
from loopgate.simulation.around.ways import Ways
from loopgate.traffic.base import Traffic

__all__ = ["Surroundings"]


class Surroundings:
    """Ordinary traffic and traffic lights, as the drive sees them, and their figures.

    Parameters
    ----------
    network, traffic
        The roads, and the running simulation.
    engine, keeper
        The parts that drive the gated vehicles.
    code
        Mapping of words to numbers.
    timetable
        The table of the lights' colours.
    others
        Whether there is ordinary traffic.
    """

    def __init__(
        self,
        network: RoadNetwork,
        traffic: Traffic,
        engine: Engine,
        keeper: Gatekeeper,
        code: Callable[[str], int],
        timetable: Timetable,
        *,
        others: bool,
    ) -> None:
        self._lights = Lights(engine, timetable) if keeper.timetable is not None else None
        self._sight: Sight | None = None
        if others:
            self._find, self._roads, self._code = CrossingWays(network), Roads(network), code
            self._sight = Sight(self._roads, traffic, engine, keeper, timetable)

    def plan(self, itineraries: Iterable[Itinerary], tracks: Iterable[Track]) -> None:
        """Read the paths of the gated vehicles, at the start or after a change.

        Parameters
        ----------
        itineraries
            The itineraries of all loops; a loop may occur several times.
        tracks
            Paths of vehicles, at least one on each loop.
        """
        if self._lights is not None:
            self._lights.plan(itineraries)
        if self._sight is not None:
            self._sight.plan(Ways(self._find, self._roads, tracks, self._code))

    def has_room(self, driver: Driver) -> bool:
        """Return whether a returning vehicle fits between the ordinary vehicles in its place."""
        return self._sight is None or self._sight.has_room(driver.robot)

    @property
    def each_step(self) -> list[Callable[[], None]]:
        """The functions to call after each step."""
        return [self._sight.give_way] if self._sight is not None else []

    def report(self) -> dict[str, Any]:
        """Return the figures of ordinary traffic and lights for ``summary.json``; call before the end."""
        found: dict[str, Any] = {}
        if self._lights is not None:
            found |= self._lights.report()
        if self._sight is not None:
            found["others"] = {"vehicles": self._sight.count, "promise": PROMISE}
        return found
