"""Vehicles that enter, drive once and leave, exhaustively: whatever is moved, whoever is let in, all arrive.

Every configuration of small systems that comes about from empty roads is looked at, by the gate's own answers
and the rule by which a run lets a vehicle in: a slot in its place, and no circle of full places; of loops, a
gate that can be made anew.
"""

from __future__ import annotations

import pytest
from comers import Comers, Everything, explored


def residents() -> Everything:
    """Three that go round two places of two, and one that passes there."""
    return Everything(Comers(((0, 1), (1, 0), (0, 1), (0, 1)), (False, False, False, True), (2, 2)), 300)


@pytest.mark.parametrize(("least", "systems", "most"), [(2, 150, 260), (1, 35, 120)])
def test_who_drives_once_arrives_and_nothing_is_refused_needlessly(
    least: int, systems: int, most: int
) -> None:
    """Moves and entries are admitted iff all who are there can arrive, narrow places among them or not."""
    looked_at = safe = refused = 0
    for everything in explored(range(systems), loops=False, least=least, most=most):
        assert not everything.stuck()
        good, needless, unsafe = everything.refused()
        assert (needless, unsafe) == (0, 0)
        looked_at += 1
        safe += good
        refused += everything.decided - good
    assert looked_at > systems // 2
    assert safe > 1000
    assert refused > 10


@pytest.mark.parametrize(("least", "systems", "most"), [(2, 18, 100), (1, 25, 60)])
def test_loops_keep_nobody_from_arriving_and_go_on(least: int, systems: int, most: int) -> None:
    """Where some never leave; where all places hold two, whoever drives once gets in, too."""
    found = [
        everything.stuck() for everything in explored(range(systems), loops=True, least=least, most=most)
    ]
    assert len(found) > systems // 3
    assert not any(found)


def test_loops_leave_room_for_who_comes_later() -> None:
    """The third of three that would go round for ever where somebody is to pass stays outside."""
    everything = residents()
    assert not everything.stuck()
    assert max(sum(map(len, node.lines)) for node in everything.moves) == 3
