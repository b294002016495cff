"""Traffic lights: the letter that a movement sees now, and when the light's program changes it."""

from __future__ import annotations

from math import inf
from typing import Final

from loopgate.traffic.base import Program, Traffic

OPEN: Final = "GgoOs"
"""SUMO's letters that let a vehicle drive: green, light off, and green arrow."""
AMBER: Final = "yY"
RED: Final = "ru"
ARROW: Final = "s"
"""SUMO's letter for a green arrow: a vehicle stops first, then may drive."""


class Lamp:
    """A traffic light of SUMO, read at most once in a step, and only when it may have changed."""

    def __init__(self, name: str, traffic: Traffic) -> None:
        self.name: Final = name
        self._traffic: Final = traffic
        self._programs: dict[str, Program] = {}
        self._seen_s = self.changes_s = -inf
        self.state = ""
        self.phase = 0
        self.spent_s = 0.0
        self.program = Program((), fixed=False)

    def look(self, now_s: float) -> None:
        """Read the light if it may have changed since it was read; SUMO makes a change in the step after."""
        if self._seen_s == now_s or now_s <= self.changes_s:
            return
        shown = self._traffic.light(self.name)
        if shown.program not in self._programs:
            self._programs[shown.program] = self._traffic.light_program(self.name)
        self.program = self._programs[shown.program]
        self.state, self.phase, self.changes_s = shown.state, shown.phase, shown.changes_s
        self._seen_s = now_s
        self.spent_s = shown.spent_s

    def next_step(self, now_s: float) -> tuple[str, int, float]:
        """Return the letters and the phase in the next step, and when they change after that [s].

        This is certain for a fixed program. Any other program is assumed to change as soon as it may.
        """
        self.look(now_s)
        if self.program.fixed and self.changes_s <= now_s:
            phase = self.program.phases[self.phase].following
            there = self.program.phases[phase]
            return there.state, phase, now_s + there.longest_s
        return self.state, self.phase, max(now_s, self.changes_s)

    def shown_for_s(self, now_s: float) -> float:
        """Return for how long the light has shown its present phase [s]."""
        return self.spent_s + now_s - self._seen_s


class Signal:
    """What a lamp shows to one movement: the letter number `link`.

    `speed`: the lowest speed limit on the movement [m/s]. `least_s`: the shortest waits at this light and
    those after it, as `loopgate.control.lights` has worked them out [s].
    """

    __slots__ = ("lamp", "least_s", "link", "speed")

    def __init__(self, lamp: Lamp, link: int, speed: float) -> None:
        self.lamp: Final = lamp
        self.link: Final = link
        self.speed: Final = speed
        self.least_s: dict[tuple[float, ...], float] = {}

    def next_letter(self, now_s: float) -> str:
        """Return the letter in the next step."""
        return self.lamp.next_step(now_s)[0][self.link]

    def red_at_s(self, now_s: float) -> float:
        """Return when the light turns red, after the rest of green and amber [s]; now if it is red."""
        state, phase, change_s = self.lamp.next_step(now_s)
        phases, red_s = self.lamp.program.phases, now_s
        for _ in range(len(phases) + 1):
            if state[self.link] not in OPEN and state[self.link] not in AMBER:
                return red_s
            red_s = change_s
            if phases:
                phase = phases[phase].following
                state = phases[phase].state
                change_s += phases[phase].longest_s
        return inf

    def may_be_open(self, now_s: float, from_s: float, to_s: float) -> bool:
        """Return whether the light is open from `from_s` to `to_s` after now [s], as far as is known.

        Of a program that is not fixed, only the present phase and its latest end are known.
        """
        lamp = self.lamp
        lamp.look(now_s)
        phases, phase, state = lamp.program.phases, lamp.phase, lamp.state
        open_now = state[self.link] in OPEN
        if not phases or not (lamp.program.fixed or open_now):
            return open_now
        left_s = lamp.changes_s - now_s
        if not lamp.program.fixed:
            left_s = phases[phase].longest_s - lamp.shown_for_s(now_s)
        for _ in range(len(phases) + 1):
            if left_s > from_s and state[self.link] not in OPEN:
                return False
            if left_s >= to_s:
                return True
            phase = phases[phase].following
            state = phases[phase].state
            left_s += phases[phase].longest_s
        return True

    def opens_s(self, now_s: float, from_s: float, to_s: float) -> float:
        """Return when a vehicle may pass that comes between `from_s` and `to_s`, by a fixed program.

        All times count from now [s]. The result is `from_s` if the light is open all the while; otherwise the
        first time at which it opens after it was closed then; infinite if it never opens.
        """
        lamp = self.lamp
        lamp.look(now_s)
        phases, phase, state = lamp.program.phases, lamp.phase, lamp.state
        left_s, opened_s, closed, looked = lamp.changes_s - now_s, 0.0, False, 0
        while looked <= len(phases):
            if left_s > from_s:
                looked += 1
                if state[self.link] not in OPEN:
                    closed = True
                elif closed:
                    return opened_s
                elif left_s >= to_s:
                    return from_s
            opened_s = left_s
            phase = phases[phase].following
            state = phases[phase].state
            left_s += phases[phase].longest_s
        return inf if closed else from_s

    def stays_s(self, letters: str, now_s: float) -> float:
        """Return for how long the light surely shows one of some letters [s].

        The result is 0 if it does not do so both now and in the next step.
        """
        lamp = self.lamp
        shown, phase, change_s = lamp.next_step(now_s)
        if shown[self.link] not in letters or lamp.state[self.link] not in letters:
            return 0.0
        phases = lamp.program.phases
        if not (lamp.program.fixed and phases):
            return max(0.0, change_s - now_s)
        for _ in range(len(phases)):
            phase = phases[phase].following
            if phases[phase].state[self.link] not in letters:
                return change_s - now_s
            change_s += phases[phase].longest_s
        return inf
