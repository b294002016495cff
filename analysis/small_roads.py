"""Small roads with capacity as systems: rings, figure eights, grids of streets, roundabouts.

Places are FIFO states; several vehicles drive on each loop. They are what the `queues` abstraction makes of
roads, small enough to look at every configuration, and with places that hold one as well.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

from loopgate.errors import SystemModelError
from loopgate.model import Robot, RobotId, StateId, System


@dataclass(frozen=True, slots=True)
class Roads:
    """Closed loops over places where vehicles queue."""

    name: str
    """A description in a few words."""
    loops: Mapping[str, tuple[str, ...]]
    """The places of each loop, in driving order."""
    narrow: frozenset[str] = frozenset()
    """Places that are short: where capacities are mixed, they hold one."""

    @property
    def places(self) -> tuple[str, ...]:
        """The places, in order of first appearance."""
        return tuple(dict.fromkeys(place for loop in self.loops.values() for place in loop))


def ring(places: int) -> Roads:
    """One loop."""
    return Roads(f"ring of {places}", {"ring": tuple(f"p{k}" for k in range(places))})


def two_rings(places: int) -> Roads:
    """Two rings of so many places that share one, and a loop that drives through both."""
    left = tuple(f"l{k}" for k in range(1, places))
    right = tuple(f"r{k}" for k in range(1, places))
    loops = {"left": ("x", *left), "right": ("x", *right), "both": ("x", *left, "x", *right)}
    return Roads(f"two rings of {places}", loops, frozenset({"x"}))


def commuters(places: int) -> Roads:
    """Two rings of so many places that share none, and commuters from each to the other and back.

    Where each ring is one slot short of full, no commuter can change over without closing a ring.
    """
    left, right = tuple(f"l{k}" for k in range(places)), tuple(f"r{k}" for k in range(places))
    loops = {"left": left, "right": right, "commuter": (*left[:2], *right[:2])}
    return Roads(f"commuters, 2 x {places}", loops, frozenset({"l0", "r0"}))


def figure_eight(places: int) -> Roads:
    """Two loops round a figure eight, half a turn apart; its middle place is passed twice in a round."""
    left = tuple(f"l{k}" for k in range(1, places))
    right = tuple(f"r{k}" for k in range(1, places))
    loops = {"first": ("x", *left, "x", *right), "second": ("x", *right, "x", *left)}
    return Roads(f"figure eight of 2 x {places}", loops, frozenset({"x"}))


def one_way_grid() -> Roads:
    """Two streets across two, all one-way, their ends joined outside: at each junction two ways in, two out.

    The four inner places make a ring, so do the four outer ones, and at each of the four junctions a
    vehicle stays on its ring or changes over.
    """
    inner, outer = ("ab", "bc", "cd", "da"), ("an", "be", "cs", "dw")
    every = {
        "".join("io"[o] for o in turns): tuple((inner, outer)[o][k] for k, o in enumerate(turns))
        for turns in product((0, 1), repeat=4)
    }
    chosen = ("iiii", "ioio", "oioi", "ooii")
    return Roads("one-way grid 2x2", {name: every[name] for name in chosen}, frozenset(inner))


def two_way_grid() -> Roads:
    """Four junctions, two-way streets between: round either way, and there and back."""
    loops = {
        "clockwise": ("ab", "bc", "cd", "da"),
        "counter": ("ba", "ad", "dc", "cb"),
        "back1": ("ab", "bc", "cb", "ba"),
        "back2": ("cd", "da", "ad", "dc"),
    }
    return Roads("two-way grid 2x2", loops, frozenset({"bc", "cb", "da", "ad"}))


def roundabout(arms: int) -> Roads:
    """Ways into a ring of short places, and ways out of it which turn back at their ends.

    One loop per arm, to the opposite arm and back; ``r0`` lies behind way in 0 and before way out 1.
    """
    loops = {}
    for here in range(arms):
        there = (here + (arms + 1) // 2) % arms
        if f"{there}-{here}" in loops:
            there = (here + 1) % arms  # even: the opposite loop is there already, so a right turn
        loops[f"{here}-{there}"] = (*_across(arms, here, there), *_across(arms, there, here))
    return Roads(f"roundabout with {arms} arms", loops, frozenset(f"r{k}" for k in range(arms)))


def _across(arms: int, here: int, there: int) -> list[str]:
    steps = (there - here) % arms
    return [f"in{here}", *(f"r{(here + k) % arms}" for k in range(steps)), f"out{there}"]


def road_system(
    roads: Roads, vehicles: int, capacity: int | Callable[[str], int], *, seed: int | None = None
) -> System:
    """Put vehicles on the loops in turn.

    Raises `SystemModelError` if they find no place.

    Parameters
    ----------
    vehicles
        How many, over all loops.
    capacity
        Of every place, or by place.
    seed
        Draws the places where they start, full ones too. Without one each vehicle starts at the emptiest
        place of its loop, and in places that hold two or more a slot stays free.
    """
    room = {place: capacity if isinstance(capacity, int) else capacity(place) for place in roads.places}
    taken = dict.fromkeys(roads.places, 0)
    rng = None if seed is None else random.Random(seed)
    names = list(roads.loops)
    robots = []
    for number in range(vehicles):
        name = names[number % len(names)]
        path = roads.loops[name]
        spare = 1 if rng is None else 0
        free = [p for p, s in enumerate(path) if taken[s] < max(1, room[s] - spare)]
        if not free:
            msg = f"{roads.name}: vehicle {number + 1} of {vehicles} finds no place on loop {name}"
            raise SystemModelError(msg)
        start = rng.choice(free) if rng else min(free, key=lambda p: taken[path[p]] / room[path[p]])
        taken[path[start]] += 1
        robots.append(Robot(RobotId(f"{name}.{number // len(names) + 1}"), _states(path), start=start))
    used = {place for robot in robots for place in robot.path}
    return System(robots, {StateId(p): c for p, c in room.items() if p in used}, used)


def _states(path: Sequence[str]) -> tuple[StateId, ...]:
    return tuple(StateId(place) for place in path)
