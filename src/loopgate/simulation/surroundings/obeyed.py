"""Makes the lights of the ledger (`loopgate.control.lamps`) from SUMO, and reports on obeyed lights."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import inf
from typing import Any

from loopgate.abstraction.itinerary import Itinerary
from loopgate.control.lamps import Lamp, Signal
from loopgate.control.lights import Lights
from loopgate.network import RoadNetwork
from loopgate.simulation.surroundings.lights import ShownLights
from loopgate.traffic.base import Program, Traffic

__all__ = ["Lamps", "ObeyedLights", "signals_in"]


class Lamps(dict[str, Lamp]):
    """The traffic lights of a simulation, by name."""

    def __init__(self, traffic: Traffic) -> None:
        self._traffic = traffic

    def __missing__(self, name: str) -> Lamp:
        """Make the light that is asked for the first time."""
        self[name] = lamp = Lamp(name, self._traffic)
        return lamp

    def program(self, name: str) -> Program:
        """Return the program that a light runs now."""
        lamp = self[name]
        lamp.look(self._traffic.now_s)
        return lamp.program


class ObeyedLights:
    """Reports on the traffic lights that vehicles under the ledger obey."""

    def __init__(
        self,
        lamps: Lamps,
        signals: Mapping[str, Signal],
        itineraries: Iterable[Itinerary],
        lights: Lights,
        *,
        obeys: bool,
    ) -> None:
        self._obeys, self._shown = obeys, ShownLights(lamps.program)
        by_movement = {name: (one.lamp.name, one.link) for name, one in signals.items()}
        self._shown.plan(itineraries, by_movement)
        self._lights = lights

    def report(self) -> dict[str, Any]:
        """Return figures and warnings for ``summary.json``; nothing if lights are not obeyed."""
        lights = self._lights
        if not self._obeys:
            return {}
        longest_s, over = lights.longest()
        at = over.movement.name if over else ""
        figures = self._shown.figures(
            grants=lights.grants,
            stood=lights.stood,
            stood_s=lights.stood_s,
            on_red=lights.on_red,
            longest_red_s=longest_s,
            at=at,
        )
        return {"at_lights": figures, "warnings": self._shown.warnings(longest_s, at)}


def signals_in(network: RoadNetwork, lamps: Lamps) -> dict[str, Signal]:
    """Return what lights show in a network, for the ledger, by movement."""
    found: dict[str, Signal] = {}
    for movement in network.connections:
        if movement.signal is not None:
            light, link = movement.signal
            speed = min((float(network.lanes[lane].speed_mps) for lane in movement.via), default=inf)
            found[movement.id] = Signal(lamps[light], link, speed)
    return found
