"""The one object through which a run and its observers drive vehicles and ask about them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from functools import partial
from math import inf
from typing import TYPE_CHECKING, Any

import numpy as np

from loopgate.abstraction.itinerary import Track
from loopgate.arrays import Floats, Ints
from loopgate.control.blocking import ahead, blockers, outside
from loopgate.control.diary import Diary
from loopgate.control.driving import Driving
from loopgate.control.places import Vehicle
from loopgate.control.refusal import CHAIN
from loopgate.control.slack import Slack
from loopgate.errors import TrafficError
from loopgate.gates import Gate
from loopgate.results.histogram import Histogram
from loopgate.results.recorder import Recorder
from loopgate.simulation.asked_gate import AskedGate
from loopgate.traffic.base import Traffic

if TYPE_CHECKING:
    from loopgate.simulation.by_messages.answering import ByMessages


class Drive:
    """Drives the vehicles of a run through the ledger, step by step.

    Vehicles have numbers. `granted` and `fronts` are in the order of these numbers, which stay the same while
    `changes` does.

    Parameters
    ----------
    driving
        Drives the vehicles; it has none yet.
    tracks
        Paths of the vehicles that are there from the beginning.
    gate
        The gate whose promise holds; None while there are no vehicles.
    slack
        Finds blockers in ordinary traffic; None without ordinary traffic.
    asked
        The gate as a rule, if it is not the chain rule.
    by_messages
        Lets vehicles decide by messages, if they do.
    """

    gate: Gate
    """The gate whose promise holds."""

    def __init__(
        self,
        traffic: Traffic,
        recorder: Recorder,
        driving: Driving,
        tracks: Sequence[Track],
        gate: Gate | None,
        slack: Slack | None = None,
        asked: AskedGate | None = None,
        by_messages: ByMessages | None = None,
    ) -> None:
        self._traffic, self._recorder, self.driving, self._tracks = traffic, recorder, driving, tracks
        self._slack, self._asked, self._by_messages = slack, asked, by_messages
        self._ledger = driving.ledger
        if gate is not None:
            self.gate = gate
        self._times = Histogram()
        recorder.before = self.settle
        driving.on_answer = self._time

    def _time(self, decisions: int, took_s: float) -> None:
        if decisions and (self._by_messages or self._ledger.by_chain):
            self._times.add(took_s * 1e6 / decisions, times=decisions)

    @property
    def decision_us(self) -> Mapping[str, Histogram]:
        """Times of the decisions by stage [us]; a decision counts with the mean of its step."""
        if self._by_messages:
            return {self._by_messages.stage: self._times}
        by_chain = {CHAIN: self._times} if self._asked is None or self._times.count else {}
        return by_chain | (self._asked.times if self._asked else {})

    @property
    def sent(self) -> int:
        """Number of messages between vehicles for the decisions."""
        if self._by_messages:
            return self._by_messages.sent
        return self._asked.messages if self._asked else 0

    def promise(self, *, others: bool) -> str:
        """Return who can always go on, as proved for a drive like this: everyone, somebody, or nobody ("").

        `others`: whether there are ordinary vehicles. They take the last slot of a circle without asking.
        """
        promise = str(getattr(getattr(self, "gate", None), "promise", ""))
        return "" if others else "somebody" if promise and self._by_messages else promise

    def assumptions(self, *, lights: bool) -> list[str]:
        """Return what must hold so that the promise does. `lights`: whether vehicles wait at red lights."""
        also = {
            "every light turns green again and again": lights,
            "every vehicle beside the road finds a gap to return": self.driving.parking.parked > 0,
        }
        return ["no vehicle stands for good", *(text for text, holds in also.items() if holds)]

    @property
    def refusals(self) -> Mapping[str, int]:
        """How often each reason was given."""
        return self._ledger.refusals

    def report(self) -> Mapping[str, Any]:
        """Return the figures of messages for ``summary.json``, if vehicles decide by messages."""
        return self._by_messages.report() if self._by_messages else {}

    @property
    def changes(self) -> int:
        """How often vehicles have come, gone or got other numbers."""
        return self.driving.changes

    @property
    def sumo_s(self) -> float:
        """Wall time spent in the simulator's steps [s]."""
        return self.driving.sumo_s

    @property
    def leaps(self) -> list[tuple[str, float, float]]:
        """Vehicle, time [s] and length [m] of each leap of an odometer."""
        return self.driving.totals.leaps

    def begin(self) -> None:
        """Make the first step, in which all vehicles appear, and put them under the ledger.

        Raises
        ------
        TrafficError
            If SUMO could not insert a vehicle at its start.
        """
        self._traffic.step()
        on_road = set(self._traffic.vehicles())
        missing = [track.vehicle for track in self._tracks if track.vehicle not in on_road]
        if missing:
            every, names = len(self._tracks), ", ".join(missing[:5]) + (", ..." if len(missing) > 5 else "")  # noqa: PLR2004  a sample
            msg = f"SUMO could not insert {len(missing)} of {every} vehicles at the start: {names}"
            raise TrafficError(msg)
        self.driving.take_in(self._tracks)

    def step(self) -> None:
        """Advance SUMO by one step, and let the ledger act."""
        self.driving.step()

    def jumped(self, vehicle: str, skipped_m: float) -> None:
        """Note that SUMO moved a vehicle `skipped_m` ahead; only a run without a gate does so."""
        self.driving.jumped(vehicle, skipped_m)

    def measure_from_now(self) -> None:
        """Begin the measured time: set all figures to zero."""
        for diary in self.records.values():
            diary.measure_from_now(self._traffic.now_s)

    def count_from(self, at_s: float) -> None:
        """Count standing times only from this time [s]."""
        self.driving.totals.counts_from_s = at_s

    def settle(self) -> None:
        """Hand all events so far to the recorder."""
        rows = self.driving.rows
        if rows:
            code = self._recorder.code
            stages = self.driving.stages
            words = [[*map(code, row[1:]), code(stages.get(k, ""))] for k, row in enumerate(rows)]
            stages.clear()
            self._recorder.passed(np.array([row[0] for row in rows]), np.array(words, dtype=np.int32))
            rows.clear()

    @property
    def vehicles(self) -> Collection[Vehicle]:
        """The vehicles on the road."""
        return self._ledger.vehicles.values()

    def names(self) -> Sequence[str]:
        """Return the names of the vehicles, in the order of their numbers."""
        return self.driving.fronts.names

    def granted(self) -> Ints:
        """Return the number of the last leg granted to each vehicle."""
        return np.array(self.driving.granted, dtype=np.int64)

    def fronts(self) -> list[float]:
        """Return each front's arc length after the last step [m]; laps and paths that it turns to add up."""
        return self.driving.fronts.as_driven()

    def read_everybody(self) -> None:
        """Read the positions of all vehicles at once, since an observer asks for them in each step."""
        if self.driving.sight is not None:
            self.driving.sight.read_everybody()

    def odometers(self) -> tuple[Sequence[str], Floats]:
        """Return the names of the vehicles, and their odometers after the last step [m]."""
        return self.driving.fronts.names, self.driving.fronts.odometers()

    def take_flow(self) -> tuple[int, float, float, int]:
        """Return the number of vehicles and the flow since the last call.

        The flow is the mean number of vehicles that stood, the distance of all vehicles [m], and their laps.
        """
        return self.driving.totals.take_flow(self.driving.diaries)

    @property
    def records(self) -> Mapping[str, Diary]:
        """The counters of the vehicles on the road, by name."""
        return self.driving.diary_of

    @property
    def queues(self) -> Mapping[tuple[str, str], Mapping[int, int]]:
        """For each edge and the next edge, in how many steps how many vehicles stood there."""
        return {movement: queue.steps for movement, queue in self.driving.totals.queues.items()}

    @property
    def taken_out(self) -> list[str]:
        """The vehicles that SUMO took out before the end of their routes."""
        return self.driving.taken_out

    @property
    def overruns(self) -> int:
        """How often a refused vehicle could not stop at its stop line; should be 0."""
        return self.driving.brakes.overruns

    @property
    def trespasses(self) -> int:
        """How often a front entered a state that was not granted; should be 0."""
        return self._ledger.trespasses

    @property
    def strays(self) -> int:
        """How many vehicles SUMO has taken to a lane outside their loop."""
        return self.driving.steering.strays

    def trespasses_now(self, vehicle: str) -> bool:
        """Return whether a vehicle is in a state that was not granted."""
        return self._ledger.vehicles[vehicle].trespasses()

    def refused(self, vehicle: str) -> Callable[[], tuple[list[list[str]], str]] | None:
        """Return a function that tells what blocks a held vehicle; None if the vehicle is not held.

        The function returns the blockers as sets of names, and the state that the vehicle wants.
        """
        diary = self.records.get(vehicle)
        return None if diary is None or diary.halted_s == inf else partial(self._refusal, vehicle)

    def _refusal(self, name: str) -> tuple[list[list[str]], str]:
        vehicle, every = self._ledger.vehicles[name], self._ledger.vehicles.values()
        sets = [[other.name for other in some] for some in blockers(vehicle, every, self._ledger.gate)]
        sets += [] if self._slack is None else outside(vehicle, self._slack, every)
        return sets, self.wanted(name)

    def waits_behind(self, vehicle: str) -> Sequence[str]:
        """Return the vehicles that a vehicle waits for: the first in its line, else its blockers."""
        every = self._ledger.vehicles
        return [other.name for other in ahead(every[vehicle], every.values(), self._ledger.gate)]

    def asks(self, vehicle: str) -> bool:
        """Return whether a vehicle waits for a grant."""
        return self._ledger.vehicles[vehicle].asks

    def reason(self, vehicle: str) -> str:
        """Return why a vehicle was last refused, or an empty text."""
        return self._ledger.vehicles[vehicle].reason

    def wanted(self, vehicle: str) -> str:
        """Return the state that a vehicle wants next."""
        return self.driving.wanted(self._ledger.vehicles[vehicle])
