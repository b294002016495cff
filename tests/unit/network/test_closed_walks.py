"""Every closed walk, against networkx."""

from __future__ import annotations

import random

import networkx as nx
from hypothesis import given, settings
from hypothesis import strategies as st

from loopgate.network.generate import every_walk
from loopgate.network.road_graph import GraphRoad, RoadGraph


def random_part(seed: int) -> RoadGraph:
    """Return twelve edges, each of which leads to one to three others, itself among them at times."""
    rng = random.Random(seed)
    roads = tuple(
        GraphRoad(
            rng.uniform(10.0, 50.0),
            tuple((k, rng.uniform(1.0, 9.0)) for k in sorted(rng.sample(range(12), rng.randint(1, 3)))),
        )
        for _ in range(12)
    )
    return RoadGraph(tuple(f"e{k}" for k in range(12)), roads)


def length_m(part: RoadGraph, walk: list[int]) -> float:
    """Return how long a closed walk is."""
    onward = zip(walk, walk[1:] + walk[:1], strict=True)
    return sum(part.roads[a].length_m + dict(part.roads[a].onward)[b] for a, b in onward)


@given(seed=st.integers(0, 10**6))
@settings(max_examples=30)
def test_every_walk_comes_once(seed: int) -> None:
    """All that are short enough and no other, however crossed the edges are."""
    part = random_part(seed)
    graph = nx.DiGraph((k, f) for k, road in enumerate(part.roads) for f, _ in road.onward)
    every = [cycle for cycle in nx.simple_cycles(graph) if length_m(part, cycle) <= 200.0]
    walks = [walk for walk in every_walk(part, 200.0) if walk is not None]
    assert len(set(walks)) == len(walks) == len(every)
    assert {frozenset(walk) for walk in walks} == {frozenset(part.edges[k] for k in c) for c in every}
    for walk in walks:
        assert length_m(part, [part.edges.index(edge) for edge in walk]) <= 200.0


def test_what_comes_first_is_spread() -> None:
    """The searches take turns: three corners with hundreds of walks each are all seen early."""
    corners, size = 3, 7
    roads = tuple(
        GraphRoad(10.0, tuple((size * corner + k, 0.0) for k in range(size) if k != here))
        for corner in range(corners)
        for here in range(size)
    )
    part = RoadGraph(tuple(f"e{k}" for k in range(corners * size)), roads)
    walks = [walk for walk in every_walk(part, 100.0) if walk is not None]
    assert len(walks) > 3000
    early = {int(walk[0][1:]) // size for walk in walks[: len(walks) // 4]}
    assert early == {0, 1, 2}
