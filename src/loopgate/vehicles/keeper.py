"""The keeper of a crossing: it leases ways over the crossing to vehicles, by pure functions on messages.

The keeper is joined by wire to the posts of the places that begin at its crossing. So a vehicle asks for slot
and crossing in one message. A lease ends when the vehicle says that it goes, when it returns the grant, or
when the time is over. By then other vehicles see the vehicle, or it does not set out. See docs/vehicles.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from loopgate.vehicles import post as posts
from loopgate.vehicles.messages import (
    Ask,
    Goes,
    Grant,
    Here,
    Left,
    Message,
    Moved,
    Refuse,
    Room,
    ToPost,
    Why,
)
from loopgate.vehicles.post import Post

__all__ = ["Claim", "Keeper", "Lease", "Way", "expire", "lapse", "receive"]

Way = tuple[int, int]
"""A way over a crossing: the place before it, and the place after it."""

PATIENCE_S, FORGETS_S = 30.0, 5.0
"""A refused vehicle that has waited `PATIENCE_S` keeps its way and the last slot from younger requests, until
it has not asked for `FORGETS_S` [s]."""

SEEN_S = 1.0
"""Other vehicles see a vehicle go within this time of its start [s]."""

VOID_S = -1.0
"""End of a grant without a lease: before all times [s]."""


@dataclass(frozen=True, slots=True)
class Lease:
    """The right of a vehicle to set out on one way over the crossing, for a limited time."""

    vehicle: int
    number: int
    way: Way
    until_s: float
    ends_s: float


@dataclass(frozen=True, slots=True)
class Claim:
    """The last request of a vehicle for a way over the crossing, and its time of arrival [s].

    `lacks_way`: whether only the way over the crossing was missing. `waits`: whether the keeper reserves
    something for the vehicle. `held`: whether the request gets no answer until a lease ends.
    """

    ask: Ask
    heard_s: float
    lacks_way: bool = False
    waits: bool = False
    held: bool = False

    @property
    def way(self) -> Way:
        """The way over the crossing that the vehicle requests."""
        return self.ask.here, self.ask.place


@dataclass(frozen=True, slots=True)
class Keeper:
    """The keeper of one crossing: which ways conflict, and which vehicle has a lease of which way.

    Attributes
    ----------
    conflicts
        Pairs of conflicting ways, in both orders.
    lease_s
        Duration of a lease [s]; longer than an answer takes.
    leases
        Leases that have not ended.
    claims
        The last request of each vehicle that has asked and has not gone.

    Examples
    --------
    >>> from loopgate.vehicles.messages import Ask
    >>> keeper = Keeper(frozenset({((3, 7), (4, 8)), ((4, 8), (3, 7))}), lease_s=2.0)
    >>> keeper, post, out = receive(keeper, Post(7, 2), Ask(7, 1, 1, 3, 9, (0, 1), sent_s=10.0), 50.0)
    >>> out
    [Grant(vehicle=1, number=1, place=7, until_s=12.0, there=1)]
    >>> receive(keeper, Post(8, 2), Ask(8, 2, 1, 4, 9, (0, 2), sent_s=11.0), 51.0)[2]
    []
    """

    conflicts: frozenset[tuple[Way, Way]]
    lease_s: float
    leases: tuple[Lease, ...] = ()
    claims: tuple[Claim, ...] = ()


Answer = tuple[Keeper, Post, list[Message]]


def receive(keeper: Keeper, post: Post, message: ToPost, now_s: float) -> Answer:
    """Return the keeper and a post after a message to the post, and their messages in answer.

    Parameters
    ----------
    post
        The post that receives the message; its place begins at the crossing.
    now_s
        Time by the keeper's clock [s], which runs as fast as the vehicles' clocks.
    """
    keeper, again = _ended(keeper, message, now_s)
    if not isinstance(message, Ask):
        keeper, post, out = _listened(keeper, post, message, now_s)
        return keeper, post, [*out, *again]
    keeper, post, out = _asked(keeper, post, message, now_s)
    return keeper, post, [*out, *again]


def _asked(keeper: Keeper, post: Post, message: Ask, now_s: float) -> Answer:
    """Answer a vehicle that wants over the crossing, or let its request wait for the end of a lease."""
    held = any(e.vehicle == message.vehicle and e.number == message.number for e in post.line)
    if not held and _is_past(post, message):
        return _listened(keeper, post, message, now_s)
    keeper = _claimed(keeper, message, now_s)
    if message.free and _conflict(keeper, message.vehicle, (message.here, message.place)):
        return _marked(keeper, message.vehicle, lacks_way=True, waits=True, held=True), post, []
    why = _refuses(keeper, post, message, now_s, held=held)
    if why is None:
        return _listened(keeper, post, message, now_s)
    said: list[Message] = [Refuse(message.vehicle, message.number, message.place, why)]
    return _noted(keeper, said), post, said


def expire(keeper: Keeper, post: Post) -> Answer:
    """Return keeper and post when the time is over for the answer to a probe, or to take an offered slot."""
    after, out = posts.expire(post)
    return _noted(keeper, out), after, out


def lapse(keeper: Keeper, ends: Callable[[Lease], bool]) -> Keeper:
    """Return the keeper without the leases for which `ends` is true."""
    return replace(keeper, leases=tuple(one for one in keeper.leases if not ends(one)))


def _ended(keeper: Keeper, message: ToPost, now_s: float) -> tuple[Keeper, list[Ask]]:
    """Return the keeper without the leases and claims that a message, or time, ends; and waiting requests.

    These requests waited for the ended leases, oldest first. A request that waited for a vehicle which now
    goes is left out: its vehicle sees that and asks again.
    """
    vehicle, number = -1, -1
    if isinstance(message, Goes | Moved | Left | Here):
        vehicle, number = message.vehicle, message.number
    place = message.place

    def ends(one: Lease) -> bool:
        of_it = one.vehicle == vehicle and one.way[1] == place and one.number <= number
        return of_it or one.ends_s < now_s

    def is_old(claim: Claim) -> bool:
        one = claim.ask
        of_it = one.vehicle == vehicle and one.place == place and one.number <= number
        return of_it or claim.heard_s + max(FORGETS_S, keeper.lease_s) < now_s

    if not any(map(ends, keeper.leases)) and not any(map(is_old, keeper.claims)):
        return keeper, []
    left = lapse(keeper, ends)
    claims = tuple(one for one in keeper.claims if not is_old(one))
    held = [] if left.leases == keeper.leases else [one for one in claims if one.held]
    if held:
        claims = tuple(replace(one, held=False) for one in claims)
    goes = [one.way for one in keeper.leases if isinstance(message, Goes) and ends(one)]
    return replace(left, claims=claims), _again(keeper, held, goes)


def _again(keeper: Keeper, held: Sequence[Claim], goes: Sequence[Way]) -> list[Ask]:
    """Return the waiting requests, oldest first, without those in conflict with a way that is used."""
    asks = [one.ask for one in held if not any((one.way, way) in keeper.conflicts for way in goes)]
    return sorted(asks, key=lambda ask: ask.stamp)


def _is_past(post: Post, ask: Ask) -> bool:
    """Return whether the post already lists a vehicle under the request's number or a later one."""
    numbers = [e.number for e in post.line if e.vehicle == ask.vehicle]
    numbers += [number for vehicle, number in (*post.rears, *post.gone) if vehicle == ask.vehicle]
    return bool(numbers) and max(numbers) >= ask.number


def _claimed(keeper: Keeper, ask: Ask, now_s: float) -> Keeper:
    """Return the keeper with a vehicle's new request in place of its old one."""
    before = next((one for one in keeper.claims if one.ask.vehicle == ask.vehicle), None)
    if before is not None and (before.ask.number, before.ask.sent_s) > (ask.number, ask.sent_s):
        return keeper
    lacks, waits = (before.lacks_way, before.waits) if before is not None else (False, False)
    others = tuple(one for one in keeper.claims if one is not before)
    leases = tuple(one for one in keeper.leases if one.vehicle != ask.vehicle or one.number >= ask.number)
    return replace(keeper, leases=leases, claims=(*others, Claim(ask, now_s, lacks, waits)))


def _marked(keeper: Keeper, vehicle: int, *, lacks_way: bool, waits: bool, held: bool = False) -> Keeper:
    claims = tuple(
        replace(one, lacks_way=lacks_way, waits=waits, held=held) if one.ask.vehicle == vehicle else one
        for one in keeper.claims
    )
    return keeper if claims == keeper.claims else replace(keeper, claims=claims)


def _conflict(keeper: Keeper, vehicle: int, way: Way) -> bool:
    """Return whether another vehicle has a lease of a conflicting way."""
    return any(one.vehicle != vehicle and (one.way, way) in keeper.conflicts for one in keeper.leases)


def _refuses(keeper: Keeper, post: Post, ask: Ask, now_s: float, *, held: bool) -> Why | None:
    """Return why a request is refused before the post is asked, or None."""
    way = ask.here, ask.place
    if not ask.free:
        return Why.CROSSING
    if any((one.vehicle, one.number) == (ask.vehicle, ask.number) for one in keeper.leases):
        return None  # its grant was lost
    free = post.slots - len(post.line) - len(post.rears) - (post.kept is not None)
    for one in keeper.claims:
        late = one.waits and one.ask.stamp < ask.stamp and now_s - one.ask.stamp[0] >= PATIENCE_S
        if not late or one.heard_s + FORGETS_S < now_s or one.ask.vehicle == ask.vehicle:
            continue
        if one.lacks_way and (one.way, way) in keeper.conflicts:
            return Why.CROSSING
        if free == 1 and one.ask.place == ask.place and not held:
            return Why.FULL
    return None


def _listened(keeper: Keeper, post: Post, message: ToPost, now_s: float) -> Answer:
    """Give the post a message; refuse requests that waited there and whose way is taken by now."""
    said: list[Message] = []
    while True:
        after, out = posts.receive(post, message)
        new = next((e for e in after.line if e not in post.line), None)
        if new is None or not _conflict(keeper, new.vehicle, _way(keeper, new.vehicle, after.place)):
            break
        post = _without(post, new.vehicle)
        said.append(Refuse(new.vehicle, new.number, post.place, Why.CROSSING))
    said += out
    keeper = _noted(keeper, said)
    for n, one in enumerate(said):
        if isinstance(one, Grant):
            asks = isinstance(message, Ask) and message.vehicle == one.vehicle
            fresh = asks or (new is not None and new.vehicle == one.vehicle)
            keeper, until_s = _lease(keeper, one, now_s, fresh=fresh)
            said[n] = replace(one, until_s=until_s, there=len(after.line) + len(after.rears))
        elif isinstance(one, Room):
            said[n] = replace(one, there=len(after.line) + len(after.rears))
    return keeper, after, said


def _noted(keeper: Keeper, out: Sequence[Message]) -> Keeper:
    """Return the keeper after it has stored why vehicles are refused."""
    for one in out:
        if isinstance(one, Refuse):
            waits = one.why in (Why.CROSSING, Why.FULL, Why.BUSY)
            keeper = _marked(keeper, one.vehicle, lacks_way=one.why is Why.CROSSING, waits=waits)
    return keeper


def _way(keeper: Keeper, vehicle: int, place: int) -> Way:
    claim = next((one for one in keeper.claims if one.ask.vehicle == vehicle), None)
    return claim.way if claim is not None and claim.ask.place == place else (-1, place)


def _without(post: Post, vehicle: int) -> Post:
    """Return a post that neither keeps a slot for a vehicle nor lets its request wait."""
    kept = None if post.kept is not None and post.kept.vehicle == vehicle else post.kept
    waiting = None if post.waiting is not None and post.waiting.vehicle == vehicle else post.waiting
    return replace(post, kept=kept, waiting=waiting)


def _lease(keeper: Keeper, grant: Grant, now_s: float, *, fresh: bool) -> tuple[Keeper, float]:
    """Return the keeper with the lease of a grant, and when the lease ends by the vehicle's clock [s].

    A repeated grant, which only asks whether it is used, makes no new lease.
    """
    mine = grant.vehicle, grant.number
    old = next((one for one in keeper.leases if (one.vehicle, one.number) == mine), None)
    claim = next((one for one in keeper.claims if (one.ask.vehicle, one.ask.number) == mine), None)
    if claim is None or not fresh:
        return keeper, old.until_s if old is not None else VOID_S
    until_s = claim.ask.sent_s + keeper.lease_s
    made = Lease(*mine, claim.way, until_s, now_s + keeper.lease_s + SEEN_S)
    leases = tuple(one for one in keeper.leases if one is not old)
    return replace(keeper, leases=(*leases, made)), until_s
