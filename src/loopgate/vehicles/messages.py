"""Messages between vehicles and the posts that keep the books of places. Places and vehicles are numbers.

A vehicle numbers its wishes: each grant that it uses or gives back takes one number. So a message that comes
late is known for what it is.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

Stamp = tuple[float, int]
"""When a vehicle first asked for what it wants now, and its number: the smaller is the older."""


class Why(StrEnum):
    """Why a post refuses."""

    FULL = "full"
    """No slot is free, or the last one is kept for another vehicle."""
    BUSY = "busy"
    """The vehicle that the post let in last has not said that it goes, and another ask waits for that."""
    CIRCLE = "circle"
    """The probe came back: the head of the last place that it passed is to go first."""
    OLDER = "older"
    """The probe of an older wish passed here."""
    CHANGED = "changed"
    """The probe went round a circle of other places, in which some vehicle has moved and a post not heard."""
    CROSSING = "crossing"
    """Another vehicle may go over the crossing before it."""
    LATE = "late"
    """The probe or its answer did not come in time."""


@dataclass(frozen=True, slots=True)
class Ask:
    """Vehicle to the post of the place that it wants: let me in. It stands `here`, and wants `then` next.

    `sent_s` is when it says so, by its own clock [s]; `free` is whether it sees its crossing free: if not, it
    only says that it waits.
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
    """Post to vehicle: you have a slot here, and the crossing until `until_s` of your clock.

    None is for ever: where no keeper leases the crossing. `there` is how many are in the place
    now: all around hear it.
    """

    vehicle: int
    number: int
    place: int
    until_s: float | None = None
    there: int = 0


@dataclass(frozen=True, slots=True)
class Refuse:
    """Post to vehicle: not now."""

    vehicle: int
    number: int
    place: int
    why: Why


@dataclass(frozen=True, slots=True)
class Offer:
    """Post to vehicle: the last slot of my place is kept for you; ask for it."""

    vehicle: int
    place: int


@dataclass(frozen=True, slots=True)
class Goes:
    """Vehicle to the post that let it in: I use the grant, and am last in your line."""

    place: int
    vehicle: int
    number: int


@dataclass(frozen=True, slots=True)
class Moved:
    """Vehicle to the post of the place before: I am out of your line; my rear is still with you."""

    place: int
    vehicle: int
    number: int


@dataclass(frozen=True, slots=True)
class Left:
    """Vehicle to post: nothing of me is with you, in line or on the road; said until the post says `Room`."""

    place: int
    vehicle: int
    number: int


@dataclass(frozen=True, slots=True)
class Here:
    """Vehicle that has begun anew to the post of its place: I am with you once; said until it answers."""

    place: int
    vehicle: int
    number: int


@dataclass(frozen=True, slots=True)
class Room:
    """Post to all around, in answer to `Left` or `Here`: a slot is free, and so many are in the place."""

    vehicle: int
    number: int
    place: int
    there: int = 0


@dataclass(frozen=True, slots=True)
class Probe:
    """Post to post, along the heads of full places: whether the last slot of `origin` closes a circle.

    `here` is the place of the vehicle that asks for it, `path` are the places that the probe has passed,
    `head` the first vehicle of the last of them, which wants `place`.
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
    """Post to the post that sent a probe: it ends here, where there is room. `path` is the way back."""

    place: int
    number: int
    path: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Changed:
    """Post to the post that sent a probe: it goes round, and not through you. `path` is the way back."""

    place: int
    number: int
    path: tuple[int, ...]


ToPost = Ask | Goes | Moved | Left | Here | Probe | Clear | Changed
ToVehicle = Grant | Refuse | Offer | Room
Message = ToPost | ToVehicle
