"""Algorithm 2 of Zhou et al. 2020 by messages: the monitor of each shared segment answers vehicles.

A monitor counts the vehicles in one shared segment (Section 3.1 of the paper). A vehicle asks the monitor of
its next segment, and reads all segments over which other vehicles could close a circuit. Monitors keep these
segments unchanged until the vehicle has decided. Pure functions on messages. See docs/vehicles.md.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum

from loopgate.vehicles.messages import Goes, Left, Moved, Room

__all__ = ["Busy", "Cause", "Free", "Look", "Mark", "Monitor", "Role", "Seen", "Stand", "Word", "receive"]

SEEN_S = 0.5
"""A vehicle is known to go within this time of its start [s]."""


class Role(StrEnum):
    """The use that a vehicle has for a segment: pass a message on, leave, enter, or read."""

    OVER = "over"
    """The monitor only passes the message on."""
    LEAVE = "leave"
    """The vehicle wants to leave the segment."""
    TAKE = "take"
    """The vehicle wants to enter the segment."""
    READ = "read"
    """The vehicle reads which vehicle is there; none enters or leaves until the vehicle has decided."""


class Cause(StrEnum):
    """The reason for which a monitor refuses."""

    FULL = "full"
    """Another vehicle, or its rear, is in the segment."""
    BUSY = "busy"
    """Another vehicle has asked to read, enter or leave the segment, and has not yet decided."""


@dataclass(frozen=True, slots=True)
class Stand:
    """A vehicle's presence in a segment of its loop.

    Attributes
    ----------
    vehicle, number
        Number of the vehicle, and number of the move by which it came.
    loop, shared, at
        The segments of its loop, whether each is shared, and the index of this segment.
    """

    vehicle: int
    number: int
    loop: tuple[int, ...]
    shared: tuple[bool, ...]
    at: int

    def ahead(self, most: int) -> tuple[int, ...]:
        """Return the next shared segments of the loop, up to `most`, ending before a private segment."""
        found: list[int] = []
        for step in range(1, most + 1):
            there = (self.at + step) % len(self.loop)
            if not self.shared[there]:
                break
            found.append(self.loop[there])
        return tuple(found)


Seat = tuple[int, Stand | None]
"""A segment, and the vehicles in it."""


@dataclass(frozen=True, slots=True)
class Look:
    """A vehicle's question, passed from monitor to monitor along `way`; now at position `at` of `way`.

    `roles` has the use of each segment, `seen` the answers so far, `me` the vehicle in the segment that it
    wants to enter.
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
        """The segment whose monitor receives the message next."""
        return self.way[self.at]


@dataclass(frozen=True, slots=True)
class Seen:
    """The answer to a `Look`: the vehicles in the segments of `way`."""

    vehicle: int
    number: int
    way: tuple[int, ...]
    seen: tuple[Seat, ...]


@dataclass(frozen=True, slots=True)
class Busy:
    """The refusal of a `Look`: try again later. `way` ends with the monitor that refused."""

    vehicle: int
    number: int
    way: tuple[int, ...]
    cause: Cause


@dataclass(frozen=True, slots=True)
class Free:
    """A vehicle tells the monitors along `way` that it has decided: they keep its segments no longer.

    Monitors before index `begins` only pass the message on. `went` is whether the vehicle has made its move,
    `number` the number of the move, `at` the index in `way` of the monitor that receives the message next.
    """

    vehicle: int
    number: int
    way: tuple[int, ...]
    begins: int = 0
    went: bool = False
    at: int = 0

    @property
    def place(self) -> int:
        """The segment whose monitor receives the message next."""
        return self.way[self.at]


@dataclass(frozen=True, slots=True)
class Whose:
    """A monitor asks a vehicle that may have entered or left its segment whether it has."""

    vehicle: int
    number: int
    place: int


ToMonitor = Look | Free | Goes | Moved | Left
Word = ToMonitor | Seen | Busy | Whose | Room


@dataclass(frozen=True, slots=True)
class Mark:
    """A note that a vehicle has read a segment and decides; the monitor keeps it until `ends_s` [s]."""

    vehicle: int
    number: int
    ends_s: float


@dataclass(frozen=True, slots=True)
class Monitor:
    """The monitor of one shared segment: the vehicle in it, and the vehicles that have read it.

    Attributes
    ----------
    place
        Number of the segment.
    lease_s
        Time for which the monitor keeps a segment unchanged for a vehicle that has read it [s].
    stand
        The vehicle in the segment, or the vehicle that may enter.
    coming
        Whether that vehicle has not yet said that it has entered.
    leaving
        Number of the move by which that vehicle may have left; 0 if it has not asked to leave.
    rears
        Vehicles whose front has left but not their rear, with the numbers of their moves.
    marks
        Vehicles that have read the segment and may still decide.
    gone
        Vehicles that have left, each with its last number; the monitor ignores older messages of theirs.

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
    """Return the monitor after a message at time `now_s` of its clock [s], and its messages in answer."""
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
    """Do what a question asks of the segment, and pass it on; or refuse it."""
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
    """Return why a vehicle cannot have the segment as it asks, or None."""
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
    """Return a monitor that keeps nothing for a vehicle under this number any more."""
    vehicle, number = free.vehicle, free.number
    after, stand = _unmarked(monitor, vehicle, number), monitor.stand
    if stand is not None and stand.vehicle == vehicle and not free.went:
        if after.coming and stand.number == number:
            after = replace(after, stand=None, coming=False)
        elif after.leaving == number:
            after = replace(after, leaving=0)
    return _settled(after, vehicle, number)


def _unmarked(monitor: Monitor, vehicle: int, number: int) -> Monitor:
    """Return a monitor without the mark of a vehicle."""
    marks = tuple(one for one in monitor.marks if one.vehicle != vehicle or one.number > number)
    return replace(monitor, marks=marks)


def _settled(monitor: Monitor, vehicle: int, number: int) -> Monitor:
    """Return a monitor in which a vehicle's requests up to this number are void."""
    last = max([number, *(old for one, old in monitor.gone if one == vehicle)])
    return replace(monitor, gone=(*(one for one in monitor.gone if one[0] != vehicle), (vehicle, last)))
