"""Where closed walks can lie."""

from loopgate.network import RoadNetwork
from loopgate.network.road_graph import parts_with_loops


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
