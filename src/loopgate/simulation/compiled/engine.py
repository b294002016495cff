"""The engine whose gatekeeping is compiled: the same run, row for row, in a fraction of the time."""

from __future__ import annotations

from collections.abc import Sequence
from time import perf_counter_ns
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from loopgate.abstraction.itinerary import Abstraction
from loopgate.errors import TrafficError
from loopgate.gates import Reason
from loopgate.gates.certified import CertifiedGate
from loopgate.negotiation.pressure import Pressure
from loopgate.results.columns import Event
from loopgate.results.recorder import Recorder
from loopgate.simulation.compiled import count as c
from loopgate.simulation.compiled.blocking import blockers
from loopgate.simulation.compiled.driving import FULL, Orders
from loopgate.simulation.compiled.entries import answer, begin, look, turn
from loopgate.simulation.compiled.making import make_books
from loopgate.simulation.compiled.tables import Books, Rider
from loopgate.simulation.driver import Driver
from loopgate.simulation.engine import FORGOTTEN_STOPS, Engine
from loopgate.simulation.gatekeeper import Gatekeeper
from loopgate.simulation.sensing import MOST_CALLS
from loopgate.simulation.track import Track
from loopgate.traffic.base import Traffic

__all__ = ["CompiledEngine", "can_be_compiled"]

_REASONS = {
    c.OCCUPIED: Reason.OCCUPIED,
    c.CROSSING: Reason.CROSSING,
    c.DEADLOCK: Reason.DEADLOCK,
    c.RESERVE: Reason.RESERVE,
}
_CHAIN = "chain"
_WORDS = {
    c.EDGE: Event.EDGE,
    c.LAP: Event.LAP,
    c.ENTER: Event.ENTER,
    c.LEAVE: Event.LEAVE,
    c.HOLD: Event.HOLD,
    c.GO: Event.GO,
    c.GRANT: Event.GRANT,
    c.REFUSE: Event.REFUSE,
    c.FREE: Reason.FREE,
    c.NOT_GRANTED: "not granted",
    c.CHAIN: _CHAIN,
    **{c.REASON + k: reason for k, reason in _REASONS.items()},
}
_NO_ROBOTS = np.zeros(0, dtype=np.int64)

_TIMED_EVERY = 20
"""Every so many steps the decisions are timed alone; else they are made in one go with all the rest."""


def can_be_compiled(keeper: Gatekeeper, traffic: Traffic) -> bool:
    """Return whether `CompiledEngine` drives these vehicles as `Engine` does.

    The gate must be `CertifiedGate` with the chain rule deciding alone, and the negotiation `Pressure`. That
    nothing else is in the way, no lights that are obeyed and no ordinary traffic, is for the caller to know.
    """
    gate = keeper.gate
    return (
        isinstance(gate, CertifiedGate)
        and gate.by_chain_alone
        and len(keeper.system.robots) > 1
        and type(keeper.negotiation) is Pressure
        and not traffic.gives_way
    )


class CompiledEngine(Engine):
    """Does what `Engine` does where `can_be_compiled` says so; `Engine` is the oracle in the tests.

    Requests, decisions and grants are in arrays, see `loopgate.simulation.compiled.tables`. Of the
    gatekeeper only what counts decisions and refusals is kept up to date; its books are not.

    Parameters
    ----------
    traffic, tracks, keeper, recorder
        As for `Engine`.
    abstraction
        What the gatekeeper was made for.
    """

    _row = Rider

    def __init__(
        self,
        traffic: Traffic,
        tracks: Sequence[Track],
        keeper: Gatekeeper,
        recorder: Recorder,
        abstraction: Abstraction,
    ) -> None:
        super().__init__(traffic, tracks, keeper, recorder)
        self._keeper = keeper
        negotiation = keeper.negotiation
        if not isinstance(negotiation, Pressure):
            msg = f"negotiation {type(negotiation).__name__} is not compiled"
            raise TypeError(msg)
        self._pressure = negotiation.figures
        self._books = make_books(abstraction, self.fleet, recorder.code)
        self._readable = Books(*(cast("Any", table).view(np.recarray) for table in self._books))
        self._riders = self.fleet.columns
        self._spell()
        rows = FULL * max(1, len(tracks))
        self._orders = Orders(
            rows=np.zeros((rows, 5), dtype=np.int32),
            acts=np.zeros((rows, 3), dtype=np.int64),
            calls=np.zeros((MOST_CALLS * len(tracks), 2), dtype=np.int32),
        )
        self._inside = (tuple(self._books), tuple(self._orders))
        self.fleet.fronts = self.fleet.vehicles.front
        self.fleet.speeds = self.fleet.vehicles.speed
        self._decision_us = 0.0
        self._decisions_us = keeper.decision_us[_CHAIN]
        self._turns = 0
        self._worn: set[int] = set()
        """Who has stops to be forgotten."""
        self._warm_up()

    def _warm_up(self) -> None:
        """Compile, or load what was compiled, so that it is no part of the run: a drive of no vehicles."""
        counters = np.zeros(c.COUNTERS, dtype=np.int64)
        tables = (*(cast("Any", table)[:0] for table in self._books[:-1]), counters)
        orders = tuple(self._orders)
        begin(0.0, 1.0, tables, orders)
        look(np.zeros(0), _NO_ROBOTS, 0.0, 1.0, tables, orders)
        answer(_NO_ROBOTS, 0.0, 1.0, self._pressure, tables, orders)
        turn(np.zeros(0), _NO_ROBOTS, 0.0, 1.0, self._pressure, tables, orders)

    def _spell(self) -> None:
        for at, word in _WORDS.items():
            self._books.pool[at] = self._recorder.code(word)

    def _turn(self, now: float) -> None:
        odometer, halted = self.fleet.read(), self._came_to_a_halt(now)
        self._turns += 1
        if self._steering.steers or self._worn or self._turns % _TIMED_EVERY == 0:
            look(odometer, halted, now, self._traffic.step_s, *self._inside)
            self._carry_out(now)
            self._forget_stops()
            self._worn = {robot for robot in self._worn if self.drivers[robot].stops}
            self._answer_timed([driver.robot for driver in self._on_their_lanes()])
        else:
            before = self._decided
            turn(odometer, halted, now, self._traffic.step_s, self._pressure, *self._inside)
            self._decisions_us.add(self._decision_us, times=self._decided - before)
            self._carry_out(now)

    def settle(self) -> None:
        """Bring the drivers' waits and the gatekeeper's counts up to date, and write what is not yet written.

        After Ctrl-C there may be rows of a step of which nothing was carried out.
        """
        pool = self._books.pool
        if pool[c.ROWS]:
            self._recorder.passed(self._traffic.now_s, self._orders.rows[: pool[c.ROWS]])
            pool[c.ROWS] = 0
        for driver, rider in zip(self.drivers, self._riders, strict=True):
            driver.hold_s = float(rider["hold_s"])
            driver.longest_wait_s = float(rider["longest_s"])
            driver.asked_s = None if np.isnan(rider["asked_s"]) else float(rider["asked_s"])
            driver.halted_since = None if np.isnan(rider["halted_s"]) else float(rider["halted_s"])
        refused = {reason.value: int(pool[c.REFUSED + k]) for k, reason in _REASONS.items()}
        self._keeper.refusals.clear()
        self._keeper.refusals.update({reason: count for reason, count in refused.items() if count})
        self.overruns = int(pool[c.OVERRUNS])
        self.trespasses = int(pool[c.TRESPASSES])

    def measure_from_now(self) -> None:
        """Let all figures begin now: the warm-up is over."""
        super().measure_from_now()
        riders = self._riders
        riders["hold_s"] = riders["longest_s"] = 0.0
        riders["halted_s"][~np.isnan(riders["halted_s"])] = self._traffic.now_s

    def _count_overrun(self) -> None:
        self._books.pool[c.OVERRUNS] += 1

    def _set_out(self, now: float) -> None:
        self._riders["length_m"] = [driver.length for driver in self.drivers]
        begin(now, self._traffic.step_s, *self._inside)
        self._answer_timed([])

    def _blockers(self, driver: Driver) -> list[list[str]]:
        sets = blockers(driver.robot, self._readable)
        return [[self.drivers[robot].id for robot in robots] for robots in sets]

    def _came_to_a_halt(self, now: float) -> NDArray[np.int64]:
        robots = []
        for vehicle in self._traffic.halted():
            driver = self._driver_of.get(vehicle)
            if driver is not None and driver.held and driver.halted_since is None:
                driver.halted_since = now
                driver.stops += 1
                if driver.stops > FORGOTTEN_STOPS:
                    self._worn.add(driver.robot)
                robots.append(driver.robot)
        return np.array(robots, dtype=np.int64) if robots else _NO_ROBOTS

    def _answer_timed(self, freed: Sequence[int]) -> None:
        """Decide, and take the time.

        There is no clock in compiled code: each decision counts as long as, on average, those of the last
        step in which decisions alone were timed.
        """
        now, step_s = self._traffic.now_s, self._traffic.step_s
        robots = np.array(freed, dtype=np.int64) if freed else _NO_ROBOTS
        before, began = self._decided, perf_counter_ns()
        answer(robots, now, step_s, self._pressure, *self._inside)
        decided = self._decided - before
        if decided:
            self._decision_us = (perf_counter_ns() - began) / 1000.0 / decided
        self._decisions_us.add(self._decision_us, times=decided)
        self._carry_out(now)

    @property
    def _decided(self) -> int:
        return int(self._books.pool[c.DECISIONS])

    def _carry_out(self, now: float) -> None:
        """Write rows to the trace, and tell the traffic whom to hold and whom to let go."""
        pool = self._books.pool
        rows, acts, lost = pool[c.ROWS : c.LOST + 1].tolist()
        if lost:
            msg = f"{lost} events of one step at {now:g} s found no room; take shorter steps"
            raise TrafficError(msg)
        if rows:
            self._recorder.passed(now, self._orders.rows[:rows])
        pool[c.ROWS : c.LOST + 1] = 0  # before anything can interrupt: `settle` writes what is left
        if acts:
            for robot, what, leg in self._orders.acts[:acts].tolist():
                driver = self.drivers[robot]
                driver.granted = leg
                if what == c.STOP:
                    self._stop(driver)
                elif what == c.RELEASE:
                    self._release(driver)
                    driver.halted_since = None
                elif what == c.STEER:
                    self._steering.begin(driver)
                elif what == c.BRAKE:
                    self._runs_through(driver, now)
                else:
                    self._route_renewed(driver)
