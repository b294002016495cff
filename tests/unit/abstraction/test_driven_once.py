"""Routes that are driven once, as queues: the places on the way, and then room for everybody."""

from __future__ import annotations

import math

import pytest
from roads import roads

from loopgate.abstraction.queue_layout import lay_out_queues
from loopgate.abstraction.queues import make_queues
from loopgate.errors import RefusedLoopError
from loopgate.gates import make_gate
from loopgate.network import RoadNetwork, make_loop
from loopgate.network.route_lanes import make_route
from loopgate.network.vehicle_type import DEFAULT_TYPE, VehicleType

GRID = RoadNetwork.open("networks/grid5-priority.net.xml")
WAY = make_route(GRID, "w", ["A0A1", "A1A2", "A2A3"])
LOOP = make_loop(GRID, "l", ["A0A1", "A1B1", "B1B0", "B0A0"])


def test_places_and_then_away() -> None:
    """One leg per edge and one behind the end, in which nobody is held; the last place has no crossing."""
    way = lay_out_queues(GRID, [(WAY, DEFAULT_TYPE)]).itineraries["w"]
    assert [leg.state for leg in way.legs] == ["A0A1_0", "A1A2_0", "A2A3_0", "away A2A3_0"]
    assert [leg.away for leg in way.legs] == [False, False, False, True]
    assert [len(leg.crossings) for leg in way.legs] == [1, 1, 0, 0]
    assert way.legs[-1].begin_m <= WAY.length_m < way.legs[-1].end_m < way.loop.lap_m
    assert way.legs[-1].begin_m == pytest.approx(way.legs[-2].end_m + 0.1)


def test_away_has_room_for_everybody() -> None:
    """It is never full, whoever arrives: so it closes no circle."""
    later = [(WAY, DEFAULT_TYPE)] * 30
    made = make_queues(GRID, [LOOP], [DEFAULT_TYPE], later=later)
    assert made.room["away A2A3_0"] > 30
    assert made.room["A2A3_0"] < 30
    gate = make_gate("certified", made.system)
    assert getattr(gate, "promise", "") == "everyone"


SHORT = roads({"a": (80.0, 1), "b": (24.0, 1), "c": (80.0, 1)}, ["a_0>b_0", "b_0>c_0", "c_0>a_0"])
BUS = VehicleType(id="bus", length_m=12.0, min_gap_m=3.0)


@pytest.mark.parametrize(
    ("round_again", "own_lengths", "room"), [(False, True, 2), (True, True, None), (False, False, None)]
)
def test_a_bus_beside_a_car_is_enough_for_a_place_if_buses_come_once(
    *, round_again: bool, own_lengths: bool, room: int | None
) -> None:
    """In 22.9 m two buses of 15 m do not fit, one beside a car of 7.5 m does; on a loop each bus stays."""
    loop, once = make_loop(SHORT, "l", ["a", "b", "c"]), make_route(SHORT, "w", ["a", "b", "c"])
    later = [(once, DEFAULT_TYPE)] * 4 + [(loop if round_again else once, BUS)] * 2
    made = make_queues(SHORT, [loop], [DEFAULT_TYPE], later=later, own_lengths=own_lengths)
    assert made.room.get("b_0") == room
    if room:
        assert made.rooms["b_0"][:3] == pytest.approx((22.9, 7.5, 7.9))
    assert math.isinf(made.rooms["a_0"].most_kept_m)


def test_movements_of_both_know_each_other() -> None:
    """The loop's turn out of A0A1 and the way straight on come from one lane: they follow each other."""
    layout = lay_out_queues(GRID, [(WAY, DEFAULT_TYPE), (LOOP, DEFAULT_TYPE)])
    turn = layout.itineraries["l"].legs[0].crossings[0]
    straight = layout.itineraries["w"].legs[0].crossings[0]
    assert turn.id != straight.id
    assert straight.id not in turn.foes


def test_a_left_turn_has_its_waiting_point_where_the_last_lane_inside_begins() -> None:
    """SUMO lets it stand there for the oncoming ones; who drives straight on waits before the junction."""
    left = make_route(GRID, "left", ["B2B1", "B1C1"])
    ways = lay_out_queues(GRID, [(left, DEFAULT_TYPE), (WAY, DEFAULT_TYPE)]).itineraries
    turn, straight = ways["left"].legs[0].crossings[0], ways["w"].legs[0].crossings[0]
    inside = next(c for c in GRID.connections if c.id == turn.id).via
    assert len(inside) == 2
    assert turn.wait_m == pytest.approx(turn.ahead_m + GRID.lanes[inside[0]].length_m)
    assert straight.wait_m == straight.ahead_m


def test_all_ways_that_do_not_work_are_named_at_once() -> None:
    """So that those who drive on them can be left out together."""
    long = VehicleType("long", length_m=300.0)
    other = make_route(GRID, "x", ["B0B1", "B1B2"])
    with pytest.raises(RefusedLoopError) as error:
        lay_out_queues(GRID, [(WAY, long), (other, long)])
    assert set(error.value.refused) == {"w", "x"}
