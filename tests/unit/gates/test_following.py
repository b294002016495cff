"""Gates that follow the moves themselves decide as they do by a configuration written out."""

from random import Random

import pytest

from loopgate.gates.algorithm2 import Algorithm2Gate
from loopgate.gates.banker import BankerGate
from loopgate.gates.base import FollowingGate
from loopgate.gates.collision import CollisionGate
from loopgate.gates.following import Follower, following
from loopgate.gates.one_step import OneStepGate
from loopgate.gates.open import OpenGate
from loopgate.model import MutableConfiguration
from loopgate.research.theory.random_systems import any_system


@pytest.mark.parametrize("gate_class", [CollisionGate, OneStepGate, BankerGate, Algorithm2Gate])
def test_who_follows_decides_the_same(gate_class: type[Follower]) -> None:
    """On walks through small systems of all kinds, blockers and all; asking changes nothing."""
    rng, refused = Random(1), 0
    for seed in range(300):
        s = any_system(seed)
        gate, here = gate_class(s), s.initial
        assert isinstance(gate, FollowingGate)
        for _ in range(20):
            asked = [gate.decide_here(robot) for robot in range(len(s.robots))]
            assert asked == [gate_class(s).decide(here, robot) for robot in range(len(s.robots))]
            refused += sum(not decision.admitted for decision in asked)
            movable = [robot for robot in range(len(s.robots)) if s.enabled(here, robot)]
            if not movable:
                break
            robot = rng.choice(movable)
            here = s.moved(here, robot)
            gate.moved_here(robot)
    assert refused > 100


class _Told(CollisionGate):
    """Somebody's own gate, made of one of ours."""


def test_a_class_made_of_one_that_follows_is_told_configurations() -> None:
    """It may count on them; it can say that it follows, and others are asked what they can."""
    s = any_system(1)
    assert following(CollisionGate(s)) is not None
    assert following(_Told(s)) is None
    assert following(OpenGate(s)) is None


def test_a_move_that_is_taken_back_leaves_no_trace() -> None:
    """Within one state, and in and out of queues."""
    for seed in range(300):
        s = any_system(seed)
        placed = MutableConfiguration(s.initial)
        for robot in range(len(s.robots)):
            if s.enabled(placed, robot):
                before = s.make(placed, robot)
                assert placed.frozen() == s.moved(s.initial, robot)
                s.take_back(placed, robot, before)
            assert placed.frozen() == s.initial
