"""A collision counts once, however long it lasts."""

from loopgate.simulation.loop_run import Collisions
from loopgate.traffic.base import Collision


def test_a_collision_begins_once_whoever_is_named_first() -> None:
    """It can begin anew after a step without it; one that goes on does not hide another."""
    ab, ba, ac = Collision("a", "b", "e_0"), Collision("b", "a", "e_0"), Collision("a", "c", "e_0")
    steps = [[ab, ab], [ba], [ab, ac], [], [ba]]
    colliding = Collisions()
    assert [colliding.begun(step) for step in steps] == [[ab], [], [ac], [], [ba]]
