"""Agents with messages decide like the central algorithm, and never move unsafely over a bad network."""

from __future__ import annotations

import random
from dataclasses import replace

import pytest

from loopgate.errors import GateError, SystemModelError
from loopgate.gates import Reason, make_gate
from loopgate.gates.walks import default_lookahead
from loopgate.research.agents import Kind, Link, Outcome, Sensing, decide_by_messages, run_agents
from loopgate.research.state_space import explore
from loopgate.research.theory.instances import instance
from loopgate.research.theory.oracle import Oracle
from loopgate.research.theory.random_systems import Shape, random_system

CONFIGURATIONS = 10_000
RUNS = 100
SLOW_RUNS = 1000


def test_agents_agree_with_the_central_algorithm() -> None:
    """On 10,000 random configurations of systems of 3 to 8 robots, deadlocks among them."""
    seen = refused = 0
    seed = 0
    while seen < CONFIGURATIONS:
        seed += 1
        robots = 3 + seed % 6
        system = random_system(Shape(robots=robots, states=robots + 1, path=(3, 5)), seed)
        gate = make_gate("algorithm2", system)
        rng = random.Random(seed)
        here = system.initial
        for _ in range(25):
            enabled = [i for i in range(robots) if system.enabled(here, i)]
            if not enabled:
                break
            seen += 1
            robot = rng.choice(enabled)
            central = gate.decide(here, robot)
            found = decide_by_messages(system, here, robot)
            assert found.admitted == central.admitted, (seed, here, robot)
            assert found.depth <= default_lookahead(system)
            refused += central.reason is Reason.DEADLOCK
            here = system.move(here, rng.choice(enabled))
    assert refused > CONFIGURATIONS // 1000


@pytest.mark.parametrize("runs", [RUNS, pytest.param(SLOW_RUNS, marks=pytest.mark.slow)])
def test_no_unsafe_move_over_a_bad_network(runs: int) -> None:
    """100 runs, or 1,000, with 30 % loss, duplicates and overtaking, and coordinators that fail.

    Every move made is one that the central algorithm admits where it is made: no collision, no deadlock.
    `System.move` refuses collisions by itself.
    """
    link = Link(delay=(0.0, 5.0), loss=0.3, duplicate=0.1, copies=3)
    moves = stopped = replaced = 0
    for seed in range(runs):
        robots = 3 + seed % 4
        system = random_system(Shape(robots=robots, states=robots + 1, path=(3, 4)), seed)
        gate = make_gate("algorithm2", system)
        oracle = Oracle(system)
        run = run_agents(system, rounds=12, seed=seed, link=link, fails=lambda n, r: (n + r) % 4 == 0)
        for here, robot in run.moves:
            assert gate.decide(here, robot).admitted
            assert oracle.live(system.move(here, robot))
        moves += len(run.moves)
        stopped += run.stopped
        replaced += run.replaced
    assert moves > runs
    assert stopped > 0
    assert replaced > 0


def test_a_missing_answer_means_stop() -> None:
    """Without any answers a robot with risky walks stays open, and so stops; one without goes."""
    system = instance("fig10")
    deaf = Link(loss=1.0)
    asked = decide_by_messages(system, system.initial, 4, link=deaf)
    assert asked.outcome is Outcome.OPEN
    assert not asked.admitted
    assert decide_by_messages(system, system.initial, 4).admitted


def test_messages_are_counted_by_kind() -> None:
    """r1's question in Fig. 10 goes round all eight robots and is answered back along the chain."""
    system = instance("fig10")
    asked = decide_by_messages(system, system.initial, 0)
    assert asked.outcome is Outcome.DEADLOCK
    assert asked.hops == 7
    assert asked.messages[Kind.VISIT] == asked.messages[Kind.REPLY] == 7
    assert asked.messages[Kind.CIRCUIT] == asked.messages[Kind.CHECK] == 7


def test_limited_range() -> None:
    """Messages beyond the range are lost, so the robot stops."""
    system = instance("fig10")
    near = Link(reaches=lambda sender, receiver: abs(sender - receiver) <= 1)
    assert decide_by_messages(system, system.initial, 0, link=near).outcome is Outcome.OPEN


def test_monitors_let_a_robot_see_beyond_its_range() -> None:
    """A robot that sees one state ahead must stop; monitors at all states give the full answer."""
    system = instance("fig10")
    blind = decide_by_messages(system, system.initial, 2, sensing=Sensing(states_ahead=1))
    assert not blind.admitted
    assert blind.outcome in {Outcome.BLIND, Outcome.OPEN}
    everywhere = frozenset(range(len(system.states)))
    seeing = decide_by_messages(system, system.initial, 2, sensing=Sensing(1, monitored=everywhere))
    assert seeing.admitted


def test_without_everybodys_agreement_nobody_moves() -> None:
    """One robot off the network, far from the others' circuits: all decide, one wins, and stands still."""
    shape = Shape(robots=4, states=12, path=(2, 3))
    moved = 0
    for seed in range(5):
        system = random_system(shape, seed)
        cut_off = Link(reaches=lambda sender, receiver: 3 not in {sender, receiver})
        assert run_agents(system, rounds=6, seed=seed, link=cut_off).moves == ()
        moved += len(run_agents(system, rounds=6, seed=seed).moves)
    assert moved > 5


def test_copies_of_a_message_are_taken_once() -> None:
    """With every copy doubled, each visit is still answered once."""
    system = instance("fig10")
    asked = decide_by_messages(system, system.initial, 0, link=Link(duplicate=1.0))
    assert asked.outcome is Outcome.DEADLOCK
    assert asked.messages[Kind.VISIT] == asked.messages[Kind.REPLY] == 7


def test_states_of_several_robots_are_refused() -> None:
    """The distributed algorithm is the paper's."""
    system = random_system(Shape(robots=4, states=4, path=(2, 4), capacity=(2, 2)), 1)
    with pytest.raises(SystemModelError, match="agents know states of one robot only"):
        decide_by_messages(system, system.initial, 0)


def test_agents_as_a_gate() -> None:
    """The same configurations come about as under the central algorithm, and messages are counted."""
    system = instance("unsound_n5")
    found = explore(system, make_gate("agents", system))
    central = explore(system, make_gate("algorithm2", system))
    assert replace(found, seconds=0.0) == replace(central, seconds=0.0)
    fig10 = instance("fig10")
    assert make_gate("agents", fig10).decide(fig10.initial, 0).messages == 28
    assert make_gate("agents:loss=1.0", fig10).decide(fig10.initial, 4).reason is Reason.BUDGET
    with pytest.raises(GateError, match="expected a probability"):
        make_gate("agents:loss=2", fig10)
