"""Algorithm 2 of Zhou et al. 2020 on segments: words between vehicles and monitors, and what a monitor does.

A monitor keeps the books of one shared segment (Section 3.1 of the paper). A vehicle that wants on asks it
for the segment, and looks at all segments by which others may come round to it: what it has looked at stays
as it is until it has decided. Pure: a message comes, messages go. See docs/vehicles.md.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum

from loopgate.vehicles.messages import Goes, Left, Moved, Room

__all__ = ["Busy", "Cause", "Free", "Look", "Mark", "Monitor", "Role", "Seen", "Stand", "Word", "receive"]

SEEN_S = 0.5
"""So long after it sets out a vehicle is known to go, at most [s]."""


class Role(StrEnum):
    """What a vehicle wants of a segment."""

    OVER = "over"
    """That the message goes on over it."""
    LEAVE = "leave"
    """To leave it."""
    TAKE = "take"
    """To have it."""
    READ = "read"
    """To know who is there, and that nobody comes or goes while it decides."""


class Cause(StrEnum):
    """Why a monitor refuses."""

    FULL = "full"
    """Another vehicle is in the segment, or its rear."""
    BUSY = "busy"
    """Another vehicle decides, and has looked at the segment, or wants to come or go there."""


@dataclass(frozen=True, slots=True)
class Stand:
    """A vehicle in a segment.

    Attributes
    ----------
    vehicle, number
        Its number, and that of the move by which it came.
    loop, shared, at
        Its loop as segments, which of them others visit too, and the position of this one.
    """

    vehicle: int
    number: int
    loop: tuple[int, ...]
    shared: tuple[bool, ...]
    at: int

    def ahead(self, most: int) -> tuple[int, ...]:
        """Return the shared segments ahead, at most so many, up to the next that is its own."""
        found: list[int] = []
        for step in range(1, most + 1):
            there = (self.at + step) % len(self.loop)
            if not self.shared[there]:
                break
            found.append(self.loop[there])
        return tuple(found)


Seat = tuple[int, Stand | None]
"""A segment, and who is there."""


@dataclass(frozen=True, slots=True)
class Look:
    """Vehicle to monitors, from one to the next of `way`: it is at position `at` there.

    `roles` says what the vehicle wants of each, `seen` what those before have said, `me` who asks: as it will
    stand in the segment that it wants.
    """

    vehicle: int
    number: int
    way: tuple[int, ...]
    roles: tuple[Role, ...]
    me: Stand
    at: int = 0
    seen: tuple[Seat, ...] = ()

    @property
    def place(self) -> int:
        """The segment whose monitor it is for now."""
        return self.way[self.at]


@dataclass(frozen=True, slots=True)
class Seen:
    """The last monitor of a way to the vehicle: that is who is there."""

    vehicle: int
    number: int
    way: tuple[int, ...]
    seen: tuple[Seat, ...]


@dataclass(frozen=True, slots=True)
class Busy:
    """A monitor to the vehicle: not now. `way` is how far its message came."""

    vehicle: int
    number: int
    way: tuple[int, ...]
    cause: Cause


@dataclass(frozen=True, slots=True)
class Free:
    """Vehicle to monitors, from one to the next of `way`: I do not need you any more, under this number.

    Those before position `begins` only pass it on. `went` is whether it has gone, and has given up nothing.
    """

    vehicle: int
    number: int
    way: tuple[int, ...]
    begins: int = 0
    went: bool = False
    at: int = 0

    @property
    def place(self) -> int:
        """The segment whose monitor it is for now."""
        return self.way[self.at]


@dataclass(frozen=True, slots=True)
class Whose:
    """Monitor to a vehicle that may have come or gone: tell me whether you have."""

    vehicle: int
    number: int
    place: int


ToMonitor = Look | Free | Goes | Moved | Left
Word = ToMonitor | Seen | Busy | Whose | Room


@dataclass(frozen=True, slots=True)
class Mark:
    """A vehicle has looked at a segment, under this number; until when by the monitor's clock [s]."""

    vehicle: int
    number: int
    ends_s: float


@dataclass(frozen=True, slots=True)
class Monitor:
    """The books of a segment.

    Attributes
    ----------
    place
        Its number.
    lease_s
        For how long what a vehicle has looked at stays as it is [s].
    stand
        Who is there, or who may come.
    coming
        Whether that one has not said yet that it has come.
    leaving
        The number under which that one may have gone; 0 if it has not asked to.
    rears
        Vehicles that have gone and are not out yet, with the numbers under which they went.
    marks
        Who has looked at it and may still be deciding.
    gone
        Numbers of vehicles that are settled: older words of these are void.

    Examples
    --------
    >>> me = Stand(1, 1, (7, 3), (True, False), 0)
    >>> monitor, out = receive(Monitor(7, 2.0), Look(1, 1, (7,), (Role.TAKE,), me), 0.0)
    >>> out
    [Seen(vehicle=1, number=1, way=(7,), seen=())]
    >>> receive(monitor, Look(2, 1, (7,), (Role.TAKE,), replace(me, vehicle=2)), 0.1)[1][0].cause
    <Cause.BUSY: 'busy'>
    """

    place: int
    lease_s: float
    stand: Stand | None = None
    coming: bool = False
    leaving: int = 0
    rears: tuple[tuple[int, int], ...] = ()
    marks: tuple[Mark, ...] = ()
    gone: tuple[tuple[int, int], ...] = ()


Answer = tuple[Monitor, list[Word]]


def receive(monitor: Monitor, message: ToMonitor, now_s: float) -> Answer:
    """Return the monitor after a message that came at this time by its clock [s], and what it says."""
    if isinstance(message, Look):
        return _looked_at(monitor, message, now_s)
    vehicle, number = message.vehicle, message.number
    if isinstance(message, Free):
        out: list[Word] = [replace(message, at=message.at + 1)] if message.at + 1 < len(message.way) else []
        return (_freed(monitor, message) if message.at >= message.begins else monitor), out
    after = _settled(_unmarked(monitor, vehicle, number), vehicle, number)
    stand = after.stand
    mine = stand is not None and stand.vehicle == vehicle
    if isinstance(message, Goes):
        if mine and stand is not None and stand.number == number:
            after = replace(after, coming=False)
        return after, []
    if mine and stand is not None and stand.number < number:
        after = replace(after, stand=None, coming=False, leaving=0, rears=(*after.rears, (vehicle, number)))
    if isinstance(message, Moved):
        return after, []
    rears = tuple(one for one in after.rears if one[0] != vehicle or one[1] > number)
    return replace(after, rears=rears), [Room(vehicle, number, monitor.place)]


def _looked_at(monitor: Monitor, look: Look, now_s: float) -> Answer:
    """Do what a vehicle wants of the segment, and pass its message on, or say why not."""
    role, stand = look.roles[look.at], monitor.stand
    if role is Role.OVER:
        return monitor, _passed_on(look, ())
    if any(vehicle == look.vehicle and number >= look.number for vehicle, number in monitor.gone):
        return monitor, []
    monitor = _settled(monitor, look.vehicle, look.number - 1)
    marks = tuple(one for one in monitor.marks if one.ends_s >= now_s)
    mine = stand is not None and stand.vehicle == look.vehicle
    if role is Role.LEAVE and (stand is None or not mine or stand.number >= look.number):
        return monitor, []
    cause = _refuses(monitor, look, marks)
    if cause is not None:
        out: list[Word] = [Busy(look.vehicle, look.number, look.way[: look.at + 1], cause)]
        if stand is not None and not mine and (monitor.coming or monitor.leaving):
            out.append(Whose(stand.vehicle, monitor.leaving or stand.number, monitor.place))
        return replace(monitor, marks=marks), out
    after = replace(monitor, marks=marks)
    if role is Role.TAKE:
        after = replace(after, stand=look.me, coming=True)
    elif role is Role.LEAVE:
        after = replace(after, coming=False, leaving=look.number)
    else:
        mark = Mark(look.vehicle, look.number, now_s + monitor.lease_s + SEEN_S)
        after = replace(after, marks=(*(one for one in marks if one.vehicle != look.vehicle), mark))
    return after, _passed_on(look, ((monitor.place, stand),) if role is Role.READ else ())


def _refuses(monitor: Monitor, look: Look, marks: tuple[Mark, ...]) -> Cause | None:
    """Return why a vehicle cannot have what it wants of the segment, if it cannot."""
    role, stand = look.roles[look.at], monitor.stand
    mine = stand is not None and stand.vehicle == look.vehicle
    if (monitor.coming or monitor.leaving > 0) and not mine:
        return Cause.BUSY
    if role is Role.READ:
        return None
    if any(one.vehicle != look.vehicle for one in marks):
        return Cause.BUSY
    taken = stand is not None and not (mine and monitor.coming)
    return Cause.FULL if role is Role.TAKE and (monitor.rears or taken) else None


def _passed_on(look: Look, more: tuple[Seat, ...]) -> list[Word]:
    """Return the message to the next monitor; from the last one, the answer to the vehicle."""
    seen = (*look.seen, *more)
    if look.at + 1 < len(look.way):
        return [replace(look, at=look.at + 1, seen=seen)]
    return [Seen(look.vehicle, look.number, look.way, seen)]


def _freed(monitor: Monitor, free: Free) -> Monitor:
    """Return a monitor of which a vehicle wants nothing more under this number."""
    vehicle, number = free.vehicle, free.number
    after, stand = _unmarked(monitor, vehicle, number), monitor.stand
    if stand is not None and stand.vehicle == vehicle and not free.went:
        if after.coming and stand.number == number:
            after = replace(after, stand=None, coming=False)
        elif after.leaving == number:
            after = replace(after, leaving=0)
    return _settled(after, vehicle, number)


def _unmarked(monitor: Monitor, vehicle: int, number: int) -> Monitor:
    """Return a monitor at which a vehicle looks no longer."""
    marks = tuple(one for one in monitor.marks if one.vehicle != vehicle or one.number > number)
    return replace(monitor, marks=marks)


def _settled(monitor: Monitor, vehicle: int, number: int) -> Monitor:
    """Return a monitor for which what a vehicle has said up to this number is void."""
    last = max([number, *(old for one, old in monitor.gone if one == vehicle)])
    return replace(monitor, gone=(*(one for one in monitor.gone if one[0] != vehicle), (vehicle, last)))
