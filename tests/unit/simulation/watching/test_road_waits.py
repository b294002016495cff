"""Whom a standing vehicle waits for on the road, by positions on the five-by-five grid."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType

import pytest
from roads import roads
from shapely import LineString, Point

from loopgate.network import Connection, Edge, RoadNetwork
from loopgate.network.road import Lane
from loopgate.simulation.watching.road_waits import LeadsOn, RoadWaits

NETWORK = RoadNetwork.open("networks/grid5-priority.net.xml")
(WAY,) = NETWORK.between("B2C2", "C2D2")
END_M = NETWORK.lanes["B2C2_0"].length_m
LONG_S, SHORT_S = 1000.0, -1.0
"""Times of standing [s]. After the second nothing is known to last."""


@dataclass
class Scene:
    """Vehicles by name: lane and position [m]; and the edges round them, where they matter."""

    at: Mapping[str, tuple[str, float]]
    edges: Mapping[str, tuple[str, list[str] | None]] = field(default_factory=dict)
    lanes: Sequence[LeadsOn] | None = None
    red: bool = False
    wishes: Mapping[str, tuple[int, bool]] = field(default_factory=dict)
    knows_sizes: bool = True

    def on_lanes(self) -> Iterable[tuple[str, str, float]]:
        return [(vehicle, *there) for vehicle, there in self.at.items()]

    def size(self, vehicle: str) -> tuple[float, float]:
        del vehicle
        return 5.0, 2.5

    def edges_around(self, vehicle: str) -> tuple[str, list[str] | None]:
        return self.edges.get(vehicle, ("", None))

    def lanes_for(self, vehicle: str) -> Sequence[LeadsOn] | None:
        return self.lanes if vehicle == "a" else None

    def lane_wish(self, vehicle: str) -> tuple[int, bool]:
        return self.wishes.get(vehicle, (0, False))

    def faces_red(self, vehicle: str) -> bool:
        del vehicle
        return self.red

    def cycle_s(self, light: str) -> float:
        del light
        return 90.0

    def sets(
        self,
        stood_s: float = 60.0,
        *,
        network: RoadNetwork = NETWORK,
        standing: Collection[str] = (),
        restless: Collection[str] = (),
    ) -> list[list[str]]:
        """Return the sets of vehicle ``a``, which goes on from B2C2 to C2D2 if nothing else is said."""
        self.edges = {"a": ("A2B2", ["C2D2", "D2E2"]), **self.edges}
        waits = RoadWaits(network, self)
        waits.look(standing, frozenset(restless))
        return waits.of("a", stood_s)


HEAD = ("B2C2_0", END_M - 1.0)


@pytest.mark.parametrize(
    ("others", "sets"),
    [
        ({"b": ("C2D2_0", 6.0)}, [["b"]]),  # no room for it behind b
        ({"b": ("C2D2_0", 20.0)}, []),
        ({"b": (WAY.via[0], 8.0)}, [["b"]]),
        ({"b": ("C2C1_0", 0.3)}, []),  # all but past it: a drives up to it, into the junction
        ({"b": ("C2C1_0", 0.3), "c": ("C2D2_0", 6.0)}, [["c"]]),  # with room beyond, a drives up to b
        ({"b": ("C2C1_0", 12.0)}, []),
        ({"b": ("D2C2_0", END_M - 1.0)}, []),  # before the junction it is in nobody's way
    ],
)
def test_the_first_in_line_waits_for_bodies_in_its_way(
    others: dict[str, tuple[str, float]], sets: list[list[str]]
) -> None:
    """Beyond the junction, in it, and across it."""
    edges = {"b": ("C3C2", ["C1B1"])}
    assert Scene({"a": HEAD, **others}, edges).sets() == sets


@pytest.mark.parametrize(("past_m", "sets"), [(1.5, [["b"]]), (1.7, [])])
def test_a_crossing_is_free_once_a_rear_is_off_the_lane(past_m: float, sets: list[list[str]]) -> None:
    """As for SUMO: half the width of a lane, 1.6 m; a driver passed a rear that was 1.75 m away."""
    (across,) = NETWORK.between("C3C2", "C2C1")
    mine, theirs = (LineString(NETWORK.lanes[way.via[0]].shape) for way in (WAY, across))
    crossing = theirs.intersection(mine)
    assert isinstance(crossing, Point)
    front_m = theirs.project(crossing) + past_m + 5.0 - theirs.length
    at = {"a": (WAY.via[0], mine.project(crossing) - 3.0), "b": ("C2C1_0", front_m)}
    assert Scene(at, {"b": ("C3C2", ["C1B1"])}).sets(restless=["a"]) == sets


@pytest.mark.parametrize(("past_m", "sets"), [(-0.5, [["b"]]), (1.0, [])])
def test_whoever_stands_on_a_way_that_is_crossed_is_beside(past_m: float, sets: list[list[str]]) -> None:
    """A driver whose front was past the crossing drove on, 1.4 m from the front of the other."""
    (across,) = NETWORK.between("C3C2", "C2C1")
    mine, theirs = (LineString(NETWORK.lanes[way.via[0]].shape) for way in (WAY, across))
    crossing = theirs.intersection(mine)
    assert isinstance(crossing, Point)
    at = {
        "a": (WAY.via[0], mine.project(crossing) + past_m),
        "b": (across.via[0], theirs.project(crossing) - 1.0),
    }
    assert Scene(at, {"b": ("C3C2", ["C2C1"])}).sets(SHORT_S) == sets


@pytest.mark.parametrize(("restless", "sets"), [("a", [["b"]]), ("", [])])
def test_who_creeps_inside_a_junction_creeps_up_to_a_body_far_on_in_its_way(
    restless: str, sets: list[list[str]]
) -> None:
    """One crept for an hour, four metres, and 538 vehicles stood behind it."""
    (across,) = NETWORK.between("C1C2", "C2C3")
    theirs = LineString(NETWORK.lanes[across.via[0]].shape)
    crossing = theirs.intersection(LineString(NETWORK.lanes[WAY.via[0]].shape))
    assert isinstance(crossing, Point)
    at = {"a": (WAY.via[0], 0.1), "b": (across.via[0], theirs.project(crossing) + 2.0)}
    assert Scene(at, {"b": ("C1C2", ["C2C3"])}).sets(SHORT_S, restless=[restless]) == sets


@pytest.mark.parametrize(
    ("missing", "slowly", "sets"), [(None, False, [["b"]]), (5, False, []), (5, True, [["b"]])]
)
def test_who_creeps_comes_past_if_there_is_space_in_the_line_before_it(
    missing: int | None, sets: list[list[str]], *, slowly: bool
) -> None:
    """A vehicle crept on 30 cm in seven minutes, a millimetre a second, and then another passed behind it."""
    (across,) = NETWORK.between("C3C2", "C2C1")
    line = {f"c{k}": ("C2C1_0", END_M - 7.5 * k) for k in range(12) if k != missing}
    rear_m, over = min(at_m for _, at_m in line.values()) - 7.5, NETWORK.lanes[across.via[0]]
    at = {"a": (WAY.via[0], 1.0), "b": (over.id, over.length_m + rear_m), **line}
    edges = dict.fromkeys(["b", *line], ("C3C2", ["C2C1", "C1B1"]))
    scene = Scene(at, {**edges, "a": ("B2C2", ["C2D2", "D2E2"])})
    waits = RoadWaits(NETWORK, scene)
    waits.look()
    scene.at = {**at, "b": (over.id, over.length_m + rear_m + (0.0 if slowly else 0.006))}
    waits.look((), {"b"})
    assert waits.of("a", 60.0)[:1] == sets


@pytest.mark.parametrize("after", [["C2D2"], ["C2D2", "D2E2"]])
@pytest.mark.parametrize(
    ("other", "waits"), [(("C2D2_0", 7.0), True), (("C2C1_0", 0.3), True), (("C2C1_0", 12.0), False)]
)
def test_inside_a_junction_a_vehicle_waits_for_bodies_on_the_rest_of_its_way(
    other: tuple[str, float], after: list[str], *, waits: bool
) -> None:
    """Also before the last edge of its route, where SUMO tells no next link."""
    beyond = other[0] == "C2D2_0"
    inside_m = NETWORK.lanes[WAY.via[0]].length_m - 1.0 if beyond else 1.0
    edges = {"a": ("B2C2", after), "b": ("B2C2" if beyond else "C3C2", [])}
    scene = Scene({"a": (WAY.via[0], inside_m), "b": other}, edges)
    assert scene.sets() == ([["b"]] if waits else [])


(LEFT,), (ONCOMING,) = NETWORK.between("C3C2", "C2D2"), NETWORK.between("C1C2", "C2C3")


@pytest.mark.parametrize(
    ("other", "sets"),
    [
        ((ONCOMING.via[0], 9.0), [["b"]]),  # it stands across the way, far from where the other waits
        ((ONCOMING.via[0], 3.0), []),
        (("C2C3_0", 6.0), []),
        (("C1C2_0", END_M - 1.0), []),  # who only comes may never come
    ],
)
def test_half_way_over_a_junction_a_vehicle_waits_for_bodies_on_all_that_is_left(
    other: tuple[str, float], sets: list[list[str]]
) -> None:
    """It has to stay where it is until its way is free, and does not drive up to them."""
    at = {"a": (LEFT.via[0], NETWORK.lanes[LEFT.via[0]].length_m - 0.1), "b": other}
    edges: dict[str, tuple[str, list[str] | None]] = {"a": ("C3C2", ["C2D2"]), "b": ("C1C2", ["C2C3"])}
    assert Scene(at, edges).sets() == sets


@pytest.mark.parametrize(
    ("mine", "its", "front_m", "sets"),
    [
        ("B2C2", "C1C2", 1.0, [["b"]]),
        ("B2C2", "C1C2", 6.0, []),  # there is space behind it
        ("C1C2", "B2C2", 5.5, []),  # the other goes first
    ],
)
def test_who_joins_a_way_first_keeps_a_vehicle_before_the_junction(
    mine: str, its: str, front_m: float, sets: list[list[str]]
) -> None:
    """By right of way, and as long as it is in the way where their ways join."""
    (joins,) = NETWORK.between(its, "C2D2")
    at = {"a": (f"{mine}_0", END_M - 0.1), "b": (joins.via[0], front_m)}
    edges: dict[str, tuple[str, list[str] | None]] = {"a": ("", ["C2D2"]), "b": (its, ["C2D2"])}
    assert Scene(at, edges).sets() == sets


def test_each_way_of_a_driver_counts_where_it_is_not_known_which_it_takes() -> None:
    """Straight on and to the right bodies stand; both have to, as long as it may still move."""
    at = {"a": HEAD, "b": ("C2D2_0", 6.0), "c": ("C2C1_0", 6.0), "d": ("C2C3_0", 6.0)}
    scene = Scene(at, {name: ("B2C2", []) for name in "bcd"} | {"a": ("A2B2", None)})
    assert scene.sets() == [["b", "c", "d"]]
    waits = RoadWaits(NETWORK, scene)
    waits.look()
    assert sorted(waits.by_each_way("a")) == [["b"], ["c"], ["d"]]
    scene.edges = {"a": ("A2B2", ["C2D2"])}
    assert waits.by_each_way("a") == []


def test_a_queue_waits_for_its_leader_only() -> None:
    """Whoever touches the next one."""
    assert Scene({"a": ("B2C2_0", 20.0), "b": ("B2C2_0", 27.6)}).sets(LONG_S) == [["b"]]


@pytest.mark.parametrize(
    ("space_m", "restless", "knows", "sets"),
    [
        (0.9, "", True, [["b"]]),
        (1.2, "", True, []),  # two such drivers closed up after a minute
        (1.2, "a", True, [["b"]]),  # it closes up already
        (1.2, "", False, [["b"]]),  # b may be longer than is known
    ],
)
def test_who_has_space_to_close_up_may_still_do_so(
    space_m: float,
    restless: str,
    sets: list[list[str]],
    *,
    knows: bool,
) -> None:
    """Beyond its minimum gap."""
    scene = Scene({"a": ("B2C2_0", 20.0), "b": ("B2C2_0", 27.5 + space_m)}, knows_sizes=knows)
    assert scene.sets(SHORT_S, restless=[restless]) == sets


@pytest.mark.parametrize(
    ("left_m", "restless", "sets"), [(3.0, "b", []), (3.0, "", [["b"]]), (0.9, "b", [["b"]])]
)
@pytest.mark.parametrize("exit_edge", ["C2C1", "C2D2"])
def test_who_stands_behind_one_that_creeps_off_the_lane_may_close_up_to_its_end(
    exit_edge: str, left_m: float, restless: str, sets: list[list[str]]
) -> None:
    """As soon as its rear is off: eight drivers did so after ten minutes, six after forty."""
    (way,) = NETWORK.between("B2C2", exit_edge)
    at = {"a": ("B2C2_0", END_M - left_m), "b": (way.via[0], 7.6 - left_m)}
    scene = Scene(at, {"b": ("B2C2", [exit_edge])})
    assert scene.sets(LONG_S, restless=[restless])[:1] == sets


def test_when_nothing_around_has_changed_for_long_everybody_around_is_a_set() -> None:
    """Not before the driver is impatient, and not at a red light."""
    others = {"b": ("D2C2_0", END_M - 1.0), "c": ("C1C2_0", END_M - 1.0), "far": ("A4A3_0", 5.0)}
    scene = Scene({"a": HEAD, **others})
    assert scene.sets(100.0) == []
    assert scene.sets(250.0) == [["b", "c"]]


(UPSTREAM,) = NETWORK.between("C0C1", "C1C2")


@pytest.mark.parametrize(
    ("at", "sets"),
    [
        (("C0C1_0", END_M - 1.0), [["b"]]),
        ((UPSTREAM.via[0], 3.0), [["b"]]),
        (("A1B1_0", END_M - 1.0), []),  # over 100 m away, at the second junction from here
    ],
)
def test_who_comes_next_to_a_junction_is_around_also_from_the_roads_before(
    at: tuple[str, float], sets: list[list[str]]
) -> None:
    """Nobody stands on C1C2: who comes there next has priority over a, and has not moved for long."""
    assert Scene({"a": HEAD, "b": at}).sets(250.0) == sets


@pytest.mark.parametrize(("behind", "sets"), [({}, [["b"]]), ({"c": ("e_1", 20.0)}, [["c"]])])
def test_who_comes_next_onto_the_lane_beside_is_around(
    behind: dict[str, tuple[str, float]], sets: list[list[str]]
) -> None:
    """Who is to drive onto it, if nobody is on it behind a driver; not d, which comes onto its own lane."""
    network = roads({"e": (100, 2), "f": (100, 1), "g": (100, 1)}, ["f_0>e_1", "g_0>e_0"])
    scene = Scene({"a": ("e_0", 60.0), "b": ("f_0", 95.0), "d": ("g_0", 95.0), **behind})
    scene.edges = {"a": ("g", [])}
    assert scene.sets(60.0, network=network) == sets


@pytest.mark.parametrize("restless", ["a", "b"])
def test_who_creeps_changes_what_is_around(restless: str) -> None:
    """Half a millimetre a second brought a vehicle past the others after half an hour.

    But not b, if it creeps up to d.
    """
    others = {"b": ("D2C2_0", END_M - 1.0), "c": ("C1C2_0", END_M - 1.0)}
    assert Scene({"a": HEAD, **others}).sets(250.0, restless=restless) == []
    blocked = {"a": HEAD, **others, "d": ("C2C3_0", 3.0)}
    scene = Scene(blocked, {"b": ("E2D2", ["C2C3"]), "d": ("D2C2", [])})
    assert scene.sets(250.0, restless=restless) == ([["b", "c", "d"]] if restless == "b" else [])


def test_who_only_has_to_leave_a_junction_yields_to_those_inside_alone() -> None:
    """Not to c, which comes next and may drive on, and patient or not."""
    (opposite,) = NETWORK.between("D2C2", "C2B2")
    scene = Scene(
        {"a": (WAY.via[0], 3.0), "b": (opposite.via[0], 3.0), "c": ("C1C2_0", END_M - 1.0)},
        {"b": ("D2C2", ["C2B2"])},
    )
    assert scene.sets(60.0) == [["b"]]
    scene.at = {**scene.at, "d": (opposite.via[0], 10.5)}
    scene.edges = {**scene.edges, "d": ("D2C2", ["C2B2"])}
    assert scene.sets(60.0, restless=["b"]) == [["b", "d"]]  # b creeps up to d, not out of the way of a


@pytest.mark.parametrize(
    ("exit_lane", "front_m", "knows", "sets"),
    [
        ("C2C1_0", 8.0, False, [["b"]]),  # on another exit, its rear perhaps inside
        ("C2D2_1", 8.0, False, [["b"]]),  # it has changed lanes beyond the junction
        ("C2C1_0", 40.0, False, []),
        ("C2C1_0", 8.0, True, []),
    ],
)
def test_who_has_to_leave_a_junction_may_wait_for_one_that_is_longer_than_is_known(
    exit_lane: str,
    front_m: float,
    knows: bool,  # noqa: FBT001  a case
    sets: list[list[str]],
) -> None:
    """Nothing changes until that one moves."""
    edge = NETWORK.edges["C2D2"]
    left = replace(edge.lanes[0], id="C2D2_1", index=1)
    network = copy(NETWORK)
    network.lanes = MappingProxyType({**NETWORK.lanes, left.id: left})
    wide = replace(edge, lanes=(*edge.lanes, left))
    network.edges = MappingProxyType({**NETWORK.edges, edge.id: wide})
    scene = Scene({"a": (WAY.via[0], 3.0), "b": (exit_lane, front_m)}, knows_sizes=knows)
    assert scene.sets(60.0, network=network) == sets


def _two_lanes(length_m: float) -> RoadNetwork:
    pair = tuple(_lane(f"e_{index}", index, length_m) for index in range(2))
    lanes = {lane.id: lane for lane in pair}
    edges = {"e": Edge("e", "j0", "j1", pair)}
    return RoadNetwork(name="two", file=Path("two"), edges=edges, lanes=lanes, junctions={}, connections=())


@pytest.mark.parametrize(("ahead_m", "sets"), [(40.0, [["b", "c"]]), (1.0, [["b"]])])
def test_who_stands_beside_another_with_space_ahead_waits_for_those_ahead_too(
    ahead_m: float, sets: list[list[str]]
) -> None:
    """It stands so that b can change lanes, and drives up once c has gone; at the lane's end b counts."""
    at_m = 50.0 - ahead_m
    scene = Scene({"a": ("e_1", at_m), "b": ("e_0", at_m - 4.0), "c": ("e_0", at_m + 8.0)})
    scene.lanes = [LeadsOn(("e_0",), 150.0, 0), LeadsOn(("e_1",), 50.0, -1)]
    assert scene.sets(0.0, network=_two_lanes(50.0))[:1] == sets


def test_of_a_jam_those_count_that_stand() -> None:
    """A lane that leads on 210 m is no better than a jam of 170 m: 23 vehicles ahead, whichever."""
    scene = Scene({"a": ("e_0", 10.0), **{f"n{k:02}": ("e_0", 17.5 + 7.5 * k) for k in range(35)}})
    scene.lanes = [LeadsOn(("e_0",), 300.0, 0), LeadsOn(("e_1",), 210.0, -1)]
    standing = [f"n{k:02}" for k in range(5, 35)]
    (jam, *_) = scene.sets(0.0, network=_two_lanes(300.0), standing=standing)
    assert jam == ["n00", *standing[:23]]


def test_of_a_jam_those_ahead_count() -> None:
    """Not the vehicles behind a driver, which SUMO does not count either."""
    line = {f"n{k:02}": ("e_0", 150.0 - 7.5 * k) for k in range(20)}
    scene = Scene({"a": ("e_0", 157.5), "z": ("e_0", 165.0), **line})
    scene.lanes = [LeadsOn(("e_0",), 300.0, 0), LeadsOn(("e_1",), 210.0, -1)]
    assert scene.sets(0.0, network=_two_lanes(300.0), restless=["a"]) == []


def test_a_jam_lasts_by_those_that_may_stand_for_good() -> None:
    """First whichever, then those of them that are left."""
    line = {f"n{k:02}": ("e_0", 17.5 + 7.5 * k) for k in range(35)}
    lanes = [LeadsOn(("e_0",), 300.0, 0), LeadsOn(("e_1",), 210.0, -1)]
    waits = RoadWaits(_two_lanes(300.0), Scene({"a": ("e_0", 10.0), **line}, lanes=lanes))
    waits.look(sorted(line))
    waits.suppose(None)
    assert waits.of("a", 0.0)[0] == ["n00"]
    waits.suppose({f"n{k:02}" for k in range(10, 35)})
    assert waits.of("a", 0.0)[0] == ["n00", *(f"n{k:02}" for k in range(10, 33))]


AHEAD = {"b": ("e_1", 57.5), "c": ("e_0", 80.0)}
TO_LEFT = [LeadsOn(("e_0",), 100.0, 1), LeadsOn(("e_1", "f_0"), 900.0, 0)]
ON_BOTH = [LeadsOn(("e_0", "f_1"), 100.0, 1), TO_LEFT[1]]


@pytest.mark.parametrize(
    ("lanes", "wishes", "b_m", "sets"),
    [
        (TO_LEFT, {}, 57.5, []),
        (TO_LEFT, {"a": (1, False)}, 57.5, [["b", "c"]]),
        (TO_LEFT, {"a": (1, False)}, 60.0, []),  # with more space it drives up to it
        (TO_LEFT, {"a": (1, False), "b": (-1, False)}, 57.5, [["b", "c"]]),
        (ON_BOTH, {"a": (1, False)}, 57.5, []),  # its own lane leads on: it may drive past b
        (TO_LEFT, {"a": (0, True), "b": (-1, False)}, 57.6, [["b", "d"]]),  # it lets b in
        (TO_LEFT, {"a": (0, True), "b": (-1, False)}, 57.5, []),  # which is too near for that
        (TO_LEFT, {"a": (0, True)}, 57.6, []),
    ],
)
def test_who_must_change_lanes_stands_with_space_ahead_and_so_does_who_lets_it_in(
    lanes: list[LeadsOn], wishes: dict[str, tuple[int, bool]], b_m: float, sets: list[list[str]]
) -> None:
    """As SUMO's drivers do. Once c drives, which is next on its lane, a may try to overtake b."""
    at = {"a": ("e_0", 50.0), **AHEAD, "b": ("e_1", b_m), "d": ("e_1", 42.0)}
    scene = Scene(at, lanes=lanes, wishes=wishes)
    network = _two_lanes(100.0)
    assert scene.sets(SHORT_S, network=network) == sets
    waits = RoadWaits(network, scene)
    waits.look()
    assert waits.cause("a") == ("lane change" if "a" in wishes else "no reason known")
    scene.at = {**at, "a": ("e_0", 50.01)}
    waits.look()
    assert waits.of("a", SHORT_S) == []  # it creeps on, and comes to rest somewhere else


def test_who_lets_another_in_drives_up_once_somebody_comes_between() -> None:
    """A driver let one in that never came, until a third drove up beside it: then it closed up."""
    at = {"a": ("e_0", 50.0), **AHEAD, "b": ("e_1", 57.6)}
    scene = Scene(at, lanes=TO_LEFT, wishes={"a": (0, True), "b": (-1, False)})
    assert scene.sets(SHORT_S, network=_two_lanes(100.0)) == []


def test_a_light_that_is_red_ends() -> None:
    """And so does the wait of whoever stands at it, unless there is no room beyond."""
    network = RoadNetwork.open("networks/grid5-actuated.net.xml")
    for others, sets in (({}, []), ({"b": ("C2D2_0", 6.0)}, [["b"]])):
        scene = Scene({"a": HEAD, "c": ("C1C2_0", END_M - 1.0), **others}, red=True)
        scene.edges = {"a": ("A2B2", ["C2D2", "D2E2"])}
        waits = RoadWaits(network, scene)
        waits.look()
        assert waits.of("a", LONG_S) == sets


def test_many_short_lanes_before_a_junction_are_looked_at_once() -> None:
    """Ten streets of a metre lead to each of ten others, ten times over: ten to the tenth ways."""
    many = range(10)
    names = [[f"s{step}x{k}" for k in many] for step in many]
    edges = {
        name: Edge(name, f"j{step}", f"j{step + 1}", (_short(name),))
        for step, row in enumerate(names)
        for name in row
    }
    ways = tuple(
        Connection(one, 0, other, 0, (), "s", f"j{step + 1}", -1, None)
        for step, (row, following) in enumerate(pairwise(names))
        for one in row
        for other in following
    )
    lanes = {edge.lanes[0].id: edge.lanes[0] for edge in edges.values()}
    network = RoadNetwork(
        name="short", file=Path("short"), edges=edges, lanes=lanes, junctions={}, connections=ways
    )
    scene = Scene({"a": ("s8x0_0", 0.5), "b": ("s0x3_0", 0.5)}, {"a": ("s7x0", ["s9x0"])})
    waits = RoadWaits(network, scene)
    waits.look()
    assert waits.of("a", LONG_S) == [["b"]]


def _short(name: str) -> Lane:
    return _lane(f"{name}_0", 0, 1.0)


def _lane(name: str, index: int, length_m: float) -> Lane:
    return Lane(
        id=name,
        edge=name.rpartition("_")[0],
        index=index,
        internal=False,
        length_m=length_m,
        speed_mps=10.0,
        width_m=3.2,
        shape=((0.0, 0.0), (1.0, 0.0)),
        allowed=frozenset({"passenger"}),
    )
