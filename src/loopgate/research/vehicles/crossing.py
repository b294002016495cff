"""A model of one crossing with its keeper, explored in every order of messages, losses and time.

Each vehicle goes over the crossing on a way of its own, some times; places have room. A vehicle that goes
*sets out*, and is *seen* a little later: then it says so. Who sees a vehicle in its way does not go. So the
lease alone keeps two from setting out at the same time.

Time is untold: a vehicle's clock runs past all that it has asked for at any moment, and a lease ends some
time after that, but not before its vehicle is seen if it has set out.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

from loopgate.research.vehicles.exploring import Next, search
from loopgate.vehicles import keeper as keepers
from loopgate.vehicles import vehicle as cars
from loopgate.vehicles.keeper import Keeper, Lease
from loopgate.vehicles.messages import Ask, Goes, Grant, Here, Left, Message, Moved, Refuse, Room, ToPost
from loopgate.vehicles.post import Post
from loopgate.vehicles.vehicle import AskingVehicle

__all__ = ["CrossingModel", "FoundAtCrossing", "begin", "explore", "unsafe"]

WAITS, SETS_OUT, SEEN, DONE = "waits", "sets out", "seen", "done"
_NOW, _PAST = 0.0, keepers.VOID_S
_LONG_AGO_S = -1e6

Receive = Callable[[Keeper, Post, ToPost, float], keepers.Answer]


@dataclass(frozen=True, slots=True)
class CrossingModel:
    """A state of the model: keeper, posts, vehicles, and messages under way.

    Attributes
    ----------
    keeper, posts
        The keeper of the crossing, and the post of the place behind the crossing on each way.
    vehicles, where
        The knowledge of each vehicle, and its real position. The place before the crossing of vehicle n is 2
        n.
    laps
        Number of times that each vehicle has still to cross.
    flight
        Messages under way, without duplicates.
    """

    keeper: Keeper
    posts: tuple[Post, ...]
    vehicles: tuple[AskingVehicle, ...]
    where: tuple[str, ...]
    laps: tuple[int, ...]
    flight: frozenset[Message] = frozenset()
    gave_back: tuple[int, ...] = ()

    @property
    def gives_back(self) -> int:
        """The number of grants that were given back."""
        return sum(self.gave_back)


@dataclass(slots=True)
class FoundAtCrossing:
    """The result of an exploration: numbers of states, of unsafe states, and of dead ends."""

    states: int = 0
    complete: bool = True
    unsafe: int = 0
    stuck: int = 0
    most_leases: int = 0


def begin(conflicts: Sequence[tuple[int, int]], laps: Sequence[int]) -> CrossingModel:
    """Return a start state of the model: vehicles whose ways conflict by the given pairs, and their laps."""
    ways = [(2 * n, 2 * n + 1) for n in range(len(laps))]
    pairs = frozenset(p for a, b in conflicts for p in ((ways[a], ways[b]), (ways[b], ways[a])))
    return CrossingModel(
        Keeper(pairs, 0.0),
        tuple(Post(2 * n + 1, 4) for n in range(len(laps))),
        tuple(AskingVehicle(n, ways[n]) for n in range(len(laps))),
        (WAITS,) * len(laps),
        tuple(laps),
        gave_back=(0,) * len(laps),
    )


def unsafe(now: CrossingModel) -> bool:
    """Return whether two vehicles are on conflicting ways at the same time in a state of the model."""
    on = [n for n, where in enumerate(now.where) if where in (SETS_OUT, SEEN)]
    return any((_way(a), _way(b)) in now.keeper.conflicts for a in on for b in on)


def _way(number: int) -> tuple[int, int]:
    return 2 * number, 2 * number + 1


def _sees_free(now: CrossingModel, number: int) -> bool:
    """Return whether a vehicle sees nobody in its way: one that has only just set out is not seen."""
    return not any(
        where == SEEN and (_way(other), _way(number)) in now.keeper.conflicts
        for other, where in enumerate(now.where)
    )


def explore(
    start: CrossingModel,
    *,
    limit: int,
    most: int = 3,
    gives_back: int = 1,
    late: bool = False,
    receive: Receive = keepers.receive,
    in_time: Callable[[Grant, float], bool] = cars.in_time,
) -> FoundAtCrossing:
    """Visit all states of the model that can be reached from `start`.

    Parameters
    ----------
    limit
        Largest number of states to visit.
    most
        Largest number of messages under way at a time; states with more are left out.
    gives_back
        Largest number of returned grants; states with more are left out.
    late
        Whether all vehicles have waited so long that the keeper keeps their ways free from younger vehicles.
    receive, in_time
        Functions to test: the keeper's reaction to a message, and the vehicle's test whether a lease lasts.
    """
    found = FoundAtCrossing()

    def steps(here: CrossingModel) -> Iterator[Next[CrossingModel]]:
        for what, then, sure, goes in _steps(here, receive, in_time, late=late):
            yield what, _plain(then, late=late), sure, goes

    def judge(here: CrossingModel) -> None:
        found.unsafe += unsafe(here)
        found.most_leases = max(found.most_leases, len(here.keeper.leases))

    searched = search(
        start,
        limit=limit,
        steps=steps,
        judge=judge,
        leave_out=lambda after: len(after.flight) > most or after.gives_back > gives_back,
        done=_all_done,
    )
    found.states, found.complete, found.stuck = searched.states, searched.complete, searched.stuck
    return found


def _plain(now: CrossingModel, *, late: bool) -> CrossingModel:
    """Return the same without what changes nothing: how full places are, and in which order asks are kept.

    Unless vehicles have waited for long, nothing is kept for those who wait.
    """
    claims = tuple(
        sorted(
            (
                replace(one, lacks_way=False, waits=False)
                if not late and (one.lacks_way or one.waits)
                else one
                for one in now.keeper.claims
            ),
            key=lambda one: one.ask.vehicle,
        )
    )
    leases = tuple(sorted(now.keeper.leases, key=lambda one: (one.vehicle, one.number)))
    flight = frozenset(
        replace(m, there=0) if isinstance(m, Grant | Room) and m.there else m for m in now.flight
    )
    keeper = now.keeper
    if (claims, leases) != (keeper.claims, keeper.leases):
        keeper = replace(keeper, claims=claims, leases=leases)
    return replace(now, keeper=keeper, flight=flight)


def _all_done(now: CrossingModel) -> bool:
    return all(where == DONE for where in now.where)


def _steps(
    now: CrossingModel, receive: Receive, in_time: Callable[[Grant, float], bool], *, late: bool
) -> Iterator[Next[CrossingModel]]:
    for message in now.flight:
        rest = replace(now, flight=now.flight - {message})
        name = type(message).__name__, getattr(message, "place", -1), getattr(message, "vehicle", -1)
        yield ("lost", *name), rest, False, False
        after, goes = _come(rest, message, receive, in_time)
        yield ("comes", *name), after, True, goes
    for car in now.vehicles:
        yield from _of_vehicle(now, car, late=late)
    for lease in now.keeper.leases:
        if lease.until_s < _NOW and now.where[lease.vehicle] != SETS_OUT:
            yield ("ends", lease.vehicle), replace(now, keeper=_without(now.keeper, lease)), True, False


def _come(
    now: CrossingModel, message: Message, receive: Receive, in_time: Callable[[Grant, float], bool]
) -> tuple[CrossingModel, bool]:
    """Return what becomes of a message that comes, and whether somebody goes by it."""
    if isinstance(message, Grant):
        return _granted(now, message, in_time)
    if isinstance(message, Room):
        return _car(now, cars.heard(now.vehicles[message.vehicle], message)), False
    if isinstance(message, Ask | Goes | Moved | Left | Here):
        return _at_keeper(now, message, receive), False
    return now, False


def _of_vehicle(now: CrossingModel, car: AskingVehicle, *, late: bool) -> Iterator[Next[CrossingModel]]:
    """Yield what a vehicle can do, and that time goes by for it."""
    number, where = car.id, now.where[car.id]
    if where == WAITS:
        free = _sees_free(now, number)
        if free or late:
            asks = cars.ask(car, (_LONG_AGO_S if late else _NOW, number), _NOW, free=free)
            yield ("asks", number), _said(now, [asks]), True, False
    elif where == SETS_OUT:
        said: list[Message] = [Goes(car.place, number, car.inside)]
        yield ("seen", number), _said(_put(now, number, SEEN), said), True, False
    elif where == SEEN:
        yield ("off", number), _off(now, number), True, False
    if where != SETS_OUT and (aged := _aged(now, number)) != now:
        yield ("time", number), aged, where != WAITS, False  # who waits has its answer in time, one day
    more = [one for one in cars.repeat(car) if one not in now.flight]
    if more:
        yield ("repeat", number), _said(now, more), True, False


def _without(keeper: Keeper, lease: Lease) -> Keeper:
    return keepers.lapse(keeper, lambda one: one == lease)


def _granted(
    now: CrossingModel, grant: Grant, in_time: Callable[[Grant, float], bool]
) -> tuple[CrossingModel, bool]:
    """Let a vehicle use a grant, give it back, or say what became of it."""
    number = grant.vehicle
    car = now.vehicles[number]
    if now.where[number] == SETS_OUT:
        return now, False  # it says so when it is seen
    if not cars.awaits(car, grant):
        after, out = cars.granted(car, grant)
        return _said(_car(now, after), out), False
    if now.where[number] == WAITS and in_time(grant, _NOW) and _sees_free(now, number):
        after, _ = cars.granted(car, grant)
        return _put(_car(now, after), number, SETS_OUT), True
    after, out = cars.give_back(car, grant)
    times = now.gave_back
    times = (*times[:number], times[number] + 1, *times[number + 1 :])
    return _said(_car(replace(now, gave_back=times), after), out), False


def _at_keeper(now: CrossingModel, message: ToPost, receive: Receive) -> CrossingModel:
    if message.place % 2 == 0:
        return now  # the place before the crossing has another keeper
    at = message.place // 2
    keeper, post, out = receive(now.keeper, now.posts[at], message, _NOW)
    posts = (*now.posts[:at], post, *now.posts[at + 1 :])
    return _said(replace(now, keeper=keeper, posts=posts), out)


def _aged(now: CrossingModel, number: int) -> CrossingModel:
    """Let time go by until all that a vehicle has asked for, and all that it is granted, is past.

    If it asks no longer, the keeper has forgotten that it did.
    """

    def aged(message: Message) -> Message:
        if isinstance(message, Ask) and message.vehicle == number:
            return replace(message, sent_s=_PAST)
        if isinstance(message, Grant) and message.vehicle == number:
            return replace(message, until_s=_PAST)
        return message

    keeper = now.keeper
    claims = tuple(
        replace(one, ask=replace(one.ask, sent_s=_PAST)) if one.ask.vehicle == number else one
        for one in keeper.claims
        if one.ask.vehicle != number or now.where[number] == WAITS
    )
    leases = tuple(replace(one, until_s=_PAST) if one.vehicle == number else one for one in keeper.leases)
    return replace(
        now,
        keeper=replace(keeper, claims=claims, leases=leases),
        flight=frozenset(map(aged, now.flight)),
    )


def _off(now: CrossingModel, number: int) -> CrossingModel:
    """Let a vehicle leave the crossing, and come back to it if it is to go again."""
    laps = (*now.laps[:number], now.laps[number] - 1, *now.laps[number + 1 :])
    car, at = now.vehicles[number], number
    car = replace(car, rears=(), untold=())
    after = _put(replace(now, laps=laps), number, WAITS if laps[number] else DONE)
    if not laps[number]:
        return _car(after, car)
    gone = Left(2 * number + 1, number, car.number)
    keeper, post, _ = keepers.receive(now.keeper, now.posts[at], gone, _NOW)
    posts = (*now.posts[:at], post, *now.posts[at + 1 :])
    back = replace(car, at=0, number=car.number + 1, inside=car.number + 1)
    return _car(replace(after, keeper=keeper, posts=posts), back)


def _put(now: CrossingModel, number: int, where: str) -> CrossingModel:
    return replace(now, where=(*now.where[:number], where, *now.where[number + 1 :]))


def _car(now: CrossingModel, car: AskingVehicle) -> CrossingModel:
    return replace(now, vehicles=(*now.vehicles[: car.id], car, *now.vehicles[car.id + 1 :]))


def _said(now: CrossingModel, out: Sequence[Message]) -> CrossingModel:
    """Send messages, but for those that change nothing where they come."""
    sent = frozenset(
        m
        for m in out
        if not isinstance(m, Refuse)
        and not (isinstance(m, Room) and (m.place, m.number) not in now.vehicles[m.vehicle].untold)
        and not (isinstance(m, Goes | Moved | Left) and m.place % 2 == 0)
    )
    return replace(now, flight=now.flight | sent) if sent else now
