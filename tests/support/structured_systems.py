"""Systems with deep deadlocks, since random ones rarely hold any: families, and a search uphill."""

from __future__ import annotations

import random

from loopgate.errors import SystemModelError
from loopgate.gates.deadlocks import deadlocked_robots
from loopgate.model import Configuration, Robot, RobotId, StateId, System
from loopgate.research.theory.homing import Homing
from loopgate.research.theory.random_systems import Shape, random_system

_REACHED = 3_000
"""Configurations looked at in search of deep deadlocks."""


def from_home(system: System) -> System:
    """Return the system with each robot beginning in a state of its own, one before where it began.

    Its paths are driven once, to the end; so a family of deadlocks is driven into instead of begun in.
    """
    robots = []
    for robot in system.robots:
        path = robot.path[robot.start :]
        robots.append(Robot(robot.id, (StateId(f"{robot.id}_start"), *path), closed=False))
    return System(
        robots, {s: room for s, room in system.capacity.items() if any(s in r.path for r in robots)}
    )


def interlocked(circuits: int, robots: int, *, ring: bool) -> System:
    """Return circuits of robots, each hooked into the next by a robot that drives through both.

    In circuit c robot i drives from state i to state i + 1 of that circuit; the last one drives on into two
    states of the next circuit before it is home. Where `ring` is true the last circuit is hooked into the
    first.

    Parameters
    ----------
    circuits, robots
        At least two of each.
    ring
        Whether the chain closes.
    """
    paths: dict[str, list[str]] = {}
    for c in range(circuits):
        for i in range(robots):
            path = [f"c{c}_{i}", f"c{c}_{(i + 1) % robots}"]
            if i == robots - 1 and (ring or c + 1 < circuits):
                after = (c + 1) % circuits
                path += [f"c{after}_1", f"c{after}_0"]
            paths[f"r{c}_{i}"] = [f"p{c}_{i}", *path]
    return System(Robot(RobotId(name), tuple(StateId(s) for s in path)) for name, path in paths.items())


def deepest(system: System, *, limit: int = _REACHED) -> int:
    """Return how many moves the deepest dead configuration is away from the nearest circular wait.

    0 if all dead configurations that are reached, among the first `limit`, are circular waits or there are
    none.
    """
    return max(_depths(system, limit), default=0)


def _depths(system: System, limit: int) -> list[int]:
    """Return that number for each dead configuration one move after a live one."""
    homing = Homing(system)
    depth: dict[Configuration, int] = {}

    def depth_of(here: Configuration) -> int:
        if here not in depth:
            moves = [i for i in range(len(system.robots)) if system.enabled(here, i)]
            stuck = deadlocked_robots(system, here)
            depth[here] = 0 if stuck or not moves else -1  # -1: on the way, should it come back here
            if depth[here] < 0:
                after = [d for i in moves if (d := depth_of(system.moved(here, i))) >= 0]
                depth[here] = 1 + min(after, default=0)
        return depth[here]

    seen, todo, found = {system.initial}, [system.initial], list[int]()
    while todo and len(seen) < limit:
        here = todo.pop()
        for robot in range(len(system.robots)):
            if system.enabled(here, robot):
                there = system.moved(here, robot)
                if there in seen:
                    continue
                seen.add(there)
                if homing.live(there):
                    todo.append(there)
                else:
                    found.append(depth_of(there))
    return found


def uphill(seed: int, *, robots: int = 5, rounds: int = 40) -> tuple[System, int]:
    """Return a system with a deep deadlock, found by changing one path at a time, and its depth.

    A change that makes the deepest deadlock no shallower is kept; among equals, one with more such deadlocks.
    """
    rng = random.Random(seed)
    best = random_system(Shape(robots=robots, states=robots + 1, path=(2, 4), proposition1=False), seed)
    height = _height(best)
    for _ in range(rounds):
        changed = _changed(best, rng)
        if changed is not None and (found := _height(changed)) >= height:
            best, height = changed, found
    return best, height[0]


def _height(system: System) -> tuple[int, int]:
    depths = _depths(system, _REACHED)
    return max(depths, default=0), sum(depths)


def _changed(system: System, rng: random.Random) -> System | None:
    """Return the system with two states of one path exchanged or one replaced; None if that is no path."""
    chosen = rng.randrange(len(system.robots))
    path = list(system.robots[chosen].path)
    home = path.pop(next(k for k, s in enumerate(path) if s.startswith("p")))
    shared = sorted({s for robot in system.robots for s in robot.path if s.startswith("s")})
    if rng.random() < 1 / 2 and len(path) > 1:
        i, j = rng.sample(range(len(path)), 2)
        path[i], path[j] = path[j], path[i]
    else:
        path[rng.randrange(len(path))] = rng.choice(shared)
    robots = list(system.robots)
    try:
        robots[chosen] = Robot(robots[chosen].id, (home, *path))
        return System(robots)
    except SystemModelError:
        return None
