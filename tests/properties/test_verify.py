"""The fast check of a gate finds what the plain one finds, and what somebody can keep up is exact."""

from __future__ import annotations

from dataclasses import replace

from hypothesis import given
from hypothesis import strategies as st

from loopgate.gates import Gate, make_gate
from loopgate.model import Configuration, System
from loopgate.theory.deadlocks import deadlocked_robots
from loopgate.theory.oracle import OracleLimitError
from loopgate.untimed import any_system, verify_everywhere
from loopgate.untimed.checking import verify_plainly
from loopgate.untimed.exploration import ExplorationLimitError
from loopgate.untimed.numbered import Numbered

_LIMIT = 1_000
GATES = ["collision", "algorithm2", "banker", "certified", "certified:promise=somebody"]


@given(seed=st.integers(0, 2**32), gate=st.sampled_from(GATES))
def test_fast_is_plain(seed: int, gate: str) -> None:
    """All counts, the judge and the counterexample; a gate that promises somebody is judged more strictly."""
    system = any_system(seed)

    def make(of: System) -> Gate:
        return make_gate(gate, of)

    try:
        plain = verify_plainly(system, make, limit=_LIMIT)
    except OracleLimitError:
        return
    fast = verify_everywhere(system, make, limit=_LIMIT)
    if fast.judge == "somebody":
        assert fast.holds
        fast = replace(fast, judge="deadlocks", safe=0, safe_admitted=0, reachable_live=plain.reachable_live)
    elif gate == "certified":
        assert fast.starving == 0
    assert replace(fast, starving=0) == plain


@given(seed=st.integers(0, 2**32))
def test_somebody_is_what_can_be_kept_up(seed: int) -> None:
    """Striking out circular waits, then whatever leads only to what is struck out, leaves the same."""
    system = any_system(seed, robots=(3, 5))
    try:
        numbered = Numbered(system, limit=_LIMIT)
    except ExplorationLimitError:
        return
    every = [numbered.configuration(k) for k in range(numbered.count)]
    kept = {here for here in every if not deadlocked_robots(system, here)}
    while struck := {here for here in kept if not _goes_on(system, here, kept)}:
        kept -= struck
    assert {here for here, good in zip(every, numbered.somebody(), strict=True) if good} == kept


def _goes_on(system: System, here: Configuration, kept: set[Configuration]) -> bool:
    robots = range(len(system.robots))
    return all(system.finished(here, i) for i in robots) or any(
        system.enabled(here, i) and system.moved(here, i) in kept for i in robots
    )
