"""The controller aboard a vehicle: it takes sensor readings and messages of posts, and answers both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from loopgate.negotiation.formulas import leaves_room
from loopgate.vehicles import vehicle as cars
from loopgate.vehicles.messages import Grant, Message, Refuse, Room, Stamp, ToVehicle
from loopgate.vehicles.vehicle import AskingVehicle

__all__ = ["Answer", "Controller"]


@dataclass(frozen=True, slots=True)
class Answer:
    """A controller's reaction to a message or a sensor reading.

    Attributes
    ----------
    say
        Messages to send.
    holds
        Whether the vehicle now has a grant, and needs to know from its sensors whether the crossing is free.
    goes
        Whether the vehicle may drive over the crossing, to the end of the next place.
    gives_back
        Whether the vehicle returns its grant.
    refused
        Whether the message refused the vehicle's last request.
    """

    say: tuple[Message, ...] = ()
    holds: bool = False
    goes: bool = False
    gives_back: bool = False
    refused: bool = False


class Controller:
    """The controller of one vehicle that decides by messages.

    Parameters
    ----------
    vehicle
        The vehicle's knowledge at the start.
    crowded
        Share of taken slots in the next place from which the vehicle leaves room for others; above 1: never.

    Examples
    --------
    >>> from loopgate.vehicles.messages import Grant
    >>> one = Controller(AskingVehicle(1, loop=(3, 7)))
    >>> one.at_line((0.0, 1), 4.5, free=True).say
    (Ask(place=7, vehicle=1, number=1, here=3, then=3, stamp=(0.0, 1), sent_s=4.5, free=True),)
    >>> one.hear(Grant(1, 1, 7, until_s=7.0)).holds
    True
    >>> one.crossing(5.0, free=True).goes
    True
    """

    def __init__(self, vehicle: AskingVehicle, crowded: float = 2.0) -> None:
        self.vehicle = vehicle
        self._crowded = crowded
        self._grant: Grant | None = None

    def at_line(
        self, stamp: Stamp, now_s: float, shares: tuple[float, float] = (0.0, 0.0), *, free: bool
    ) -> Answer:
        """React to the vehicle being first in line and near its stop line: ask for the next place, or wait.

        Parameters
        ----------
        stamp
            The time of its first request for the next place [s], and the number of the vehicle.
        now_s
            Time by the vehicle's clock [s].
        shares
            Share of taken slots in the next place and in its own place, by the last messages of the posts.
        free
            Whether the vehicle sees its crossing free.
        """
        if free and leaves_room(*shares, (now_s - stamp[0]) / cars.ROOM_S, self._crowded):
            return Answer()
        return Answer((cars.ask(self.vehicle, stamp, now_s, free=free),))

    def hear(self, message: ToVehicle) -> Answer:
        """React to a message of a post."""
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
        """Use the grant if its lease lasts and the crossing is free; else give the grant back."""
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
        """Report that the vehicle's rear has left the first of the places that it still touches."""
        if not self.vehicle.rears:
            return Answer()
        self.vehicle, out = cars.rear_out(self.vehicle)
        return Answer(tuple(out))

    def remind(self) -> Answer:
        """Repeat the messages that no post has answered."""
        return Answer(tuple(cars.repeat(self.vehicle)))

    @classmethod
    def start(
        cls, number: int, loop: Sequence[int], at: int, rears: Sequence[int], clock: int, crowded: float = 2.0
    ) -> Controller:
        """Make the controller of a vehicle that starts, or that restarts without its memory.

        A restarted vehicle numbers its requests from the clock. So its numbers are larger than all before: it
        makes fewer than a thousand moves a second.

        Parameters
        ----------
        number
            Number of the vehicle.
        loop, at, rears
            The places of its loop, the index of its place, and the places behind in which its rear still is,
            by its odometer.
        clock
            Time by the vehicle's clock [ms]; 0 for a vehicle that starts for the first time.
        crowded
            As for `Controller`.
        """
        car = AskingVehicle(number, tuple(loop), at)
        return cls(cars.begin_anew(car, rears, clock) if clock else car, crowded)
