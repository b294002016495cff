"""Which lanes a vehicle takes round a loop, on hand-made roads."""

from __future__ import annotations

import pytest
from roads import roads

from loopgate.errors import RouteError
from loopgate.network import make_loop


def lanes(loop_spans: object) -> list[tuple[str, ...]]:
    return [span.lane_ids for span in loop_spans]  # type: ignore[attr-defined]


def test_the_lane_that_makes_the_turn() -> None:
    """Two lanes all the way, but only lane 1 turns from b back to a: lane 1 all round, no change."""
    net = roads({"a": (100, 2), "b": (100, 2)}, ["a_0>b_0", "a_1>b_1", "b_1>a_1"])
    loop = make_loop(net, "l", ["a", "b"])
    assert lanes(loop.spans) == [("a_1",), ("b_1",)]


def test_a_change_sweeps_every_edge_on_which_it_could_happen() -> None:
    """Entered on lane 0 of a, left on lane 1 of c: one change, on a, b or c, whichever SUMO likes."""
    net = roads(
        {"a": (100, 2), "b": (90, 2), "c": (120, 2), "d": (100, 1)},
        ["a_0>b_0", "a_1>b_1", "b_0>c_0", "b_1>c_1", "c_1>d_0", "d_0>a_0"],
    )
    loop = make_loop(net, "l", ["a", "b", "c", "d"])
    assert [set(ids) for ids in lanes(loop.spans)] == [
        {"a_0", "a_1"},
        {"b_0", "b_1"},
        {"c_0", "c_1"},
        {"d_0"},
    ]
    assert [span.changes for span in loop.spans] == [True, True, True, False]
    assert all(span.lane_ids[0] == span.lane_id for span in loop.spans)


def test_lanes_that_are_as_good_count_both() -> None:
    """Two lanes lead all the way round: the vehicle may keep to either."""
    net = roads({"a": (100, 2), "b": (100, 2)}, ["a_0>b_0", "a_1>b_1", "b_0>a_0", "b_1>a_1"])
    loop = make_loop(net, "l", ["a", "b"])
    assert lanes(loop.spans) == [("a_0", "a_1"), ("b_0", "b_1")]


def test_changing_on_the_longer_edge_is_preferred() -> None:
    """The change may be made on a (10 m) or on b (200 m): the reference lane changes on b."""
    net = roads(
        {"a": (10, 2), "b": (200, 2), "d": (100, 1)},
        ["a_0>b_0", "a_1>b_1", "b_1>d_0", "d_0>a_0"],
    )
    loop = make_loop(net, "l", ["a", "b", "d"])
    assert [span.lane for span in loop.spans] == [0, 1, 0]


def test_a_bus_lane_between_cannot_be_crossed() -> None:
    """The only way round would cross lane 1, which is for buses."""
    net = roads({"a": (100, 3), "b": (100, 1)}, ["a_2>b_0", "b_0>a_0"], buses_only=["a_1"])
    with pytest.raises(RouteError, match="route l: no lanes open to passenger lead all the way round"):
        make_loop(net, "l", ["a", "b"])
    assert make_loop(net, "l", ["a", "b"], vclass="bus").length_m == 200.0


def test_an_edge_that_leads_to_itself_is_a_loop() -> None:
    """A roundabout of a single edge."""
    assert make_loop(roads({"a": (100, 1)}, ["a_0>a_0"]), "l", ["a"]).length_m == 100.0


@pytest.mark.parametrize(
    ("edges", "text"),
    [
        (["a", "b", "x"], "f.rou.xml: route l: edge x is not in the network hand-made"),
        (
            ["a", "bus"],
            "f.rou.xml: route l: edge bus is closed to passenger .open to bus.; lead the route round",
        ),
        (
            ["a", "c", "b"],
            "f.rou.xml: route l: edge a does not lead to edge c .from a a passenger can go to b.",
        ),
        (
            ["a", "b", "c"],
            "route l: not a loop: its last edge c does not lead to its first edge a .c leads now",
        ),
        (
            ["a", "b"],
            "not a loop: its last edge b does not lead to its first edge a .* can go to c.; add the",
        ),
        ([], "route l: it has no edges"),
    ],
)
def test_routes_that_are_no_loops(edges: list[str], text: str) -> None:
    """Each error names the file, the route and the edge, and says what to do."""
    net = roads(
        {"a": (100, 1), "b": (100, 1), "c": (100, 1), "bus": (100, 1)},
        ["a_0>b_0", "b_0>c_0", "a_0>bus_0", "bus_0>a_0"],
        buses_only=["bus_0"],
    )
    with pytest.raises(RouteError, match=text):
        make_loop(net, "l", edges, source="f.rou.xml")
