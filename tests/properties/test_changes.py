"""After a change of loops, and while first vehicles stand: what is proved, what is decided and what is so."""

from __future__ import annotations

from random import Random

import changes
import pytest
from change_rule import Hindrance, Standing, Why, find_hindrance
from changes import WRONG, change, study
from everyone import draw
from hypothesis import settings
from road_oracle import Reach, Roads

SYSTEMS = 3 * settings.default.max_examples if settings.default else 0
"""180, and 9,000 in a soak; `python analysis/changes.py` looks at 10,000."""


def test_all_go_on_after_a_change_iff_the_walk_and_the_crowds_say_so() -> None:
    """Changes, heads that stand, and both at once, on random systems."""
    found = study(SYSTEMS)
    assert {key: found[key] for key in WRONG} == dict.fromkeys(WRONG, 0)
    assert found["changes that keep everyone live"] > SYSTEMS // 2
    assert min(found[f"refused: {why.name.lower()}"] for why in Why) > 0
    assert min(found[kind] for kind in changes.KINDS) > SYSTEMS // 10


@pytest.mark.parametrize("why", Why)
def test_each_condition_on_a_change_is_needed(why: Why, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the walk, without (S), or with loops left where a head stands, some change is unsafe."""
    whole = find_hindrance

    def forgetful(there: Standing, **words: set[int]) -> Hindrance | None:
        found = whole(there, **words)
        return None if found and found.why is why else found

    monkeypatch.setattr(changes, "find_hindrance", forgetful)
    found = study(180)
    assert found["unsafe"] > 0
    assert found["needless"] == found["mismatches"] == 0


def test_nobody_else_is_lost() -> None:
    """Where a head stands, the others of its place are lost and everyone else goes on, if led round."""
    loops = ((0, 1, 2), (0, 2), (1, 2))
    led = Roads(loops, (2, 2, 2), (((1, 0),), ((0, 1), (2, 0)), ((1, 1),)), frozenset({1}))
    assert bool(Reach(led).live[0])
    through = Roads(loops, (2, 2, 2), (((0, 0),), ((0, 1), (2, 0)), ((1, 1),)), frozenset({1}))
    assert not Reach(through).live[0]
    there = Standing([[0, 1, 2]] * 2 + [[1, 2], [0, 2]], [0, 1, 0, 1], [[0], [1, 2], [3]], [2, 2, 2])
    assert find_hindrance(there, stands={1}) == Hindrance(Why.LEADS_THERE, (1,), (0,))


def test_a_change_leaves_everyone_where_it_stands() -> None:
    """And draws the same for the same seed."""
    roads = draw(5, narrow=False)
    one, two = (change(roads, roads.start, Random(1), "both") for _ in range(2))
    assert one == two
    assert [len(line) for line in one.start] == [len(line) for line in roads.start]
    for place, line in enumerate(one.start):
        assert all(one.loops[loop][position] == place for loop, position in line)


def test_the_study_is_deterministic() -> None:
    """Same seeds, same figures."""
    assert study(20) == study(20)


A, B, C = (0, 1), (1, 2), (2, 0)


@pytest.mark.parametrize(
    ("lines", "stands", "why"),
    [
        ([[A], [A, B], [B]], set(), None),
        ([[A, A], [B, B], [C, C]], set(), Why.CIRCLE),
        ([[A, A], [A], [B]], set(), Why.CROWD),
        ([[A], [A, B], [C]], set(), None),
        ([[A], [A], [B, C]], {2}, None),
        ([[A], [B], [B, C]], {2}, Why.LEADS_THERE),
    ],
    ids=["start", "ring", "crowd", "turned", "broken", "not_all"],
)
def test_instances_of_the_proofs(
    lines: list[list[tuple[int, int]]], stands: set[int], why: Why | None
) -> None:
    """Those of docs/proofs/Instance.v: the search and the decision say of them what is proved."""
    loops, numbers = (A, B, C), iter(range(9))
    start = tuple(tuple((loops.index(w), w.index(p)) for w in line) for p, line in enumerate(lines))
    assert bool(Reach(Roads(loops, (2, 2, 2), start, frozenset(stands))).live[0]) == (why is None)
    ways = [way for line in lines for way in line]
    positions = [way.index(p) for p, line in enumerate(lines) for way in line]
    there = Standing(ways, positions, [[next(numbers) for _ in line] for line in lines], [2, 2, 2])
    found = find_hindrance(there, stands=stands)
    assert (found.why if found else None) == why
