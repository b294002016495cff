"""The post of a place: it counts the vehicles in the place and grants slots, by pure functions on messages.

It knows the slots of its place, the vehicles in line and the next place of each, and the vehicles whose rear
is still inside. It reserves the last slot for one vehicle at a time, until its probe, passed along the heads
of full places, has reached a place with a free slot. See docs/vehicles.md.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

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
    Stamp,
    ToPost,
    Why,
)


@dataclass(frozen=True, slots=True)
class Entry:
    """A vehicle in the line of a place: its number, and the place that it wants next."""

    vehicle: int
    number: int
    then: int


@dataclass(frozen=True, slots=True)
class Kept:
    """The last slot of a place, reserved for a vehicle in place `here`; no `entry` if it is only offered."""

    vehicle: int
    here: int
    stamp: Stamp
    probe: int
    entry: Entry | None


@dataclass(frozen=True, slots=True)
class Post:
    """The post of one place: the vehicles in line, the slots taken, and the slot reserved.

    Attributes
    ----------
    place, slots
        Number of the place, and number of its slots: at least two.
    line
        Vehicles with a grant that have not moved on, the first in line first.
    known
        Whether the last vehicle in line has said that it uses its grant.
    rears
        Vehicles that have moved on, and whose rear is still inside, with their numbers.
    kept
        The last slot, while it is reserved.
    waiting
        A request that waits until `known` is true.
    probes
        Number of probes sent.
    gone
        Vehicles that have left, each with its last number; older messages of theirs may still arrive.

    Examples
    --------
    >>> from loopgate.vehicles.messages import Ask
    >>> post = Post(7, 2)
    >>> post, out = receive(post, Ask(7, vehicle=1, number=1, here=3, then=8, stamp=(0, 1)))
    >>> out
    [Grant(vehicle=1, number=1, place=7, until_s=None, there=0)]
    """

    place: int
    slots: int
    line: tuple[Entry, ...] = ()
    known: bool = True
    rears: tuple[tuple[int, int], ...] = ()
    kept: Kept | None = None
    probes: int = 0
    gone: tuple[tuple[int, int], ...] = ()
    waiting: Ask | None = None

    @property
    def full(self) -> bool:
        """Whether no slot is free; a reserved slot counts as taken."""
        return len(self.line) + (self.kept is not None) >= self.slots

    @property
    def head(self) -> Entry | None:
        """The first vehicle in line."""
        return self.line[0] if self.line else None


Answer = tuple[Post, list[Message]]


def receive(post: Post, message: ToPost) -> Answer:
    """Return the post after a message, and its messages in answer."""
    answer: Answer = post, []
    match message:
        case Ask():
            answer = _asked(post, message)
        case Goes():
            if post.line and (post.line[-1].vehicle, post.line[-1].number) == (
                message.vehicle,
                message.number,
            ):
                answer = _then_asked((replace(post, known=True), []))
        case Moved():
            answer = _then_asked(_moved(post, message.vehicle, message.number))
        case Left():
            answer = _left(post, message)
        case Here():
            answer = _stands(post, message)
        case Probe():
            answer = _back(post, message) if message.origin == post.place else _passes(post, message)
        case Clear() if _awaits(post, message.number):
            answer = _let_in(post)
        case Changed() if _awaits(post, message.number):
            answer = _drop(post, Why.CHANGED)
        case _:
            pass
    return answer


def expire(post: Post) -> Answer:
    """Return the post when the time is over for the answer to its probe, or to take the slot it offered."""
    return _drop(post, Why.LATE)


def inquire(post: Post) -> list[Message]:
    """Return the grant again, for a vehicle that has not said whether it uses the grant."""
    if post.known or not post.line:
        return []
    return [Grant(post.line[-1].vehicle, post.line[-1].number, post.place)]


def _asked(post: Post, ask: Ask) -> Answer:
    """Answer a vehicle's request; a vehicle may repeat requests, and old ones may arrive late."""
    vehicle, kept, out = ask.vehicle, post.kept, list[Message]()
    numbers = [e.number for e in post.line if e.vehicle == vehicle]
    numbers += [number for v, number in (*post.rears, *post.gone) if v == vehicle]
    if kept is not None and kept.entry is not None and kept.vehicle == vehicle:
        numbers.append(kept.entry.number)
    if numbers and max(numbers) >= ask.number:
        last = post.line[-1] if post.line else None
        again = not post.known and last is not None and (last.vehicle, last.number) == (vehicle, ask.number)
        return post, (inquire(post) if again else [])
    if any(e.vehicle == vehicle for e in post.line):
        post, out = _moved(post, vehicle, ask.number - 1)
        if post.known and post.waiting is not None:
            busy = Refuse(post.waiting.vehicle, post.waiting.number, post.place, Why.BUSY)
            post, out = replace(post, waiting=None), [*out, busy]
    if not post.known:
        if post.waiting is None:
            return replace(post, waiting=ask), out
        if (post.waiting.vehicle, post.waiting.number) != (vehicle, ask.number):
            out = [*out, Refuse(vehicle, ask.number, post.place, Why.BUSY)]
        return post, [*out, *inquire(post)]
    after, more = _decided(post, ask)
    return after, [*out, *more]


def _decided(post: Post, ask: Ask) -> Answer:
    """Admit a vehicle, refuse it, or keep the last slot for it and send a probe."""
    vehicle, kept = ask.vehicle, post.kept
    entry = Entry(vehicle, ask.number, ask.then)
    if kept is not None and kept.entry is None and (kept.vehicle, kept.here) == (vehicle, ask.here):
        return _let_in(replace(post, kept=replace(kept, entry=entry)))
    taken = len(post.line) + (kept is not None)
    if taken + len(post.rears) >= post.slots:
        return post, [Refuse(vehicle, ask.number, post.place, Why.FULL)]
    held = Kept(vehicle, ask.here, ask.stamp, post.probes + 1, entry)
    head = post.head
    if taken + 1 < post.slots or head is None or head.then == ask.here:
        return _let_in(replace(post, kept=held))
    after = replace(post, kept=held, probes=post.probes + 1)
    return after, [
        Probe(head.then, post.place, after.probes, ask.stamp, ask.here, (post.place,), head.vehicle)
    ]


def _then_asked(before: Answer) -> Answer:
    """Answer the waiting request, if there is one and it can be answered now."""
    post, out = before
    if post.waiting is None or not post.known:
        return before
    after, more = _asked(replace(post, waiting=None), post.waiting)
    return after, [*out, *more]


def _let_in(post: Post) -> Answer:
    """Admit the vehicle for which the slot is kept."""
    kept = post.kept
    if kept is None or kept.entry is None:
        return post, []
    after = replace(post, line=(*post.line, kept.entry), known=False, kept=None)
    return after, [Grant(kept.vehicle, kept.entry.number, post.place)]


def _drop(post: Post, why: Why) -> Answer:
    """Stop keeping the slot."""
    kept = post.kept
    if kept is None:
        return post, []
    said: list[Message] = []
    if kept.entry is not None:
        said = [Refuse(kept.vehicle, kept.entry.number, post.place, why)]
    return replace(post, kept=None), said


def _moved(post: Post, vehicle: int, number: int) -> Answer:
    """Take a vehicle out of line. A kept slot is then no longer the last, so it need not be kept."""
    gone = tuple(e for e in post.line if e.vehicle == vehicle and e.number <= number)
    if not gone:
        return post, []
    last_goes = post.line[-1] in gone
    after = replace(
        post,
        line=tuple(e for e in post.line if e not in gone),
        known=post.known or last_goes,
        rears=(*post.rears, *((vehicle, e.number) for e in gone)),
    )
    if after.kept is None:
        return after, []
    if after.kept.entry is None or not after.known:
        return _drop(after, Why.CHANGED)
    return _let_in(after)


def _left(post: Post, left: Left) -> Answer:
    """Record that a vehicle has left with its rear, and acknowledge it."""
    kept = post.kept
    if kept is not None and kept.vehicle == left.vehicle and kept.entry and kept.entry.number <= left.number:
        post = replace(post, kept=None)  # it has forgotten that it asked
    after, out = _moved(post, left.vehicle, left.number)
    rears = tuple(r for r in after.rears if r[0] != left.vehicle or r[1] > left.number)
    last = max([left.number, *(number for vehicle, number in post.gone if vehicle == left.vehicle)])
    gone = (*(one for one in post.gone if one[0] != left.vehicle), (left.vehicle, last))
    heard = Room(left.vehicle, left.number, post.place)
    return _then_asked((replace(after, rears=rears, gone=gone), [*out, heard]))


def _stands(post: Post, here: Here) -> Answer:
    """Remove entries of a vehicle that are older than the entry under which it stands here; acknowledge.

    If the vehicle has gone on since, under that entry or a later one, no older entry is left.
    """
    mine = [e.number for e in post.line if e.vehicle == here.vehicle and e.number <= here.number]
    after, out = post, list[Message]()
    if mine:
        last = max(mine)
        after, out = _moved(post, here.vehicle, last - 1)
        rears = tuple(r for r in after.rears if r[0] != here.vehicle or r[1] >= last)
        after = replace(after, rears=rears)
    heard = Room(here.vehicle, here.number, post.place)
    return _then_asked((after, [*out, heard]))


def _awaits(post: Post, number: int) -> bool:
    """Return whether the last slot is kept until this probe is answered."""
    return post.kept is not None and post.kept.entry is not None and post.kept.probe == number


def _passes(post: Post, probe: Probe) -> Answer:
    """Pass on a probe that arrives, or answer that it ends here."""
    out: list[Message] = []
    clear = Clear(probe.origin, probe.number, (*probe.path, post.place))
    if post.place == probe.here:  # the asking vehicle goes from here, even if another is first in line
        return post, [clear]
    if post.full and post.kept is not None and post.kept.stamp > probe.stamp:
        post, out = _drop(post, Why.OLDER)
    head = post.head
    if not post.full or head is None:
        return post, [*out, clear]
    if post.place in probe.path:
        return post, [Changed(probe.origin, probe.number, probe.path)]
    path = (*probe.path, post.place)
    return post, [replace(probe, place=head.then, path=path, head=head.vehicle)]


def _back(post: Post, probe: Probe) -> Answer:
    """Refuse a request whose probe has returned.

    The vehicle that brought the probe wants the kept slot, and may have it.
    """
    if not _awaits(post, probe.number):
        return post, []
    after, out = _drop(post, Why.CIRCLE)
    offered = Kept(probe.head, probe.path[-1], probe.stamp, probe.number, None)
    return replace(after, kept=offered), [*out, Offer(probe.head, post.place)]
