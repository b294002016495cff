"""Events as they happen, and on file."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

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
        self.fresh: list[Happening] = []

    def note(
        self, time_s: float, vehicle: str, event: Event, place: str, reason: str = "", stage: str = ""
    ) -> None:
        """Record one event."""
        self.fresh.append(Happening(time_s, vehicle, str(event), place, reason, stage))
        super().note(time_s, vehicle, event, place, reason, stage)

    def passed(self, time_s: float, rows: NDArray[np.int32]) -> None:
        """Record events of one step."""
        words = self.words
        self.fresh += [Happening(time_s, *(words[number] for number in row)) for row in rows.tolist()]
        super().passed(time_s, rows)
