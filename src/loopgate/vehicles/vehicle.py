"""A vehicle that asks posts for slots: its loop, its place and its grants, by pure functions on messages."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from loopgate.vehicles.messages import Ask, Goes, Grant, Here, Left, Message, Moved, Room, Stamp

ROOM_S = 100.0
"""A vehicle that has waited this long may go from an empty place into a full one [s]."""

Told = tuple[int, int]
"""A place, and the number under which its post knows the vehicle."""


@dataclass(frozen=True, slots=True)
class AskingVehicle:
    """The knowledge of a vehicle that asks posts: its loop, its place, and its open messages.

    Attributes
    ----------
    id
        Its number.
    loop
        The places of its closed loop in driving order; no place twice in a row.
    at
        Index of its place on the loop.
    number
        Number of grants that it has used or given back.
    inside
        Its number in the line of its place.
    rears
        Places that its front has left but not its rear.
    untold
        Places that it has left, or in which it has restarted, and whose posts have not acknowledged it.
    forgot
        The highest number that it may have used before it lost its memory; 0 if it has not.

    Examples
    --------
    >>> from loopgate.vehicles.messages import Grant
    >>> car = AskingVehicle(1, loop=(3, 7))
    >>> ask(car, (0, 1), 2.5).sent_s
    2.5
    >>> car, out = granted(car, Grant(1, 1, 7))
    >>> car.place, out
    (7, [Goes(place=7, vehicle=1, number=1), Moved(place=3, vehicle=1, number=0)])
    """

    id: int
    loop: tuple[int, ...]
    at: int = 0
    number: int = 0
    inside: int = 0
    rears: tuple[Told, ...] = ()
    untold: tuple[Told, ...] = ()
    forgot: int = 0

    @property
    def place(self) -> int:
        """The place in whose line the vehicle is."""
        return self.loop[self.at]

    @property
    def wanted(self) -> int:
        """The next place on the vehicle's loop."""
        return self.loop[(self.at + 1) % len(self.loop)]


Answer = tuple[AskingVehicle, list[Message]]


def ask(vehicle: AskingVehicle, stamp: Stamp, now_s: float = 0.0, *, free: bool = True) -> Ask:
    """Return the request of a vehicle that is first in line for its next place.

    Parameters
    ----------
    stamp
        The time of its first request for the place [s], and the number of the vehicle.
    now_s
        Time by the vehicle's clock [s].
    free
        Whether the vehicle sees its crossing free.
    """
    then = vehicle.loop[(vehicle.at + 2) % len(vehicle.loop)]
    return Ask(vehicle.wanted, vehicle.id, vehicle.number + 1, vehicle.place, then, stamp, now_s, free)


def awaits(vehicle: AskingVehicle, grant: Grant) -> bool:
    """Return whether a grant answers the vehicle's present request."""
    return grant.number == vehicle.number + 1 and grant.place == vehicle.wanted


def in_time(grant: Grant, now_s: float) -> bool:
    """Return whether the lease of a grant still lasts, by the vehicle's clock [s]."""
    return grant.until_s is None or now_s <= grant.until_s


def granted(vehicle: AskingVehicle, grant: Grant) -> Answer:
    """Return the vehicle after a grant, and its messages: it sets out, or answers an outdated grant."""
    if awaits(vehicle, grant):
        after = replace(
            vehicle,
            at=(vehicle.at + 1) % len(vehicle.loop),
            number=grant.number,
            inside=grant.number,
            rears=(*vehicle.rears, (vehicle.place, vehicle.inside)),
            untold=tuple(one for one in vehicle.untold if one != (vehicle.place, vehicle.forgot - 1)),
        )
        goes = Goes(grant.place, vehicle.id, grant.number)
        return after, [goes, Moved(vehicle.place, vehicle.id, vehicle.inside)]
    inside = grant.number == vehicle.inside or grant.number <= vehicle.forgot
    if grant.place == vehicle.place and inside:
        return vehicle, [Goes(grant.place, vehicle.id, grant.number)]
    if any(place == grant.place for place, _ in vehicle.rears):  # to have left would free its slot too
        return vehicle, [Moved(grant.place, vehicle.id, grant.number)]
    return vehicle, [Left(grant.place, vehicle.id, grant.number)]


def give_back(vehicle: AskingVehicle, grant: Grant) -> Answer:
    """Return the vehicle after it has returned an unusable grant, and its messages.

    If its rear is still in that place, the later report that it has left covers the returned grant too.
    """
    if any(place == grant.place for place, _ in vehicle.rears):
        rears = tuple((p, grant.number if p == grant.place else n) for p, n in vehicle.rears)
        return replace(vehicle, number=grant.number, rears=rears), []
    after = replace(vehicle, number=grant.number, untold=_also(vehicle, grant.place, grant.number))
    return after, [Left(grant.place, vehicle.id, grant.number)]


def begin_anew(vehicle: AskingVehicle, rears: Sequence[int], number: int) -> AskingVehicle:
    """Return a vehicle that has lost its memory but knows its position, and its messages to posts.

    It takes a number larger than all numbers that it has used; a report under that number covers all older
    ones. Each post of its loop may still list it, although no part of it is in the place: so it sends `Left`
    to all these posts, and each removes older entries. The post of its own place may list it twice, if it has
    lost its memory before: so it sends `Here`, unless its rear is there too.

    Parameters
    ----------
    rears
        The places behind in which its body still is, farthest first.
    number
        Larger than all numbers that it has used, and all that it has asked with.

    Examples
    --------
    >>> car = begin_anew(AskingVehicle(1, loop=(3, 7, 9), at=1), rears=(3,), number=5000)
    >>> car.rears, car.untold
    (((3, 5000),), ((7, 4999), (9, 5000)))
    >>> repeat(car)
    [Here(place=7, vehicle=1, number=4999), Left(place=9, vehicle=1, number=5000)]
    """
    away = tuple(
        (
            place,
            number - (place == vehicle.place),
        )  # so `Room` for `Here` is none for a later `Left`
        for place in dict.fromkeys(vehicle.loop)
        if place not in rears
    )
    behind = tuple((place, number) for place in rears)
    return replace(vehicle, number=number, inside=number, rears=behind, untold=away, forgot=number)


def rear_out(vehicle: AskingVehicle) -> Answer:
    """Return the vehicle after its rear has left the first place that it still touches, and its messages.

    It repeats its position in the same transmission, since its last report may have been lost.
    """
    place, number = vehicle.rears[0]
    after = replace(vehicle, rears=vehicle.rears[1:], untold=_also(vehicle, place, number))
    return after, [Left(place, vehicle.id, number), Goes(vehicle.place, vehicle.id, vehicle.inside)]


def _also(vehicle: AskingVehicle, place: int, number: int) -> tuple[Told, ...]:
    """Return the reports with a new one in place of older ones about the same place."""
    return (*(one for one in vehicle.untold if one[0] != place), (place, number))


def repeat(vehicle: AskingVehicle) -> list[Message]:
    """Return the reports that no post has acknowledged, to be sent again."""
    return [_told(vehicle, place, number) for place, number in vehicle.untold]


def _told(vehicle: AskingVehicle, place: int, number: int) -> Left | Here:
    """Return a report to a post: that the vehicle has left, or that it is there once."""
    if (place, number) == (vehicle.place, vehicle.forgot - 1):
        return Here(place, vehicle.id, number)
    return Left(place, vehicle.id, number)


def heard(vehicle: AskingVehicle, room: Room) -> AskingVehicle:
    """Return the vehicle after a post has acknowledged that the vehicle left its place."""
    told = (room.place, room.number)
    return replace(vehicle, untold=tuple(one for one in vehicle.untold if one != told))
