"""Events as they happen, and on file."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from loopgate.arrays import Floats
from loopgate.results.columns import Event
from loopgate.results.recorder import Recorder


class Happening(NamedTuple):
    """An event: a row of the events, see `loopgate.results.columns`."""

    time_s: float
    vehicle: str
    event: str
    place: str
    reason: str
    stage: str


class EventFeed(Recorder):
    """Records events, and hands those of each step out."""

    def __init__(self, file: Path) -> None:
        super().__init__(file)
        self._fresh: list[Happening] = []

    def note(
        self, time_s: float, vehicle: str, event: Event, place: str, reason: str = "", stage: str = ""
    ) -> None:
        """Record one event."""
        self.before()
        self._fresh.append(Happening(time_s, vehicle, str(event), place, reason, stage))
        super().note(time_s, vehicle, event, place, reason, stage)

    def passed(self, times: Floats, rows: NDArray[np.int32]) -> None:
        """Record many events."""
        words = self.words
        self._fresh += [
            Happening(time_s, *(words[number] for number in row))
            for time_s, row in zip(times.tolist(), rows.tolist(), strict=True)
        ]
        super().passed(times, rows)

    def take(self) -> list[Happening]:
        """Return the events since the last time, in order."""
        self.before()
        fresh, self._fresh = self._fresh, []
        return fresh
