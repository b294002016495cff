"""The check of a gate finds what brute force finds, and what somebody can keep up is exact."""

from __future__ import annotations

from functools import partial

from brute_force import can_be_kept, counted, verify_plainly
from hypothesis import given
from hypothesis import strategies as st

from loopgate.errors import UnsafeStartError
from loopgate.gates import make_gate
from loopgate.research.state_space import ExplorationLimitError, StateSpace, verify_space, verify_walks
from loopgate.research.theory.oracle import Oracle
from loopgate.research.theory.random_systems import any_system

_LIMIT = 600
GATES = ["collision", "algorithm2", "banker", "certified", "certified:promise=somebody"]


@given(seed=st.integers(0, 2**32), gate=st.sampled_from(GATES))
def test_as_by_brute_force(seed: int, gate: str) -> None:
    """All counts; certified keeps its promise, and the one to everyone for everyone."""
    system = any_system(seed, robots=(2, 6))
    try:
        space = StateSpace(system, limit=_LIMIT)
    except ExplorationLimitError:
        return
    found = verify_space(space, partial(make_gate, gate))
    try:
        made = make_gate(gate, system)
    except UnsafeStartError:
        assert (found.starts_refused, found.live_starts_refused) == (1, Oracle(system).live(system.initial))
        return
    if found.dead_starts_accepted:
        assert not Oracle(system).live(system.initial)
        return
    assert counted(found) == verify_plainly(system, made)
    if gate.startswith("certified"):
        assert found.holds
    if gate == "certified" and found.judge == "oracle":
        assert found.starving == 0


@given(seed=st.integers(0, 2**32))
def test_somebody_is_what_can_be_kept_up(seed: int) -> None:
    """Striking out circular waits, then whatever leads only to what is struck out, leaves the same."""
    system = any_system(seed, robots=(2, 5))
    try:
        space = StateSpace(system, limit=_LIMIT)
    except ExplorationLimitError:
        return
    kept = {space.configuration(k) for k, good in enumerate(space.somebody) if good}
    assert kept == can_be_kept(system)


@given(seed=st.integers(0, 2**32), gate=st.sampled_from(["certified", "certified:promise=somebody"]))
def test_walks_are_judged_by_the_same_promise(seed: int, gate: str) -> None:
    """A gate that keeps its promise everywhere keeps it along walks."""
    system = any_system(seed, robots=(2, 5))
    found = verify_walks(system, partial(make_gate, gate), seed=seed, steps=20)
    assert found.holds or found.live_starts_refused
