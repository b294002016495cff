"""Robots that keep the witness by messages: safe whatever the network does, moving though one breaks down."""

from __future__ import annotations

from collections import Counter

import pytest

from loopgate.errors import GateError
from loopgate.gates.certified.broken_robots import Remainder
from loopgate.model import Robot, RobotId, StateId, System
from loopgate.research.agents import Kind, Link, components, part, run_certified_agents
from loopgate.research.theory.homing import Homing
from loopgate.research.theory.instances import instance
from loopgate.research.theory.random_systems import Shape, random_system

_BAD = Link(delay=(0.1, 7.0), loss=0.3, duplicate=0.2)


def _component(seed: int) -> System:
    system = random_system(Shape(robots=5, states=6, path=(2, 4)), seed)
    return part(system, max(components(system), key=len))


@pytest.mark.parametrize("seed", range(25))
def test_safe_under_loss_delay_and_duplication(seed: int) -> None:
    """A third of the messages lost, a fifth doubled, all reordered: every configuration on the way is live.

    A move that capacity or order forbid would have raised an error.
    """
    system = _component(seed)
    run = run_certified_agents(system, ticks=400, seed=seed, link=_BAD)
    judge, here = Homing(system), system.initial
    for robot, _ in run.moves:
        here = system.move(here, robot)
        assert judge.live(here)
    assert here == run.last


def test_everybody_moves_and_messages_are_counted() -> None:
    """On a good network all robots of the five-robot system drive on and on; a move costs few messages."""
    run = run_certified_agents(instance("unsound_n5"), ticks=400, seed=1)
    assert min(Counter(robot for robot, _ in run.moves).values()) > 15
    assert len(run.coordinators) == 1
    assert run.messages[Kind.PROPOSE] > len(run.moves)
    assert 5 < run.messages_per_move < 25


@pytest.mark.parametrize("link", [Link(delay=(0.2, 0.8)), _BAD])
@pytest.mark.parametrize("when", [1, 37, 60, 153])
def test_a_coordinator_that_fails_is_replaced(link: Link, when: int) -> None:
    """The first coordinator breaks down: another takes over, and who is not behind it keeps moving."""
    states = {name: StateId(name) for name in ("a", "b", "c")}
    paths = {
        "r1": (StateId("p1"), states["a"]),
        "r2": (StateId("p2"), states["a"], states["b"]),
        "r3": (StateId("p3"), states["b"], states["c"]),
        "r4": (StateId("p4"), states["c"], states["b"]),
    }
    system = System(Robot(RobotId(name), path) for name, path in paths.items())
    run = run_certified_agents(system, ticks=1500, seed=when, link=link, failures={0: when})
    assert len(run.coordinators) >= 2 or 0 not in run.coordinators
    late = Counter(robot for robot, time in run.moves if time > 700)
    assert late[2] > 5
    assert late[3] > 5
    assert late[0] == 0


def test_a_majority_has_to_be_there() -> None:
    """Two of three robots broken down: nobody may decide alone, so the third stands still, safe."""
    a = StateId("a")
    system = System(Robot(RobotId(f"r{k}"), (StateId(f"p{k}"), a)) for k in range(3))
    run = run_certified_agents(system, ticks=600, seed=1, failures={0: 100, 1: 100})
    assert max(time for _, time in run.moves) < 130


def test_who_is_behind_a_broken_robot_stops_out_of_the_way() -> None:
    """r1 stands in b for good; r2, which has to pass b, may still drive to its private state before it."""
    paths = {"r1": ("p1", "b"), "r2": ("p2", "a", "b"), "r3": ("p3", "a")}
    system = System(
        Robot(RobotId(name), tuple(StateId(s) for s in path), start=int(name in {"r1", "r2"}))
        for name, path in paths.items()
    )
    rest = Remainder(system, system.initial, frozenset({0}))
    assert rest.broken == {0, 1}  # r2 has no home before b any more, and stays in a
    rest = Remainder(system, system.configuration([1, 0, 0]), frozenset({0}))
    assert rest.broken == {0}
    assert [rest.admits(system.configuration([1, 0, 0]), i) for i in range(3)] == [False, False, True]


def test_robots_without_homes_are_refused() -> None:
    """Agents need homes for their witnesses."""
    ring = tuple(StateId(s) for s in "abc")
    system = System([Robot(RobotId("r1"), ring), Robot(RobotId("r2"), ring, start=1)])
    with pytest.raises(GateError, match="have no home"):
        run_certified_agents(system, ticks=10, seed=1)


def test_components_share_nothing() -> None:
    """Robots that meet, directly or through others, belong together; the rest decide apart."""
    paths = {"r1": "ab", "r2": "bc", "r3": "de", "r4": "fd", "r5": "gh"}
    system = System(Robot(RobotId(n), tuple(StateId(s) for s in p)) for n, p in paths.items())
    assert components(system) == [[0, 1], [2, 3], [4]]
    assert [robot.id for robot in part(system, [2, 3]).robots] == ["r3", "r4"]
