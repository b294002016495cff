"""The lanes of routes that are driven once, on hand-made roads."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from random import Random

import pytest
from roads import roads

from loopgate.errors import RouteError
from loopgate.network import route_lanes
from loopgate.network.lanes import Cost, Layer, find_costs
from loopgate.network.route_lanes import LaneWishes, Load, RouteChoices, Shortest, change_on, make_route

WIDE = roads({"a": (100, 2), "b": (100, 2), "c": (100, 2)}, ["a_0>b_0", "a_1>b_1", "b_0>c_0", "b_1>c_1"])


def test_a_route_ends_where_nothing_leads_on() -> None:
    """It is not closed, has its lanes once, and room for those who are gone behind its end."""
    way = make_route(WIDE, "w", ["a", "b", "c"])
    assert not way.closed
    assert [span.lane_id for span in way.spans] == ["a_0", "b_0", "c_0"]
    assert way.length_m == pytest.approx(300.0)
    assert way.lap_m > way.length_m + 500.0


def test_parallel_lanes_share_the_traffic() -> None:
    """Of two lanes that are equally good the one with fewer vehicles is taken."""
    load = Load({"a_0": 1, "b_0": 1, "c_0": 1})
    assert [span.lane for span in make_route(WIDE, "w", ["a", "b", "c"], load=load).spans] == [1, 1, 1]


def test_two_changes_of_lanes_are_worse_than_a_crowd() -> None:
    """Only lane 1 of b leads to c: nobody on it changes to lane 0 and back for its being emptier."""
    net = roads({"a": (100, 2), "b": (100, 2), "c": (100, 1)}, ["a_0>b_0", "a_1>b_1", "b_1>c_0"])
    load = Load({"a_1": 40, "b_1": 40, "c_0": 50, "a_1>b": 40, "b_1>c": 40})
    way = make_route(net, "w", ["a", "b", "c"], load=load, wishes=LaneWishes(1))
    assert [span.lane for span in way.spans] == [1, 1, 0]


def test_nobody_comes_into_the_only_lane_that_leads_on_from_the_empty_one_beside() -> None:
    """Where a lane ends, all drive on the one that goes on, however many they are."""
    net = roads({"a": (600, 2), "b": (600, 1)}, ["a_1>b_0"])
    load = Load({"a_1": 50, "b_0": 50, "a_1>b": 50})
    way = make_route(net, "w", ["a", "b"], load=load)
    assert [(span.lane_in, span.lane) for span in way.spans] == [(1, 1), (0, 0)]


def test_a_change_by_two_lanes_is_worse_than_a_full_lane() -> None:
    """From a ramp vehicles come into the next lane, though the one beyond it is emptier."""
    net = roads({"a": (200, 3), "b": (200, 2)}, ["a_1>b_0", "a_2>b_1"])
    load = Load({"a_1": 50, "b_0": 50, "a_1>b": 50, "a_2": 45, "b_1": 45, "a_2>b": 45})
    way = make_route(net, "w", ["a", "b"], load=load, wishes=LaneWishes(0))
    assert [(span.lane_in, span.lane) for span in way.spans] == [(0, 1), (0, 0)]


FORK = roads(
    {"a": (100, 2), "on": (100, 2), "left": (100, 1), "b": (100, 1)},
    ["a_0>on_0", "a_1>on_1", "a_1>left_0", "on_1>b_0"],
)


def test_lanes_are_not_shared_with_many_who_go_elsewhere() -> None:
    """Who goes on takes the lane without those who turn, and changes lanes later; not for a few of them."""
    few, many = (Load({"a_1": n, "a_1>left": n, "a_0": 50, "a_0>on": 50}) for n in (10, 40))
    assert [span.lane for span in make_route(FORK, "w", ["a", "on", "b"], load=few).spans] == [1, 1, 0]
    way = make_route(FORK, "w", ["a", "on", "b"], load=many)
    assert [(span.lane_in, span.lane) for span in way.spans] == [(0, 0), (0, 1), (0, 0)]


def test_lanes_change_where_there_is_room() -> None:
    """The change is made on the long edge, though the short one would do for the number of changes."""
    net = roads({"a": (9, 2), "b": (90, 2), "c": (100, 1)}, ["a_0>b_0", "b_1>c_0"])
    way = make_route(net, "w", ["a", "b", "c"], shortest=Shortest(12.0))
    assert [(span.lane_in, span.lane) for span in way.spans] == [(0, 0), (0, 1), (0, 0)]


def test_lanes_change_where_others_change_already() -> None:
    """An edge on which somebody changes is cut for all, so nobody cuts a second one, though it is longer."""
    net = roads({"a": (200, 2), "b": (150, 2), "c": (100, 1)}, ["a_0>b_0", "a_1>b_1", "b_1>c_0"])
    users = {"a_0": 25, "a_1": 25, "b_1": 50, "c_0": 50}
    ways = [
        make_route(net, "w", ["a", "b", "c"], load=Load(users | changing), wishes=LaneWishes(0))
        for changing in ({change_on("b"): 25}, {change_on("a"): 25})
    ]
    changes = [[(span.lane_in, span.lane) for span in way.spans] for way in ways]
    assert changes == [[(0, 0), (0, 1), (0, 0)], [(0, 1), (1, 1), (0, 0)]]


def test_lanes_change_where_others_can_wait_before_and_after() -> None:
    """On a shorter edge a change shuts a crossing: better behind those who go elsewhere, changed before."""
    net = roads(
        {"a": (100, 2), "ring": (30, 2), "left": (100, 1), "c": (100, 1)},
        ["a_0>ring_0", "a_1>ring_1", "a_0>left_0", "ring_0>c_0"],
    )
    load = Load({"a_0": 50, "a_0>left": 40, "a_0>ring": 10, "ring_0": 10, "ring_0>c": 10})
    ways = [
        make_route(net, "w", ["a", "ring", "c"], load=load, wishes=LaneWishes(1), shortest=shortest)
        for shortest in (Shortest(10.0, 25.0), Shortest())
    ]
    changes = [[(span.lane_in, span.lane) for span in way.spans] for way in ways]
    assert changes == [[(1, 1), (1, 0), (0, 0)], [(1, 0), (0, 0), (0, 0)]]


def test_wishes_of_the_file() -> None:
    """A lane to depart on, and one to arrive on; but nobody changes lanes for that."""
    for wishes, lane in {(1, None): 1, (None, 1): 1, (1, 0): 1}.items():
        way = make_route(WIDE, "w", ["a", "b", "c"], wishes=LaneWishes(*wishes))
        assert [(span.lane_in, span.lane) for span in way.spans] == [(lane, lane)] * 3


def test_lanes_to_stop_on() -> None:
    """The way leads over them, though that is a change of lanes; -1 stands for any."""
    for lane in (0, 1):
        way = make_route(WIDE, "w", ["a", "b", "c"], wishes=LaneWishes(1 - lane, stop={"b": lane, "c": -1}))
        assert (way.spans[1].lane_in, way.spans[1].lane) == (lane, lane)


def test_one_edge_is_a_route() -> None:
    """It departs and arrives on it."""
    assert make_route(WIDE, "w", ["b"]).edges == ("b",)


def test_edges_that_do_not_follow() -> None:
    """One line that names route and edges."""
    with pytest.raises(RouteError, match="route w: edge a does not lead to edge c"):
        make_route(WIDE, "w", ["a", "c"])


def test_lanes_over_the_same_edges_are_chosen_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Thousands of trips share few ways; a wish, a load or a class of its own asks anew."""
    chosen: list[int] = []

    def counted(layers: Sequence[Layer], last: Iterable[int]) -> list[dict[int, Cost]]:
        chosen.append(1)
        return find_costs(layers, last)

    monkeypatch.setattr(route_lanes, "find_costs", counted)
    choices = RouteChoices(WIDE)
    first, second = (choices.make(name, ["a", "b", "c"]) for name in ("v", "w"))
    assert (len(chosen), second.id, second.spans) == (1, "w", first.spans)
    wished = choices.make("x", ["a", "b", "c"], wishes=LaneWishes(depart=1))
    loaded = choices.make("y", ["a", "b", "c"], load=Load({"a_0": 1, "b_0": 1, "c_0": 1}))
    assert [way.spans[0].lane for way in (first, wished, loaded)] == [0, 1, 1]
    choices.make("z", ["a", "b", "c"], vclass="bus")
    assert len(chosen) == 4


def test_the_fullest_lane_is_known_at_any_time() -> None:
    """As the greatest of all numbers, whoever comes and goes."""
    rng, load = Random(1), Load({"a": 2})
    there: list[tuple[str, ...]] = [("a",), ("a",)]
    for _ in range(300):
        if there and rng.random() < 0.5:
            load.take(there.pop(rng.randrange(len(there))))
        else:
            there.append(tuple(rng.sample("abcdef", 3)))
            load.add(there[-1])
        assert load.most == max(load.of.values())
