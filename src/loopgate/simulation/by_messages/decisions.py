"""Decisions in simulated time by messages between vehicles, posts of places and keepers of crossings.

`loopgate.vehicles` defines what each of them does with a message, from its own state only. This module
connects them with the road: it gives a vehicle its senses (it is first in line, its crossing is free, its
rear is out), its motor and its clock.

An answer that arrives within half a step counts in that step, otherwise in the next one: SUMO knows no time
between steps.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from math import inf
from random import Random
from typing import Any

from loopgate.errors import ScenarioError
from loopgate.gates import Reason
from loopgate.simulation.by_messages.controllers import Controllers
from loopgate.simulation.by_messages.crossings import crossings
from loopgate.simulation.by_messages.events import Again, Heard, Mind, Patience
from loopgate.simulation.by_messages.motor import Motor
from loopgate.simulation.by_messages.radio import Radio
from loopgate.simulation.by_messages.turns import Turns
from loopgate.vehicles import keeper as keepers
from loopgate.vehicles.air import AirSettings
from loopgate.vehicles.keeper import PATIENCE_S, SEEN_S, Keeper, Way
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
    Offer,
    Probe,
    Refuse,
    Room,
    ToPost,
    ToVehicle,
    Why,
)
from loopgate.vehicles.post import Entry, Post

__all__ = ["DecisionsByMessages"]

_ROOM_PATIENCE_S = 5.0
"""A vehicle that found a place full asks again after this time, even if it has not heard of a free slot [s].
"""

_SAYS_AGAIN_S = 2.0
"""A vehicle with a long wait repeats that it waits in this interval, while its crossing is not free [s]."""

_LEASE_S, _LEASE_DELAYS = 2.0, 6.0
"""How long a lease lasts [s], plus so many delays: an answer takes two, and one step of SUMO."""

_WHY = {
    Why.FULL: Reason.OCCUPIED,
    Why.BUSY: Reason.OCCUPIED,
    Why.CIRCLE: Reason.DEADLOCK,
    Why.OLDER: Reason.ANSWER,
    Why.CHANGED: Reason.ANSWER,
    Why.CROSSING: Reason.ANSWER,
    Why.LATE: Reason.ANSWER,
}


_Timed = Patience | Mind | Again | Heard
_Event = Message | _Timed


class DecisionsByMessages:
    """The decisions of a run on queues, made by posts, keepers and the controllers of vehicles.

    Parameters
    ----------
    settings
        Settings of the radio channel.
    seed
        Seed of the losses and delays of messages.
    motor
        Senses and motors of the vehicles.
    controllers
        The controllers aboard the vehicles.
    room
        Number of slots of each place, by name.
    """

    def __init__(
        self,
        settings: AirSettings,
        seed: int,
        motor: Motor,
        controllers: Controllers,
        room: Mapping[str, int],
    ) -> None:
        self.settings, self._room = settings, room
        self.radio: Radio[_Timed] = Radio(settings, seed)
        self.controllers = controllers
        self._air = self.radio.air
        self._lots = Random(f"ears {seed}")
        self._motor = motor
        self.posts: list[Post] = []
        self.keepers: list[Keeper] = []
        """The keepers of crossings; `_keeper` has the number of the keeper before each place."""
        self.moves = self.unsafe = self.given_back = self.late = 0
        self.refused: Counter[str] = Counter()
        self.otherwise: Counter[str] = Counter()
        """Refusals by reason, and how many of them the central gate would not have given."""
        self._clock_s = 0.0
        self._moved_s: dict[int, float] = {}
        """When each vehicle last went on [s]."""
        self._ready: dict[int, None] = {}
        self._open: dict[int, Way] = {}
        """Vehicles that have asked in this step and have no answer, with the way that each wants."""
        self._said_s: dict[int, float] = {}
        """When each vehicle last said that it waits [s]."""
        self._asked_s: dict[int, float] = {}
        self._full: dict[int, dict[int, float]] = {}
        """For each place, the vehicles that found it full, and when each asks again without news [s]."""
        self._unsaid: dict[int, list[Message]] = {}
        """What vehicles say when others see them go: until then their leases last."""
        self._held: dict[int, None] = {}
        """Vehicles with a grant that arrived between two steps."""
        self._repeating: set[int] = set()
        self._patience_s = max(1.0, 6.0 * settings.delay_s)
        self._again_s = 3.0 * settings.delay_s  # no answer takes longer, except the answer to a probe
        self._probe_s = 2.0 + 40.0 * settings.delay_s

    def begin(self) -> None:
        """Set the first positions: each vehicle is in one place with its full length."""
        motor = self._motor
        self.where = where = motor.where
        self.radio.over(where)
        everybody = range(len(motor.vehicles))
        if any(where.place(number) == where.wanted(number) for number in everybody):
            msg = "decide vehicles: a loop has one place twice in a row; take central"
            raise ScenarioError(msg)
        makes = [vehicle.make for vehicle in motor.vehicles]
        longest_m = max(make.length_m + make.top * motor.step_s for make in makes)
        least_m = max(longest_m, *where.over_m.values())
        if motor.step_s > SEEN_S:
            msg = (
                f"decide vehicles: a step lasts {motor.step_s:g} s; expected at most {SEEN_S:g} s, or leases "
                "end before other vehicles see who goes"
            )
            raise ScenarioError(msg)
        if self.settings.range_m < least_m:
            msg = (
                f"decide vehicles: range is {self.settings.range_m:g} m; expected at least {least_m:.1f} m, "
                "or vehicles and posts on both sides of a crossing do not hear each other"
            )
            raise ScenarioError(msg)
        rooms = [self._room[place.name] for place in where.places]
        self.posts = [
            Post(s, max(2, room), tuple(Entry(n, 0, where.wanted(n)) for n in motor.line(s)))
            for s, room in enumerate(rooms)
        ]
        lease_s = _LEASE_S + _LEASE_DELAYS * self.settings.delay_s
        self.keepers, self._keeper = crossings(where.paths.values(), where.number, lease_s)
        self._before: dict[int, list[int]] = {}
        """For each place, the places from which vehicles come into it."""
        for here, after in self.where.over_m:
            self._before.setdefault(after, []).append(here)
        conflicts = {place: self.keepers[keeper].conflicts for place, keeper in self._keeper.items()}
        self.turns = Turns(motor, self.posts, conflicts, self.settings.loss, self._lots)
        self._moved_s = dict.fromkeys(everybody, motor.now_s)
        crowded = max(0.0, 1.0 - len(motor.vehicles) / sum(rooms))
        self.controllers.begin([where.stand(n) for n in everybody], crowded)

    def look(self, now_s: float) -> None:
        """Deliver the messages since the last step, and let vehicles sense what has changed."""
        self._ready = {}
        while (event := self._air.next(now_s)) is not None:
            self._comes(*event)
        self._clock_s = max(self._clock_s, now_s)
        for number in self._motor.seen_to_go():
            self._say_as(number, self._unsaid.pop(number, []))
        for number in self._motor.rears_out():
            self._rear_out(number)
        for number, answer in self.controllers.look(now_s, self.where.stand):
            self._say_as(number, answer.say)
        for number in self._motor.asking():
            if self._motor.reason(number) == Reason.CROSSING and self._says_that_it_waits(number):
                self._said_s[number] = self._clock_s
                self._ask(number, free=False)
        self._motor.look_again(list(self._held))

    def decide(self, ready: Sequence[int], now_s: float, *, first: bool) -> None:
        """Let ready vehicles ask, and wait for answers for half a step.

        `first`: whether these are the first vehicles of the step. Then vehicles that hold a grant use it.
        """
        self._ready = dict.fromkeys(ready)
        if first:
            held, self._held = self._held, {}
            for number in held:
                self._use(number)
        self._open = {}
        line = [number for number in ready if self._motor.asks(number) and self._may_ask(number)]
        line = self._ask_apart(
            sorted(line, key=lambda number: (-self.turns.pressure(number, self._clock_s), number))
        )
        until_s = now_s + self._motor.step_s / 2.0
        while self._open and (event := self._air.next(until_s)) is not None:
            before = len(self._open)
            self._comes(*event)
            if line and len(self._open) < before:
                line = self._ask_apart(line)
        for number in ready:
            if self._motor.asks(number) and number in self._ready:
                self._refuse(number, Reason.ANSWER)
        self._ready, self._open = {}, {}

    def _ask_apart(self, line: Sequence[int]) -> list[int]:
        """Let each vehicle ask that hears no competing request; return the other vehicles.

        A competing request is for the same place, or for a way in conflict. The vehicle with most pressure
        asks first. A vehicle that misses a competing request asks too.
        """
        later = []
        for number in line:
            way = self.turns.way(number)
            if self.turns.hears(way, self._open.values()):
                later.append(number)
            elif not self._motor.free_way(number):
                self._ready.pop(number, None)  # `free_way` has refused it
            elif self._ask(number):
                self._open[number] = way
            elif number in self._ready:
                self._refuse(number, Reason.RESERVE)
        return later

    def _may_ask(self, number: int) -> bool:
        asked_s = self._asked_s.get(number)
        if asked_s is not None and self._clock_s - asked_s < self._again_s:
            return False
        return number not in self._held and self._clock_s >= self._full_until_s(number)

    def _full_until_s(self, number: int) -> float:
        return self._full.get(self.where.wanted(number), {}).get(number, -1.0)

    def _says_that_it_waits(self, number: int) -> bool:
        waited = self._clock_s - self._motor.since_s(number) >= PATIENCE_S
        due = self._clock_s - self._said_s.get(number, -inf) >= _SAYS_AGAIN_S
        return waited and due and number not in self._held

    def _ask(self, number: int, *, free: bool = True) -> bool:
        """Let a controller ask for its grant, or say that it waits; return whether it asks."""
        stamp = self._motor.since_s(number), number
        said = self.controllers.at_line(
            number, stamp, self._clock_s, self.turns.shares(number), free=free
        ).say
        if not said:
            return False
        if not free:
            self._say_as(number, said)
            return False
        self._asked_s[number] = self._clock_s
        if self.settings.loss:
            self._air.wake(self._clock_s + self._again_s, Again(number, self._clock_s))
        self._full.get(self.where.wanted(number), {}).pop(number, None)
        self._say_as(number, said)
        return True

    def _comes(self, at_s: float, event: _Event) -> None:
        self._clock_s = max(self._clock_s, at_s)
        if isinstance(event, Ask | Goes | Moved | Left | Here | Probe | Clear | Changed):
            self._comes_to_post(event)
        elif isinstance(event, Patience):
            self._out_of_patience(event)
        elif isinstance(event, Again):
            if event.number in self._open and self._asked_s.get(event.number) == event.asked_s:
                self._ask_again(event.number)
        elif isinstance(event, Mind):
            self._comes_to_mind(event)
        elif isinstance(event, Heard):
            self.turns.hears_of(event.number, event.place, event.there)
        else:
            self._comes_to_vehicle(event)

    def _ask_again(self, number: int) -> None:
        """Let a vehicle without an answer ask again if its crossing is still free."""
        if not self._motor.free_way(number):
            self._open.pop(number)
            self._ready.pop(number, None)
        else:
            self._ask(number)

    def _comes_to_post(self, message: ToPost) -> None:
        before, keeper = self.posts[message.place], self._keeper[message.place]
        after: Post
        self.keepers[keeper], after, out = keepers.receive(
            self.keepers[keeper], before, message, self._clock_s
        )
        self.posts[message.place] = after
        if after.kept is not None and after.kept is not before.kept:
            self._air.wake(self._clock_s + self._probe_s, Patience(message.place, after.kept))
        self._say_from(message.place, out)

    def _out_of_patience(self, late: Patience) -> None:
        if self.posts[late.place].kept == late.kept:
            keeper = self._keeper[late.place]
            self.keepers[keeper], self.posts[late.place], out = keepers.expire(
                self.keepers[keeper], self.posts[late.place]
            )
            self._say_from(late.place, out)

    def _comes_to_mind(self, mind: Mind) -> None:
        if mind.heard:
            self._full.get(self.where.wanted(mind.number), {}).pop(mind.number, None)
            return
        self._repeating.discard(mind.number)
        self._say_as(mind.number, self.controllers.remind(mind.number).say)

    def _comes_to_vehicle(self, message: ToVehicle) -> None:
        number = message.vehicle
        answer = self.controllers.hear(number, message)
        if isinstance(message, Grant | Room):
            self.turns.hears_of(number, message.place, message.there)
        if isinstance(message, Offer):
            self._full.get(self.where.wanted(number), {}).pop(number, None)
            self._asked_s.pop(number, None)
        elif isinstance(message, Refuse) and answer.refused:
            self._refused(number, message)
        elif answer.holds:
            self._answered(number)
            if number in self._ready:
                self._use(number)
            else:
                self._held[number] = None
        self._say_as(number, answer.say)

    def _answered(self, number: int) -> None:
        self._asked_s.pop(number, None)
        self._open.pop(number, None)

    def _refused(self, number: int, refusal: Refuse) -> None:
        why = refusal.why
        self._answered(number)
        self.refused[why.value] += 1
        if why is not Why.CROSSING and self._motor.asks(number) and not self._motor.would_close(number):
            self.otherwise[why.value] += 1
        if why is Why.FULL:
            self._full.setdefault(refusal.place, {})[number] = self._clock_s + _ROOM_PATIENCE_S
        if number in self._ready and self._motor.asks(number):
            self._refuse(number, _WHY[why])

    def _refuse(self, number: int, reason: Reason) -> None:
        self._motor.refuse(number, reason)
        self._ready.pop(number, None)

    def _use(self, number: int) -> None:
        """Tell a vehicle with a grant whether its crossing is free: it goes, or gives the grant back."""
        ready = number in self._ready and self._motor.asks(number)
        self._ready.pop(number, None)
        free = ready and self._sees_free(number)
        answer = self.controllers.crossing(number, self._clock_s, free=free)
        if answer.goes:
            self._go(number)
            self._unsaid[number] = []
        elif free:
            self._motor.refuse(number, Reason.ANSWER)
        self.given_back += answer.gives_back
        self.late += answer.gives_back and free
        self._say_as(number, answer.say)

    def _sees_free(self, number: int) -> bool:
        """Return whether a vehicle sees its crossing free at the moment at which it would set out."""
        return self._motor.free_way(number)

    def _go(self, number: int) -> None:
        self.unsafe += self._motor.would_close(number)
        self._motor.go(number)
        self.moves += 1
        self._moved_s[number] = self._clock_s
        self._said_s.pop(number, None)

    def _rear_out(self, number: int) -> None:
        self._say_as(number, self.controllers.rear_out(number).say)

    def _say_as(self, number: int, out: Sequence[Message]) -> None:
        """Send a vehicle's messages; remind it later of places that it has left."""
        if number in self._unsaid:
            self._unsaid[number] += out
            return
        if number not in self._repeating and any(isinstance(message, Left | Here) for message in out):
            self._repeating.add(number)
            self._air.wake(self._clock_s + self._patience_s, Mind(number, heard=False))
        self.radio.say_as(number, out, self._clock_s)

    def _say_from(self, place: int, out: Sequence[Message]) -> None:
        """Send the messages of the post of a place, and look again at a request that has waited there.

        Vehicles that wait for a slot of the place may overhear that a slot is free.
        """
        for message in out:
            if isinstance(message, Ask):  # the request has waited at the keeper, which now looks at it again
                self._air.wake(self._clock_s, message)
                continue
            for number in self._full.get(place, ()) if isinstance(message, Room) else ():
                self.radio.overhear(place, number, Mind(number, heard=True), self._clock_s)
            if isinstance(message, Grant | Room):
                for number in self._near(place):
                    if number != message.vehicle:
                        heard = Heard(number, place, message.there)
                        self.radio.overhear(place, number, heard, self._clock_s)
            self.radio.say_from(place, message, self._clock_s)

    def _near(self, place: int) -> list[int]:
        """Return the vehicles that are in a place, and those that want it next."""
        near = self._motor.line(place)
        for before in self._before.get(place, ()):
            near += [number for number in self._motor.line(before) if self.where.wanted(number) == place]
        return near

    def report(self) -> dict[str, Any]:
        """Return the figures of the messages and decisions."""
        return (
            self.radio.report(self.moves)
            | self.controllers.report()
            | {
                "longest_still_s": round(self._clock_s - min(self._moved_s.values(), default=0.0), 1),
                "given_back": self.given_back,
                "leases_over": self.late,
                "refused": dict(sorted(self.refused.items())),
                "central_otherwise": dict(sorted(self.otherwise.items())),
                "unsafe": self.unsafe,
            }
        )
