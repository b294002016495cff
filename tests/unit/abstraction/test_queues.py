"""Places, crossings and starts of the queues abstraction, on hand-made roads and on real networks."""

from __future__ import annotations

import itertools
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely
from roads import roads

from loopgate.abstraction.itinerary import Guide
from loopgate.abstraction.movements import REACH_M, reach_m
from loopgate.abstraction.queue_layout import lay_out_queues, why_not
from loopgate.abstraction.queue_survey import RefusedLoop, survey_queues
from loopgate.abstraction.queues import make_queues
from loopgate.errors import LoopRefusal, RefusedLoopError, ScenarioError, TooManyVehiclesError
from loopgate.gates import make_gate
from loopgate.network import RoadNetwork, VehicleType, generate_loops, make_loop
from loopgate.network.vehicle_type import DEFAULT_TYPE

GRID = Path(__file__).resolve().parents[3] / "networks" / "grid5-priority.net.xml"


def apart(network: RoadNetwork) -> RoadNetwork:
    """Give each movement a junction of its own."""
    return RoadNetwork(
        name=network.name,
        file=network.file,
        edges=network.edges,
        lanes=network.lanes,
        junctions={},
        connections=tuple(replace(c, junction=f"J{c.id}", link=-1) for c in network.connections),
    )


# b holds one vehicle: floor((10 - 1.1) / 7.5).
RING = apart(roads({"a": (80.0, 1), "b": (10.0, 1), "c": (40.0, 1)}, ["a_0>b_0", "b_0>c_0", "c_0>a_0"]))


def test_places_are_lanes_that_hold_two_and_short_ones_join_the_crossing() -> None:
    """80 m hold floor(78.9 / 7.5) = 10 vehicles and 40 m five; 10 m hold one, so b lies in a crossing."""
    loop = make_loop(RING, "ring", ["a", "b", "c"])
    abstraction = make_queues(RING, [loop] * 3)
    assert dict(abstraction.system.capacity) == {"a_0": 10, "c_0": 5}
    legs = abstraction.itineraries[0].legs
    assert [leg.state for leg in legs] == ["a_0", "c_0"]
    assert [[crossing.id for crossing in leg.crossings] for leg in legs] == [
        ["a_0>b_0", "b_0>c_0"],
        ["c_0>a_0"],
    ]
    assert [(leg.begin_m, leg.end_m) for leg in legs] == [(0.0, 79.9), (90.0, 129.9)]


def test_the_longest_visitor_of_a_lane_says_how_many_it_holds() -> None:
    """A bus of 12 m with a gap of 3 m: floor(78.9 / 15) = 5."""
    loop = make_loop(RING, "ring", ["a", "b", "c"])
    bus = VehicleType(id="bus", length_m=12.0, min_gap_m=3.0)
    places = lay_out_queues(RING, [(loop, DEFAULT_TYPE), (loop, bus)]).places
    assert {name: place.capacity for name, place in places.items()} == {"a_0": 5, "c_0": 2}


def test_a_place_holds_as_many_as_fit_whichever_they_are() -> None:
    """Where all vehicles are known: a bus of 15 m and cars of 7.5 m, 78.9 m and 38.9 m of room."""
    loop = make_loop(RING, "ring", ["a", "b", "c"])
    bus = VehicleType(id="bus", length_m=12.0, min_gap_m=3.0)
    for buses, most in ((1, {"a_0": 9, "c_0": 4}), (2, {"a_0": 8, "c_0": 3}), (9, {"a_0": 5, "c_0": 2})):
        later = [(loop, bus)] * buses + [(loop, DEFAULT_TYPE)] * 4
        assert dict(make_queues(RING, [loop], later=later).room) == most


def test_more_vehicles_than_can_start_are_refused_with_the_number_that_can() -> None:
    """One slot stays free on each place: 9 and 4 of 10 and 5."""
    loop = make_loop(RING, "ring", ["a", "b", "c"])
    assert len(make_queues(RING, [loop] * 13).starts_m) == 13
    with pytest.raises(ScenarioError, match="14 vehicles are too many for 1 loops; the first 13 can start"):
        make_queues(RING, [loop] * 14)


def test_the_number_that_can_start_is_one_that_can() -> None:
    """Two loops in turn, one with room for two: the fifth vehicle finds no place, though the sixth would."""
    both = roads(
        {"a": (20.0, 1), "b": (20.0, 1), "c": (80.0, 1), "d": (80.0, 1)},
        ["a_0>b_0", "b_0>a_0", "c_0>d_0", "d_0>c_0"],
    )
    loops = [make_loop(both, "small", ["a", "b"]), make_loop(both, "large", ["c", "d"])]
    with pytest.raises(ScenarioError, match=r"the first 4 can start .*\(v5 finds no place\): take at most 4"):
        make_queues(both, [loops[k % 2] for k in range(6)])
    assert len(make_queues(both, [loops[k % 2] for k in range(4)]).starts_m) == 4


def test_long_vehicles_that_must_stay_behind_do_not_count_against_the_others() -> None:
    """Cars alone: 9 and 4 places as above. With the bus as the last of 14, lanes hold 5 and 2 only.

    Then 4 and 1 could start; but the bus is not among the first 13, and these can.
    """
    loop = make_loop(RING, "ring", ["a", "b", "c"])
    kinds = [*[DEFAULT_TYPE] * 13, VehicleType(id="bus", length_m=12.0, min_gap_m=3.0)]
    with pytest.raises(TooManyVehiclesError, match=r"first 13 can start .*\(v14 finds no place\)") as refused:
        make_queues(RING, [loop] * 14, kinds)
    assert refused.value.fitting == 13
    assert len(make_queues(RING, [loop] * 13, kinds[:13]).starts_m) == 13


def test_vehicles_of_different_lengths_start_apart() -> None:
    """Behind each the next keeps its own gap, not that of the one before; each stands wholly on its lane."""
    car, van, bus = (
        VehicleType(id=f"{length:g}", length_m=length, min_gap_m=gap)
        for length, gap in ((5.0, 2.5), (7.0, 1.0), (12.0, 4.0))
    )
    loop = make_loop(RING, "ring", ["a", "b", "c"])
    kinds = [car, bus, van, bus]
    made = make_queues(RING, [loop] * 4, kinds, starts_m=dict.fromkeys(["v1", "v2", "v3", "v4"], 0.0))
    on_lane: dict[str, list[tuple[float, VehicleType]]] = {}
    for robot, itinerary, front, kind in zip(
        made.system.robots, made.itineraries, made.starts_m, kinds, strict=True
    ):
        leg = itinerary.legs[robot.start]
        assert leg.begin_m <= front - kind.length_m < front <= leg.end_m
        on_lane.setdefault(leg.state, []).append((front, kind))
    assert max(len(line) for line in on_lane.values()) > 1
    for line in on_lane.values():
        for (front, ahead), (behind, follower) in itertools.pairwise(sorted(line, key=lambda v: -v[0])):
            assert front - ahead.length_m - behind > follower.min_gap_m


CHANGE = apart(roads({"a": (100.0, 2), "b": (80.0, 1)}, ["a_0>b_0", "b_0>a_1"]))


def test_where_a_loop_changes_lanes_its_edge_becomes_place_stretch_and_place() -> None:
    """100 m: a stretch of 10 + 5 m in the middle, and floor((42.5 - 1.1) / 7.5) = 5 vehicles on each side.

    Entered on lane 1, left on lane 0: it is held on lane 1 and the stop at the stretch's end lies there, too.
    """
    abstraction = make_queues(CHANGE, [make_loop(CHANGE, "l", ["a", "b"])])
    before, behind, other = abstraction.itineraries[0].legs
    assert [(leg.state, leg.line.lane) for leg in (before, behind, other)] == [
        ("a_1/1", 1),
        ("a_0/2", 0),
        ("b_0", 0),
    ]
    assert (before.begin_m, before.end_m, behind.begin_m, behind.end_m) == (0.0, 42.4, 57.5, 99.9)
    assert [crossing.id for crossing in before.crossings] == ["a:1>0"]
    assert before.guides == (Guide("a", 1, 57.4, 0.1, to_lane=0, stop_m=15.0),)
    assert not behind.guides
    assert not other.guides
    assert [abstraction.system.capacity[leg.state] for leg in (before, behind)] == [5, 5]


def test_on_a_fast_road_vehicles_change_lanes_late() -> None:
    """At 28 m/s the stretch takes a third, with five slots behind it: the others wait before."""
    network = apart(roads({"a": (240.0, 2), "b": (80.0, 1)}, ["a_0>b_0", "b_0>a_1"], speed_mps=28.0))
    abstraction = make_queues(network, [make_loop(network, "l", ["a", "b"])])
    before, behind, _ = abstraction.itineraries[0].legs
    assert behind.begin_m - before.end_m == pytest.approx(70.1)
    assert [abstraction.system.capacity[leg.state] for leg in (before, behind)] == [17, 5]


@pytest.mark.parametrize(
    ("length_m", "states", "crossings"),
    [
        (42.3, ["a_1/1", "a_0/2", "b_0", "c_0"], [["a:1>0"], ["a_0>b_0"], ["b_0>c_0"], ["c_0>a_1"]]),
        (42.1, ["a_0/2", "b_0", "c_0"], [["a_0>b_0"], ["b_0>c_0"], ["c_0>a_1", "a:1>0"]]),
        (26.1, ["a_0/2", "b_0", "c_0"], [["a_0>b_0"], ["b_0>c_0"], ["c_0>a_1", "a:1>0"]]),
        (26.0, ["b_0", "c_0"], [["b_0>c_0"], ["c_0>a_1", "a:1>0", "a_0>b_0"]]),
    ],
)
def test_on_a_short_edge_the_stretch_joins_the_crossings_beside_it(
    length_m: float, states: list[str], crossings: list[list[str]]
) -> None:
    """A place takes 2 * 7.5 + 1.1 m, a stretch 10 m: 42.2 m for both places, 26.1 m for one."""
    edges = {"a": (length_m, 2), "b": (80.0, 1), "c": (80.0, 1)}
    network = apart(roads(edges, ["a_0>b_0", "b_0>c_0", "c_0>a_1"]))
    legs = make_queues(network, [make_loop(network, "l", ["a", "b", "c"])]).itineraries[0].legs
    assert [leg.state for leg in legs] == states
    assert [[crossing.id for crossing in leg.crossings] for leg in legs] == crossings
    for leg, after in zip(legs, (*legs[1:], legs[0]), strict=True):
        for guide in leg.guides:
            assert guide == Guide("a", 1, guide.position_m, guide.from_m, 0, guide.stop_m)
            lap = 160.0 + length_m
            assert guide.position_m == pytest.approx(
                (after.begin_m - 0.1) % lap if "/2" in after.state else length_m - 0.1
            )


def test_an_edge_too_short_to_change_lanes_on_is_named_with_what_it_takes() -> None:
    """Nine metres, where a car with its gap and 2.5 m to spare takes ten."""
    edges = {"a": (9.0, 2), "1": (80.0, 1), "c": (80.0, 1)}
    network = apart(roads(edges, ["a_0>1_0", "1_0>c_0", "c_0>a_1"]))
    loop = make_loop(network, "l", ["a", "1", "c"])
    (refused,) = survey_queues(network, [(loop, DEFAULT_TYPE)]).refused
    assert refused.edge == "a"
    assert refused.reason.startswith("must change from lane 1 to lane 0 on edge a, which is 9.0 m long")
    with pytest.raises(ScenarioError, match="loop l must change from lane 1 to lane 0"):
        make_queues(network, [loop])


def test_where_one_loop_changes_lanes_the_others_cross_its_stretch() -> None:
    """One that stays on lane 0 and one that comes to it exclude each other."""
    network = apart(roads({"a": (100.0, 2), "b": (80.0, 1)}, ["a_0>b_0", "b_0>a_1", "b_0>a_0"]))
    edges = ["a", "b"]
    change = roads({"a": (100.0, 2), "b": (80.0, 1)}, ["a_0>b_0", "b_0>a_1"])
    changes, stays = make_loop(change, "changes", edges), make_loop(network, "stays", edges)
    layout = lay_out_queues(network, [(changes, DEFAULT_TYPE), (stays, DEFAULT_TYPE)])
    one, other = layout.itineraries["changes"].legs, layout.itineraries["stays"].legs
    assert [leg.state for leg in one] == ["a_1/1", "a_0/2", "b_0"]
    assert [leg.state for leg in other] == ["a_0/1", "a_0/2", "b_0"]
    assert one[0].crossings[0].foes == {"a:0>0"}
    assert other[0].crossings[0].foes == {"a:1>0"}


def test_lanes_over_which_nobody_changes_are_not_cut() -> None:
    """From lane 2 to lane 1, beside lane 0; and over lane 1, from lane 2 to lane 0."""
    ways = ["a_0>b_0", "a_1>b_1", "b_0>a_0", "b_1>a_2"]
    network = apart(roads({"a": (100.0, 3), "b": (80.0, 2)}, [*ways, "b_0>a_1"]))
    changes = make_loop(
        roads({"a": (100.0, 3), "b": (80.0, 2)}, ["a_1>b_1", "b_1>a_2"]), "changes", ["a", "b"]
    )
    stays = make_loop(network, "stays", ["a", "b"])
    layout = lay_out_queues(network, [(changes, DEFAULT_TYPE), (stays, DEFAULT_TYPE)])
    assert [leg.state for leg in layout.itineraries["changes"].legs] == ["a_2/1", "a_1/2", "b_1"]
    assert [leg.state for leg in layout.itineraries["stays"].legs] == ["a_0", "b_0"]
    assert layout.places["a_0"].length_m == 100.0
    wide = roads({"a": (100.0, 3), "b": (80.0, 2)}, ["a_0>b_1", "b_1>a_2"])
    assert lay_out_queues(apart(wide), [(make_loop(wide, "wide", ["a", "b"]), DEFAULT_TYPE)]).stretches[
        "a"
    ].lanes == {0, 1, 2}


def test_a_short_lane_beside_a_change_of_lanes_is_told_to_join_the_crossing() -> None:
    """On s, 12 m long, one loop changes from lane 2 to lane 1; one stays on lane 0, too short to wait on."""
    edges = {"a": (80.0, 3), "s": (12.0, 3), "b": (80.0, 2)}
    ways = ["a_0>s_0", "s_0>b_0", "b_0>a_0", "a_2>s_2", "s_1>b_1", "b_1>a_2"]
    network = apart(roads(edges, ways))
    loops = [
        make_loop(roads(edges, some), name, list(edges))
        for name, some in (("on", ways[:3]), ("changes", ways[3:]))
    ]
    found = survey_queues(network, [(loop, DEFAULT_TYPE) for loop in loops])
    assert [(one.lane, one.loops) for one in found.joined] == [("s_0", ("on",))]


def test_where_sumo_could_choose_a_lane_a_stop_leads_to_the_loops_own() -> None:
    """From b to either lane of a: the stop at the end of the lane is done with once the vehicle is on it."""
    fork = apart(roads({"a": (80.0, 2), "b": (80.0, 1)}, ["a_0>b_0", "a_1>b_0", "b_0>a_0", "b_0>a_1"]))
    legs = make_queues(fork, [make_loop(fork, "l", ["a", "b"])]).itineraries[0].legs
    assert [leg.guides for leg in legs] == [(), (Guide("a", 0, 79.9, 0.1, stop_m=80.0),)]


def test_where_two_chains_of_lanes_lead_to_one_place_each_choice_has_its_stop() -> None:
    """Over either lane of the short s to c: a stop at the end of s, none on c, which has one lane."""
    edges = {"a": (80.0, 1), "s": (5.0, 2), "c": (80.0, 1)}
    network = apart(roads(edges, ["a_0>s_0", "a_0>s_1", "s_0>c_0", "s_1>c_0", "c_0>a_0"]))
    legs = make_queues(network, [make_loop(network, "l", ["a", "s", "c"])]).itineraries[0].legs
    assert legs[0].guides == (Guide("s", 0, 4.9, 0.1, stop_m=5.0),)
    tight = apart(roads(edges | {"s": (0.2, 2)}, ["a_0>s_0", "a_0>s_1", "s_0>c_0", "s_1>c_0", "c_0>a_0"]))
    refusal = why_not(tight, make_loop(tight, "l", ["a", "s", "c"]))
    assert refusal is not None
    assert "too short to tell SUMO" in refusal.reason
    assert refusal.edge == "a"


def test_a_loop_made_for_other_roads_is_refused_where_it_finds_no_movement() -> None:
    """By itself, as part of the layout, and in the survey, which says so of this loop alone."""
    edges = {"a": (80.0, 1), "b": (80.0, 1), "c": (80.0, 1)}
    ways = ["a_0>b_0", "b_0>a_0", "b_0>c_0", "c_0>a_0"]
    loop = make_loop(roads(edges, ways), "l", ["a", "b", "c"])
    network = apart(roads(edges, [*ways[:2], ways[3]]))
    refusal = LoopRefusal("has no movement from lane b_0 to edge c", "b")
    assert why_not(network, loop) == refusal
    users = [(loop, DEFAULT_TYPE), (make_loop(network, "k", ["a", "b"]), DEFAULT_TYPE)]
    with pytest.raises(RefusedLoopError, match="loop l has no movement from lane b_0 to edge c"):
        lay_out_queues(network, users)
    assert survey_queues(network, users).refused == (RefusedLoop(loop, *refusal),)


def test_crossings_name_the_lanes_that_they_lead_between() -> None:
    """Over the junctions, and over the stretch on which the loop changes lanes."""
    edges = {"a": (80.0, 2), "b": (80.0, 1)}
    network = apart(roads(edges, ["a_0>b_0", "b_0>a_1"]))
    found = survey_queues(network, [(make_loop(network, "l", ["a", "b"]), DEFAULT_TYPE)])
    assert {(one.from_lane, one.to_lane) for one in found.crossings} == {
        ("a_1", "a_0"),
        ("a_0", "b_0"),
        ("b_0", "a_1"),
    }


def lead_back(past_m: float) -> RoadNetwork:
    """Four roads of 80 m, of which y leads back on the line of x, from `past_m` on aside."""
    network = apart(
        roads(
            {"x": (80.0, 1), "y": (80.0, 1), "a": (80.0, 1), "b": (80.0, 1)},
            ["x_0>a_0", "a_0>y_0", "y_0>b_0", "b_0>x_0"],
        )
    )
    (first_x, y), (last_x, _) = network.lanes["x_0"].shape
    bend_x = min(first_x + past_m, last_x)
    shape = ((last_x, y), (bend_x, y), (bend_x, y + bend_x - first_x + 1e-3))
    return y_drawn_as(network, shape)


def y_drawn_as(network: RoadNetwork, shape: tuple[tuple[float, float], ...]) -> RoadNetwork:
    """Return a network whose road y, of one lane, is drawn elsewhere."""
    lane = replace(network.lanes["y_0"], shape=shape)
    return RoadNetwork(
        name="narrow",
        file=network.file,
        edges={**network.edges, "y": replace(network.edges["y"], lanes=(lane,))},
        lanes={**network.lanes, "y_0": lane},
        junctions={},
        connections=network.connections,
    )


def test_where_roads_lie_on_one_another_for_a_part_there_are_places_on_the_rest() -> None:
    """On the last 30 m of x and the first of y: nobody waits there, and one way at a time is taken."""
    narrow = lead_back(50.0)
    layout = lay_out_queues(narrow, [(make_loop(narrow, "l", ["x", "a", "y", "b"]), DEFAULT_TYPE)])
    assert layout.places["x_0"].capacity == layout.places["y_0"].capacity == 6
    legs = {str(leg.state): leg for leg in layout.itineraries["l"].legs}
    assert legs["x_0"].end_m == pytest.approx(49.0, abs=1.5)
    out, back = legs["x_0"].crossings[0], legs["a_0"].crossings[0]
    assert out.foes == {back.id}
    assert back.foes == {out.id}
    begin_m, end_m = out.overlaps[back.id]
    assert begin_m <= 1.0
    assert end_m >= 26.0  # the rear of one whose front is where x ends


def test_a_street_too_narrow_for_two_is_crossed_one_way_at_a_time() -> None:
    """Two edges on one line, opposed: no places on them, and each excludes the other until it is past."""
    narrow = lead_back(0.0)
    legs = make_queues(narrow, [make_loop(narrow, "l", ["x", "a", "y", "b"])]).itineraries[0].legs
    assert [leg.state for leg in legs] == ["a_0", "b_0"]
    there = legs[0].crossings[1]
    assert there.id == "y:0>0"
    assert there.foes == {"x:0>0"}
    assert not there.overlaps


def test_only_the_lanes_of_a_narrow_street_that_are_near_others_are_narrow() -> None:
    """As where the bus lanes of both directions lie on one another: cars wait on the lanes beside."""
    network = apart(
        roads(
            {"x": (80.0, 2), "y": (80.0, 1), "a": (80.0, 2), "b": (80.0, 2)},
            ["x_0>a_0", "a_0>y_0", "y_0>b_0", "b_0>x_0", "x_1>a_1", "a_1>b_1", "b_1>x_1"],
        )
    )
    narrow = y_drawn_as(network, network.lanes["x_0"].shape[::-1])
    loops = [make_loop(narrow, "bus", ["x", "a", "y", "b"]), make_loop(narrow, "car", ["x", "a", "b"])]
    layout = lay_out_queues(narrow, [(loop, DEFAULT_TYPE) for loop in loops])
    assert {"x_0", "y_0"}.isdisjoint(layout.places)
    assert layout.places["x_1"].capacity == 10
    bus = [leg.crossings for leg in layout.itineraries["bus"].legs]
    (across,) = [one for some in bus for one in some if one.id == "x:0>0"]
    assert across.foes == {"y:0>0"}


@pytest.mark.parametrize("name", [str(GRID), "sumo:DRT", "sumo:bs3d"])
def test_conflicts_are_symmetric_and_those_of_the_geometry(name: str) -> None:
    """Against a brute-force distance of the drawn curves, pair by pair, and the request matrix."""
    network = RoadNetwork.open(name)
    loops = generate_loops(network, 30, length_m=(400.0, 3000.0), seed=1)
    found = lay_out_queues(network, [(loop, DEFAULT_TYPE) for loop in loops]).conflicts
    movements = [m for m in network.connections if m.id in found.foes]
    curves = {
        m.id: shapely.LineString(np.concatenate([network.lanes[lane].shape for lane in m.via]))
        for m in movements
    }
    apart = 0
    for one, other in itertools.permutations(movements, 2):
        if one.junction != other.junction:
            continue
        assert (other.id in found.foes[one.id]) == (one.id in found.foes[other.id])
        same_lane = (one.from_edge, one.from_lane) == (other.from_edge, other.from_lane)
        if not same_lane and curves[one.id].distance(curves[other.id]) < DEFAULT_TYPE.width_m:
            assert other.id in found.foes[one.id]
        elif not same_lane and network.are_foes(one, other):
            apart += other.id not in found.foes[one.id]
    assert (apart == 0) == (name == str(GRID))  # only streets with several lanes have such pairs


def test_starts_leave_a_slot_free_on_every_place_and_are_live() -> None:
    """No place is full, fronts stand in line on their lanes, and the certified gate accepts the start."""
    network = RoadNetwork.open(GRID)
    loops = generate_loops(network, 20, seed=3)
    abstraction = make_queues(network, [loops[k % 20] for k in range(300)], seed=2)
    system = abstraction.system
    held = Counter(robot.path[robot.start] for robot in system.robots)
    assert all(count < system.capacity[state] for state, count in held.items())
    line: dict[str, float] = {}
    for k, (robot, start) in enumerate(zip(system.robots, abstraction.starts_m, strict=True)):
        leg = abstraction.itineraries[k].legs[robot.start]
        front = start - leg.begin_m
        assert 5.0 <= front <= leg.end_m - leg.begin_m
        assert front <= line.get(leg.state, np.inf) - 7.5
        line[leg.state] = front
    make_gate("certified", system)


def test_the_same_seed_gives_the_same_starts() -> None:
    """And another seed others."""
    network = RoadNetwork.open(GRID)
    loops = generate_loops(network, 10, seed=3)
    assert make_queues(network, loops, seed=5).starts_m == make_queues(network, loops, seed=5).starts_m
    assert make_queues(network, loops, seed=5).starts_m != make_queues(network, loops, seed=6).starts_m


def test_wide_vehicles_are_in_each_others_way_for_longer() -> None:
    """A bus of 2.5 m counts within 2.9 m where cars do within 2.2 m: no conflict goes, each stretch grows."""
    assert reach_m([1.8, 1.8]) == REACH_M
    assert reach_m([1.8, 2.5]) == pytest.approx(2.9)
    network = RoadNetwork.open(GRID)
    loops = generate_loops(network, 10, seed=3)
    bus = VehicleType(id="bus", vclass="bus")
    cars = lay_out_queues(network, [(loop, DEFAULT_TYPE) for loop in loops]).conflicts
    mixed = lay_out_queues(network, [(loop, DEFAULT_TYPE) for loop in loops] + [(loops[0], bus)]).conflicts
    longer = 0
    for one, touching in cars.overlaps.items():
        assert cars.foes[one] <= mixed.foes[one]
        for other, (begin, end) in touching.items():
            wide = mixed.overlaps[one][other]
            assert wide[0] <= begin
            assert end <= wide[1]
            longer += wide != (begin, end)
    assert longer > 0


def test_long_vehicles_cut_corners() -> None:
    """Twelve metres swing out over what cars pass beside; no conflict of cars goes."""
    network = RoadNetwork.open("sumo:bs3d")
    loops = generate_loops(network, 20, length_m=(400.0, 3000.0), seed=1)
    long = VehicleType(id="long", length_m=12.0)
    cars = lay_out_queues(network, [(loop, DEFAULT_TYPE) for loop in loops]).conflicts
    mixed = lay_out_queues(
        network, [(loop, kind) for loop in loops for kind in (DEFAULT_TYPE, long)]
    ).conflicts
    common = cars.foes.keys() & mixed.foes.keys()
    assert all(cars.foes[one] & common <= mixed.foes[one] for one in common)
    assert [(one, foe) for one in common for foe in mixed.foes[one] & common - cars.foes[one]]


def test_cars_share_no_more_of_the_road_because_buses_come() -> None:
    """The stretch that two cars share is theirs, but not less than without buses; a bus has its own."""
    network = RoadNetwork.open("sumo:bs3d")
    loops = generate_loops(network, 20, length_m=(400.0, 3000.0), seed=1)
    bus = VehicleType(id="bus", vclass="bus", length_m=12.0)
    cars = lay_out_queues(network, [(loop, DEFAULT_TYPE) for loop in loops]).conflicts
    mixed = lay_out_queues(
        network, [(loop, kind) for loop in loops for kind in (DEFAULT_TYPE, bus)]
    ).conflicts
    shorter = apart = 0
    for one, sized in mixed.sized.items():
        for other, table in sized.items():
            assert table.sizes == (5.0, 12.0)
            (short, _), (_, long) = table.among
            assert long == mixed.overlaps[one][other]
            known = cars.overlaps.get(one, {}).get(other)
            if short is None:
                apart += 1
                assert mixed.sized[other][one].among[0][0] is None
                assert known is None
            elif known:
                assert short[0] <= known[0] + 1e-9
                assert short[1] >= known[1] - 1e-9
                shorter += short[1] < long[1]
    assert shorter > 0
    assert apart > 0


def test_all_loops_agree_on_the_places_of_an_edge() -> None:
    """Arc lengths are rounded otherwise on each loop; whether a lane is a place must not depend on that."""
    network = RoadNetwork.open("sumo:bs3d")
    loops = generate_loops(network, 60, length_m=(400.0, 3000.0), seed=1)
    layout = lay_out_queues(network, [(loop, DEFAULT_TYPE) for loop in loops])
    for loop in loops:
        states = {leg.state for leg in layout.itineraries[loop.id].legs}
        for span in loop.spans:
            if not span.internal and span.edge not in layout.stretches:
                assert (span.lane_id in states) == (span.lane_id in layout.places)
            elif not span.internal:
                for half, lane in ((1, span.lane_in), (2, span.lane)):
                    name = f"{span.edge}_{lane}/{half}"
                    assert (name in states) == (name in layout.places)
