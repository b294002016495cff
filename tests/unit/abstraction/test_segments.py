"""Zones and private pieces of hand-made loops, with the figures worked out beside them."""

from __future__ import annotations

import random

import pytest
from networkx.utils import UnionFind
from roads import polygon

from loopgate.abstraction.itinerary import Abstraction, Itinerary
from loopgate.abstraction.segments import (
    ZoneVisit,
    collision_segments,
    cover,
    lay_out_segments,
    make_segments,
)
from loopgate.abstraction.survey import survey
from loopgate.errors import RouteError, ScenarioError

# Two squares of 100 m whose sides cross at right angles in (50, 100) and (100, 50).
ONE = polygon("one", [(0, 0), (100, 0), (100, 100), (0, 100)])
TWO = polygon("two", [(50, 50), (150, 50), (150, 150), (50, 150)])
FAR = polygon("far", [(1000, 0), (1100, 0), (1100, 100), (1000, 100)])


def legs(itinerary: Itinerary) -> list[tuple[str, float, float]]:
    return [(leg.state, round(leg.begin_m, 3), round(leg.end_m, 3)) for leg in itinerary.legs]


def shared(abstraction: Abstraction, robot: int) -> list[tuple[str, float, float]]:
    return [leg for leg in legs(abstraction.itineraries[robot]) if leg[0].startswith("zone")]


def test_definition_1_on_two_crossings() -> None:
    """Within 2 rho = 2.5 m of a right-angled crossing lie 2.5 m to each side, on both paths.

    One crosses at 150 m (up its second side) and 250 m (along its third); two at 50 m and, coming down its
    fourth side, at 350 m. The crossing (100, 50) is one's 150 m and two's 50 m.
    """
    found = collision_segments([ONE, TWO], 1.25)
    rows = zip(
        found.path.tolist(), found.other.tolist(), found.begin_m.tolist(), found.end_m.tolist(), strict=True
    )
    assert sorted(rows) == [
        (0, 1, pytest.approx(147.5), pytest.approx(152.5)),
        (0, 1, pytest.approx(247.5), pytest.approx(252.5)),
        (1, 0, pytest.approx(47.5), pytest.approx(52.5)),
        (1, 0, pytest.approx(347.5), pytest.approx(352.5)),
    ]
    begins = {(round(found.begin_m[a], 1), round(found.begin_m[b], 1)) for a, b in found.pairs.tolist()}
    assert begins == {(147.5, 47.5), (247.5, 347.5)}


def test_definition_1_over_the_beginning() -> None:
    """A bar 2 m wide on both sides of the corner where one begins: one segment, from 396.5 m to 422.5 m.

    The bar reaches from x = -20 m to x = 20 m and y = -1 m to y = 1 m: one comes down to it over its last
    1 m + 2.5 m, and then runs within it for 20 m and away from it for 2.5 m.
    """
    bar = polygon("bar", [(-20, -1), (20, -1), (20, 1), (-20, 1)])
    found = collision_segments([ONE, bar], 1.25)
    rows = [(found.begin_m[k], found.end_m[k]) for k in range(len(found.path)) if found.path[k] == 0]
    assert rows == [(pytest.approx(396.5), pytest.approx(422.5))]


def test_zones_grow_upstream_to_the_vehicles_length() -> None:
    """A state has to hold 5 m of vehicle, 2.5 m of gap and 1 m of clearance: 8.5 m, not 5 m."""
    found = make_segments([ONE, TWO], piece_m=1000.0)
    assert shared(found, 0) == [("zone1", 144.0, 152.5), ("zone2", 244.0, 252.5)]
    assert shared(found, 1) == [("zone1", 44.0, 52.5), ("zone2", 344.0, 352.5)]
    assert found.warnings == ()


def test_legs_partition_the_loop() -> None:
    """Private pieces fill the rest, at most 50 m long.

    The 91.5 m between the zones make two pieces of 45.75 m, the 291.5 m from 252.5 m over the beginning to
    544 m = 400 m + 144 m six of 48.58 m; the one across the beginning comes first.
    """
    assert legs(make_segments([ONE, TWO], piece_m=50.0).itineraries[0]) == [
        ("one/1", -1.75, 46.833),
        ("one/2", 46.833, 95.417),
        ("one/3", 95.417, 144.0),
        ("zone1", 144.0, 152.5),
        ("one/4", 152.5, 198.25),
        ("one/5", 198.25, 244.0),
        ("zone2", 244.0, 252.5),
        ("one/6", 252.5, 301.083),
        ("one/7", 301.083, 349.667),
        ("one/8", 349.667, 398.25),
    ]


def test_a_short_private_gap_goes_to_the_zone_after_it() -> None:
    """Two crossings 10 m apart leave 5 m between the collision segments: too short for a vehicle."""
    bars = [polygon(f"bar{x}", [(x, -30), (x + 3, -30), (x + 3, 30), (x, 30)]) for x in (40, 53)]
    loop = polygon("loop", [(0, 0), (100, 0), (100, 200), (0, 200)])
    found = make_segments([loop, *bars], piece_m=1000.0)
    # bar40 occupies x = 40..43, near from 37.5 to 45.5; bar53 from 50.5 to 58.5: 5 m between them.
    assert shared(found, 0) == [("zone1", 37.0, 45.5), ("zone2", 45.5, 58.5)]


def test_overlapping_segments_are_one_zone_for_all() -> None:
    """Bars at 40 and 44 overlap on the loop's path: one state, on all three paths (Step 1)."""
    bars = [polygon(f"bar{x}", [(x, -30), (x + 3, -30), (x + 3, 30), (x, 30)]) for x in (40, 44)]
    loop = polygon("loop", [(0, 0), (100, 0), (100, 200), (0, 200)])
    found = make_segments([loop, *bars])
    assert shared(found, 0) == [("zone1", 37.5, 49.5)]
    assert {state for robot in (1, 2) for state, _, _ in shared(found, robot)} == {"zone1"}


def test_a_zone_that_comes_back_has_a_position_for_each_visit() -> None:
    """The bar's path crosses a road twice, there and back 3 m beside: two visits, one state, for the bar."""
    bar = polygon("bar", [(40, -30), (43, -30), (43, 30), (40, 30)])
    loop = polygon("loop", [(0, 0), (100, 0), (100, 200), (0, 200)])
    found = make_segments([loop, bar], piece_m=1000.0)
    assert shared(found, 0) == [("zone1", 37.0, 45.5)]
    assert [state for state, _, _ in shared(found, 1)] == ["zone1", "zone1"]
    assert found.system.robots[1].path.count(shared(found, 1)[0][0]) == 2


def test_a_path_near_itself_does_not_conflict() -> None:
    """A hairpin of 2 m has no collision segment with itself."""
    assert not len(collision_segments([polygon("bar", [(0, 0), (2, 0), (2, 90), (0, 90)]), FAR], 1.25).path)


def test_proposition_1_is_ensured() -> None:
    """Two zones that follow each other on two paths become one, and a warning says so.

    Loops a and b run 3 m apart and cross two bars; on a bar's path their segments overlap, so each bar is one
    zone for both. The 5 m between the bars are too short for a vehicle, so that the two zones touch on a and
    on b.
    """
    loops = [
        polygon("a", [(0, 0), (100, 0), (100, 50), (0, 50)]),
        polygon("b", [(0, -3), (100, -3), (100, -60), (0, -60)]),
    ]
    arms = [polygon(f"arm{x}", [(x, -40), (x + 3, -40), (x + 3, 20), (x, 20)]) for x in (40, 53)]
    found = make_segments([*loops, *arms], piece_m=1000.0)
    assert len(shared(found, 0)) == len(shared(found, 1)) == 1
    assert shared(found, 0)[0][0] == shared(found, 1)[0][0]
    assert any("(Prop. 1)" in line and "a, b" in line for line in found.warnings)


def test_a_segment_over_the_beginning_is_one() -> None:
    """The collision segment reaches over arc length 0: one leg, beginning below 0, and it comes first."""
    bar = polygon("bar", [(-20, -1), (20, -1), (20, 1), (-20, 1)])
    found = make_segments([ONE, bar])
    first = legs(found.itineraries[0])[0]
    assert first[0] == "zone1"
    assert first[1] < 0.0 < first[2]


def test_a_swallowed_loop_is_a_single_state() -> None:
    """Twice the same way: each loop is one zone, a warning says so, and two vehicles cannot start."""
    twin = polygon("twin", [(0, 0), (100, 0), (100, 100), (0, 100)])
    with pytest.raises(ScenarioError, match="vehicles one and twin both start in zone1, which holds one"):
        make_segments([ONE, twin])


def test_warnings_name_the_zone_that_swallows() -> None:
    """A loop inside the zone of another's long side."""
    small = polygon("small", [(20, 0), (80, 0), (80, 2), (20, 2)])
    found = make_segments([ONE, small])
    assert found.system.robots[1].path == ("zone1",)
    assert any("zone1 takes 100% of small: one vehicle at a time" in line for line in found.warnings)
    assert (
        "zone1: small lies in it all the way: its vehicle never leaves, and one can never enter"
        in found.warnings
    )
    numbers = survey(found.itineraries)
    assert numbers.loops[1].shared == pytest.approx(1.0)
    assert numbers.zones[0].loops == ("one", "small")


def test_a_loop_without_private_road_is_named() -> None:
    """Two loops lie on its two halves; the 3 m between their segments are too short for a vehicle."""
    loop = polygon("loop", [(0, 0), (30, 0), (30, 20), (0, 20)])
    east = polygon("east", [(19, 0), (30, 0), (30, 20), (19, 20)])
    west = polygon("west", [(0, 0), (11, 0), (11, 20), (0, 20)])
    found = make_segments([loop, east, west])
    assert [state for state, _, _ in legs(found.itineraries[0])] == ["zone2", "zone1"]
    assert "no private road on loop: its vehicle always blocks others" in found.warnings


def test_starts_are_private_whole_and_by_seed() -> None:
    """The vehicle stands within one lane and one private state; another seed, another place."""
    places = set()
    for seed in range(8):
        found = make_segments([ONE, TWO], seed=seed)
        for loop, itinerary, robot, front in zip(
            (ONE, TWO), found.itineraries, found.system.robots, found.starts_m, strict=True
        ):
            leg = itinerary.legs[robot.start]
            assert leg.begin_m <= front - 5.0 < front <= leg.end_m
            assert loop.span_at(front) is loop.span_at(front - 5.0)
            assert not leg.state.startswith("zone")
        places.add(found.starts_m)
    assert len(places) > 3
    assert make_segments([ONE, TWO], seed=3).starts_m == make_segments([ONE, TWO], seed=3).starts_m


def test_two_vehicles_placed_in_one_zone() -> None:
    """The error names both vehicles and the zone."""
    with pytest.raises(ScenarioError, match="vehicles v1 and v2 both start in zone1"):
        make_segments([ONE, TWO], names=["v1", "v2"], starts_m={"v1": 150.0, "v2": 50.0})


def test_a_vehicle_placed_across_two_states() -> None:
    """5 m of vehicle with the front at 146 m stand across the zone's beginning at 144 m."""
    with pytest.raises(ScenarioError, match=r"vehicle one: at 146.0 m on one it stands across two states"):
        make_segments([ONE, TWO], starts_m={"one": 146.0})
    assert make_segments([ONE, TWO], starts_m={"one": 149.5}).starts_m[0] == 149.5


@pytest.mark.parametrize(
    ("options", "text"),
    [({"rho_m": 0.0}, "rho 0 m; expected more than 0"), ({"piece_m": -1.0}, "piece -1 m; expected more")],
)
def test_bad_lengths(options: dict[str, float], text: str) -> None:
    """Lengths have to be positive."""
    with pytest.raises(ScenarioError, match=text):
        lay_out_segments([ONE, TWO], **options)


def test_one_loop_twice() -> None:
    """One path, one robot; the way out is the other abstraction."""
    with pytest.raises(
        ScenarioError, match=r"2 vehicles on loop one, which holds one .*--abstraction queues"
    ):
        make_segments([ONE, ONE])


def test_a_loop_shorter_than_the_vehicle() -> None:
    """8 m round cannot hold what needs 8.5 m."""
    with pytest.raises(RouteError, match=r"loop dot: 8.0 m are too short for a vehicle that needs 8.5 m"):
        make_segments([polygon("dot", [(0, 0), (2, 0), (2, 2), (0, 2)])])


def test_loops_that_meet_nobody_are_private() -> None:
    """No zones, no warnings; a single loop works too."""
    found = make_segments([ONE, FAR])
    assert all(found.system.private)
    assert survey(found.itineraries).shared == 0.0
    assert len(make_segments([ONE]).system.robots) == 1


def test_a_visit_boxed_in_joins_the_shorter_neighbour() -> None:
    """Three visits that touch, the middle one too short: it joins the shorter of the two beside it."""
    union: UnionFind[int] = UnionFind(range(3))
    found = cover(ONE, [ZoneVisit(10, 40, 0), ZoneVisit(40, 44, 1), ZoneVisit(44, 60, 2)], 8.5, union)
    assert [(v.begin_m, v.end_m) for v in found] == [(10, 40), (40, 60)]
    assert union[1] == union[2] != union[0]


def test_a_visit_grows_downstream_when_there_is_no_room_upstream() -> None:
    """4 m long, touching the visit before it: 4.5 m are taken from the private road after it."""
    found = cover(ONE, [ZoneVisit(10, 40, 0), ZoneVisit(40, 44, 1)], 8.5, UnionFind(range(2)))
    assert [(v.begin_m, v.end_m) for v in found] == [(10, 40), (40, pytest.approx(48.5))]


def test_the_order_of_loops_decides_nothing_but_names() -> None:
    """Zones are the same stretches whatever the order in which loops are given."""
    loops = [polygon(f"l{k}", [(20 * k, 5 * k), (20 * k + 90, 5 * k), (20 * k + 40, 80)]) for k in range(5)]
    shuffled = loops[:]
    random.Random(1).shuffle(shuffled)

    def stretches(found: Abstraction) -> dict[str, list[tuple[float, float]]]:
        return {
            itinerary.loop.id: [leg[1:] for leg in legs(itinerary) if leg[0].startswith("zone")]
            for itinerary in found.itineraries
        }

    assert stretches(make_segments(loops)) == stretches(make_segments(shuffled))
