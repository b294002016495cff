"""Random systems keep the shape that was asked for."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from loopgate.errors import SystemModelError
from loopgate.model import system_to_dict
from loopgate.research.theory.random_systems import Shape, dense, random_system, sparse


def test_same_seed_same_system() -> None:
    """Shape and seed decide the system."""
    shape = Shape(robots=5, states=7)
    assert system_to_dict(random_system(shape, 3)) == system_to_dict(random_system(shape, 3))
    assert system_to_dict(random_system(shape, 3)) != system_to_dict(random_system(shape, 4))


@pytest.mark.parametrize("robots", [4, 8, 16, 64])
def test_sparse_and_dense_visitors(robots: int) -> None:
    """Two or three robots visit a state of a sparse system, at most a quarter one of a dense system."""
    for shape, most in ((sparse(robots), 3), (dense(robots), max(2, robots // 4))):
        system = random_system(shape, 1)
        shared = [v for v, private in zip(system.visitors, system.private, strict=True) if not private]
        assert 1 < max(len(v) for v in shared) <= most


@given(seed=st.integers(0, 10**6))
@settings(max_examples=20)
def test_proposition1(seed: int) -> None:
    """No two states are neighbours on the paths of two robots."""
    system = random_system(Shape(robots=6, states=7, path=(3, 5)), seed)
    owner: dict[frozenset[int], int] = {}
    for robot, path in enumerate(system.paths):
        for pair in zip(path, path[1:] + path[:1], strict=True):
            assert owner.setdefault(frozenset(pair), robot) == robot


def test_robots_start_in_private_states() -> None:
    """With private states, closed or open, everyone starts in one."""
    for closed in (True, False):
        system = random_system(Shape(robots=6, states=7, private=2, closed=closed), 5)
        assert all(system.private[system.state_at(system.initial, i)] for i in range(len(system.robots)))


def test_open_paths_end_in_private_states() -> None:
    """An open path's terminal state is nobody else's."""
    system = random_system(Shape(robots=6, states=7, closed=False), 5)
    assert all(system.private[path[-1]] for path in system.paths)


def test_capacities_and_fifo() -> None:
    """Capacities and FIFO states are drawn within their ranges."""
    system = random_system(Shape(robots=8, states=9, capacity=(2, 4), fifo=1.0), 5)
    shared = [s for s, private in enumerate(system.private) if not private]
    assert {system.room[s] for s in shared} <= {2, 3, 4}
    assert set(system.fifo_states) == set(shared)


def test_no_room_to_start() -> None:
    """Too many robots for too few states: a clear error."""
    with pytest.raises(SystemModelError, match="finds no state with room"):
        random_system(Shape(robots=4, states=2, private=0), 0)


def test_bad_shape() -> None:
    """A range upside down is refused."""
    with pytest.raises(SystemModelError, match="path is 5 to 2"):
        Shape(robots=4, states=2, path=(5, 2))
