"""Lights that gated vehicles obey: made for the ledger from SUMO, and reported on."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from math import inf
from typing import Any

from loopgate.abstraction.itinerary import Itinerary
from loopgate.control.lamps import OPEN, Lamp, Signal
from loopgate.control.lending import Lending
from loopgate.control.lights import Lights
from loopgate.network import RoadNetwork
from loopgate.network.road import RAIL_CROSSING
from loopgate.traffic.base import Program, Traffic

_LONG_RED_S = 300.0
"""A red this long is worth a warning [s]."""


def longest_closed_s(program: Program, link: int) -> float:
    """Return for how long a program shows no green to one link at most [s]; 0 if it is not fixed."""
    phases = program.phases
    if not phases:
        return 0.0
    if not any(phase.state[link] in OPEN for phase in phases):
        return math.inf
    longest_s = closed_s = 0.0
    phase = 0
    for _ in range(2 * len(phases) if program.fixed else 0):
        here = phases[phase]
        closed_s = 0.0 if here.state[link] in OPEN else closed_s + here.longest_s
        longest_s = max(longest_s, closed_s)
        phase = here.following
    return longest_s


class ShownLights:
    """The traffic lights that gated vehicles obey, and their figures for ``summary.json``.

    Parameters
    ----------
    program
        Function that returns the present program of a light by its name.
    """

    def __init__(self, program: Callable[[str], Program]) -> None:
        self._program = program
        self._used: dict[tuple[str, int], str] = {}
        """The movements on the loops, by light and link."""

    def plan(self, itineraries: Iterable[Itinerary], signals: Mapping[str, tuple[str, int]]) -> None:
        """Read the paths of the vehicles, at the start or after a change; `signals` by movement."""
        self._used.clear()
        for itinerary in {itinerary.loop: itinerary for itinerary in itineraries}.values():
            for crossing in (crossing for leg in itinerary.legs for crossing in leg.crossings):
                if crossing.id in signals:
                    self._used[signals[crossing.id]] = crossing.id

    def figures(
        self, *, grants: int, stood: int, stood_s: float, on_red: int, longest_red_s: float, at: str
    ) -> dict[str, Any]:
        """Return the figures for ``summary.json``; `at` is the place of the longest wait at red."""
        return {
            "grants": grants,
            "stood": stood,
            "stood_s": round(stood_s, 3),
            "on_red": on_red,
            "longest_red_s": round(longest_red_s, 3),
            "longest_red_at": at,
        }

    def warnings(self, longest_red_s: float, at: str) -> list[str]:
        """Return warnings about lights on the loops that are rarely or never green."""
        never, rarely = [], []
        for (light, link), movement in self._used.items():
            closed_s = longest_closed_s(self._program(light), link)
            if closed_s == math.inf:
                never.append(f"{movement} (light {light})")
            elif closed_s > _LONG_RED_S:
                rarely.append(f"{movement} (light {light}, red for {closed_s:.0f} s on end)")
        lines = []
        if never:
            lines.append(
                f"lights: {len(never)} of {len(self._used)} movements with a light never get green in its "
                f"program, first {never[0]}: vehicles wait there for ever, which is no deadlock; "
                "try --lights off"
            )
        if rarely:
            lines.append(
                f"lights: {len(rarely)} of {len(self._used)} movements with a light stay red for more than "
                f"{_LONG_RED_S:.0f} s, first {rarely[0]}: a queue there is no deadlock; try --lights off"
            )
        light = next((light for (light, _), movement in self._used.items() if movement == at), "")
        if longest_red_s > _LONG_RED_S and not lines:
            lines.append(
                f"lights: a vehicle waited {longest_red_s:.0f} s for green at movement {at} (light {light})"
            )
        return lines


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
        lending: Lending,
    ) -> None:
        self._shown = ShownLights(lamps.program)
        by_movement = {name: (one.lamp.name, one.link) for name, one in signals.items()}
        self._shown.plan(itineraries, by_movement)
        self._lights = lights
        self._lending = lending

    def report(self) -> dict[str, Any]:
        """Return figures and warnings for ``summary.json``."""
        lights = self._lights
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
        figures["lent"] = self._lending.lent
        return {"at_lights": figures, "warnings": self._shown.warnings(longest_s, at)}


def signals_in(network: RoadNetwork, lamps: Lamps, *, rails_only: bool = False) -> dict[str, Signal]:
    """Return what lights show in a network, for the ledger, by movement; `rails_only`: at level crossings."""
    found: dict[str, Signal] = {}
    for movement in network.connections:
        if rails_only and network.junctions[movement.junction].type != RAIL_CROSSING:
            continue
        if movement.signal is not None:
            light, link = movement.signal
            speed = min((float(network.lanes[lane].speed_mps) for lane in movement.via), default=inf)
            found[movement.id] = Signal(lamps[light], link, speed)
    return found
