"""A start with too many residents is refused, by name and number; one with room for passers is taken."""

from __future__ import annotations

import random
from itertools import combinations

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from builders import robot, system
from loopgate.errors import SystemModelError, UnsafeStartError
from loopgate.gates.certified import CertifiedGate
from loopgate.gates.certified.chain_rule import ChainRule
from loopgate.gates.certified.checker import Checker
from loopgate.gates.certified.crowding import find_crowd, is_plain_for_the_chain, too_many
from loopgate.gates.certified.free_slots import FreeSlots
from loopgate.model import StateId, System
from loopgate.research.theory.certificates import fits_with_two_empty, leaves_room_for_passers

Loops = list[tuple[int, ...]]


def crowded_by_trying(loops: Loops, slots: list[int]) -> bool:
    """Look at every set of places: the condition as it is written down."""
    places = range(len(slots))
    for some in (set(q) for size in range(1, len(slots)) for q in combinations(places, size)):
        crossed = any(some & set(loop) and not some >= set(loop) for loop in loops)
        residents = sum(some >= set(loop) for loop in loops)
        if crossed and residents > sum(slots[p] for p in some) - 2:
            return True
    return False


def fit(loops: Loops, slots: list[int]) -> bool:
    """Return whether all can stand on their loops at once."""
    return fits_with_two_empty(loops, [*slots, 2, 0], empty=len(slots), endless=len(slots) + 1)


@given(seed=st.integers(0, 2**32), crowded=st.booleans())
def test_crowds_are_found_where_there_are_any(seed: int, crowded: bool) -> None:  # noqa: FBT001 - drawn
    """The cuts, the matchings and the definition agree; without those to stay away there is no crowd left."""
    rng = random.Random(seed)
    slots = [rng.randint(2, 4) for _ in range(rng.randint(2, 6))]
    kinds = [
        tuple(rng.sample(range(len(slots)), rng.randint(2, min(3, len(slots)))))
        for _ in range(rng.randint(1, 4))
    ]
    most = sum(slots)
    loops = [rng.choice(kinds) for _ in range(rng.randint(most // 2 if crowded else 1, most))]
    assume(fit(loops, slots))
    crowd = find_crowd(loops, slots)
    assert (crowd is not None) == crowded_by_trying(loops, slots)
    assert (crowd is None) == leaves_room_for_passers(loops, slots)
    gone = too_many(loops, slots)
    assert bool(gone) == (crowd is not None)
    left = [loop for i, loop in enumerate(loops) if i not in gone]
    assert not left or not crowded_by_trying(left, slots)
    if crowd is not None:
        inside = set(crowd.places)
        assert crowd.residents == tuple(i for i, loop in enumerate(loops) if inside >= set(loop))
        assert crowd.slots == sum(slots[p] for p in inside)
        assert crowd.excess > 0
        assert any(inside & set(loop) and not inside >= set(loop) for loop in loops)


def shuttle(residents: int) -> System:
    """One commuter between a and c over b; residents between b and c, which hold two each."""
    paths = {"commuter": "a b c", **{f"r{n}": "b c" for n in range(residents)}}
    starts = {f"r{n}": n % 2 for n in range(residents)}
    return system(
        paths, starts=starts, capacity=dict.fromkeys("abc", 2), fifo=tuple(StateId(s) for s in "abc")
    )


@pytest.mark.parametrize("promise", ["auto", "everyone"])
def test_a_crowded_start_is_refused_in_words(promise: str) -> None:
    """Three residents in four slots, and one who passes: it says who, where, how many, and who too many."""
    with pytest.raises(UnsafeStartError) as error:
        CertifiedGate(shuttle(3), promise=promise)
    text = str(error.value)
    assert "3 robots (r0, r1, r2) never leave the places b, c, which hold 4" in text
    assert "at most 2 may. 1 fewer would do: leave out r" in text
    assert "promise=somebody" in text
    assert CertifiedGate(shuttle(3), promise="somebody").promise == "somebody"


def test_two_residents_leave_room_for_who_passes() -> None:
    """The same with one fewer: the promise is to everyone, by the chain rule."""
    crowded = shuttle(2)
    full = system(
        {r.id: " ".join(r.path) for r in crowded.robots},
        starts={"r0": 0, "r1": 0},
        capacity=dict.fromkeys("abc", 2),
        fifo=tuple(StateId(s) for s in "abc"),
    )
    for start in (crowded, full):
        gate = CertifiedGate(System([*start.robots, robot("second", "a b c")], start.capacity, start.fifo))
        assert (gate.promise, gate.by_chain_alone) == ("everyone", True)


def test_wide_places_are_for_the_chain_rule_at_once() -> None:
    """However small the system, a slot free everywhere is taken, and nothing is searched."""
    ring = system(
        {f"r{n}": "a b c d e f" for n in range(5)},
        starts={f"r{n}": n for n in range(5)},
        capacity=dict.fromkeys("abcdef", 2),
        fifo=tuple(StateId(s) for s in "abcdef"),
    )
    gate = CertifiedGate(ring, budget=1)
    assert isinstance(gate._proof, ChainRule)
    assert gate.promise == "everyone"


def test_wide_places_left_in_any_order_need_no_search_either() -> None:
    """A slot free everywhere is a witness by itself, however few configurations there are to look at."""
    ring = system(
        {f"r{n}": "a b c d e f" for n in range(5)},
        starts={f"r{n}": n for n in range(5)},
        capacity=dict.fromkeys("abcdef", 2),
    )
    gate = CertifiedGate(ring, budget=1)
    assert isinstance(gate._proof, FreeSlots)
    assert gate.promise == "everyone"
    assert all(gate.decide(ring.initial, i).admitted for i in range(5))


def test_a_slot_free_everywhere_is_looked_at_by_the_checker() -> None:
    """A witness that ends with a place full, or before an open path's end, is none."""
    ring = system(
        {"r1": "a b c", "r2": "a b c", "r3": "d e"},
        starts={"r1": 0, "r2": 1, "r3": 0},
        capacity={"a": 2, "b": 1, "c": 2},
        fifo=tuple(StateId(s) for s in "abc"),
    )
    blocking = [not own for own in ring.private]
    checker = Checker(ring)
    assert checker.leaves_room(ring.initial, [1], blocking)
    assert not checker.leaves_room(ring.initial, [], blocking), "b is full"
    assert not checker.leaves_room(ring.initial, [0], blocking), "b has no room"
    assert not checker.leaves_room(ring.initial, [1, 0, 1, 1], blocking), "b is full again"
    ends = system({"r1": "a b", "r2": "b c"}, capacity={"b": 3}, closed=False)
    blocking = [name == "b" for name in ends.states]
    assert not checker_of(ends, [1], blocking), "r1 ends where others pass"
    assert not checker_of(ends, [0], blocking), "r2 has not ended"


def checker_of(ends: System, moves: list[int], blocking: list[bool]) -> bool:
    return Checker(ends).leaves_room(ends.initial, moves, blocking)


def test_what_is_plain_for_the_chain_rule_is_decided_by_it() -> None:
    """On random systems with places of one to three, left in order of arrival or in any, loops and trips."""
    draw, plain = random.Random(1), 0
    for _ in range(400):
        paths = {f"r{n}": draw.sample("abcdef", draw.randint(2, 4)) for n in range(4)}
        visited = sorted({state for path in paths.values() for state in path})
        room = {state: draw.choice((1, 2, 2, 3, 3)) for state in visited}
        fifo = [StateId(state) for state in visited if draw.random() < 0.95]
        robots = [robot(name, " ".join(path), closed=draw.random() < 0.95) for name, path in paths.items()]
        try:
            made = System(robots, {StateId(name): most for name, most in room.items()}, fifo)
        except SystemModelError:
            continue
        if is_plain_for_the_chain(made):
            plain += 1
            proof = CertifiedGate(made)._proof
            assert isinstance(proof, ChainRule)
            assert (proof.by_chain_alone, proof.for_everyone) == (True, True)
    assert plain > 20
