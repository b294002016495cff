"""Everyone goes on: what is proved, what the gate decides and what is so, on some of the study's systems."""

from __future__ import annotations

import random
from collections import Counter
from random import Random

import pytest
from everyone import WRONG, draw, narrow_system, wide_system
from hypothesis import given, settings
from hypothesis import strategies as st
from road_oracle import Reach
from service_bound import longest_service, moves_until, slow_line
from service_rule import next_mover

from loopgate.errors import SystemModelError
from loopgate.gates.certified.free_slots import FreeSlots
from loopgate.gates.certified.occupancy import Occupancy
from loopgate.gates.certified.search import Budget
from loopgate.gates.certified.system_index import SystemIndex
from loopgate.research.theory.oracle import Oracle, OracleLimitError
from loopgate.research.theory.random_systems import Shape, random_system


def sample(systems: int, *, narrow: bool) -> Counter[str]:
    """Return what the study finds on the small ones among its first systems."""
    found: Counter[str] = Counter()
    for seed in range(systems):
        roads = draw(seed, narrow=narrow)
        if any(roads.start) and not (narrow and min(roads.slots) > 1):
            try:
                found += (narrow_system if narrow else wide_system)(roads, seed)
            except OverflowError:
                continue
    return found


@pytest.mark.parametrize("systems", [50, pytest.param(120, marks=pytest.mark.slow)])
def test_live_is_no_circle_and_no_crowd(systems: int) -> None:
    """Where places hold two or more; the gate admits what is safe and nothing else, and serves everyone."""
    found = sample(systems, narrow=False)
    assert {key: found[key] for key in (*WRONG, "needless")} == dict.fromkeys((*WRONG, "needless"), 0)
    assert found["crowded"] > 0
    assert found["starts refused"] > found["crowded"]
    assert found["live"] < found["configurations"]
    assert found["served"] > 100 / 120 * systems


def test_a_slot_free_everywhere_is_a_witness_where_places_hold_one() -> None:
    """`FreeSlots` admits nothing unsafe, blocks nobody, and refuses hardly anything that is safe."""
    found = sample(120, narrow=True)
    assert {key: found[key] for key in WRONG} == dict.fromkeys(WRONG, 0)
    assert found["safe"] > 1000
    assert found["needless"] <= found["safe"] // 100


def test_moving_heads_of_full_places_ends_with_free_slots_or_a_circle() -> None:
    """From wherever a start with a slot free everywhere has led to, places that hold one among them."""
    ends: Counter[bool] = Counter()
    for seed in range(600):
        roads, rng = draw(seed, narrow=True), Random(seed)
        here = roads.start
        for _ in range(40):
            here = rng.choice(roads.moves(here) or [(0, here)])[1]
        full = [move for move in roads.moves(here) if len(here[move[0]]) == roads.slots[move[0]]]
        for _ in range(10_000):
            if not full:
                break
            _, here = rng.choice(full)
            full = [move for move in roads.moves(here) if len(here[move[0]]) == roads.slots[move[0]]]
        assert not full
        free = all(len(line) < room for line, room in zip(here, roads.slots, strict=True))
        assert free != roads.circle(here)
        ends[free] += 1
    assert min(ends[False], ends[True]) > 20


@given(seed=st.integers(0, 10**6))
@settings(max_examples=40)
def test_service_ends_from_every_live_configuration(seed: int) -> None:
    """Whoever is served moves; on the way everything stays live, and no configuration comes twice."""
    roads = draw(seed, narrow=False)
    try:
        reach = Reach(roads, most=800)
    except OverflowError:
        return
    if not any(roads.start) or not reach.live[0]:
        return
    system, rng = roads.system, random.Random(seed)
    here = system.initial
    for _ in range(25):
        stand = Occupancy.of(SystemIndex(system), here)
        robot, mover, seen = rng.randrange(len(system.robots)), -1, set[object]()
        there = here
        while mover != robot:
            assert there not in seen
            seen.add(there)
            mover = next_mover(stand, robot)
            there = system.move(there, mover)
            stand.step(mover)
            assert reach.is_live(there)
        safe = [i for i in range(len(system.robots)) if system.enabled(here, i)]
        safe = [i for i in safe if reach.is_live(system.moved(here, i))]
        here = system.moved(here, rng.choice(safe))


@pytest.mark.parametrize(("loops", "moves"), [(1, 2), (2, 6), (3, 19)])
def test_nothing_can_be_chosen_where_one_slot_is_free(loops: int, moves: int) -> None:
    """On a line of loops there is one safe move in every configuration, and service takes ever longer."""
    _, most, longest = longest_service(loops)
    assert (most, longest) == (1, moves)


@pytest.mark.parametrize("loops", range(1, 11))
def test_service_takes_twice_as_long_with_each_loop(loops: int) -> None:
    """The start is live, there is one safe move each time, and the free slot walks as worked out."""
    roads = slow_line(loops)
    assert not roads.crowded()
    assert moves_until(roads, loops) == 4 * 2**loops - 3 * loops - 4


def test_one_free_slot_leaves_one_safe_move_on_any_roads() -> None:
    """Of all moves from live configurations with one slot free, just one keeps everyone going."""
    looked_at = 0
    for seed in range(600):
        roads = draw(seed, narrow=False)
        visited = {p for line in roads.start for loop, _ in line for p in roads.loops[loop]}
        if sum(len(roads.start[p]) - roads.slots[p] for p in visited) != -1:
            continue
        try:
            reach = Reach(roads, most=800)
        except OverflowError:
            continue
        for here, live in zip(reach.all, reach.live.tolist(), strict=True):
            if live:
                safe = [there for _, there in roads.moves(here) if reach.live[reach.number[there]]]
                assert len(safe) == 1
                looked_at += 1
    assert looked_at > 20


def test_service_says_so_where_nobody_can_move() -> None:
    """A circle of full places has no end of the chain."""
    for seed in range(400):
        roads = draw(seed, narrow=False)
        if any(roads.start) and all(
            len(line) == most for line, most in zip(roads.start, roads.slots, strict=True)
        ):
            with pytest.raises(ValueError, match="in a circle through p"):
                next_mover(Occupancy.of(SystemIndex(roads.system), roads.system.initial), 0)
            return
    pytest.fail("no system was full")


@pytest.mark.parametrize("systems", [24, pytest.param(60, marks=pytest.mark.slow)])
@pytest.mark.parametrize("fifo", [0.0, 0.5, 1.0])
def test_roomy_in_places_of_every_kind(fifo: float, systems: int) -> None:
    """Open and closed paths, any order: nothing unsafe, nobody blocked, the favoured one moves."""
    favoured_moved = 0
    for seed in range(systems):
        shape = Shape(
            robots=5, states=6, path=(2, 4), private=seed % 2, capacity=(1, 3), fifo=fifo, proposition1=False,
            closed=seed % 3 > 0,
        )  # fmt: skip
        try:
            system = random_system(shape, seed)
            oracle = Oracle(system, limit=3_000)
            oracle.live(system.initial)
        except (SystemModelError, OracleLimitError):
            continue
        layout = SystemIndex(system)
        stand, keeper, here = (
            Occupancy.of(layout, system.initial),
            FreeSlots(layout, Budget(2_000)),
            system.initial,
        )
        if layout.hopeless or not FreeSlots.applies(layout) or not keeper.begin(here, stand):
            continue
        assert oracle.live(here)
        rng, robots = random.Random(seed), range(len(system.robots))
        favoured = rng.choice(robots)
        for _ in range(25):
            enabled = [i for i in robots if stand.enabled(i)]
            admitted = [i for i in enabled if keeper.judge(here, stand, i).admitted]
            assert all(oracle.safe(here, i) for i in admitted)
            assert admitted or all(system.finished(here, i) for i in robots)
            if not admitted:
                break
            robot = rng.choice(admitted)
            here, before = system.moved(here, robot), stand.at[robot]
            stand.step(robot)
            assert keeper.moved(robot, before)
            favoured_moved += robot == favoured
            keeper.favour(here, stand, -1 if robot == favoured else favoured)
    assert favoured_moved > 10 / 60 * systems
