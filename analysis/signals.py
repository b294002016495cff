"""Controllers of traffic lights from the literature, for any run in this process: the gate's rivals.

``with controlled("max-pressure"): simulate(scenario, folder)`` switches the lights of the network after each
step. Max-pressure is Varaiya's (2013) with a guard against spillback; those of the package
``sumoITScontrol`` are run as their authors publish them, if it is installed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Final

import libsumo

GREEN_S: Final = 5.0
AMBER_S: Final = 3.0
SLOT_M: Final = 7.5
STAYS: Final = 0.8
"""By so many vehicles' pressure another phase has to be better than the one that shows green."""


@dataclass
class Junction:
    """A traffic light: its links, the phases to choose from, and what it shows."""

    name: str
    links: Sequence[tuple[str, str]]
    phases: Sequence[str]
    shown: int = 0
    bound_for: int = 0
    until_s: float = 0.0

    def states(self) -> str:
        """Return what is to be shown: the phase, or amber for who loses green on the way to the next."""
        now, then = self.phases[self.shown], self.phases[self.bound_for]
        return "".join("y" if a in "Gg" and b == "r" else a for a, b in zip(now, then, strict=True))


class MaxPressure:
    """Every five seconds, green for the movements with most vehicles behind and fewest ahead.

    A movement counts for nothing while the lane ahead is full, and its light shows amber, so that nobody
    comes to stand on the junction. Beside the phases of the programme there is one for each approach alone.
    """

    def __init__(self) -> None:
        found = (self._junction(name) for name in libsumo.trafficlight.getIDList())
        self._junctions = [junction for junction in found if junction.phases]
        lanes = {lane for junction in self._junctions for link in junction.links for lane in link if lane}
        self._slots = {lane: max(2, int(libsumo.lane.getLength(lane) / SLOT_M)) for lane in lanes}

    @staticmethod
    def _junction(name: str) -> Junction:
        links = [tuple(of[0][:2]) if of else ("", "") for of in libsumo.trafficlight.getControlledLinks(name)]
        shown, programmes = (
            libsumo.trafficlight.getProgram(name),
            libsumo.trafficlight.getAllProgramLogics(name),
        )
        programme = next((one for one in programmes if one.programID == shown), programmes[0])
        if not programme.phases:  # a signal of a railway
            return Junction(name, [], [])
        # A state can be longer than the links that are used.
        links += [("", "")] * (len(programme.phases[0].state) - len(links))
        phases = [phase.state for phase in programme.phases if "y" not in phase.state]
        phases += [
            "".join("G" if link[0] == lane else "r" for link in links)
            for lane in dict.fromkeys(link[0] for link in links if link[0])
        ]
        return Junction(name, [(str(a), str(b)) for a, b in links], list(dict.fromkeys(phases)))

    def step(self) -> None:
        """Look at all queues and switch."""
        now_s = libsumo.simulation.getTime()
        held = {lane: libsumo.lane.getLastStepVehicleNumber(lane) for lane in self._slots}
        for junction in self._junctions:
            if now_s >= junction.until_s:
                self._choose(junction, now_s, held)
            states = junction.states()
            full = (self._full(lane, held) for _, lane in junction.links)
            shown = "".join("y" if no and s in "Gg" else s for s, no in zip(states, full, strict=True))
            libsumo.trafficlight.setRedYellowGreenState(junction.name, shown)

    def _full(self, lane: str, held: dict[str, int]) -> bool:
        return not lane or held[lane] >= self._slots[lane] - 1

    def _choose(self, junction: Junction, now_s: float, held: dict[str, int]) -> None:
        if junction.bound_for != junction.shown:
            junction.shown, junction.until_s = junction.bound_for, now_s + GREEN_S
            return
        wanted = {lane: _next_edges(lane) for lane in {begin for begin, _ in junction.links if begin}}
        pressures = [self._pressure(junction, phase, wanted, held) for phase in junction.phases]
        pressures[junction.shown] += STAYS if pressures[junction.shown] > 0.0 else 0.0
        best = max(range(len(pressures)), key=pressures.__getitem__)
        junction.bound_for = best
        junction.until_s = now_s + (1.0 if best == junction.shown else AMBER_S)

    def _pressure(
        self, junction: Junction, phase: str, wanted: dict[str, list[str]], held: dict[str, int]
    ) -> float:
        total = 0.0
        for (begin, end), state in zip(junction.links, phase, strict=True):
            if state in "Gg" and not self._full(end, held):
                queue = wanted[begin].count(libsumo.lane.getEdgeID(end))
                fuller = held[begin] / self._slots[begin] - held[end] / self._slots[end]
                total += queue * max(0.05, fuller + 0.5) * (1.0 if state == "G" else 0.6)
        return total


def _next_edges(lane: str) -> list[str]:
    """Return where the vehicles on a lane go next, those who go nowhere left out."""
    found = []
    for vehicle in libsumo.lane.getLastStepVehicleIDs(lane):
        route, at = libsumo.vehicle.getRoute(vehicle), libsumo.vehicle.getRouteIndex(vehicle)
        found += route[at + 1 : at + 2]
    return found


class Published:
    """The max-pressure of sumoITScontrol with phases that end when another has more pressure."""

    def __init__(self) -> None:
        from sumoITScontrol import Intersection, intersection  # noqa: PLC0415  an extra
        from sumoITScontrol.control.intersection_management.MaxPressure_Flex import (  # noqa: PLC0415
            MaxPressure_Flex,
        )

        intersection.traci = libsumo
        self._controllers = []
        for name in libsumo.trafficlight.getIDList():
            links = libsumo.trafficlight.getControlledLinks(name)
            states = [phase.state for phase in libsumo.trafficlight.getAllProgramLogics(name)[0].phases]
            green = [k for k, state in enumerate(states) if "y" not in state and "G" in state.upper()]
            if not green[1:] or green != list(range(0, len(states), 2)):  # not green and amber in turn
                continue
            lanes = {
                k: sorted({of[0][0] for of, s in zip(links, states[k], strict=True) if of and s in "Gg"})
                for k in green
            }
            words = {
                "T_L": AMBER_S,
                "T_A": GREEN_S,
                "G_T_MIN": GREEN_S,
                "G_T_MAX": 50.0,
                "measurement_period": 1,
            }
            self._controllers.append(MaxPressure_Flex(words, Intersection(name, green, links=lanes)))

    def step(self) -> None:
        """Let each look at its lanes and switch."""
        now_ms = libsumo.simulation.getTime() * 1000
        for controller in self._controllers:
            controller.execute_control(now_ms)


CONTROLLERS: Final[dict[str, Callable[[], MaxPressure | Published]]] = {"max-pressure": MaxPressure}
if find_spec("sumoITScontrol"):
    CONTROLLERS["max-pressure of sumoITScontrol"] = Published


@contextmanager
def controlled(name: str) -> Iterator[None]:
    """Switch the lights of all simulations of this process, until the end of the block."""

    class Listener(libsumo.StepListener):  # type: ignore[misc]  # libsumo is not typed
        controller: MaxPressure | Published | None = None
        last_s = 0.0

        def step(self, _time: float = 0.0) -> bool:
            now_s = libsumo.simulation.getTime()
            if self.controller is None or now_s < self.last_s:
                self.controller = CONTROLLERS[name]()
            self.last_s = now_s
            self.controller.step()
            return True

    listener = Listener()
    number = libsumo.addStepListener(listener)
    try:
        yield
    finally:
        libsumo.removeStepListener(number)
