"""The controller aboard a vehicle: what sensors and posts tell it, and what it says and does then."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from loopgate.vehicles import vehicle as cars
from loopgate.vehicles.messages import Grant, Message, Refuse, Room, Stamp, ToVehicle
from loopgate.vehicles.vehicle import Vehicle

__all__ = ["Answer", "Controller"]


@dataclass(frozen=True, slots=True)
class Answer:
    """What a controller does with what it is told.

    Attributes
    ----------
    say
        Messages that it sends.
    holds
        Whether it holds a grant now, and waits for the word of its sensors that the crossing is free.
    goes
        Whether it lets the motor go on over the crossing, to the end of the next place.
    gives_back
        Whether it gives a grant back.
    refused
        Whether it takes a refusal for the answer to what it asked last.
    """

    say: tuple[Message, ...] = ()
    holds: bool = False
    goes: bool = False
    gives_back: bool = False
    refused: bool = False


class Controller:
    """The controller of one vehicle.

    Parameters
    ----------
    vehicle
        What it knows at the beginning.
    crowded
        The share of slots taken from which on it leaves room for others; above 1 it never does.

    Examples
    --------
    >>> from loopgate.vehicles.messages import Grant
    >>> one = Controller(Vehicle(1, loop=(3, 7)))
    >>> one.at_line((0.0, 1), 4.5, free=True).say
    (Ask(place=7, vehicle=1, number=1, here=3, then=3, stamp=(0.0, 1), sent_s=4.5, free=True),)
    >>> one.hear(Grant(1, 1, 7, until_s=7.0)).holds
    True
    >>> one.crossing(5.0, free=True).goes
    True
    """

    def __init__(self, vehicle: Vehicle, crowded: float = 2.0) -> None:
        self.vehicle = vehicle
        self._crowded = crowded
        self._grant: Grant | None = None

    def at_line(
        self, stamp: Stamp, now_s: float, shares: tuple[float, float] = (0.0, 0.0), *, free: bool
    ) -> Answer:
        """Ask, or say that it waits, or leave room for others: it is first in line, and near the line.

        Parameters
        ----------
        stamp
            Since when it wants on, and its number.
        now_s
            By its own clock [s].
        shares
            Of the slots taken in the place that it wants, and in its own, as it heard posts say last.
        free
            Whether its crossing is free, as it sees it.
        """
        if free and cars.leaves_room(*shares, now_s - stamp[0], self._crowded):
            return Answer()
        return Answer((cars.ask(self.vehicle, stamp, now_s, free=free),))

    def hear(self, message: ToVehicle) -> Answer:
        """Take in what a post says."""
        car = self.vehicle
        if isinstance(message, Room):
            self.vehicle = cars.heard(car, message)
        elif isinstance(message, Refuse):
            return Answer(refused=message.number == car.number + 1)
        elif isinstance(message, Grant):
            if cars.awaits(car, message):
                self._grant = message
                return Answer(holds=True)
            self.vehicle, out = cars.granted(car, message)
            return Answer(tuple(out))
        return Answer()

    def crossing(self, now_s: float, *, free: bool) -> Answer:
        """Go by the grant that it holds, if that lasts and the crossing is still free; else give it back."""
        grant, self._grant = self._grant, None
        if grant is None or not cars.awaits(self.vehicle, grant):
            return Answer()
        free = free and cars.in_time(grant, now_s)
        if free:
            self.vehicle, out = cars.granted(self.vehicle, grant)
        else:
            self.vehicle, out = cars.give_back(self.vehicle, grant)
        return Answer(tuple(out), goes=free, gives_back=not free)

    def rear_out(self) -> Answer:
        """Say that the rear has left the first of the places that it is still in."""
        if not self.vehicle.rears:
            return Answer()
        self.vehicle, out = cars.rear_out(self.vehicle)
        return Answer(tuple(out))

    def remind(self) -> Answer:
        """Say again what no post has answered."""
        return Answer(tuple(cars.repeat(self.vehicle)))

    @classmethod
    def start(
        cls, number: int, loop: Sequence[int], at: int, rears: Sequence[int], clock: int, crowded: float = 2.0
    ) -> Controller:
        """Return the controller of a vehicle that begins, or that has lost its memory, at this clock.

        Its numbers go on from the clock, which is ahead of all that it has used: it goes less than a thousand
        times a second. See `cars.begin_anew`.

        Parameters
        ----------
        number
            Of the vehicle.
        loop, at, rears
            Its loop as places, the position of its place there, and the places behind that its body is
            still in, as its odometer says.
        clock
            In milliseconds.
        crowded
            As above.
        """
        car = Vehicle(number, tuple(loop), at)
        return cls(cars.begin_anew(car, rears, clock) if clock else car, crowded)
