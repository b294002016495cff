"""The ground that bodies sweep: who touches whom, who merely follows, and where one may wait."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from loopgate.abstraction.movements import FreePart, waiting_parts
from loopgate.abstraction.queue_layout import QueueLayout, lay_out_queues, tails_over
from loopgate.abstraction.swept import Touches, find_touches
from loopgate.abstraction.swept_paths import swept_paths_of
from loopgate.network import Connection, Edge, Lane, Loop, RoadNetwork, VehicleType, make_loop
from loopgate.network.road import Junction
from loopgate.network.vehicle_type import DEFAULT_TYPE

Points = tuple[tuple[float, float], ...]

Way = list[tuple[str, Points]]

BUS = VehicleType(id="bus", length_m=12.0)
STIFF = VehicleType(id="stiff", length_m=16.5)
TRAILER = VehicleType(id="trailer", length_m=16.5, vclass="trailer")


def length(shape: Points) -> float:
    """Return the length of a polyline."""
    return sum(math.dist(here, there) for here, there in itertools.pairwise(shape))


REGULATED = Junction("J", "priority", 0.0, 0.0, (), (frozenset(),), (frozenset(),))
UNREGULATED = Junction("J", "unregulated", 0.0, 0.0, (), (), ())


def network(
    ways: Sequence[Way], heights: dict[str, float] | None = None, junction: Junction = REGULATED
) -> RoadNetwork:
    """Return closed ways of lanes by name and shape; names of lanes inside junctions begin with a colon."""
    high = heights or {}
    lanes: dict[str, Lane] = {}
    connections: list[Connection] = []
    for way in ways:
        for name, shape in way:
            inside = name.startswith(":")
            lanes[f"{name}_0"] = Lane(
                f"{name}_0",
                name,
                0,
                inside,
                length(shape),
                10.0,
                3.2,
                shape,
                frozenset({"passenger"}),
                heights=(high[name],) * len(shape) if name in high else (),
            )
        roads = [k for k, (name, _) in enumerate(way) if not name.startswith(":")]
        for k, following in zip(roads, [*roads[1:], roads[0]], strict=True):
            between = way[k + 1 : following] if following > k else way[k + 1 :] + way[:following]
            via = tuple(f"{name}_0" for name, _ in between)
            ends = way[k][0], way[following][0]
            if ends not in [(c.from_edge, c.to_edge) for c in connections]:
                connections.append(Connection(ends[0], 0, ends[1], 0, via, "s", f"J{ends[0]}", -1, None))
    edges = {lane.edge: Edge(lane.edge, "J", "J", (lane,)) for lane in lanes.values() if not lane.internal}
    return RoadNetwork(
        name="made",
        file=Path("made"),
        edges=edges,
        lanes=lanes,
        junctions={"J": junction},
        connections=tuple(connections),
    )


def touches(net: RoadNetwork, *loops: list[str], kind: VehicleType = DEFAULT_TYPE) -> Touches:
    """Return the touches of vehicles on loops."""
    return find_touches(net, swept_paths_of(net, users(net, *loops, kind=kind)))


def users(
    net: RoadNetwork, *loops: list[str], kind: VehicleType = DEFAULT_TYPE
) -> list[tuple[Loop, VehicleType]]:
    """Return loops with a type each."""
    return [(make_loop(net, f"loop{k}", edges), kind) for k, edges in enumerate(loops)]


def lanes_of(found: Touches) -> set[frozenset[str]]:
    """Return the pairs of lanes on which fronts are that touch."""
    return {frozenset(lanes) for lanes in fronts_by_lanes(found)}


def fronts_by_lanes(found: Touches) -> dict[tuple[str, str], list[float]]:
    """Return where the first fronts are [m], by the lanes of both; in both orders."""
    by_lanes: dict[tuple[str, str], list[float]] = {}
    orders = (found.one, found.other, found.one_at_m), (found.other, found.one, found.other_at_m)
    for first, second, fronts in orders:
        for a, b, at in zip(first.tolist(), second.tolist(), fronts.tolist(), strict=True):
            by_lanes.setdefault((found.paths[a].lane, found.paths[b].lane), []).append(at)
    return by_lanes


EAST: Way = [
    ("w", ((-100.0, 0.0), (-10.0, 0.0))),
    (":ew", ((-10.0, 0.0), (10.0, 0.0))),
    ("e", ((10.0, 0.0), (100.0, 0.0))),
]
BACK: Way = [
    (":eb", ((100.0, 0.0), (100.0, 200.0))),
    ("b", ((100.0, 200.0), (-100.0, 200.0))),
    (":bw", ((-100.0, 200.0), (-100.0, 0.0))),
]


def across(at: float, *, before: float = -100.0) -> Way:
    """Return a way from south to north at an x, and back far to the west."""
    return [
        ("s", ((at, before), (at, -10.0))),
        (":sn", ((at, -10.0), (at, 10.0))),
        ("n", ((at, 10.0), (at, 100.0))),
        (":far", ((at, 100.0), (-500.0, 100.0))),
        ("f", ((-500.0, 100.0), (-500.0, before))),
        (":home", ((-500.0, before), (at, before))),
    ]


def test_ways_that_cross_touch_where_they_do() -> None:
    """Cars of 1.8 m at right angles: from two metres or so before the middle to as much behind."""
    net = network([EAST + BACK, across(0.0)])
    found = touches(net, ["w", "e", "b"], ["s", "n", "f"])
    assert frozenset((":ew_0", ":sn_0")) in lanes_of(found)
    fronts = fronts_by_lanes(found)[":ew_0", ":sn_0"]
    assert min(fronts) == pytest.approx(10.0 - 1.6, abs=0.6)
    layout = lay_out_queues(net, users(net, ["w", "e", "b"], ["s", "n", "f"]))
    begin, end = layout.conflicts.overlaps["w_0>e_0"]["s_0>n_0"]
    assert begin == pytest.approx(8.4, abs=0.8)
    assert end == pytest.approx(11.6, abs=0.8)


def test_a_stop_line_moves_back_from_a_way_that_passes_over_it() -> None:
    """The other road passes 12 m before the end of w, on which vehicles would wait."""
    net = network([EAST + BACK, across(-12.0)])
    found = touches(net, ["w", "e", "b"], ["s", "n", "f"])
    part = waiting_parts(net, found, {})["w_0"]
    assert part.begin_m == 0.0
    assert part.end_m == pytest.approx(90.0 - 2.0 - 1.6, abs=1.1)
    layout: QueueLayout = lay_out_queues(net, users(net, ["w", "e", "b"], ["s", "n", "f"]))
    leg = next(leg for leg in layout.itineraries["loop0"].legs if leg.state == "w_0")
    assert leg.end_m == pytest.approx(part.end_m - 0.1)
    assert leg.crossings[0].foes == {"s_0>n_0"}
    assert leg.crossings[0].ahead_m == pytest.approx(90.0 - leg.end_m)


def test_a_place_begins_where_nobody_passes_any_more() -> None:
    """The other road passes 8 m behind the beginning of e: rears have to be past that."""
    net = network([EAST + BACK, across(18.0)])
    part = waiting_parts(net, touches(net, ["w", "e", "b"], ["s", "n", "f"]), {})["e_0"]
    assert part.begin_m == pytest.approx(8.0 + 1.6, abs=1.1)
    assert part.end_m == pytest.approx(90.0)


def test_a_stop_line_moves_back_from_the_tails_of_those_who_turn_off() -> None:
    """A car that turns by 45 degrees on the spot swings 0.9 m x sin 45 back over the lane it has left."""
    ahead: dict[str, Points] = {"straight on": ((0.0, 0.0), (10.0, 0.0)), "aside": ((0.0, 0.0), (7.1, 7.1))}
    ends = {}
    for name, inside in ahead.items():
        on = ((inside[1], (60.0, 0.0)), ((60.0, 0.0), (60.0, -80.0), (-100.0, -80.0), (-100.0, 0.0)))
        way: Way = [("w", ((-100.0, 0.0), (0.0, 0.0))), (":on", inside), ("e", on[0]), (":home", on[1])]
        net = network([way])
        layout = lay_out_queues(net, users(net, ["w", "e"]))
        ends[name] = next(leg for leg in layout.itineraries["loop0"].legs if leg.state == "w_0").end_m
    assert ends["straight on"] - ends["aside"] == pytest.approx(0.9 * math.sin(math.pi / 4), abs=0.05)


def test_a_way_that_bends_back_over_its_own_stop_line_is_its_own_foe() -> None:
    """Inside the junction it leads from w round over the last metres of w."""
    ring: Points = (
        (-10.0, 0.0),
        (5.0, 0.0),
        (15.0, 15.0),
        (0.0, 30.0),
        (-20.0, 20.0),
        (-20.0, -20.0),
        (0.0, -40.0),
    )
    way: Way = [
        ("w", ((-100.0, 0.0), (-10.0, 0.0))),
        (":ring", ring),
        ("e", ((0.0, -40.0), (100.0, -40.0))),
        (":round", ((100.0, -40.0), (100.0, -100.0), (-150.0, -100.0), (-150.0, 0.0))),
        ("b", ((-150.0, 0.0), (-120.0, 0.0))),
        (":on", ((-120.0, 0.0), (-100.0, 0.0))),
    ]
    net = network([way])
    layout = lay_out_queues(net, users(net, ["w", "e", "b"]))
    assert "w_0>e_0" in layout.conflicts.foes["w_0>e_0"]
    leg = next(leg for leg in layout.itineraries["loop0"].legs if leg.state == "w_0")
    assert leg.end_m < layout.itineraries["loop0"].loop.length_m
    assert waiting_parts(net, touches(net, ["w", "e", "b"]), {})["w_0"].end_m < 80.0


def test_what_is_jointed_bends_at_the_corner_where_what_is_stiff_cuts_it() -> None:
    """The other road ends 3 m inside the corner: only what is stiff sweeps over it."""
    corner: Way = [
        ("w", ((-100.0, 0.0), (0.0, 0.0))),
        (":corner", ((0.0, 0.0), (0.0, 0.1))),
        ("n", ((0.0, 0.1), (0.0, 100.0))),
        (":home", ((0.0, 100.0), (-300.0, 100.0), (-300.0, 0.0), (-100.0, 0.0))),
    ]
    inside: Way = [
        ("i", ((-90.0, 90.0), (-4.5, 4.5))),
        (":back", ((-4.5, 4.5), (-90.0, 95.0), (-100.0, 95.0), (-90.0, 90.0))),
    ]
    net = network([corner, inside])
    (round_corner, _), (on_the_other, _) = users(net, ["w", "n"], ["i"])
    met = {}
    for kind in (STIFF, TRAILER):
        users_of_it = [(round_corner, kind), (on_the_other, DEFAULT_TYPE)]
        found = find_touches(net, swept_paths_of(net, users_of_it))
        met[kind.id] = frozenset(("n_0", "i_0")) in lanes_of(found)
    assert met == {"stiff": True, "trailer": False}


def test_a_bridge_does_not_touch_the_road_below() -> None:
    """Six metres higher it does not, one metre it does."""
    for above, apart in ((6.0, True), (1.0, False)):
        heights = {name: above for name, _ in across(0.0)} | {name: 0.0 for name, _ in EAST + BACK}
        net = network([EAST + BACK, across(0.0)], heights)
        found = touches(net, ["w", "e", "b"], ["s", "n", "f"])
        assert (frozenset((":ew_0", ":sn_0")) not in lanes_of(found)) is apart


def test_who_follows_does_not_touch() -> None:
    """On one loop alone, and where another one leaves the same lane."""
    net = network([EAST + BACK])
    assert not len(touches(net, ["w", "e", "b"]).one)


def test_who_goes_on_behind_a_short_way_is_apart_from_who_still_turns() -> None:
    """Straight on is 0.1 m inside the junction: on the road behind it nobody looks back for who turns."""
    straight: Way = [
        ("w", ((-100.0, 0.0), (0.0, 0.0))),
        (":on", ((0.0, 0.0), (0.1, 0.0))),
        ("e", ((0.1, 0.0), (100.0, 0.0))),
        (":home", ((100.0, 0.0), (100.0, -100.0), (-150.0, -100.0), (-150.0, 0.0), (-100.0, 0.0))),
    ]
    turn: Way = [
        ("w", straight[0][1]),
        (":turn", ((0.0, 0.0), (4.0, 0.5), (6.0, 3.0), (4.0, 8.0), (0.0, 14.0))),
        ("n", ((0.0, 14.0), (0.0, 100.0))),
        (":back", ((0.0, 100.0), (-150.0, 100.0), (-150.0, 0.0), (-100.0, 0.0))),
    ]
    net = network([straight, turn])
    layout = lay_out_queues(net, users(net, ["w", "e"], ["w", "n"]))
    assert "w_0>n_0" in layout.conflicts.foes["w_0>e_0"]
    longer = [
        *straight[:1],
        (":on", ((0.0, 0.0), (20.0, 0.0))),
        ("e", ((20.0, 0.0), (100.0, 0.0))),
        straight[3],
    ]
    net = network([longer, turn])
    layout = lay_out_queues(net, users(net, ["w", "e"], ["w", "n"]))
    assert "w_0>n_0" not in layout.conflicts.foes.get("w_0>e_0", ())


def test_vehicles_that_take_two_movements_one_after_the_other_follow_each_other() -> None:
    """Two ways join before a lane of 0.2 m and part behind it: who comes from the other way may be beside."""
    short, on = ((0.0, 0.0), (0.2, 0.0)), ((0.2, 0.0), (7.0, 0.0))
    first: Way = [
        ("w", ((-100.0, 0.0), (-40.0, 0.0))),
        (":in", ((-40.0, 0.0), (0.0, 0.0))),
        ("s", short),
        (":on", on),
        ("e", ((7.0, 0.0), (107.0, 0.0))),
        (":home", ((107.0, 0.0), (107.0, -99.0), (-150.0, -99.0), (-150.0, 0.0), (-100.0, 0.0))),
    ]
    second: Way = [
        ("u", ((-100.0, -30.0), (-30.0, -8.0))),
        (":join", ((-30.0, -8.0), (0.0, 0.0))),
        ("s", short),
        (":off", ((0.2, 0.0), (7.0, 2.0))),
        ("f", ((7.0, 2.0), (100.0, 60.0))),
        (":back", ((100.0, 60.0), (100.0, 150.0), (-160.0, 150.0), (-160.0, -30.0), (-100.0, -30.0))),
    ]
    net = network([first, second])
    layout = lay_out_queues(net, users(net, ["w", "s", "e"], ["u", "s", "f"]))
    assert "w_0>s_0" in layout.conflicts.foes["s_0>f_0"]
    assert ("w_0>s_0", "s_0>f_0") in layout.conflicts.with_others
    legs = [leg for itinerary in layout.itineraries.values() for leg in itinerary.legs]
    over = next(leg.crossings for leg in legs if [c.id for c in leg.crossings] == ["w_0>s_0", "s_0>e_0"])
    assert over[0].foes >= {"u_0>s_0", "s_0>f_0"}
    assert "w_0>s_0" not in over[1].foes


def test_without_right_of_way_ways_out_of_one_lane_are_foes() -> None:
    """At an unregulated junction SUMO keeps nobody apart, at any other it does."""
    ahead: Way = [
        ("w", ((-100.0, 0.0), (0.0, 0.0))),
        (":on", ((0.0, 0.0), (20.0, 0.0))),
        ("e", ((20.0, 0.0), (100.0, 0.0))),
        (":home", ((100.0, 0.0), (100.0, -100.0), (-150.0, -100.0), (-150.0, 0.0), (-100.0, 0.0))),
    ]
    turn: Way = [
        ("w", ahead[0][1]),
        (":turn", ((0.0, 0.0), (4.0, 0.5), (6.0, 3.0), (4.0, 8.0), (0.0, 14.0))),
        ("n", ((0.0, 14.0), (0.0, 100.0))),
        (":back", ((0.0, 100.0), (-150.0, 100.0), (-150.0, 0.0), (-100.0, 0.0))),
    ]
    for junction, apart in ((REGULATED, True), (UNREGULATED, False)):
        net = network([ahead, turn], junction=junction)
        layout = lay_out_queues(net, users(net, ["w", "e"], ["w", "n"]))
        assert ("w_0>n_0" not in layout.conflicts.foes.get("w_0>e_0", ())) is apart


PARTS: Points = ((0.0, 0.0), (17.0, 1.2), (25.0, 5.0), (40.0, 14.0))
TURNS_BACK: Points = ((0.0, 0.0), (8.0, 3.0), (16.0, 6.0), (24.0, 3.0), (32.0, -3.0), (40.0, -12.0))


@pytest.mark.parametrize(
    ("aside", "meets_m"), [(PARTS, None), (TURNS_BACK, 24.0)], ids=["parts", "turns back"]
)
def test_who_leaves_a_lane_follows_until_the_ways_part(aside: Points, meets_m: float | None) -> None:
    """One way leads straight on over 40 m; the other parts late, or comes back across it."""
    straight: Points = ((0.0, 0.0), (40.0, 0.0))
    ways = []
    for name, inside, far in (
        ("straight", straight, 300.0),
        ("aside", aside, 400.0 if meets_m is None else -400.0),
    ):
        (x, y), end = inside[-1], (inside[-1][0] + 100.0, inside[-1][1])
        home = (end, (end[0] + 50.0, far), (-150.0, far), (-100.0, 0.0))
        ways.append(
            [
                ("w", ((-100.0, 0.0), (0.0, 0.0))),
                (f":{name}", inside),
                (name, ((x, y), end)),
                (f":home {name}", home),
            ]
        )
    net = network(ways)
    layout = lay_out_queues(net, users(net, ["w", "straight"], ["w", "aside"]))
    foes = layout.conflicts.foes["w_0>straight_0"]
    assert ("w_0>aside_0" in foes) is (meets_m is not None)
    if meets_m is not None:
        begin_m, _ = layout.conflicts.overlaps["w_0>straight_0"]["w_0>aside_0"]
        assert begin_m == pytest.approx(meets_m, abs=4.0)


def test_long_bodies_cut_corners() -> None:
    """A turn of 9 m radius: a car keeps off a lane 3.4 m inside of it, a bus does not."""
    turn: Points = tuple(
        (-10.0 + 9.0 * x, 9.0 - 9.0 * y)
        for x, y in ((0.0, 1.0), (0.383, 0.924), (0.707, 0.707), (0.924, 0.383), (1.0, 0.0))
    )
    way: Way = [
        ("w", ((-100.0, 0.0), (-10.0, 0.0))),
        (":left", turn),
        ("n", ((-1.0, 9.0), (-1.0, 100.0))),
        (":back", ((-1.0, 100.0), (-300.0, 100.0))),
        ("f", ((-300.0, 100.0), (-300.0, 0.0))),
        (":home", ((-300.0, 0.0), (-100.0, 0.0))),
    ]
    beside: Way = [
        ("x", ((-60.0, 3.4), (-9.0, 3.4))),
        (":xy", ((-9.0, 3.4), (-9.0, 60.0))),
        ("y", ((-9.0, 60.0), (-200.0, 60.0))),
        (":yx", ((-200.0, 60.0), (-200.0, 3.4), (-60.0, 3.4))),
    ]
    net = network([way, beside])
    waits = [
        waiting_parts(net, touches(net, ["w", "n", "f"], ["x", "y"], kind=kind), {}).get(
            "x_0", FreePart(0.0, 51.0)
        )
        for kind in (DEFAULT_TYPE, BUS)
    ]
    assert waits[1].end_m < waits[0].end_m


def test_two_lanes_of_one_edge_are_left_to_sumo() -> None:
    """They may be narrower than two bodies; nobody changes lanes there."""
    net = network([EAST + BACK])
    lane = net.lanes["w_0"]
    twin = replace(lane, id="w_1", index=1, shape=tuple((x, y + 1.0) for x, y in lane.shape))
    edges = dict(net.edges) | {"w": Edge("w", "J", "J", (lane, twin))}
    wide = RoadNetwork(
        name="made",
        file=net.file,
        edges=edges,
        lanes={**net.lanes, "w_1": twin},
        junctions=net.junctions,
        connections=net.connections,
    )
    assert not len(touches(wide, ["w", "e", "b"]).one)


def test_who_waits_keeps_clear_of_who_turns_round() -> None:
    """At a dead end the body of who has turned lies across the junction, over the end of the lane it left."""
    there: Way = [
        ("w", ((-100.0, 0.0), (0.0, 0.0))),
        (":turn", ((0.0, 0.0), (1.0, 0.3), (1.3, 1.3), (1.0, 2.3), (0.0, 2.6))),
        ("b", ((0.0, 2.6), (-100.0, 2.6))),
        (":home", ((-100.0, 2.6), (-101.0, 2.3), (-101.3, 1.3), (-101.0, 0.3), (-100.0, 0.0))),
    ]
    net = network([there])
    courses = swept_paths_of(net, users(net, ["w", "b"]))
    swing = tails_over(net, courses)
    assert swing["w_0"] > 0.5
    without = {course: bodies for course, bodies in courses.items() if net.lanes[course.lane].internal}
    assert tails_over(net, without).get("w_0", 0.0) < swing["w_0"]
