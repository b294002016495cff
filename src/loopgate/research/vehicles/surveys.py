"""Random runs of vehicles that decide by Algorithm 2 by messages; the central gate checks each move."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from random import Random

from loopgate.gates.algorithm2 import Algorithm2Gate
from loopgate.model import Robot, System
from loopgate.vehicles import survey as monitors
from loopgate.vehicles import surveyor as cars
from loopgate.vehicles.messages import Goes, Left, Moved
from loopgate.vehicles.survey import Busy, Free, Look, Monitor, Seen, Stand, ToMonitor, Word
from loopgate.vehicles.surveyor import Surveyor

__all__ = ["SurveyWalk", "rounds"]

Receive = Callable[[Monitor, ToMonitor, float], monitors.Answer]

_ASKS, _AGAIN, _REAR, _BACK = 0.25, 0.1, 0.1, 0.01
"""How often, of all events, somebody asks, something is said again, a rear leaves, a wish is given up."""
_LEASE_S = 40.0
"""How long what was looked at stays so [s]; an event takes one second."""


def rounds(system: System) -> System:
    """Return a system for a random run: closed paths, and at most one robot in each state at the start."""
    made: list[Robot] = []
    taken: set[object] = set()
    for one in system.robots:
        if one.path[one.start] not in taken and one.path[0] != one.path[-1]:
            taken.add(one.path[one.start])
            made.append(Robot(one.id, one.path, start=one.start))
    return System(made)


class SurveyWalk:
    """A random run of vehicles and monitors: messages come in any order, and some are lost.

    Parameters
    ----------
    system
        A system of closed paths whose states hold one robot.
    rng
        Source of randomness for the next event.
    loss
        Share of messages that are lost.
    receive
        Function to test: a monitor's reaction to a message.

    Attributes
    ----------
    found
        Counts of moves; moves that the central gate refuses (``unsafe``); decisions that differ from the
        central gate's although no vehicle moved meanwhile (``otherwise``); states with two vehicles
        (``overfull``); messages.
    """

    def __init__(
        self, system: System, rng: Random, *, loss: float, receive: Receive = monitors.receive
    ) -> None:
        self.system, self.here = system, system.initial
        self._gate = Algorithm2Gate(system)
        self._rng, self._loss, self._receive = rng, loss, receive
        self.monitors = {
            state: Monitor(state, _LEASE_S) for state, alone in enumerate(system.private) if not alone
        }
        self.cars: list[Surveyor] = []
        for number, path in enumerate(system.paths):
            at = system.robots[number].start
            stand = Stand(number, 0, path, tuple(not system.private[s] for s in path), at)
            self.cars.append(Surveyor(stand, len(system.paths), lease_s=_LEASE_S))
            if stand.shared[at]:
                self.monitors[path[at]] = Monitor(path[at], _LEASE_S, stand)
        self.flight: list[Word] = []
        self.found: Counter[str] = Counter()
        self._now_s = 0.0
        self._moved_s = 0.0

    def step(self) -> None:
        """Simulate one random event: a request, a repetition, a departure, or the arrival of a message."""
        self._now_s += 1.0
        rng, lot = self._rng, self._rng.random()
        number = rng.randrange(len(self.cars))
        car = self.cars[number]
        if lot < _ASKS:
            if car.survey is None:
                self._say(number, cars.ask(car, self._now_s))
            self._go(number)
        elif lot < _ASKS + _AGAIN:
            self._say(number, (car, [*cars.again(car), *cars.repeat(car)]))
        elif lot < _ASKS + _AGAIN + _REAR:
            if car.rears:
                self._say(number, cars.rear_out(car))
        elif lot < _ASKS + _AGAIN + _REAR + _BACK:
            self._say(number, cars.give_up(car))
        elif self.flight:
            message = self.flight.pop(rng.randrange(len(self.flight)))
            if rng.random() >= self._loss:
                self._comes(message)

    def goes_on(self) -> bool:
        """Deliver all messages; return whether some vehicle moves, or the central gate admits no move too."""
        self._loss = 0.0
        before = self.found["moves"]
        for _ in range(3):
            for number in range(len(self.cars)):
                self._say(number, cars.give_up(self.cars[number]))
                while self.cars[number].rears:
                    self._say(number, cars.rear_out(self.cars[number]))
                self._settle()
                self._say(number, (self.cars[number], cars.repeat(self.cars[number])))
                self._settle()
            self._now_s += 2.0 * _LEASE_S
            for number in range(len(self.cars)):
                self.asks(number)
                self.goes_or_gives_up(number)
        anybody = any(self._gate.decide(self.here, n).admitted for n in range(len(self.cars)))
        return self.found["moves"] > before or not anybody

    def asks(self, number: int) -> None:
        """Let a vehicle ask for its next segment, and deliver all messages that follow."""
        self._say(number, cars.ask(self.cars[number], self._now_s))
        self._settle()

    def goes_or_gives_up(self, number: int) -> None:
        """Let a vehicle move if it may, otherwise withdraw its request; deliver all messages."""
        self._go(number)
        self._say(number, cars.give_up(self.cars[number]))
        self._settle()
        while self.cars[number].rears:
            self._say(number, cars.rear_out(self.cars[number]))
            self._settle()
        self._now_s += _LEASE_S

    def _settle(self) -> None:
        while self.flight:
            self._comes(self.flight.pop(self._rng.randrange(len(self.flight))))

    def _comes(self, message: Word) -> None:
        if isinstance(message, Look | Free | Goes | Moved | Left):
            monitor = self.monitors[message.place]
            self.monitors[message.place], out = self._receive(monitor, message, self._now_s)
            self._send(out)
            return
        car = self.cars[message.vehicle]
        if isinstance(message, Seen):
            self._say(message.vehicle, cars.seen(car, message))
            return
        self.found["refused"] += isinstance(message, Busy)
        self._say(message.vehicle, cars.told(car, message))

    def _go(self, number: int) -> None:
        """Let a vehicle go that has all answers, and may."""
        car = self.cars[number]
        decision = cars.decide(car)
        if decision is None or car.survey is None:
            return
        central = self._gate.decide(self.here, number)
        asked_s = car.survey.until_s - _LEASE_S
        if self._moved_s < asked_s:
            self.found["compared"] += 1
            self.found["otherwise"] += central.admitted is not decision.admitted
        if not decision.admitted or self._now_s > car.survey.until_s:
            self._say(number, cars.give_up(car))
            return
        self.found["moves"] += 1
        self.found["unsafe"] += not central.admitted
        self.here = self.system.moved(self.here, number)
        self._moved_s = self._now_s
        self._say(number, cars.go(car))
        at = self.system.paths[number][self.here.positions[number]]
        there = [self.system.paths[n][p] for n, p in enumerate(self.here.positions)].count(at)
        rear = any(
            at in [place for place, *_ in one.rears] for one in self.cars if one is not self.cars[number]
        )
        self.found["overfull"] += there > 1 or (rear and not self.system.private[at])

    def _say(self, number: int, answer: cars.Answer) -> None:
        self.cars[number], out = answer
        self._send(out)

    def _send(self, out: list[Word]) -> None:
        self.found["messages"] += len(out)
        self.flight += out
