"""Traffic lights as the tables of the drive have them: what they show now, and what their programs say."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from loopgate.drive.around import LightRow, PhaseRow, SignalRow
from loopgate.drive.lights import OPEN
from loopgate.drive.rows import table
from loopgate.drive.tables import Tables
from loopgate.traffic.base import Program, Traffic

__all__ = ["Signal", "Timetable"]


@dataclass(frozen=True, slots=True)
class Signal:
    """What a light shows to a movement.

    Attributes
    ----------
    movement
        The movement over the junction.
    light, link
        SUMO's name of the light and the number of its link.
    speed_mps
        Lowest speed limit on the movement.
    """

    movement: str
    light: str
    link: int
    speed_mps: float


class Timetable:
    """The traffic lights of a running simulation, each read at most once a step, and only if it is asked for.

    Parameters
    ----------
    traffic
        The running simulation.
    signals
        All that vehicles can be shown.
    """

    def __init__(self, traffic: Traffic, signals: Iterable[Signal]) -> None:
        self._traffic = traffic
        self.signals = tuple(signals)
        """The signals by number."""
        self.numbers = {signal.movement: number for number, signal in enumerate(self.signals)}
        """Their numbers by movement."""
        self._names = sorted({signal.light for signal in self.signals})
        self._lights = {name: number for number, name in enumerate(self._names)}
        rows = [(self._lights[signal.light], signal.link, signal.speed_mps) for signal in self.signals]
        self._signals = table(SignalRow, length=len(rows))
        self._signals[:] = rows
        self._now = table(LightRow, {"seen_s": -math.inf, "changes_s": -math.inf}, length=len(self._names))
        self._phases, self._phase_count = table(PhaseRow, length=1), 0
        self._letters, self._letter_count = np.zeros(1, dtype=np.int64), 0
        self._given = self._phases, self._letters
        """As they were put into tables."""
        self._states: dict[str, int] = {}
        """Where the letters of a state are."""
        self._written: dict[Program, int] = {}
        """By program: the index of its first phase."""
        self._programs: dict[tuple[str, str], tuple[Program, int]] = {}
        """By light and name, and where their phases are."""
        self._followed: dict[int, Program] = {}
        """The program that each light followed when it was read."""

    def put_into(self, tables: Tables) -> Tables:
        """Return tables for vehicles that obey these lights."""
        self._given = self._phases, self._letters
        return tables._replace(
            signals=cast("Any", self._signals),  # row by row they are what `Tables` says
            lights=cast("Any", self._now),
            phases=cast("Any", self._phases),
            letters=self._letters,
        )

    def read(self) -> bool:
        """Read the lights that are marked as unread; return whether tables are to take over more room."""
        for number in np.flatnonzero(self._now["unread"]).tolist():
            self._read(number)
        return self._given[0] is not self._phases or self._given[1] is not self._letters

    def is_open(self, light: str, link: int) -> bool:
        """Return whether a vehicle may drive now."""
        row = self._now[self._known(light)]
        return int(self._letters[row["letters"] + link]) in OPEN

    def numbers_of(self, lights: Iterable[str]) -> NDArray[np.int64]:
        """Return the numbers of lights, for `showing`."""
        return np.array([self._lights[light] for light in lights], dtype=np.int64)

    def showing(self, lights: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return where the letters are of what each of some lights shows now: elsewhere once that changes."""
        rows, now_s = self._now[lights], self._traffic.now_s
        for number in lights[(rows["seen_s"] != now_s) & (now_s > rows["changes_s"])].tolist():
            self._read(number)
        return cast("NDArray[np.int64]", self._now["letters"][lights])

    def program(self, light: str) -> Program:
        """Return the program that a light follows now."""
        return self._followed[self._known(light)]

    def _known(self, light: str) -> int:
        """Return the number of a light, read anew if what was read holds no longer."""
        number, now_s = self._lights[light], self._traffic.now_s
        row = self._now[number]
        # A change that is due now is made at the beginning of the next step.
        if row["seen_s"] != now_s and now_s > row["changes_s"]:
            self._read(number)
        return number

    def _read(self, number: int) -> None:
        light = self._names[number]
        shown = self._traffic.light(light)
        key = light, shown.program
        if key not in self._programs:
            program = self._traffic.light_program(light)
            self._programs[key] = program, self._write(program)
        program, first = self._programs[key]
        self._followed[number] = program
        letters, times = self._where(shown.state), (shown.changes_s, self._traffic.now_s, shown.spent_s)
        self._now[number] = (first + shown.phase, len(program.phases), program.fixed, letters, *times, False)

    def _write(self, program: Program) -> int:
        """Return where the phases of a program are."""
        first = self._written.get(program)
        if first is None:
            first = self._written[program] = self._phase_count
            self._phase_count += len(program.phases)
            while self._phase_count > len(self._phases):
                more = table(PhaseRow, length=2 * len(self._phases))
                more[: len(self._phases)] = self._phases
                self._phases = more
            for number, phase in enumerate(program.phases, start=first):
                self._phases[number] = self._where(phase.state), phase.longest_s, first + phase.following
        return first

    def _where(self, state: str) -> int:
        """Return where the letters of a state are."""
        at = self._states.get(state)
        if at is None:
            at = self._states[state] = self._letter_count
            self._letter_count += len(state)
            while self._letter_count > len(self._letters):
                self._letters = np.concatenate([self._letters, np.zeros_like(self._letters)])
            self._letters[at : self._letter_count] = list(map(ord, state))
        return at
