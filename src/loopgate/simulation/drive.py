"""What drives the vehicles of a run, as the run and its observers ask it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from functools import partial
from math import inf
from typing import Any

import numpy as np

from loopgate.arrays import Floats, Ints
from loopgate.control.accounts import Account
from loopgate.control.blocking import ahead, blockers, outside
from loopgate.control.driving import Driving
from loopgate.control.places import Vehicle
from loopgate.control.refusal import CHAIN
from loopgate.control.slack import Slack
from loopgate.control.way import Way
from loopgate.errors import TrafficError
from loopgate.gates import Gate
from loopgate.results.histogram import Histogram
from loopgate.results.recorder import Recorder
from loopgate.simulation.asked_gate import AskedGate
from loopgate.simulation.by_messages.answering import STAGE, ByMessages
from loopgate.traffic.base import Traffic


class Drive:
    """Drives the vehicles of a run through the ledger, step by step.

    Vehicles have numbers, which hold until `changes` grows; `granted` and `fronts` are by number.

    Parameters
    ----------
    driving
        Drives nobody yet.
    ways
        Of the vehicles that are there from the beginning.
    gate
        Whose promise holds; None while nobody is there.
    slack
        Of ordinary traffic, if there is any.
    asked
        The gate, if it is another than the chain rule.
    by_messages
        Vehicles that decide by messages, if they do.
    """

    gate: Gate
    """Whose promise holds."""

    def __init__(
        self,
        traffic: Traffic,
        recorder: Recorder,
        driving: Driving,
        ways: Sequence[Way],
        gate: Gate | None,
        slack: Slack | None = None,
        asked: AskedGate | None = None,
        by_messages: ByMessages | None = None,
    ) -> None:
        self._traffic, self._recorder, self.driving, self._ways = traffic, recorder, driving, ways
        self._slack, self._asked, self._by_messages = slack, asked, by_messages
        self._ledger = driving.ledger
        if gate is not None:
            self.gate = gate
        self._times = Histogram()
        recorder.before = self.settle
        driving.on_answer = self._time

    @property
    def _by_gate(self) -> Callable[[Vehicle], list[str]] | None:
        """Name those by whom the gate refuses a vehicle, where not the chain rule decides."""
        return self._asked.blockers if self._asked is not None and self._asked.decides else None

    def _time(self, decisions: int, took_s: float) -> None:
        if decisions and (self._by_messages or self._by_gate is None):
            self._times.add(took_s * 1e6 / decisions, times=decisions)

    @property
    def decision_us(self) -> Mapping[str, Histogram]:
        """Times of the decisions [us]: each counts as the mean of its step."""
        if self._by_messages:
            return {STAGE: self._times}
        by_chain = {CHAIN: self._times} if self._asked is None or self._times.count else {}
        return by_chain | (self._asked.times if self._asked else {})

    @property
    def sent(self) -> int:
        """How many messages between vehicles the decisions cost."""
        if self._by_messages:
            return self._by_messages.sent
        return self._asked.messages if self._asked else 0

    @property
    def refusals(self) -> Mapping[str, int]:
        """How often each reason was given."""
        return self._ledger.refusals

    def report(self) -> Mapping[str, Any]:
        """Return the figures of messages, if vehicles decide by them."""
        return self._by_messages.report() if self._by_messages else {}

    @property
    def changes(self) -> int:
        """How often vehicles have got other numbers, or others have come."""
        return self.driving.changes

    @property
    def sumo_s(self) -> float:
        """Wall time spent in the simulator's steps [s]."""
        return self.driving.sumo_s

    @property
    def leaps(self) -> list[tuple[str, float, float]]:
        """Whose odometers have leapt, when [s], and by how much [m]."""
        return self.driving.accounts.leaps

    def begin(self) -> None:
        """Make the first step, in which all vehicles appear, and take them over.

        Raises
        ------
        TrafficError
            If a vehicle could not be inserted at its start.
        """
        self._traffic.step()
        on_road = set(self._traffic.vehicles())
        missing = [way.vehicle for way in self._ways if way.vehicle not in on_road]
        if missing:
            names = ", ".join(missing[:5]) + (", ..." if len(missing) > 5 else "")  # noqa: PLR2004  a sample
            msg = f"SUMO could not insert {len(missing)} of {len(self._ways)} vehicles at the start: {names}"
            raise TrafficError(msg)
        self.driving.take_in(self._ways)

    def step(self) -> None:
        """Advance the traffic by one step and do what is due."""
        self.driving.step()

    def jumped(self, vehicle: str, skipped_m: float) -> None:
        """Take note that the simulator moved a vehicle ahead under no gate [m]."""
        self.driving.jumped(vehicle, skipped_m)

    def measure_from_now(self) -> None:
        """Let all figures begin now: the warm-up is over."""
        for account in self.records.values():
            account.measure_from_now(self._traffic.now_s)

    def count_from(self, at_s: float) -> None:
        """Count the time that vehicles stand only from then on [s]."""
        self.driving.accounts.counts_from_s = at_s

    def settle(self) -> None:
        """Hand over all events so far."""
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
        """Return the vehicles by number."""
        return self.driving.fronts.names

    def granted(self) -> Ints:
        """Return the number of the last leg granted to each."""
        return np.array([diary.vehicle.granted for diary in self.driving.diaries], dtype=np.int64)

    def fronts(self) -> Floats:
        """Return where their fronts were after the last step, along their loops, laps counted on [m]."""
        return self.driving.fronts.at_m

    def odometers(self) -> tuple[Sequence[str], Floats]:
        """Return the vehicles, and what their odometers read after the last step [m]."""
        return self.driving.fronts.names, self.driving.fronts.odometers()

    def take_flow(self) -> tuple[int, float, float, int]:
        """Return how many there are, and since the last call the mean number that stand, metres, and laps."""
        return self.driving.accounts.take_flow()

    @property
    def records(self) -> Mapping[str, Account]:
        """What the vehicles on the road have done, by name."""
        return self.driving.accounts.of

    @property
    def stood_s(self) -> Mapping[str, float]:
        """For how long vehicles have stood on each edge [s]."""
        return self.driving.accounts.stood_s

    @property
    def overruns(self) -> int:
        """Refused vehicles that could not brake for their line: should be none."""
        return self.driving.brakes.overruns

    @property
    def trespasses(self) -> int:
        """How often a front was in a state that was not granted: should be never."""
        return self._ledger.trespasses

    @property
    def strays(self) -> int:
        """How many vehicles SUMO has put on another lane than their loop's."""
        return self.driving.steering.strays

    def trespasses_now(self, vehicle: str) -> bool:
        """Return whether a vehicle is where it was granted nothing."""
        return self._ledger.vehicles[vehicle].trespasses()

    def refused(self, vehicle: str) -> Callable[[], tuple[list[list[str]], str]] | None:
        """Return what tells whom a refused vehicle waits for, and the state it wants; None if it is not."""
        account = self.records.get(vehicle)
        return None if account is None or account.halted_s == inf else partial(self._refusal, vehicle)

    def _refusal(self, name: str) -> tuple[list[list[str]], str]:
        vehicle, every = self._ledger.vehicles[name], self._ledger.vehicles.values()
        sets = [[other.name for other in some] for some in blockers(vehicle, every, self._by_gate)]
        sets += [] if self._slack is None else outside(vehicle, self._slack, every)
        return sets, self.wanted(name)

    def waits_behind(self, vehicle: str) -> Sequence[str]:
        """Return the vehicles that one waits for: the first in its line, else those that block it."""
        every = self._ledger.vehicles
        return [other.name for other in ahead(every[vehicle], every.values(), self._by_gate)]

    def asks(self, vehicle: str) -> bool:
        """Return whether a vehicle waits for a grant."""
        return self._ledger.vehicles[vehicle].asks

    def reason(self, vehicle: str) -> str:
        """Return why it was refused last, or an empty text."""
        return self._ledger.vehicles[vehicle].reason

    def wanted(self, vehicle: str) -> str:
        """Return the state that it wants next."""
        return self.driving.wanted(self._ledger.vehicles[vehicle])
