"""The one seam between a run and what drives its vehicles: tables (`loopgate.drive`), or the ledger."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from loopgate.arrays import Floats, Ints
from loopgate.gates import Gate
from loopgate.results.histogram import Histogram


class Record(Protocol):
    """What a vehicle has done since the measured time began."""

    @property
    def laps(self) -> int:
        """Laps."""

    @property
    def distance_m(self) -> float:
        """Distance [m]."""

    @property
    def stood_s(self) -> float:
        """Time in which it stood, wherever that was [s]."""

    def total_hold_s(self, now_s: float) -> float:
        """Return the time at gates until now [s]."""

    def worst_wait_s(self, now_s: float) -> float:
        """Return the longest time from asking to being granted, a wait under way included [s]."""


class Drive(Protocol):
    """What a run and its observers ask of what drives the vehicles.

    Vehicles have numbers, which hold until `changes` grows; `granted` and `fronts` are by number.
    """

    @property
    def changes(self) -> int:
        """How often vehicles have got other numbers, or others have come."""

    @property
    def sumo_s(self) -> float:
        """Wall time spent in the simulator's steps [s]."""

    @property
    def leaps(self) -> Sequence[tuple[str, float, float]]:
        """Whose odometers have leapt, when [s], and by how much [m]."""

    def begin(self) -> None:
        """Make the first step, in which all vehicles appear, and take them over."""

    def step(self) -> None:
        """Advance the traffic by one step and do what is due."""

    def jumped(self, vehicle: str, skipped_m: float, /) -> None:
        """Take note that the simulator moved a vehicle ahead under no gate [m]."""

    def measure_from_now(self) -> None:
        """Let all figures begin now: the warm-up is over."""

    def count_from(self, at_s: float) -> None:
        """Count the time that vehicles stand only from then on [s]."""

    def settle(self) -> None:
        """Hand over all events so far."""

    def names(self) -> Sequence[str]:
        """Return the vehicles by number."""

    def granted(self) -> Ints:
        """Return the number of the last leg granted to each."""

    def fronts(self) -> Floats:
        """Return where their fronts were after the last step, along their loops, laps counted on [m]."""

    def odometers(self) -> tuple[Sequence[str], Floats]:
        """Return the vehicles, and what their odometers read after the last step [m]."""

    def take_flow(self) -> tuple[int, float, float, int]:
        """Return how many there are, and since the last call the mean number that stand, metres, and laps."""

    @property
    def records(self) -> Mapping[str, Record]:
        """What the vehicles on the road have done, by name."""

    @property
    def stood_s(self) -> Mapping[str, float]:
        """For how long vehicles have stood on each edge [s]."""

    @property
    def overruns(self) -> int:
        """Refused vehicles that could not brake for their line: should be none."""

    @property
    def trespasses(self) -> int:
        """How often a front was in a state that was not granted: should be never."""

    @property
    def strays(self) -> int:
        """Vehicles that the simulator took to another lane than their loop's."""

    def trespasses_now(self, vehicle: str) -> bool:
        """Return whether a vehicle is where it was granted nothing."""

    def refused(self, vehicle: str) -> Callable[[], tuple[list[list[str]], str]] | None:
        """Return what tells whom a refused vehicle waits for, and the state it wants; None if it is not.

        Of each set of vehicles, some must move on.
        """

    def waits_behind(self, vehicle: str) -> Sequence[str]:
        """Return the vehicles that one waits for: the first in its line, else those that block it."""

    def asks(self, vehicle: str) -> bool:
        """Return whether a vehicle waits for a grant."""

    def reason(self, vehicle: str) -> str:
        """Return why it was refused last, or an empty text."""

    def wanted(self, vehicle: str) -> str:
        """Return the state that it wants next."""


@dataclass(frozen=True, slots=True)
class Made:
    """How many stops a vehicle has made, and for how long it stood at them [s]."""

    served: int = 0
    stood_s: float = 0.0


class Reports(Protocol):
    """What has figures at the end of a run."""

    def report(self) -> Mapping[str, Any]:
        """Return figures for ``summary.json``."""


class StopFigures(Reports, Protocol):
    """What is told of the stops of vehicles."""

    def of(self, vehicle: str, /) -> Made:
        """Return the figures of the stops of a vehicle."""


class Answers(Reports, Protocol):
    """What is told of the answers to requests, and the gate whose promise holds."""

    gate: Gate

    @property
    def sent(self) -> int:
        """How many messages vehicles sent one another for their answers."""

    @property
    def decision_us(self) -> Mapping[str, Histogram]:
        """Times of the decisions by the stage that made them [us]."""

    @property
    def refusals(self) -> Mapping[str, int]:
        """How often each reason was given."""
