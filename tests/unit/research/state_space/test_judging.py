"""One judge for exploring and checking: what the gate promises, exactly."""

from __future__ import annotations

from functools import partial

import pytest

from loopgate.gates import make_gate
from loopgate.model import Robot, RobotId, StateId, System
from loopgate.research.state_space import StateSpace, explore, verify_everywhere, verify_walks


def streets(paths: dict[str, tuple[str, int]], capacity: dict[str, int]) -> System:
    """Return vehicles on closed paths over FIFO places, each with its path and its start."""
    robots = [
        Robot(RobotId(name), tuple(map(StateId, path.split())), start=k) for name, (path, k) in paths.items()
    ]
    rooms = {StateId(place): room for place, room in capacity.items()}
    return System(robots, rooms, rooms)


LAPS = streets(
    {"v0": ("p2 p1 p0 p4", 3), "v1": ("p1 p3 p2 p4 p0", 4), "v2": ("p4 p0 p2", 2), "v3": ("p2 p1 p0 p4", 3)},
    {"p0": 1, "p1": 1, "p2": 2, "p3": 3, "p4": 3},
)
MORE_LAPS = streets(
    {
        "v0": ("p0 p1 p2 p3 p4", 4),
        "v1": ("p2 p0 p4 p3", 0),
        "v2": ("p2 p0 p4 p1 p3", 3),
        "v3": ("p0 p1 p2 p3 p4", 2),
    },
    {"p0": 3, "p1": 1, "p2": 3, "p3": 1, "p4": 1},
)
TRAP = streets(
    {"r1": ("a b", 0), "r2": ("a b", 0), "r3": ("a b", 1), "x": ("c b", 0)}, {"a": 2, "b": 2, "c": 2}
)
"""A ring of two places with three residents: they can move for ever, and x can never come in."""


@pytest.mark.parametrize(
    ("system", "configurations", "kept"), [(LAPS, 256, 228), (MORE_LAPS, 504, 456), (TRAP, 9, 6)]
)
def test_a_way_on_is_counted_once(system: System, configurations: int, kept: int) -> None:
    """As brute force finds: in places of one and of several, all that is no dead end can be kept."""
    space = StateSpace(system)
    assert space.count == configurations
    assert int(space.somebody.sum()) == kept
    make = partial(make_gate, "certified:promise=somebody")
    found = verify_everywhere(system, make)
    assert found.holds
    assert found.judge == "somebody"
    assert verify_walks(system, make, seed=1, walks=3).holds


def test_exploring_and_checking_judge_by_the_same_promise() -> None:
    """Nobody but the residents goes on in the trap: safe for who promises somebody, a dead start else."""
    somebody = explore(TRAP, make_gate("certified:promise=somebody", TRAP), counterexample=True)
    assert (somebody.configurations, somebody.live, somebody.unsafe_admitted) == (6, 0, 0)
    assert somebody.counterexample is None
    checked = verify_everywhere(TRAP, partial(make_gate, "certified:promise=somebody"))
    assert (checked.unsafe_admitted, checked.starving) == (0, 6)
    everyone = explore(TRAP, make_gate("collision", TRAP), counterexample=True)
    assert (everyone.configurations, everyone.unsafe_admitted) == (9, 8)
    assert everyone.counterexample is not None
    assert everyone.counterexample.moves == ()
    assert verify_everywhere(TRAP, partial(make_gate, "collision")).dead_starts_accepted == 1
    assert verify_everywhere(TRAP, partial(make_gate, "certified")).starts_refused == 1
