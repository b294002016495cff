"""Where vehicles can stop without being in anybody's way."""

from dataclasses import replace

import pytest
from roads import roads

from loopgate.abstraction.queue_layout import lay_out_queues
from loopgate.abstraction.stopping import fit_stops, move_stops
from loopgate.errors import ScenarioError
from loopgate.network import VehicleDemand, VehicleType, make_loop
from loopgate.network.route_lanes import make_route
from loopgate.network.stops import Stop, on_loop
from loopgate.simulation.demand.apart import moved_stops

NET = roads(
    {"a": (100, 2), "b": (60, 2), "c": (100, 2)},
    ["a_0>b_0", "a_1>b_1", "b_0>c_0", "b_1>c_1", "c_0>a_0", "c_1>a_1"],
    buses_only=[],
)
LOOP = make_loop(NET, "r", ("a", "b", "c"))
BUS = VehicleType("bus", 12.0)


def fitted(end_m: float, *, start_m: float = 0.0, kind: str = "lane", lane: str = "b_0") -> Stop:
    """Return a stop on edge b as a bus makes it."""
    way = lay_out_queues(NET, [(LOOP, BUS)]).itineraries["r"]
    stops = on_loop(LOOP, [Stop("here", kind, lane, start_m, end_m)], "x.rou.xml: vehicle v")
    (stop,) = fit_stops(way, BUS, stops, what="x.rou.xml: vehicle v")
    return stop


def test_a_stop_within_a_place_is_as_it_was() -> None:
    """The bus stands there as a whole, before its line."""
    stop = fitted(40.0, kind="busStop")
    assert (stop.end_m, stop.arc_m) == (40.0, 140.0)


def test_a_stop_on_a_lane_ends_at_the_line() -> None:
    """As far as it begins before that."""
    stop = fitted(60.0, start_m=30.0)
    assert stop.start_m == 30.0
    assert stop.end_m == pytest.approx(59.6)
    assert stop.arc_m == pytest.approx(159.6)


@pytest.mark.parametrize(
    ("end_m", "start_m", "kind", "lane", "found"),
    [
        (60.0, 30.0, "busStop", "b_0", r"beyond the line of place b_0.*let it end at 59.6 m, or before"),
        (60.0, 59.8, "lane", "b_0", r"beyond the line of place b_0"),
        (12.0, 0.0, "busStop", "b_0", r"12 m would reach back out of place b_0.*at 12.5 m, or later"),
        (40.0, 0.0, "busStop", "b_1", r"is on lane b_1, but loop r leads over b_0 there; move the stop"),
    ],
)
def test_a_stop_in_others_way_is_refused(
    end_m: float, start_m: float, kind: str, lane: str, found: str
) -> None:
    """With file, vehicle, stop, place, and what would do."""
    with pytest.raises(ScenarioError, match=rf"x.rou.xml: vehicle v: the stop at here .*{found}"):
        fitted(end_m, start_m=start_m, kind=kind, lane=lane)


def test_a_stop_before_the_place_where_a_trip_begins() -> None:
    """It is not the last of a round: the message says where the trip could stop."""
    trip = make_route(NET, "t", ("a", "b"), vclass="bus")
    way = lay_out_queues(NET, [(trip, BUS)]).itineraries["t"]
    late = replace(way, legs=(replace(way.legs[0], begin_m=30.0), *way.legs[1:]))
    stops = on_loop(trip, [Stop("here", "busStop", "a_0", 0.0, 20.0)], "v")
    assert fit_stops(way, BUS, stops, what="v") == stops
    with pytest.raises(
        ScenarioError, match=r"before place a_0, in which the trip begins; .* 22.5 m, to 42.5 m"
    ):
        fit_stops(late, BUS, stops, what="v")


@pytest.mark.parametrize(
    ("end_m", "lane", "to_m", "by_m"),
    [(60, "b_0", 59.6, -0.4), (12, "b_0", 12.5, 0.5), (40, "b_1", 40.0, 0.0), (40, "b_0", 40.0, None)],
)
def test_a_stop_moves_to_the_nearest_position(
    end_m: float, lane: str, to_m: float, by_m: float | None
) -> None:
    """On a lane of the path, with the metres; one that fits stays."""
    way = lay_out_queues(NET, [(LOOP, BUS)]).itineraries["r"]
    stops = on_loop(LOOP, [Stop("here", "busStop", lane, 0.0, end_m)], "v")
    (stop,), moved = move_stops(way, BUS, stops)
    assert (stop.lane, round(stop.end_m, 1), stop.name) == ("b_0", to_m, "here")
    assert {name: round(m, 1) for name, m in moved.items()} == ({} if by_m is None else {"here": by_m})


def test_one_line_tells_of_moved_stops_for_whom() -> None:
    """Also where vehicles of two lengths move a stop by different metres, and some depart later."""
    cut = lay_out_queues(NET, [(LOOP, BUS)])
    here = on_loop(LOOP, [Stop("here", "busStop", "b_0", 0.0, 9.0)], "v")
    there = on_loop(LOOP, [Stop("there", "busStop", "b_0", 0.0, 40.0)], "v")
    van = VehicleType("van", 10.0)
    v, w, *later = (VehicleDemand(name, LOOP, BUS, stops=here) for name in "vwxyz")
    (now, then), told = moved_stops(
        [[v, replace(w, type=van)], [*later, VehicleDemand("fits", LOOP, BUS, stops=there)]],
        cut.itineraries.values(),
    )
    assert told == ("1 stop moved, onto the lane: here by +3.5 m for v, x, y and 1 more, by +1.5 m for w",)
    assert [one.stops[0].end_m for one in (*now, *then)] == [12.5, 10.5, 12.5, 12.5, 12.5, 40.0]
