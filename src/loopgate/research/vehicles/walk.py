"""One random run of the protocol; the central chain rule checks each decision."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from random import Random

from loopgate.gates.certified.chain import closes
from loopgate.research.vehicles.world import Receive, World, circle, misled, overfull
from loopgate.vehicles import post as posts
from loopgate.vehicles import vehicle as cars
from loopgate.vehicles.messages import (
    Ask,
    Changed,
    Clear,
    Goes,
    Grant,
    Here,
    Left,
    Message,
    Moved,
    Probe,
    Refuse,
    Room,
    ToPost,
)
from loopgate.vehicles.vehicle import AskingVehicle

_NUMBERS = 1000
"""A vehicle uses fewer numbers than this from one step to the next."""
_ASKS, _LATE, _AGAIN, _BACK = 0.3, 0.02, 0.1, 0.05
"""How often, of all steps, somebody asks, a post loses patience, a vehicle says something again; and how
often, of all grants, one is given back."""


class RandomWalk:
    """Vehicles and posts under way: messages come in any order, and some do not come.

    Parameters
    ----------
    start
        Where they begin.
    rng
        Draws what happens next.
    loss
        The share of messages that are lost.
    receive
        What posts do with messages.
    forgets
        How often, of all steps, a vehicle loses its memory. If ever, decisions are not compared with those of
        the central rule: nobody knows which grants are still to be used.

    Attributes
    ----------
    found
        Grants; those that close a circle (``unsafe``); refusals by reason, of moves that the central rule
        would have refused too (``full: as central``) or not (``full: central admits``); states that are not
        as they should be; messages by kind.
    """

    def __init__(
        self,
        start: World,
        rng: Random,
        *,
        loss: float,
        receive: Receive = posts.receive,
        forgets: float = 0.0,
    ) -> None:
        self.posts, self.vehicles = list(start.posts), list(start.vehicles)
        self.ground = [list(line) for line in start.ground]
        self.granted = [list(line) for line in start.ground]
        """Where all stand as soon as what is granted is done: what a central gate sees."""
        self._wants = [car.wanted for car in self.vehicles]
        self.flight: list[Message] = []
        self.asked_at = [0.0] * len(self.vehicles)
        self.found: Counter[str] = Counter()
        self._rng, self._loss, self._receive, self._forgets = rng, loss, receive, forgets
        self._time = 0

    def step(self) -> None:
        """Let something happen."""
        self._time += 1
        if self._forgets and self._rng.random() < self._forgets:
            self._forget(self._rng.randrange(len(self.vehicles)))
            return
        rng, lot = self._rng, self._rng.random()
        if lot < _ASKS or not self.flight:
            self._ask(rng.choice([line[0] for line in self.ground if line]))
        elif lot < _ASKS + _LATE:
            self._impatient(rng.randrange(len(self.posts)))
        elif lot < _ASKS + _LATE + _AGAIN:
            self._again(rng.randrange(len(self.vehicles)))
        else:
            message = self.flight.pop(rng.randrange(len(self.flight)))
            if rng.random() >= self._loss:
                self._comes(message, back=rng.random() < _BACK)
            else:
                self.found["lost"] += 1

    def judge(self) -> None:
        """Count all faults of the present state."""
        world = World(tuple(self.posts), tuple(self.vehicles), tuple(map(tuple, self.ground)))
        self.found["circles"] += bool(circle(world))
        self.found["overfull"] += bool(overfull(world))
        self.found["books misled"] += bool(misled(world))

    def goes_on(self, rounds: int = 60) -> bool:
        """Deliver all messages from now on; return whether some vehicle moves within some rounds."""
        self._loss = 0.0
        before = self.found["moves"]
        for _ in range(rounds):
            for line in self.ground:
                if line:
                    self._ask(line[0])
            for number in range(len(self.vehicles)):
                self._again(number)
            while self.flight:
                self._comes(self.flight.pop(self._rng.randrange(len(self.flight))), back=False)
                if self.found["moves"] > before:
                    return True
            for place in range(len(self.posts)):
                self._impatient(place)  # with nothing under way what it waits for is lost
        return False

    def _ask(self, number: int) -> None:
        car = self.vehicles[number]
        self._say([cars.ask(car, (self.asked_at[number], number))])

    def _again(self, number: int) -> None:
        car = self.vehicles[number]
        if car.rears:
            self.vehicles[number], out = cars.rear_out(car)
            self._say(out)
        else:
            self._say(cars.repeat(car))

    def _forget(self, number: int) -> None:
        """Let a vehicle begin anew where it is."""
        car = self.vehicles[number]
        rears = [place for place, _ in car.rears]
        anew = cars.begin_anew(AskingVehicle(car.id, car.loop, car.at), rears, _NUMBERS * self._time)
        self.vehicles[number] = anew
        self.found["forgot"] += 1
        self._say(cars.repeat(anew))

    def _impatient(self, place: int) -> None:
        self.posts[place], out = posts.expire(self.posts[place])
        self._say(out, place)

    def _comes(self, message: Message, *, back: bool) -> None:
        if isinstance(message, Ask | Goes | Moved | Left | Here | Probe | Clear | Changed):
            self._comes_to_post(message)
        elif isinstance(message, Room):
            self.vehicles[message.vehicle] = cars.heard(self.vehicles[message.vehicle], message)
        elif isinstance(message, Grant):
            self._comes_to_vehicle(message, back=back)

    def _comes_to_post(self, message: ToPost) -> None:
        before = self.posts[message.place]
        self.posts[message.place], out = self._receive(before, message)
        for entry in self.posts[message.place].line[len(before.line) - 1 :]:
            if entry not in before.line:
                self._let_in(message.place, entry.vehicle)
        self._say(out, message.place)

    def _comes_to_vehicle(self, grant: Grant, *, back: bool) -> None:
        while not back and any(place == grant.place for place, _ in self.vehicles[grant.vehicle].rears):
            self.vehicles[grant.vehicle], out = cars.rear_out(self.vehicles[grant.vehicle])
            self._say(out)  # no vehicle is as long as its loop: the rear is out before the front comes round
        car = self.vehicles[grant.vehicle]
        going = cars.awaits(car, grant)
        if going and back:
            self.vehicles[car.id], out = cars.give_back(car, grant)
            if self._forgets:
                pass
            elif car.id in self.granted[grant.place]:
                self.granted[grant.place].remove(car.id)
                self.granted[car.place].insert(0, car.id)
            else:
                self.found["books misled"] += 1
            self._wants[car.id] = grant.place
            self.found["given back"] += 1
        else:
            self.vehicles[car.id], out = cars.granted(car, grant)
        if going and not back:
            self.ground[car.place].remove(car.id)
            self.ground[grant.place].append(car.id)
            self.asked_at[car.id] = self._time
            self.found["moves"] += 1
        self._say(out)

    def _let_in(self, place: int, number: int) -> None:
        """Note that a post lets a vehicle in, and what the central rule says to that."""
        self.found["grants"] += 1
        if self._forgets:
            return
        here = next(p for p, line in enumerate(self.granted) if number in line)
        self.found["unsafe"] += self._refuses(here, place)
        self.granted[here].remove(number)
        self.granted[place].append(number)
        car = self.vehicles[number]
        self._wants[number] = car.loop[(car.at + 2) % len(car.loop)]

    def _refuses(self, here: int, place: int) -> bool:
        full = len(self.granted[place]) >= self.posts[place].slots
        return full or bool(closes(self, here, place))

    def free(self, place: int) -> int:
        """Return how many slots are free, as a central gate sees it."""
        return self.posts[place].slots - len(self.granted[place])

    def first(self, place: int) -> int | None:
        """Return the first vehicle in a place, as a central gate sees it."""
        return self.granted[place][0] if self.granted[place] else None

    def wanted(self, number: int) -> int:
        """Return the next place of a vehicle, as a central gate sees it."""
        return self._wants[number]

    def _say(self, out: Sequence[Message], place: int = -1) -> None:
        for message in out:
            self.found[type(message).__name__] += 1
            if isinstance(message, Refuse) and not self._forgets:
                here = self.vehicles[message.vehicle].place
                stale = (
                    message.vehicle not in self.granted[here]
                    or self.vehicles[message.vehicle].wanted != place
                )
                same = (
                    "is past" if stale else "as central" if self._refuses(here, place) else "central admits"
                )
                self.found[f"{message.why}: {same}"] += 1
            self.flight.append(message)
