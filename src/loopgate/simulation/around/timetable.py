"""When the links of traffic lights are open: what they show now, and what their programs say of later."""

from __future__ import annotations

import math
from dataclasses import dataclass

from loopgate.traffic.base import Light, Program, Traffic

__all__ = ["Showing", "Timetable"]

_OPEN = frozenset("GgoOs")
"""Letters with which a vehicle may drive: green, lights off, and the green arrow."""

_AMBER = frozenset("yY")


@dataclass(frozen=True, slots=True)
class Showing:
    """The showing of a link in the next step.

    Attributes
    ----------
    letter
        SUMO's letter.
    is_open
        Whether a vehicle may drive.
    red_at_s
        When it turns red, after the rest of the green and the amber [s]; now if it is red.
    until_s
        Until when that is known [s].
    """

    letter: str
    is_open: bool
    red_at_s: float
    until_s: float


class Timetable:
    """The traffic lights of a running simulation, each read at most once a step, and only if it is asked for.

    Parameters
    ----------
    traffic
        The running simulation.
    """

    def __init__(self, traffic: Traffic) -> None:
        self._traffic = traffic
        self._seen: dict[str, tuple[float, Light]] = {}
        self._next: dict[tuple[str, int], Showing] = {}
        self._programs: dict[tuple[str, str], Program] = {}

    def shows(self, light: str, link: int) -> str:
        """Return SUMO's letter of what the link shows now."""
        return self._now(light).state[link]

    def is_open(self, light: str, link: int) -> bool:
        """Return whether a vehicle may drive now."""
        return self.shows(light, link) in _OPEN

    def next(self, light: str, link: int) -> Showing:
        """Return what the link shows in the next step: a change that is due is made at its beginning.

        That is certain where the program is fixed. Others are taken to end what they show as soon as they
        may: whoever counts on more stands at a red with its grant now and then, in the way of all others.
        """
        found = self._next.get((light, link))
        if found is None or self._traffic.now_s >= found.until_s:
            found = self._next[light, link] = self._find_next(light, link)
        return found

    def _find_next(self, light: str, link: int) -> Showing:
        shown = self._now(light)
        program = self._program(light, shown)
        now_s, state, phase = self._traffic.now_s, shown.state, shown.phase
        until_s = shown.changes_s if shown.changes_s > now_s else now_s + self._traffic.step_s / 2
        change_s = max(now_s, shown.changes_s)
        if program.fixed and change_s <= now_s:
            phase = program.phases[phase].following
            state, change_s = program.phases[phase].state, change_s + program.phases[phase].longest_s
        letter = state[link]
        is_open, red_at_s = letter in _OPEN, now_s
        for _ in range(len(program.phases) + 1):
            if state[link] not in _OPEN and state[link] not in _AMBER:
                return Showing(letter, is_open, red_at_s, until_s)
            red_at_s = change_s
            if not program.phases:
                break
            phase = program.phases[phase].following
            state, change_s = program.phases[phase].state, change_s + program.phases[phase].longest_s
        return Showing(letter, is_open, math.inf, until_s)

    def may_be_open(self, light: str, link: int, from_s: float, to_s: float) -> bool:
        """Return whether the link is open all the time between two times, as far as can be known.

        That is certain where the program is fixed. Of others, which change as the traffic does, only what
        they show now is known, and when at the latest they have to change.

        Parameters
        ----------
        light, link
            The light and the number of its link.
        from_s, to_s
            From now on [s]; 0 is now.
        """
        shown = self._now(light)
        program = self._program(light, shown)
        open_now = shown.state[link] in _OPEN
        if not program.phases:
            return open_now
        if not program.fixed and not open_now:
            return False
        if program.fixed:
            left_s = shown.changes_s - self._traffic.now_s
        else:
            spent_s = shown.spent_s + self._traffic.now_s - self._seen[light][0]
            left_s = program.phases[shown.phase].longest_s - spent_s
        state, phase = shown.state, shown.phase
        for _ in range(len(program.phases) + 1):
            if left_s > from_s and state[link] not in _OPEN:
                return False
            if left_s >= to_s:
                return True
            phase = program.phases[phase].following
            state = program.phases[phase].state
            left_s += program.phases[phase].longest_s
        return True

    def ever_open(self, light: str, link: int) -> bool:
        """Return whether the program that the light follows now opens the link in any phase."""
        shown = self._now(light)
        program = self._program(light, shown)
        if not program.phases:
            return True
        return any(phase.state[link] in _OPEN for phase in program.phases)

    def longest_closed_s(self, light: str, link: int) -> float:
        """Return for how long a fixed program keeps the link closed on end [s]; 0 where it is not fixed."""
        program = self._program(light, self._now(light))
        if not program.fixed or not program.phases:
            return 0.0
        if not self.ever_open(light, link):
            return math.inf
        longest = closed = 0.0
        phase = 0
        for _ in range(2 * len(program.phases)):
            here = program.phases[phase]
            closed = 0.0 if here.state[link] in _OPEN else closed + here.longest_s
            longest = max(longest, closed)
            phase = here.following
        return longest

    def _now(self, light: str) -> Light:
        now_s = self._traffic.now_s
        known = self._seen.get(light)
        # A change that is due now is made at the beginning of the next step.
        if known is not None and (known[0] == now_s or now_s <= known[1].changes_s):
            return known[1]
        shown = self._traffic.light(light)
        self._seen[light] = now_s, shown
        return shown

    def _program(self, light: str, shown: Light) -> Program:
        key = light, shown.program
        found = self._programs.get(key)
        if found is None:
            found = self._programs[key] = self._traffic.light_program(light)
        return found
