"""Traffic lights in SUMO."""

from typing import Any

from loopgate.traffic.base import Light, Phase, Program

_STATIC = 0  # SUMO's number for lights that follow a timetable


class SumoLights:
    """The calls of `Traffic` that are about lights."""

    _api: Any

    def light(self, light: str) -> Light:
        get = self._api.trafficlight
        return Light(
            state=get.getRedYellowGreenState(light),
            changes_s=float(get.getNextSwitch(light)),
            program=get.getProgram(light),
            phase=int(get.getPhase(light)),
            spent_s=float(get.getSpentDuration(light)),
        )

    def light_program(self, light: str) -> Program:
        get = self._api.trafficlight
        name = get.getProgram(light)
        logic = next((one for one in get.getAllProgramLogics(light) if one.programID == name), None)
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
