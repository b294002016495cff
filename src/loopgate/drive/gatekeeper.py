"""The gatekeeper: lets the negotiation order the requests and the gate decide them."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from time import perf_counter_ns
from typing import Any, cast

import numpy as np

from loopgate.drive import step as drive
from loopgate.drive.blocking import blockers
from loopgate.drive.codes import (
    CROSSING,
    NOTHING,
    OCCUPIED,
    REASONS,
    RESERVE,
    SERVICE,
    SPACING,
    STOPPING,
    number_of,
)
from loopgate.drive.ground import HOLDERS, LINE, Ground
from loopgate.drive.requests import REASK_S
from loopgate.drive.step import Step
from loopgate.drive.tables import Tables
from loopgate.drive.timetable import Timetable
from loopgate.gates import Decision, Gate, Reason
from loopgate.gates.careful import careful
from loopgate.gates.certified import CertifiedGate
from loopgate.gates.certified.chain import closes
from loopgate.gates.following import following
from loopgate.model import System
from loopgate.negotiation import careful as careful_order
from loopgate.negotiation.base import InformedNegotiation, Negotiation, Request
from loopgate.negotiation.pressure import Pressure
from loopgate.results.histogram import Histogram

__all__ = ["Gatekeeper"]

_CHAIN = "chain"

_OUTSIDE = frozenset(number_of(reason) for reason in (Reason.RED, Reason.TRAFFIC, Reason.STOP))
"""Refusals that something outside the system lifts."""


class Gatekeeper:
    """Answers the requests in the tables. Knows robots, states and time; no roads.

    Pressure, the chain rule of the certified gate, lights and ordinary traffic are compiled; every other
    negotiation and gate is asked from here, between the parts of the same compiled step.

    Parameters
    ----------
    negotiation
        Orders the requests that are possible at the same time.
    serve_after_s
        The age [s] from which on the oldest requests are served (`loopgate.drive.service`), where the chain
        rule decides and promises everyone to go on; infinity for never.
    """

    system: System
    gate: Gate

    def __init__(self, negotiation: Negotiation, *, serve_after_s: float = math.inf) -> None:
        self._patience_s = serve_after_s
        self.negotiation = negotiation
        self._orders = careful_order.careful(negotiation)
        self._times: defaultdict[str, Histogram] = defaultdict(Histogram)
        self.messages = 0
        self.timetable: Timetable | None = None
        """The lights that are obeyed; to be set before tables are taken over."""
        self._around: Mapping[str, Any] = {}
        self._names: Sequence[str] = ()
        self._look: Callable[[], object] | None = None
        """Tables of ordinary traffic, the names of its vehicles by number, and what looks where these are."""
        self._by_pressure = type(negotiation) is Pressure
        self._granted = False
        """Whether anything has been granted since the requests were collected."""
        self._decision_us, self._counted = 0.0, 0
        """How long a compiled decision took when it was last timed [us], and how many have been counted."""
        self.in_place = self._by_chain = False
        """Whether vehicles can come and go with no gate made anew, and whether the chain rule decides."""
        self._serve_after_s = math.inf

    def change(
        self, system: System, gate: Gate, rows: Sequence[int] | None = None, *, joined: bool = False
    ) -> None:
        """Go on with these robots, which stand as the system says; the tables are to be taken over next.

        Parameters
        ----------
        system, gate
            Robots and states, and a gate made for them.
        rows
            By robot the number that it has in the tables; by default the same.
        joined
            Whether a robot may be joined by others; else nobody else ever comes to a place of its own.
        """
        self.system = system
        self.gate = gate
        self._rows = range(len(system.robots)) if rows is None else rows
        self._robots = {row: robot for robot, row in enumerate(self._rows)}
        self._asked = careful(gate, system)
        self._following = following(self._asked)
        # What is derived from it decides as it likes.
        certified = gate if type(gate) is CertifiedGate else None
        self._by_chain = certified is not None and certified.by_chain_alone
        self._by_chain = self._by_chain and (joined or len(system.robots) > 1)
        self.in_place = self._by_chain and joined
        everyone = self._by_chain and certified is not None and certified.promise == "everyone"
        self._serve_after_s = self._patience_s if everyone else math.inf
        self._configuration = system.initial
        """For gates that do not follow the moves themselves."""
        self._decisions: dict[int, Decision] = {}
        if isinstance(self._orders, InformedNegotiation):
            self._orders.prepare(system)

    def take_over(self, ground: Ground) -> Step:
        """Take over the tables; return the way in."""
        self._ground, self._code = ground, ground.code
        self._tables = tables = ground.tables
        self._step = Step(self._all_tables())
        self._vehicles = v = cast("Any", tables.vehicles)
        # Read by column: a number of a row costs ten times as much.
        self._granted_leg, self._leg_at, self._legs = v["granted"], v["leg_at"], v["legs"]
        self._since_s, self._asked_at_s, self._decided = v["since_s"], v["asked_at_s"], v["decided"]
        self._reason, self._going = v["reason"], v["going"]
        self._run, self._states, self._reasons, self._entries = (
            cast("Any", table) for table in (tables.run, tables.states, tables.reasons, tables.entries)
        )
        self._held_by, self._rooms, self._outside = (self._states[c] for c in ("held_by", "room", "outside"))
        self._state_behind = cast("Any", tables.legs)["state"]
        self._run["serve_after_s"] = self._serve_after_s
        self._run["at_once"] = self._at_once
        negotiation = self.negotiation
        if type(negotiation) is Pressure:
            for column, figure in zip(("crowded", "patience_s", "wait_s"), negotiation.figures, strict=True):
                self._run[column] = figure
        return self._step

    @property
    def signals(self) -> Mapping[str, int]:
        """Numbers of the signals that are obeyed, by movement."""
        return self.timetable.numbers if self.timetable is not None else {}

    def _all_tables(self) -> Tables:
        tables = self._tables._replace(**self._around)
        return tables if self.timetable is None else self.timetable.put_into(tables)

    @property
    def _at_once(self) -> bool:
        return self._look is None

    def look_around(
        self, around: Mapping[str, Any], names: Sequence[str], look: Callable[[], object]
    ) -> None:
        """Heed ordinary traffic.

        Parameters
        ----------
        around
            Its tables, by name (`loopgate.drive.around`).
        names
            Of the vehicles in these by number.
        look
            Brings them up to date; called before requests are answered.
        """
        self._around, self._names, self._look = around, names, look
        self._step.use(self._all_tables())

    @property
    def looks_around(self) -> bool:
        """Whether ordinary traffic is heeded."""
        return self._look is not None

    def ask(self, what: int, robot: int = 0) -> int:
        """Ask of the steps what has to do with ordinary traffic alone; see `loopgate.drive.step.Step`."""
        return self._step(what, robot)

    def number(self, state: str) -> int | None:
        """Return the number of a state; None if nobody comes there."""
        return self._ground.states.get(state)

    @property
    def by_chain(self) -> bool:
        """Whether the chain rule decides alone."""
        return self._by_chain

    @property
    def compiled(self) -> bool:
        """Whether all is decided in compiled code: by the chain rule and pressure."""
        return self._by_chain and self._by_pressure

    def held(self, state: int) -> int:
        """Return how many vehicles hold `state`."""
        return int(self._held_by[state])

    def room(self, state: int) -> int:
        """Return how many more vehicles fit into `state`."""
        return int(self._rooms[state] - self._held_by[state])

    def outside(self, state: int) -> int:
        """Return how many vehicles wait to depart into `state`."""
        return int(self._outside[state])

    def here(self, robot: int) -> int:
        """Return the state of the last grant to `robot`."""
        return self._state(robot, 0)

    def wanted(self, robot: int) -> int:
        """Return the state behind the last that was granted to `robot`."""
        return self._state(robot, 1)

    def _state(self, robot: int, ahead: int) -> int:
        """Return a state of the way of `robot`, so many legs ahead of the last that was granted."""
        leg = self._leg_at[robot] + (self._granted_leg[robot] + ahead) % self._legs[robot]
        return int(self._state_behind[leg])

    def holders(self, state: int) -> list[int]:
        """Return the robots that hold `state`, in the order in which they took it."""
        return self._ground.read(state, HOLDERS)

    def line(self, state: int) -> list[int]:
        """Return the robots whose last grant is `state`, first one first."""
        return self._ground.read(state, LINE)

    def slots(self, state: int) -> int:
        """Return how many vehicles fit into `state`."""
        return int(self._rooms[state])

    def free(self, state: int) -> int:
        """Return how many slots of `state` nobody has been granted, as the chain rule counts them."""
        return self.slots(state) - int(self._states["queue"][state])

    def first(self, state: int) -> int | None:
        """Return the robot that goes on first of those whose last grant is `state`."""
        return next(iter(self.line(state)), None)

    @property
    def refusals(self) -> dict[str, int]:
        """How often each reason was given."""
        counts = zip(REASONS, self._reasons["refused"].tolist(), strict=True)
        return {reason.value: count for reason, count in counts if reason and count}

    @property
    def sent(self) -> int:
        """How many messages the gate sent for vehicles."""
        return self.messages

    def report(self) -> Mapping[str, Any]:
        """Return no more figures for ``summary.json``."""
        return {}

    def answer(self) -> None:
        """Decide what is pending, and let vehicles go or stay, until nobody else may go; look at lights."""
        waiting = self._run["waiting"][0]
        if self._look is not None:
            if waiting:
                self._look()
            self.read_lights()  # it reads some too, and may have needed more room
        if self.compiled and (waiting or self.timetable):
            while self._time(lambda: self._step(drive.ANSWER)):
                self.read_lights()
            return
        if waiting:
            self._decide()
            while self._step(drive.TELL):
                self._decide()
        if self.timetable:
            while self._step(drive.LIGHTS):
                self.read_lights()

    def read_lights(self) -> None:
        """Read the lights of which the steps have to know."""
        if self.timetable is not None and self.timetable.read():
            self._step.use(self._all_tables())

    @property
    def decision_us(self) -> Mapping[str, Histogram]:
        """Times of the decisions by the stage that made them, empty where the gate has none [us].

        There is no clock in compiled code: each decision counts as long as, on average, those of the last
        step in which decisions alone were timed.
        """
        self._count()
        return self._times

    def _count(self) -> None:
        """Count the compiled decisions that have not been counted."""
        decided = self._uncounted
        if decided:
            self._times[_CHAIN].add(self._decision_us, times=decided)
            self._counted += decided

    @property
    def _uncounted(self) -> int:
        return int(self._run["decisions"][0]) - self._counted

    def _time(self, answer: Callable[[], int]) -> int:
        self._count()
        began = perf_counter_ns()
        said = answer()
        took_us, decided = (perf_counter_ns() - began) / 1000.0, self._uncounted
        if decided:
            self._decision_us = took_us / decided
            self._count()
        return said

    def _decide(self) -> None:
        """Decide once; nobody is told."""
        now_s = float(self._run["now_s"][0])
        self._granted = False
        self._run["at_once"] = self._at_once
        while self.timetable and self._step(drive.UNREAD):
            self.read_lights()
        ready = self._step(drive.COLLECT)
        robots = self._in_order(ready, now_s)
        if self._by_chain:
            if robots:
                self._decide_by_chain(robots)
        else:
            for robot in robots:
                self._decide_one(robot)

    def _due(self, ready: int, now_s: float) -> list[int]:
        """Return those that are ready and may ask."""
        return [one for one in self._entries["ready"][:ready].tolist() if self._is_due(one, now_s)]

    def _in_order(self, ready: int, now_s: float) -> list[int]:
        """Return who goes of those that are ready, in order; the others are to stay."""
        listed = self._entries["ready"]
        if self._by_pressure and not self._run["serving"][0]:
            return cast("list[int]", listed[: self._step(drive.ORDER, ready)].tolist())
        requests = [self._request(robot) for robot in self._due(ready, now_s)]
        ordered = [request.robot for request in self._ordered(requests, now_s)] if requests else []
        staying = [request.robot for request in requests if request.robot not in ordered]
        self._entries["staying"][: len(staying)] = staying
        self._run["staying"] = len(staying)
        return ordered

    def _ordered(self, requests: list[Request], now_s: float) -> Sequence[Request]:
        """Put the requests in order: whoever must move next goes before all others, whatever these say."""
        if not self._run["serving"][0]:
            return self._orders.order(requests, self, now_s)
        first = self._vehicles["mover"]
        movers = [request for request in requests if first[request.robot]]
        if not movers:
            return self._orders.order(requests, self, now_s)
        others = [request for request in requests if not first[request.robot]]
        return [*movers, *(self._orders.order(others, self, now_s) if others else ())]

    def _is_due(self, robot: int, now_s: float) -> bool:
        """Return whether the gate may be asked, for the first time or again."""
        return bool(not self._decided[robot] or now_s - self._asked_at_s[robot] >= REASK_S)

    def _request(self, robot: int) -> Request:
        return Request(robot, self._state(robot, 0), self._state(robot, 1), float(self._since_s[robot]))

    def _decide_by_chain(self, robots: list[int]) -> None:
        self._time(lambda: self._step(drive.DECIDE, robots=np.array(robots, dtype=np.int64)))

    def _decide_one(self, robot: int) -> None:
        if self._granted and not self._step(drive.STILL_FREE, robot):
            return
        self._ask_gate(robot)
        self._granted |= bool(self._going[robot])

    def _ask_gate(self, row: int) -> None:
        begin, robot = perf_counter_ns(), self._robots[row]
        if self._following is not None:
            decision = self._following.decide_here(robot)
        else:
            decision = self._asked.decide(self._configuration, robot)
        self._times[decision.stage].add((perf_counter_ns() - begin) / 1000.0)
        self.messages += decision.messages
        self._decisions[robot] = decision
        stage = self._code(decision.stage)
        self._step(drive.SETTLE, row, int(decision.admitted), number_of(decision.reason), stage)
        if decision.admitted:
            if self._following is not None:
                self._following.moved_here(robot)
            else:
                self._configuration = self.system.moved(self._configuration, robot)
                self._asked.moved(self._configuration, robot)

    def blockers(self, robot: int) -> list[list[int]]:
        """Return whom the request of `robot` waits for: of every set, some robot has to move on."""
        one = self._vehicles[robot]
        reason = int(one["reason"])
        if not one["pending"] or reason in _OUTSIDE or reason in (NOTHING, SPACING):
            return []
        if reason in (CROSSING, OCCUPIED, SERVICE):
            return blockers(robot, self._tables)
        if reason != RESERVE:
            if self._by_chain:
                circle = closes(self, self.here(robot), self.wanted(robot))
                if circle:
                    return [[first for place in circle for first in self.line(place)[:1]]]
                return [[other for other in range(len(self._vehicles)) if other != robot]]
            asking = self._robots[robot]
            decision: Decision | None
            if self._following is not None:
                decision = self._following.decide_here(asking)  # by now others may be in its way, or none
            else:
                decision = self._decisions.get(asking)  # none if the gate is another by now
            if decision is not None and decision.blockers:
                return [[self._rows[other] for other in decision.blockers]]
        return [[other for other in range(len(self._vehicles)) if other != robot]]

    def outside_blockers(self, robot: int, ids: Sequence[str]) -> list[list[str]]:
        """Return as `blockers` does, by name, who keeps `robot` from a grant outside of the system.

        Whatever it was refused for last: that may have passed since, and what is outside not. The vehicles
        of the system have the names `ids`, by number.
        """
        one = self._vehicles[robot]
        if not one["pending"] or int(one["reason"]) == STOPPING:
            return []
        if self._look is None:
            return []
        self._look()
        self._step(drive.FIND, robot)
        found = [[vehicle] for vehicle in self._found()]
        if self._step(drive.INSIDE, robot):
            found.append(self._found() + [ids[other] for other in self.holders(self.wanted(robot))])
        elif self._step(drive.TIGHT, robot):
            found.append([*ids[:robot], *ids[robot + 1 :]])
        return found

    def _found(self) -> list[str]:
        found = self._around["others"]["found"][: self._run["found"][0]]
        return [self._names[other] for other in found.tolist()]
