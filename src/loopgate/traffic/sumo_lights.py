"""Traffic lights in SUMO."""

from collections.abc import Callable
from typing import Any

from loopgate.traffic.base import Light, Phase, Program

_STATIC = 0  # SUMO's number for lights that follow a timetable

_FIGURES = ("getRedYellowGreenState", "getNextSwitch", "getProgram", "getPhase", "getSpentDuration")
"""What reads the figures of a `Light`, one after the other."""


class SumoLights:
    """The calls of `Traffic` that are about lights; `read` finds a reading by its name."""

    def __init__(self, api: Any, read: Callable[[str], Callable[..., Any]]) -> None:  # noqa: ANN401  no types
        self._programs_of, self._program_of = (
            api.trafficlight.getAllProgramLogics,
            read("trafficlight_getProgram"),
        )
        self._figures = [read(f"trafficlight_{name}") for name in _FIGURES]

    def light(self, light: str) -> Light:
        return Light._make([figure(light) for figure in self._figures])

    def light_program(self, light: str) -> Program:
        name = self._program_of(light)
        logic = next((one for one in self._programs_of(light) if one.programID == name), None)
        if logic is None:
            return Program((), fixed=False)
        fixed = int(logic.type) == _STATIC
        count = len(logic.phases)
        return Program(
            tuple(
                Phase(
                    state=phase.state,
                    longest_s=float(phase.duration if fixed else phase.maxDur),
                    following=int(phase.next[0]) if phase.next else (number + 1) % count,
                )
                for number, phase in enumerate(logic.phases)
            ),
            fixed=fixed,
        )
