"""Who came last into a circle of roads, without SUMO."""

from types import SimpleNamespace
from typing import Any

import numpy as np
from fake_traffic import whereabouts

from loopgate.simulation.watching.trails import Trails

CIRCLE = ("one_0", "two_0")


def test_who_came_last_into_a_circle() -> None:
    """Not who went on within it, however late; a gated vehicle came when it was let go to it."""
    granted = np.array([0])
    drive: Any = SimpleNamespace(changes=0, names=lambda: ["g"], granted=granted.copy)
    trails = Trails(drive)
    ways = {
        "within": ["one_0", "one_0", "one_0", "one_0", ":j_0", "two_0"],
        "o": ["far_0", "far_0", ":j_0", "one_0", "one_0", "one_0"],
        "g": ["near_0", "near_0", "near_0", "near_0", ":j_1", "one_0"],
    }
    for second in range(6):
        granted[0] = int(second >= 1)
        trails.look(float(second), whereabouts(**{v: (on[second], 0.0, 0.0) for v, on in ways.items()}))
    assert trails.came_s("within", CIRCLE) == 0.0
    assert trails.came_s("o", CIRCLE) == 2.0
    assert trails.came_s("g", CIRCLE) == 1.0
    assert trails.last(ways, CIRCLE) == ("o", 2.0)
    assert trails.last(["within", "g"], CIRCLE) == ("g", 1.0)
