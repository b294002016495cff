"""Vehicles on finite routes among loops, exhaustively: by the chain rule all who are let in arrive.

A finite route is a path and then a place ``away`` with room for everybody, as in the drive. Small systems are
looked at configuration by configuration, whatever is moved: somebody can always move, and as long as anybody
on a finite route is not away there are moves that bring one nearer.
"""

from __future__ import annotations

import random

from hypothesis import given, settings
from hypothesis import strategies as st

from loopgate.errors import GateError, SystemModelError
from loopgate.gates import Gate, make_gate
from loopgate.model import Configuration, Robot, RobotId, StateId, System

SYSTEMS = 150
AWAY = StateId("away")


def drawn(rng: random.Random) -> tuple[System, list[int]]:
    """Return a system of places that hold two, and the robots on finite routes; with a start."""
    while True:
        found = drawn_once(rng)
        if found is not None:
            return found


def drawn_once(rng: random.Random) -> tuple[System, list[int]] | None:
    """Return a system and robots, or None if its start is none."""
    places = [StateId(f"p{k}") for k in range(rng.randint(3, 4))]
    robots, open_ = [], []
    for number in range(rng.randint(3, 5)):
        once = number == 0 or rng.random() < 0.6
        path = rng.sample(places, rng.randint(1 if once else 2, len(places)))
        if once:
            open_.append(number)
            path.append(AWAY)
        start = rng.randrange(len(path) - 1) if once else rng.randrange(len(path))
        robots.append(Robot(RobotId(f"r{number}"), tuple(path), start=start))
    capacity = {place: 2 for robot in robots for place in robot.path} | {AWAY: len(robots) + 2}
    try:
        system = System(robots, capacity, capacity.keys())
        make_gate("certified", system)
    except (GateError, SystemModelError):  # more in a place than it holds, or a start that is not live
        return None
    return system, open_


def arrived(system: System, here: Configuration, robot: int) -> bool:
    return system.states[system.state_at(here, robot)] == AWAY


def admitted(system: System, gate: Gate, here: Configuration, open_: list[int]) -> dict[int, Configuration]:
    """Return what the gate lets come next; who is away stays there."""
    return {
        robot: system.moved(here, robot)
        for robot in range(len(system.robots))
        if not (robot in open_ and arrived(system, here, robot))
        and (system.enabled(here, robot) or leaves(system, here, robot))
        and gate.decide(here, robot).admitted
    }


def leaves(system: System, here: Configuration, robot: int) -> bool:
    """Return whether a robot is about to go away: others who are away do not stand before anybody."""
    state = system.next_state(here, robot)
    return state is not None and system.states[state] == AWAY and system.at_head(here, robot)


@given(seed=st.integers(0, 10**6))
@settings(max_examples=SYSTEMS)
def test_everybody_arrives_whatever_is_moved(seed: int) -> None:
    """From every configuration that the gate lets come about, all on finite routes can still get away."""
    system, open_ = drawn(random.Random(seed))
    gate = make_gate("certified", system)
    following: dict[Configuration, set[Configuration]] = {}
    queue = [system.initial]
    while queue:
        here = queue.pop()
        if here in following:
            continue
        moves = admitted(system, gate, here, open_)
        on_road = [robot for robot in open_ if not arrived(system, here, robot)]
        if on_road or len(open_) < len(system.robots):
            assert moves, f"nobody can move in {system.describe(here)}"
        following[here] = set(moves.values())
        queue += following[here]
    good = {here for here in following if all(arrived(system, here, robot) for robot in open_)}
    assert good
    before: dict[Configuration, set[Configuration]] = {here: set() for here in following}
    for here, those in following.items():
        for there in those:
            before[there].add(here)
    front = list(good)
    while front:
        for here in before[front.pop()] - good:
            good.add(here)
            front.append(here)
    assert good == following.keys()
