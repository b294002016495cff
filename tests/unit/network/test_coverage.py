"""Coverage on a road of a few lanes, counted by hand."""

import pytest
from roads import roads

from loopgate.network import make_loop
from loopgate.network.coverage import measure_coverage

EDGES = {"a": (100.0, 2), "b": (50.0, 1), "c": (200.0, 1), "buses": (70.0, 1)}


def test_coverage_by_hand() -> None:
    """The loop a, b drives on one lane of a: 2 of 3 edges, 150 of 450 m; buses do not count."""
    network = roads(EDGES, ["a_0>b_0", "b_0>a_0", "b_0>c_0", "c_0>a_1"], buses_only=["buses_0"])
    found = measure_coverage(network, [make_loop(network, "round", ["a", "b"])])
    assert (found.visited_edges, found.edges) == (2, 3)
    assert found.of_edges == pytest.approx(2 / 3)
    assert (found.visited_lane_km, found.lane_km) == pytest.approx((0.15, 0.45))
    assert found.of_lane_km == pytest.approx(1 / 3)


def test_loops_that_no_car_can_drive_are_measured_by_the_roads_of_their_own_class() -> None:
    """A line on two of four roads that are open to buses: not 0 of the one that is open to cars."""
    sizes = {"a": (100.0, 1), "b": (50.0, 1), "c": (50.0, 1), "cars": (100.0, 1)}
    network = roads(sizes, ["a_0>b_0", "b_0>a_0", "b_0>c_0"], buses_only=["a_0", "b_0", "c_0"])
    found = measure_coverage(network, [make_loop(network, "line", ["a", "b"], vclass="bus")])
    assert (found.visited_edges, found.edges) == (2, 4)
    assert found.of_lane_km == pytest.approx(0.5)


def test_nothing_covers_nothing() -> None:
    """No loops, or no road for the class: shares of 0."""
    network = roads(EDGES, [])
    assert measure_coverage(network, []).of_edges == 0.0
    none = measure_coverage(network, [], vclass="ship")
    assert (none.edges, none.of_edges, none.of_lane_km) == (0, 0.0, 0.0)
