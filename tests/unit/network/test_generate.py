"""Random loops, and all there are where these run out."""

from __future__ import annotations

import pytest

from loopgate.errors import RouteError
from loopgate.network import FoundLoops, Loop, RoadNetwork, find_loops, generate_loops


@pytest.fixture(scope="module")
def bs3d() -> RoadNetwork:
    return RoadNetwork.open("sumo:bs3d")


@pytest.mark.parametrize("seed", [1, 2])
def test_generated_loops(bs3d: RoadNetwork, seed: int) -> None:
    """Distinct, closed, edge-simple, in range, without U-turns, and the same for the same seed."""
    loops = generate_loops(bs3d, 12, length_m=(500, 2500), seed=seed)
    assert loops == generate_loops(bs3d, 12, length_m=(500, 2500), seed=seed)
    assert len({frozenset(loop.edges) for loop in loops}) == 12
    for loop in loops:
        assert len(set(loop.edges)) == len(loop.edges)
        assert 500 <= loop.length_m <= 2500
        for here, there in zip(loop.edges, loop.edges[1:] + loop.edges[:1], strict=True):
            assert any(c.direction != "t" for c in bs3d.between(here, there))


def test_loops_over_some_streets_and_not_over_others(bs3d: RoadNetwork) -> None:
    """All lead over both edges, none over those that are closed; random ones first, then all there are."""
    first = generate_loops(bs3d, 1, length_m=(800, 2500))[0]
    via = first.edges[0], first.edges[len(first.edges) // 2]
    others = find_loops(bs3d, 6, length_m=(400, 4000), via=via).loops
    assert len(others) > 1
    assert all(set(via) <= set(loop.edges) for loop in others)
    closed = set(others[0].edges) - set(others[1].edges) - set(via)
    kept = find_loops(bs3d.without(closed), 6, length_m=(400, 4000), via=via).loops
    assert kept
    assert all(closed.isdisjoint(loop.edges) for loop in kept)
    with pytest.raises(RouteError, match=f"no loop leads over {via[0]}"):
        find_loops(bs3d.without(via[:1]), 6, via=via)


def test_seeds_differ(bs3d: RoadNetwork) -> None:
    """Another seed makes other loops."""
    one, two = (generate_loops(bs3d, 6, seed=seed) for seed in (1, 2))
    assert {loop.edges for loop in one} != {loop.edges for loop in two}


@pytest.fixture(scope="module")
def every(bs3d: RoadNetwork) -> FoundLoops:
    """All loops of usual length in Braunschweig; random walks alone find 75 of them."""
    return find_loops(bs3d, 90)


def test_the_search_finds_all_there_are(bs3d: RoadNetwork, every: FoundLoops) -> None:
    """Another seed, and a filter that takes all, end with the same loops, and say that these are all."""
    again = find_loops(bs3d, 90, seed=2, admits=lambda _: True)
    assert {_round(loop) for loop in again.loops} == {_round(loop) for loop in every.loops}
    assert [loop.id for loop in every.loops] == [f"loop{k}" for k in range(80)]
    for found in (every, again):
        assert "found 80 of 90 loops" in found.shortfall
        assert found.shortfall.endswith("there are no others")
        assert "--u-turns" in found.way_out


def test_a_filter_drops_no_more_than_it_refuses(bs3d: RoadNetwork, every: FoundLoops) -> None:
    """What the filter takes of all there are is found, and how much it refused is said."""
    some = find_loops(bs3d, 90, admits=lambda loop: len(loop.edges) % 2 == 0)
    assert {_round(x) for x in some.loops} == {_round(x) for x in every.loops if len(x.edges) % 2 == 0}
    assert f"there are no others, besides {80 - len(some.loops)} that share too much" in some.shortfall


def test_enough_is_enough(bs3d: RoadNetwork) -> None:
    """Where all are found nothing is said."""
    found = find_loops(bs3d, 5)
    assert (len(found.loops), found.shortfall, found.way_out) == (5, "", "")


def test_more_than_can_be_looked_at() -> None:
    """With thousands of loops to refuse the search gives up, and does not say that there are no others."""
    with pytest.raises(RouteError, match=r"found 0 of 1 loops .*; no others were found, besides [0-9]+ that"):
        find_loops(RoadNetwork.open("sumo:DRT"), 1, length_m=(400, 4000), admits=lambda _: False)


def test_loops_off_the_largest_part() -> None:
    """`square` is two rings that do not meet."""
    square = RoadNetwork.open("sumo:square")
    assert len(find_loops(square, 5, length_m=(100, 5000)).loops) == 2


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("square", r"found 0 of 3 loops .*; there are none, the longest below that has 399.2 m; widen --len"),
        ("fokr_bs_demo", r"no way round for passenger: .*; turning round is the only way: allow --u-turns"),
    ],
)
def test_not_a_single_loop(name: str, words: str) -> None:
    """The one case that is an error, and what to do about it."""
    network = RoadNetwork.open(f"sumo:{name}")
    with pytest.raises(RouteError, match=words):
        find_loops(network, 3)
    assert find_loops(network, 3, u_turns=True).loops


def test_u_turns_are_recommended_only_where_they_help() -> None:
    """Nobody can turn round on grid6."""
    with pytest.raises(RouteError, match=r"found 1 of 3 loops .*; there are no others; ask for fewer, widen"):
        generate_loops(RoadNetwork.open("sumo:grid6"), 3)
    assert "u-turns" not in find_loops(RoadNetwork.open("sumo:grid6"), 3).way_out


def _round(loop: Loop) -> frozenset[str]:
    return frozenset(loop.edges)
