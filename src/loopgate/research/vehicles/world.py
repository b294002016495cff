"""Vehicles, posts and messages under way as one state, with all possible next events.

Any message in flight may come next, or be lost; any post may lose patience; whoever is first in line may ask,
and ask again. So messages overtake one another, and are as late as can be.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

from loopgate.vehicles import post as posts
from loopgate.vehicles import vehicle as cars
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
    ToPost,
)
from loopgate.vehicles.post import Entry, Post
from loopgate.vehicles.vehicle import AskingVehicle, Told

Receive = Callable[[Post, ToPost], posts.Answer]


@dataclass(frozen=True, slots=True)
class World:
    """A state of all.

    Attributes
    ----------
    posts, vehicles
        By number.
    ground
        Who really stands in line in each place, first in line first: no post and no vehicle sees this.
    flight
        Messages that are under way; the same one only once.
    """

    posts: tuple[Post, ...]
    vehicles: tuple[AskingVehicle, ...]
    ground: tuple[tuple[int, ...], ...]
    flight: frozenset[Message] = frozenset()


@dataclass(frozen=True, slots=True)
class Step:
    """Something that can happen.

    `what` names it; the same name for the same thing in other states. `sure` is whether it happens sooner or
    later where messages get through. `goes` is the vehicle that goes on by it.
    """

    what: tuple[object, ...]
    after: World
    sure: bool = True
    goes: int | None = None


def begin(
    loops: Sequence[Sequence[int]], slots: Sequence[int], lines: Sequence[Sequence[tuple[int, int]]]
) -> World:
    """Return a start: for each place the loops of the vehicles in line, with their positions."""
    vehicles: list[AskingVehicle] = []
    ground, books = [], []
    for place, line in enumerate(lines):
        entries, here = [], []
        for loop, at in line:
            car = AskingVehicle(len(vehicles), tuple(loops[loop]), at)
            entries.append(Entry(car.id, 0, car.wanted))
            here.append(car.id)
            vehicles.append(car)
        books.append(Post(place, slots[place], tuple(entries)))
        ground.append(tuple(here))
    return World(tuple(books), tuple(vehicles), tuple(ground))


def circle(world: World) -> list[int]:
    """Return a circle of full places that wait for each other; empty if there is none."""
    for begins, line in enumerate(world.ground):
        place, seen = begins, list[int]()
        while len(world.ground[place]) >= world.posts[place].slots and place not in seen:
            seen.append(place)
            place = world.vehicles[world.ground[place][0]].wanted
        if line and place in seen:
            return seen[seen.index(place) :]
    return []


def overfull(world: World) -> list[int]:
    """Return the places with more vehicles than slots; rears still inside count."""
    there = [len(line) for line in world.ground]
    for car in world.vehicles:
        for place, _ in car.rears:
            there[place] += 1
    return [p for p, number in enumerate(there) if number > world.posts[p].slots]


def misled(world: World) -> list[int]:
    """Return the places whose posts have a wrong line of vehicles."""
    found = []
    for post, line in zip(world.posts, world.ground, strict=True):
        last = {e.vehicle: e for e in post.line if _is_inside(world.vehicles[e.vehicle], e)}
        if [e.vehicle for e in post.line if last.get(e.vehicle) is e and e.vehicle in line] != list(line):
            found.append(post.place)
    return found


def _is_inside(car: AskingVehicle, entry: Entry) -> bool:
    """Return whether an entry may be that under which a vehicle is in its place."""
    return entry.number == car.inside or (car.inside == car.forgot and entry.number <= car.forgot)


def steps(world: World, receive: Receive = posts.receive, *, seen: bool = False) -> Iterator[Step]:
    """Yield all that can happen next.

    Parameters
    ----------
    receive
        What posts do with messages.
    seen
        Whether posts see at once who goes, with nothing of it left behind; else vehicles say so, and rears
        leave later.
    """
    for message in world.flight:
        rest = replace(world, flight=world.flight - {message})
        name = _name(message)
        yield Step(("lost", *name), tidy(rest), sure=False)
        yield from _come(rest, message, name, receive, seen=seen)
    for car in world.vehicles:
        wish = cars.ask(car, (0, car.id))
        if world.ground[car.place][0] == car.id and wish not in world.flight:
            yield Step(("ask", car.id), tidy(_said(world, [wish])))
        if car.rears:
            yield Step(("rear", car.id), tidy(_rear(world, car)))
        more = [one for one in cars.repeat(car) if one not in world.flight]
        if more:
            yield Step(("repeat", car.id), tidy(_said(world, more)))
    for post in world.posts:
        if post.kept is not None:
            after, out = posts.expire(post)
            dead = post.kept.entry is not None and not any(
                isinstance(m, Probe | Clear | Changed)
                and m.number == post.kept.probe
                and _origin(m) == post.place
                for m in world.flight
            )
            yield Step(("late", post.place), tidy(_said(_with_post(world, after), out)), sure=dead)


def _come(
    world: World, message: Message, name: tuple[object, ...], receive: Receive, *, seen: bool
) -> Iterator[Step]:
    """Yield what can become of a message that comes."""
    if isinstance(message, Ask | Goes | Moved | Left | Here | Probe | Clear | Changed):
        after, out = receive(world.posts[message.place], message)
        yield Step(("comes", *name), tidy(_said(_with_post(world, after), out)))
        return
    car = world.vehicles[message.vehicle]
    if isinstance(message, Room):
        yield Step(("comes", *name), tidy(_with_car(world, cars.heard(car, message))))
    elif isinstance(message, Grant):
        going = cars.awaits(car, message)
        after_car, out = cars.granted(car, message)
        there = _said(_with_car(world, after_car), out)
        if going:
            ground = list(there.ground)
            ground[car.place] = ground[car.place][1:]
            ground[message.place] = (*ground[message.place], car.id)
            there = replace(there, ground=tuple(ground))
            if seen:
                there = _see(
                    replace(there, flight=there.flight.difference(out)), car, grant=message, receive=receive
                )
        yield Step(("comes", *name), tidy(there), goes=car.id if going else None)
        if going and not seen:
            back, out = cars.give_back(car, message)
            yield Step(("given back", *name), tidy(_said(_with_car(world, back), out)), sure=False)


def _see(world: World, car: AskingVehicle, *, grant: Grant, receive: Receive) -> World:
    """Let both posts know that a vehicle has gone, as it was before."""
    world = _with_car(world, replace(world.vehicles[car.id], rears=()))
    for message in (Left(car.place, car.id, car.inside), Goes(grant.place, car.id, grant.number)):
        after, out = receive(world.posts[message.place], message)
        world = _said(_with_post(world, after), out)
    return world


def _name(message: Message) -> tuple[object, ...]:
    to = (
        message.place
        if isinstance(message, Ask | Goes | Moved | Left | Here | Probe | Clear | Changed)
        else -1
    )
    return type(message).__name__, to, getattr(message, "vehicle", _origin(message))


def _origin(message: Message) -> int:
    return message.origin if isinstance(message, Probe) else getattr(message, "place", -1)


def _rear(world: World, car: AskingVehicle) -> World:
    after, out = cars.rear_out(car)
    return _said(_with_car(world, after), out)


def _said(world: World, out: Sequence[Message]) -> World:
    """Send messages, but for those that change nothing where they come: vehicles ask again anyway."""
    sent = frozenset(
        m
        for m in out
        if not isinstance(m, Refuse | Offer)
        and not (isinstance(m, Room) and (m.place, m.number) not in world.vehicles[m.vehicle].untold)
    )
    return replace(world, flight=world.flight | sent) if sent else world


def _with_post(world: World, post: Post) -> World:
    return replace(world, posts=(*world.posts[: post.place], post, *world.posts[post.place + 1 :]))


def _with_car(world: World, car: AskingVehicle) -> World:
    return replace(world, vehicles=(*world.vehicles[: car.id], car, *world.vehicles[car.id + 1 :]))


_NUMBERED: Final = (Ask, Grant, Refuse, Goes, Moved, Left, Here, Room)


def tidy(world: World) -> World:
    """Return the same with numbers as small as can be: only which is equal and which is older matters.

    Numbers of vehicles count down from the last one that was used; probes of a post that are under way count
    up from one. What is gone is forgotten where nothing of before is under way.
    """
    numbers = _Numbers(world)
    return world if numbers.are_small else numbers.small()


class _Numbers:
    """The numbers in a state, and smaller ones in their place."""

    def __init__(self, world: World) -> None:
        self.world = world
        used = [{car.inside, *(n for _, n in (*car.rears, *car.untold))} for car in world.vehicles]
        probes: list[set[int]] = [set() for _ in world.posts]
        for message in world.flight:
            if isinstance(message, _NUMBERED):
                used[message.vehicle].add(message.number)
            elif isinstance(message, Probe | Clear | Changed):
                probes[_origin(message)].add(message.number)
        self._gone = [self._recalled(post) for post in world.posts]
        for post, gone in zip(world.posts, self._gone, strict=True):
            for vehicle, number in (*((e.vehicle, e.number) for e in post.line), *post.rears, *gone):
                used[vehicle].add(number)
            if post.waiting is not None:
                used[post.waiting.vehicle].add(post.waiting.number)
            if post.kept is not None and post.kept.entry is not None:
                used[post.kept.vehicle].add(post.kept.entry.number)
                probes[post.place].add(post.kept.probe)
        self._smaller = [
            _counted_down(car.number, some) for car, some in zip(world.vehicles, used, strict=True)
        ]
        self._rank = [{n: k for k, n in enumerate(sorted(some), 1)} for some in probes]

    def _recalled(self, post: Post) -> tuple[Told, ...]:
        asks = [m for m in self.world.flight if isinstance(m, Ask) and m.place == post.place]
        asks += [post.waiting] if post.waiting is not None else []
        return tuple(
            sorted((v, n) for v, n in post.gone if any(m.vehicle == v and m.number <= n for m in asks))
        )

    @property
    def are_small(self) -> bool:
        """Whether all numbers are already as low as possible."""
        if any(old != new for one in (*self._smaller, *self._rank) for old, new in one.items()):
            return False
        rest = zip(self.world.posts, self._rank, self._gone, strict=True)
        return all(post.probes == len(rank) and post.gone == gone for post, rank, gone in rest)

    def small(self) -> World:
        """Return the state with the smaller ones."""
        world, smaller = self.world, self._smaller
        return World(
            tuple(map(self._post, world.posts)),
            tuple(
                replace(
                    car,
                    number=0,
                    inside=smaller[car.id][car.inside],
                    rears=tuple((place, smaller[car.id][n]) for place, n in car.rears),
                    untold=tuple((place, smaller[car.id][n]) for place, n in car.untold),
                )
                for car in world.vehicles
            ),
            world.ground,
            frozenset(map(self._message, world.flight)),
        )

    def _post(self, post: Post) -> Post:
        kept = post.kept
        if kept is not None:
            entry = kept.entry and self._entry(kept.entry)
            kept = replace(kept, probe=self._rank[post.place][kept.probe] if entry else 0, entry=entry)
        return replace(
            post,
            line=tuple(map(self._entry, post.line)),
            rears=tuple(sorted((v, self._smaller[v][n]) for v, n in post.rears)),
            gone=tuple((v, self._smaller[v][n]) for v, n in self._gone[post.place]),
            kept=kept,
            waiting=post.waiting and self._ask(post.waiting),
            probes=len(self._rank[post.place]),
        )

    def _entry(self, entry: Entry) -> Entry:
        return Entry(entry.vehicle, self._smaller[entry.vehicle][entry.number], entry.then)

    def _ask(self, ask: Ask) -> Ask:
        return replace(ask, number=self._smaller[ask.vehicle][ask.number])

    def _message(self, message: Message) -> Message:
        if isinstance(message, _NUMBERED):
            return replace(message, number=self._smaller[message.vehicle][message.number])
        if isinstance(message, Probe | Clear | Changed):
            return replace(message, number=self._rank[_origin(message)][message.number])
        return message


def _counted_down(last: int, numbers: set[int]) -> dict[int, int]:
    """Return smaller numbers for those that are used; the last one is 0."""
    past = sorted((n for n in numbers if n < last), reverse=True)
    return {n: -k for k, n in enumerate(past, 1)} | {last: 0, last + 1: 1}
