"""Stops without SUMO: when it is told of them, and what becomes of them on another path."""

from __future__ import annotations

from dataclasses import replace
from math import inf
from typing import Any, cast

import pytest
from fake_traffic import FakeTraffic, FakeVehicle

from loopgate.abstraction.itinerary import Round, Track
from loopgate.control.diary import Row
from loopgate.control.ledger import Ledger
from loopgate.control.parking import Parking
from loopgate.control.places import Make, Place, path_of
from loopgate.control.rules import usual
from loopgate.control.stops import Stops
from loopgate.network.stops import Stop

CAR = Make(5.0, 2.6, 4.5, 10.0, 1.0)
LAP_M = 300.0
STOPS = (
    Stop("market", "busStop", "a_0", 20.0, 50.0, arc_m=50.0),
    Stop("school", "busStop", "c_0", 10.0, 40.0, arc_m=240.0),
)


class Told(FakeTraffic):
    """A simulation that notes which stops it has been given, and which were taken back."""

    def __init__(self) -> None:
        super().__init__({"v": FakeVehicle([(edge, 100.0) for edge in "abc"], 10.0)})
        self.stops: list[str] = []
        self.begun: list[str] = []
        self.over = 0

    def set_stop(self, vehicle: str, stop: Stop) -> None:
        del vehicle
        self.stops.append(stop.name)

    def drop_stop(self, vehicle: str, stop: Stop) -> None:
        del vehicle
        self.stops.remove(stop.name)

    def stops_begun(self) -> tuple[str, ...]:
        begun, self.begun = tuple(self.begun), []
        return begun

    def stops_ended(self) -> tuple[str, ...]:
        return ("v",) * bool(self.over)

    def stops_ahead(self, vehicle: str) -> int:
        del vehicle
        over, self.over = self.over, 0
        del self.stops[:over]
        return len(self.stops)


class Line:
    """A vehicle on a loop of three roads of 100 m, with a stop at 50 m and one at 240 m."""

    def __init__(self, front_m: float = 10.0, *, again: bool = True) -> None:
        self.told, self.rows = Told(), list[Row]()
        ledger = Ledger(usual())
        parking = Parking(self.told, ledger, lambda _: True, self.rows)
        self.stops = Stops(self.told, ledger, {"v": STOPS}, parking, self.rows)
        path = path_of([Place(name, 3) for name in "abc"], closed=True)
        self.car = ledger.take_in("v", path, 0, CAR, LAP_M)
        self.car.front_m = front_m
        self.track = self.way("abc", again=again)
        self.stops.take_in(self.car, self.track)

    @staticmethod
    def way(edges: str, *, again: bool = True) -> Track:
        """Return a path over roads of 100 m."""
        rounds = (Round(edges[1], "round", "first"),) if again else ()
        begins = tuple((100.0 * number, edge) for number, edge in enumerate(edges))
        return Track("v", edges, LAP_M, 10.0, 10.0, rounds, begins, ())

    def step(self, front_m: float, *, stops: bool = False, goes_on: bool = False) -> list[str]:
        """Let the vehicle come there; return the new events."""
        before, self.car.front_m = len(self.rows), front_m
        self.told.begun, self.told.over = ["v"] * stops, int(goes_on)
        self.told.now_s += 1.0
        self.stops.look()
        return [str(row[2]) for row in self.rows[before:]]


def test_each_stop_is_made_in_every_round() -> None:
    """SUMO gets it again once it is behind; times and counts are kept."""
    line = Line()
    assert line.told.stops == ["market", "school"]
    for lap_m in (0.0, LAP_M):
        assert line.car.stop_m == lap_m + 50.0
        assert line.step(lap_m + 50.0, stops=True) == ["stop"]
        assert [name for name, _ in line.stops.made_now()] == ["v"]
        assert line.step(lap_m + 50.0) == []
        assert line.step(lap_m + 50.0, goes_on=True) == ["served"]
        assert line.car.stop_m == lap_m + 240.0
        line.step(lap_m + 240.0, stops=True)
        line.step(lap_m + 240.0, goes_on=True)
        line.step(lap_m + 241.0)
        assert line.told.stops == ["market", "school"]
    assert (line.stops.served, line.stops.missed) == (4, 0)
    assert line.stops.made["v"] == (4, 6.0)
    assert [visit[1] for visit in line.stops.visits] == ["market", "school"] * 2
    assert [visit[4] - visit[3] for visit in line.stops.visits] == [2.0, 1.0] * 2


@pytest.mark.parametrize("again", [True, False])
def test_a_stop_ten_metres_behind_is_missed(again: bool) -> None:  # noqa: FBT001  a case
    """Who drives a loop makes it in the next round."""
    line = Line(again=again)
    assert line.step(60.0) == []
    assert line.step(60.1) == ["missed"]
    assert line.car.stop_m == 240.0
    assert line.stops.missed == 1
    assert line.step(250.1) == ["missed"]
    assert line.car.stop_m == (350.0 if again else inf)


def test_a_stop_too_near_at_the_start_is_made_in_the_next_round() -> None:
    """Where it drives once it is missed: the vehicle cannot brake for it."""
    assert Line(front_m=51.0).car.stop_m == 240.0
    once = Line(front_m=51.0, again=False)
    assert (once.car.stop_m, once.stops.missed) == (240.0, 1)


@pytest.mark.parametrize(
    ("front_m", "edges", "may"),
    [(10.0, "acb", True), (10.0, "abd", False), (10.0, "aca", False), (45.0, "acb", False)],
)
def test_a_vehicle_takes_another_path_on_which_it_makes_all_stops(
    front_m: float,
    edges: str,
    may: bool,  # noqa: FBT001  a case
) -> None:
    """Each road of a stop once, and not just before a stop."""
    line = Line()
    line.car.front_m, line.car.speed = front_m, 5.0
    assert line.stops.may_take("v", line.way(edges)) == may
    assert line.stops.may_take("nobody", line.way(edges))


def test_nor_while_it_stands_at_one() -> None:
    line = Line()
    line.step(50.0, stops=True)
    line.car.front_m = 51.0
    assert not line.stops.may_take("v", line.way("acb"))
    line.step(51.0, goes_on=True)
    assert line.stops.may_take("v", line.way("acb"))


def test_on_another_path_stops_are_set_anew_where_they_lie_there() -> None:
    """The one just made comes a round later; SUMO forgets what it knew."""
    line = Line()
    line.step(50.0, stops=True)
    line.step(50.0, goes_on=True)
    line.step(60.0)
    line.stops.takes_back(line.car)
    assert line.told.stops == []
    line.stops.turned_off(line.car, line.way("acb"))
    assert line.car.stop_m == 140.0
    assert line.told.stops == ["school", "market"]
    line.step(140.0, stops=True)
    line.step(140.0, goes_on=True)
    assert line.car.stop_m == 350.0


def test_a_stop_on_the_road_where_the_route_is_renewed_is_set_again() -> None:
    """Not while the vehicle stands at it, and none on other roads."""
    line = Line()
    calls: list[str] = []
    told = cast("Any", line.told)
    told.set_stop = lambda _, stop: calls.append(stop.name)
    told.drop_stop = lambda _, stop: calls.append(f"no {stop.name}")
    line.stops.renewed(line.car)
    assert calls == []
    stops = Line()
    track = replace(stops.track, rounds=(Round("a", "round", "first"),))
    stops.told.stops.clear()
    stops.stops.take_in(stops.car, track)
    told = cast("Any", stops.told)
    told.set_stop = lambda _, stop: calls.append(stop.name)
    told.drop_stop = lambda _, stop: calls.append(f"no {stop.name}")
    stops.stops.renewed(stops.car)
    assert calls == ["no market", "market"]
    stops.step(50.0, stops=True)
    stops.stops.renewed(stops.car)
    assert len(calls) == 2


def test_where_a_loop_passes_a_road_twice_it_is_told_of_the_stop_after_the_last_pass() -> None:
    """Else SUMO would take the stop for one on the next pass. The loop is a, b, a, c."""
    line = Line()
    line.car.lap_m = 400.0
    line.stops._stops["v"] = STOPS[:1]
    line.told.stops.clear()
    line.stops.take_in(line.car, line.way("abac"))
    assert line.told.stops == ["market"]
    line.step(50.0, stops=True)
    line.step(50.0, goes_on=True)
    for front_m, told in ((60.0, []), (250.4, []), (250.6, ["market"])):
        line.step(front_m)
        assert line.told.stops == told
    assert line.car.stop_m == 450.0
