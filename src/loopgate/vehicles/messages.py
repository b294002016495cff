"""Messages between vehicles and the posts of places. Places and vehicles are numbers.

A vehicle numbers its requests: each grant that it uses or gives back takes one number. So posts recognize
late messages.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

Stamp = tuple[float, int]
"""The time of a vehicle's first request for its next place [s], and its number: the smaller stamp is older.
"""


class Why(StrEnum):
    """The reason for which a post refuses a request."""

    FULL = "full"
    """No slot is free, or the last slot is kept for another vehicle."""
    BUSY = "busy"
    """The last admitted vehicle has not said that it goes, and another request waits already."""
    CIRCLE = "circle"
    """The probe came back: the head of the last place that it passed goes first."""
    OLDER = "older"
    """The probe of an older request passed here."""
    CHANGED = "changed"
    """The probe found a circle that does not lead through its post."""
    CROSSING = "crossing"
    """Another vehicle goes over the crossing first."""
    LATE = "late"
    """The probe or its answer did not come in time."""


@dataclass(frozen=True, slots=True)
class Ask:
    """A vehicle asks a post for a slot of its place; the vehicle is in place `here`, and next wants `then`.

    `sent_s` is the time of the message by the vehicle's clock [s]. `free` is whether the vehicle sees its
    crossing free; if not, the message only says that the vehicle waits.
    """

    place: int
    vehicle: int
    number: int
    here: int
    then: int
    stamp: Stamp
    sent_s: float = 0.0
    free: bool = True


@dataclass(frozen=True, slots=True)
class Grant:
    """A post grants a vehicle a slot of its place, and the crossing until `until_s` by the vehicle's clock.

    `until_s` is None where no keeper leases the crossing. `there` is the number of vehicles in the place now;
    all vehicles in reach hear it.
    """

    vehicle: int
    number: int
    place: int
    until_s: float | None = None
    there: int = 0


@dataclass(frozen=True, slots=True)
class Refuse:
    """A post refuses a vehicle's request for now."""

    vehicle: int
    number: int
    place: int
    why: Why


@dataclass(frozen=True, slots=True)
class Offer:
    """A post keeps the last slot of its place for a vehicle, and invites the vehicle to ask for it."""

    vehicle: int
    place: int


@dataclass(frozen=True, slots=True)
class Goes:
    """A vehicle tells the post of the next place that it uses its grant, and is last in line there."""

    place: int
    vehicle: int
    number: int


@dataclass(frozen=True, slots=True)
class Moved:
    """A vehicle tells the post of the place behind that it has left the line; its rear is still there."""

    place: int
    vehicle: int
    number: int


@dataclass(frozen=True, slots=True)
class Left:
    """A vehicle tells a post that no part of it is in the place; repeated until the post answers `Room`."""

    place: int
    vehicle: int
    number: int


@dataclass(frozen=True, slots=True)
class Here:
    """A restarted vehicle tells the post of its place that it is in line there; repeated until answered."""

    place: int
    vehicle: int
    number: int


@dataclass(frozen=True, slots=True)
class Room:
    """A post tells all vehicles in reach that a slot is free, and how many vehicles its place has."""

    vehicle: int
    number: int
    place: int
    there: int = 0


@dataclass(frozen=True, slots=True)
class Probe:
    """A question from post to post along full places: whether the last slot of `origin` would close a circle.

    `here` is the place of the vehicle that asks for the slot. `path` has the places that the probe has
    passed. `head` is the first vehicle of the last place in `path`; it wants `place`.
    """

    place: int
    origin: int
    number: int
    stamp: Stamp
    here: int
    path: tuple[int, ...]
    head: int


@dataclass(frozen=True, slots=True)
class Clear:
    """The answer to a probe that reached a place with a free slot: no circle. It goes back along `path`."""

    place: int
    number: int
    path: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Changed:
    """The answer to a probe when a place of its `path` now leads elsewhere; it goes back along `path`."""

    place: int
    number: int
    path: tuple[int, ...]


ToPost = Ask | Goes | Moved | Left | Here | Probe | Clear | Changed
ToVehicle = Grant | Refuse | Offer | Room
Message = ToPost | ToVehicle
