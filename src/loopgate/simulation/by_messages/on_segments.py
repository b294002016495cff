"""Vehicles on segments that decide by Algorithm 2 from messages, in simulated time.

`loopgate.vehicles.survey` and `surveyor` define what a monitor and a vehicle do with a message. This module
connects them with the road; `decisions` does the same for queues.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Container, Sequence
from itertools import pairwise
from random import Random
from typing import Any, NamedTuple, cast

from loopgate.errors import ScenarioError
from loopgate.gates import Reason
from loopgate.simulation.by_messages.controllers import Controllers, ControllersHere
from loopgate.simulation.by_messages.motor import Motor
from loopgate.simulation.by_messages.radio import Radio
from loopgate.vehicles import survey as monitors
from loopgate.vehicles import surveyor as cars
from loopgate.vehicles.air import AirSettings
from loopgate.vehicles.messages import Goes, Left, Moved, Room
from loopgate.vehicles.survey import Busy, Cause, Free, Look, Monitor, Seen, Stand, Whose, Word
from loopgate.vehicles.surveyor import Surveyor

__all__ = ["DecisionsOnSegments"]

_LEASE_S, _LEASE_DELAYS = 2.0, 60.0
"""How long a segment that a vehicle has looked at stays locked for it [s], plus so many mean delays."""

_ANSWER_DELAYS, _SOON_S = 3.0, 0.05
"""No answer takes longer than so many mean delays, plus this time [s]: monitors are joined by wire."""

_LATER_S = 2.0
"""A refused vehicle asks again after a random time of at most this [s]."""

_WHY = {Cause.FULL: Reason.OCCUPIED, Cause.BUSY: Reason.ANSWER}


class _Again(NamedTuple):
    """A vehicle's wait for answers to its question of this number is over."""

    vehicle: int
    number: int


class _Mind(NamedTuple):
    """The event at which a vehicle learns that no monitor has answered it in time."""

    vehicle: int


_Event = Word | _Again | _Mind


class DecisionsOnSegments:
    """The decisions of a run on segments, made by vehicles and by the monitors of shared segments.

    Parameters
    ----------
    settings
        Settings of the radio channel.
    seed
        Seed of losses, delays, and of the times when vehicles ask again.
    motor
        Senses and motors of the vehicles.
    shared
        Names of the segments that several vehicles visit.
    lookahead
        Lookahead of the gate.
    """

    def __init__(
        self, settings: AirSettings, seed: int, motor: Motor, shared: Container[str], lookahead: int
    ) -> None:
        self.settings = settings
        self.radio: Radio[_Event] = Radio(settings, seed)
        self.controllers: Controllers = ControllersHere()
        self._air, self._motor, self._shared, self._lookahead = self.radio.air, motor, shared, lookahead
        self._lots = Random(f"patience {seed}")
        self.monitors: dict[int, Monitor] = {}
        """The monitors of shared segments, by number."""
        self.cars: list[Surveyor] = []
        self.moves = self.unsafe = self.given_back = self.late = self.found = 0
        self.refused: Counter[str] = Counter()
        self.otherwise: Counter[str] = Counter()
        self._clock_s = 0.0
        self._moved_s: dict[int, float] = {}
        self._ready: dict[int, None] = {}
        self._held: dict[int, None] = {}
        """Vehicles that have decided to go, and wait for the next step or a free crossing."""
        self._later_s: dict[int, float] = {}
        self._repeating: set[int] = set()
        self._lease_s = _LEASE_S + _LEASE_DELAYS * settings.delay_s
        self._patience_s = max(1.0, 6.0 * settings.delay_s)

    def begin(self) -> None:
        """Set the first positions: each vehicle holds the segment in which it stands."""
        motor = self._motor
        self.where = where = motor.where
        self.radio.over(where)
        shared = [place.name in self._shared for place in where.places]
        self.monitors = {
            place: Monitor(place, self._lease_s) for place, others in enumerate(shared) if others
        }
        everybody = range(len(motor.vehicles))
        for number in everybody:
            loop, at, _ = where.stand(number)
            if len(loop) > 1 and where.place(number) == where.wanted(number):
                msg = "decide vehicles: a loop has one segment twice in a row; take central"
                raise ScenarioError(msg)
            stand = Stand(number, 0, loop, tuple(shared[place] for place in loop), at)
            self.cars.append(Surveyor(stand, len(everybody), self._lookahead, self._lease_s))
            if stand.shared[at]:
                self.monitors[loop[at]] = Monitor(loop[at], self._lease_s, stand)
        self._moved_s = dict.fromkeys(everybody, motor.now_s)

    def look(self, now_s: float) -> None:
        """Deliver the messages since the last step, and note the rears that have left segments."""
        self._ready = {}
        while (event := self._air.next(now_s)) is not None:
            self._comes(event[0], cast("_Event", event[1]))
        self._clock_s = max(self._clock_s, now_s)
        for number in self._motor.rears_out():
            self._now(number, cars.rear_out(self.cars[number]))
        self._motor.look_again(list(self._held))

    def decide(self, ready: Sequence[int], now_s: float, *, first: bool) -> None:
        """Let ready vehicles ask, oldest request first, and wait for answers for half a step.

        `first`: whether these are the first vehicles of the step. Then vehicles that have decided to go do
        so.
        """
        self._ready = dict.fromkeys(ready)
        if first:
            held, self._held = self._held, {}
            for number in held:
                self._use(number)
        for number in sorted(self._ready, key=lambda number: (self._motor.since_s(number), number)):
            if self._motor.asks(number) and self._may_ask(number):
                self._ask(number)
        until_s = now_s + self._motor.step_s / 2.0
        while self._waits() and (event := self._air.next(until_s)) is not None:
            self._comes(event[0], cast("_Event", event[1]))
        for number in ready:
            if self._motor.asks(number) and number in self._ready:
                self._refuse(number, Reason.ANSWER)
        self._ready = {}

    def _waits(self) -> bool:
        """Return whether a ready vehicle still waits for an answer."""
        return any(
            self.cars[number].survey is not None and number not in self._held for number in self._ready
        )

    def _may_ask(self, number: int) -> bool:
        return self.cars[number].survey is None and self._clock_s >= self._later_s.get(number, 0.0)

    def _ask(self, number: int) -> None:
        self._now(number, cars.ask(self.cars[number], self._clock_s))
        self._judge(number)
        self._be_patient(number)

    def _be_patient(self, number: int) -> None:
        survey = self.cars[number].survey
        if survey is not None and survey.open:
            at_s = self._clock_s + _ANSWER_DELAYS * self.settings.delay_s + _SOON_S
            self._air.wake(at_s, _Again(number, self.cars[number].number))

    def _judge(self, number: int) -> None:
        """Let a vehicle decide if it has all answers."""
        car = self.cars[number]
        decision = cars.decide(car)
        if decision is None or number in self._held or car.survey is None:
            return
        self.found += len(car.survey.stands)
        if decision.admitted:
            self._use(number)
        else:
            self._count_refusal(number, decision.reason.value)
            self._give_up(number, decision.reason)

    def _count_refusal(self, number: int, why: str) -> None:
        self.refused[why] += 1
        if self._motor.asks(number) and not self._motor.would_close(number):
            self.otherwise[why] += 1

    def _give_up(self, number: int, reason: Reason) -> None:
        self._now(number, cars.give_up(self.cars[number]))
        self._later_s[number] = self._clock_s + self._lots.uniform(0.0, _LATER_S)
        if number in self._ready and self._motor.asks(number):
            self._refuse(number, reason)

    def _refuse(self, number: int, reason: Reason) -> None:
        self._motor.refuse(number, reason)
        self._ready.pop(number, None)

    def _use(self, number: int) -> None:
        """Let a vehicle that has decided to drive on do so, if its decision still holds.

        Its crossing must be free.
        """
        survey = self.cars[number].survey
        if survey is None:
            return
        if self._clock_s > survey.until_s:
            self.given_back += 1
            self.late += 1
            self._give_up(number, Reason.ANSWER)
        elif number in self._ready and self._motor.asks(number) and self._motor.free_way(number):
            self._ready.pop(number)
            self.unsafe += self._motor.would_close(number)
            self._motor.go(number)
            self.moves += 1
            self._moved_s[number] = self._clock_s
            self._now(number, cars.go(self.cars[number]))
        else:
            self._held[number] = None

    def _comes(self, at_s: float, event: _Event) -> None:
        self._clock_s = max(self._clock_s, at_s)
        if isinstance(event, Look | Free | Goes | Moved | Left):
            monitor = self.monitors[event.place]
            self.monitors[event.place], out = monitors.receive(monitor, event, self._clock_s)
            for message in out:
                self._say_from(monitor.place, message)
        elif isinstance(event, _Mind):
            self._repeating.discard(event.vehicle)
            self._now(event.vehicle, (self.cars[event.vehicle], cars.repeat(self.cars[event.vehicle])))
        elif isinstance(event, _Again):
            self._asks_again(event)
        else:
            self._comes_to_vehicle(event)

    def _asks_again(self, event: _Again) -> None:
        car = self.cars[event.vehicle]
        if car.survey is None or car.number != event.number or not car.survey.open:
            return
        if self._clock_s > car.survey.until_s:
            self._give_up(event.vehicle, Reason.ANSWER)
            return
        self._now(event.vehicle, (car, cars.again(car)))
        self._be_patient(event.vehicle)

    def _comes_to_vehicle(self, message: Seen | Busy | Whose | Room) -> None:
        number, car = message.vehicle, self.cars[message.vehicle]
        if isinstance(message, Seen):
            self._now(number, cars.seen(car, message))
            self._judge(number)
            if self.cars[number] is not car:
                self._be_patient(number)
        elif isinstance(message, Busy):
            if car.survey is not None and message.number == car.number:
                self._count_refusal(number, message.cause.value)
                self._give_up(number, _WHY[message.cause])
        else:
            self._now(number, cars.told(car, message))

    def _now(self, number: int, answer: cars.Answer) -> None:
        """Set a vehicle's new state and send its messages; remind it later of segments it has left."""
        self.cars[number], out = answer
        if number not in self._repeating and any(isinstance(message, Left) for message in out):
            self._repeating.add(number)
            self._air.wake(self._clock_s + self._patience_s, _Mind(number))
        self.radio.say_as(number, [m for m in out if isinstance(m, Goes | Moved | Left)], self._clock_s)
        for message in out:
            if isinstance(message, Look | Free):
                stretch_m = self.where.to_m(number, message.way[0])
                self.radio.say(message, [stretch_m], self._clock_s, message.way[:1], number)

    def _say_from(self, place: int, message: Word) -> None:
        if isinstance(message, Look | Free):
            before = message.way[message.at - 1]
            self.radio.say(
                message, [self.where.over_m[before, message.place]], self._clock_s, (before, message.place)
            )
        elif isinstance(message, Seen | Busy):
            back = [self.where.over_m[pair] for pair in pairwise(message.way)][::-1]
            stretches_m = [*back, self.where.to_m(message.vehicle, message.way[0])]
            self.radio.say(message, stretches_m, self._clock_s, message.way, message.vehicle)
        elif isinstance(message, Whose):
            stretches_m = [self.where.to_m(message.vehicle, place)]
            if stretches_m[0] > self.settings.range_m:
                stretches_m = self.where.back_to_m(message.vehicle, place)[::-1]
            self.radio.say(message, stretches_m, self._clock_s, [place], message.vehicle)
        elif isinstance(message, Room):
            self.radio.say_from(place, message, self._clock_s)

    def report(self) -> dict[str, Any]:
        """Return the figures of the messages and decisions."""
        return self.radio.report(self.moves) | {
            "longest_still_s": round(self._clock_s - min(self._moved_s.values(), default=0.0), 1),
            "found_per_decision": round(self.found / max(1, self.moves + sum(self.refused.values())), 2),
            "given_back": self.given_back,
            "leases_over": self.late,
            "refused": dict(sorted(self.refused.items())),
            "central_otherwise": dict(sorted(self.otherwise.items())),
            "unsafe": self.unsafe,
        }
