"""Covering loops on random roads: closed, connected, and over every edge that can be covered."""

from __future__ import annotations

import networkx as nx
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from roads import roads

from loopgate.network.cover.design import CoverTask, make_design, walks_of


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_loops_cover_what_can_be_covered(data: st.DataObject) -> None:
    """Against strongly connected components; no cheaper than the circulation, none shorter than the bound."""
    size = data.draw(st.integers(2, 12))
    ends = st.integers(0, size - 1)
    arcs = data.draw(st.sets(st.tuples(ends, ends), min_size=1, max_size=4 * size))
    lengths = data.draw(st.lists(st.integers(20, 400), min_size=size, max_size=size))
    network = roads(
        {f"e{k}": (length, 1) for k, length in enumerate(lengths)},
        [f"e{a}_0>e{b}_0" for a, b in sorted(arcs)],
    )
    graph = nx.DiGraph(arcs)
    parts = [p for p in nx.strongly_connected_components(graph) if len(p) > 1 or graph.has_edge(*list(p) * 2)]
    if not parts:
        return
    design = make_design(network, CoverTask())
    largest = max(map(len, parts))
    assert {f"e{k}" for k in range(size)} == set(design.required) | set(design.left_out)
    assert len(design.required) == largest
    count = data.draw(st.integers(1, 4))
    *_, plan = design.plans(count, seed=1)
    walks = [[design.graph.edges[node] for node in walk] for walk in walks_of(design, plan)]
    assert {edge for walk in walks for edge in walk} == set(design.required)
    for walk, length in zip(walks, plan.lengths, strict=True):
        for here, there in zip(walk, [*walk[1:], walk[0]], strict=True):
            assert network.between(here, there)
        assert sum(network.edges[edge].length_m for edge in walk) == pytest.approx(length, abs=0.1)
    assert len(walks) == min(count, largest)
    assert plan.total >= design.circulation - 0.1
    assert plan.longest >= design.bound(len(walks)) - 0.1
