"""What surrounds the gated vehicles of a run: lights they obey, traffic under no gate."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from loopgate.drive.engine import Engine
from loopgate.drive.gatekeeper import Gatekeeper
from loopgate.simulation.assembly import Assembly
from loopgate.simulation.lights import Lights, signals_of
from loopgate.simulation.others import Others
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.timetable import Timetable
from loopgate.simulation.ways import Way, Ways
from loopgate.traffic.base import Traffic

__all__ = ["Surroundings"]

_ON_SEGMENTS = (
    "lights: on segments no state ends at a light, so a vehicle holds its zone while it waits there at a red"
)


class Surroundings:
    """Puts up the obstacles that a scenario asks for, and tells what they did to the run.

    Parameters
    ----------
    scenario, assembly
        What is run.
    traffic
        The running simulation.
    engine, keeper
        Made for it; no keeper where no gate rules.
    """

    def __init__(
        self,
        scenario: Scenario,
        assembly: Assembly,
        traffic: Traffic,
        engine: Engine,
        keeper: Gatekeeper | None,
    ) -> None:
        self._lights: Lights | None = None
        self._others: Others | None = None
        self._abstraction = scenario.abstraction
        abstraction = assembly.abstraction
        if keeper is None or abstraction is None:
            return
        timetable = Timetable(traffic)
        if scenario.rule_for_lights == "obey":
            signals = signals_of(assembly.network, abstraction.itineraries)
            self._lights = Lights(traffic, engine.drivers, signals, timetable)
            keeper.obstacles += (self._lights,)
        if scenario.traffic:
            system = abstraction.system
            find = Ways(assembly.network)
            of_loop: dict[str, tuple[Way, ...]] = {}
            for driver, itinerary, path in zip(
                engine.drivers, abstraction.itineraries, system.paths, strict=True
            ):
                if itinerary.loop not in of_loop:
                    of_loop[itinerary.loop] = find.of(driver.track, itinerary, path, system.room)
            ways = [of_loop[itinerary.loop] for itinerary in abstraction.itineraries]
            self._others = Others(traffic, engine.drivers, ways, keeper, timetable)
            keeper.obstacles += (self._others,)

    @property
    def each_step(self) -> list[Callable[[], None]]:
        """What is to be called after each step."""
        return [self._lights.look] if self._lights else []

    def report(self) -> dict[str, Any]:
        """Return what the obstacles add to ``summary.json``; call before the simulation is closed."""
        found: dict[str, Any] = {}
        if self._lights is not None:
            lines = [_ON_SEGMENTS] if self._abstraction == "segments" else self._lights.warnings()
            found |= {"at_lights": self._lights.figures(), "warnings": lines}
        if self._others is not None:
            found["others"] = self._others.figures()
        return found
