"""Where closed walks can lie."""

import networkx as nx
from hypothesis import given
from hypothesis import strategies as st

from loopgate.network import RoadNetwork
from loopgate.network.road_graph import parts_with_loops, strong_parts


def test_parts_of_a_network() -> None:
    """The two rings of `square` without U-turns, all of it with them; the largest part comes first."""
    square = RoadNetwork.open("sumo:square")
    rings = parts_with_loops(square, vclass="passenger", u_turns=False)
    assert [(len(part.edges), part.movements) for part in rings] == [(4, 4), (4, 4)]
    (whole,) = parts_with_loops(square, vclass="passenger", u_turns=True)
    assert set(whole.edges) == set(square.edges)
    sizes = [
        len(part.edges)
        for part in parts_with_loops(RoadNetwork.open("sumo:A10KW"), vclass="passenger", u_turns=False)
    ]
    assert sizes == sorted(sizes, reverse=True)


def test_edges_that_lead_nowhere_are_no_part() -> None:
    """A street that no vehicle can drive round on has no closed walk."""
    street = RoadNetwork.open("sumo:fokr_bs_demo")
    assert parts_with_loops(street, vclass="passenger", u_turns=False) == ()


@given(st.lists(st.tuples(st.integers(0, 12), st.integers(0, 12)), max_size=40))
def test_parts_are_those_of_networkx(arcs: list[tuple[int, int]]) -> None:
    """For every graph, also with arcs from a node to itself and several arcs between two."""
    theirs: nx.DiGraph[str] = nx.DiGraph((str(tail), str(head)) for tail, head in arcs)
    onward = {node: list(theirs.successors(node)) for node in theirs}
    parts = map(sorted, nx.strongly_connected_components(theirs))
    assert sorted(map(sorted, strong_parts(onward))) == sorted(parts)
