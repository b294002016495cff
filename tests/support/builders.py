"""Short ways to write systems down in tests."""

from __future__ import annotations

from collections.abc import Mapping

from loopgate.model import Robot, RobotId, StateId, System


def robot(name: str, path: str, *, closed: bool = True, start: int = 0) -> Robot:
    """Make a robot from a path written as words."""
    return Robot(RobotId(name), tuple(StateId(s) for s in path.split()), closed=closed, start=start)


def system(
    paths: Mapping[str, str],
    *,
    starts: Mapping[str, int] | None = None,
    capacity: Mapping[str, int] | None = None,
    fifo: tuple[str, ...] = (),
    closed: bool = True,
) -> System:
    """Make a system from robots' paths written as words, all closed or all open."""
    at = starts or {}
    return System(
        (robot(name, path, closed=closed, start=at.get(name, 0)) for name, path in paths.items()),
        {StateId(s): room for s, room in (capacity or {}).items()},
        (StateId(s) for s in fifo),
    )


def ring_of_three() -> System:
    """Three loops that pairwise share a state, in a cycle: the smallest deadlock (Prop. 2)."""
    return system({"r1": "p1 a b", "r2": "p2 b c", "r3": "p3 c a"})
