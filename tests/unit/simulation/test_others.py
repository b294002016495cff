"""Where ordinary traffic is in the way of a gated vehicle, without SUMO."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

from fake_traffic import FakeTraffic, FakeVehicle

from builders import system
from loopgate.abstraction.itinerary import Leg
from loopgate.drive.build import make_tables
from loopgate.drive.driver import Driver
from loopgate.drive.track import Round, Track
from loopgate.gates import Reason
from loopgate.model import StateId
from loopgate.results.recorder import Recorder
from loopgate.simulation.coming import Arrival
from loopgate.simulation.crossing_ways import Approach, Movement, Place, Way
from loopgate.simulation.others import Others
from loopgate.simulation.sight import Sight
from loopgate.simulation.timetable import Timetable
from loopgate.traffic.base import Dynamics, Light, Program

STREET = [("before", 100.0), ("junction", 20.0), ("after", 50.0), ("foe", 20.0), ("priority", 100.0)]
BEGINS = {"before": 0.0, "junction": 100.0, "after": 120.0, "foe": 170.0, "priority": 190.0}


class Scene:
    """The vehicle ``v`` stands at 90 m of 100 on ``before_0``; ``after_0`` has five slots of 10 m."""

    def __init__(self, *, others_in_next: int = 0, signal: tuple[str, int] | None = None) -> None:
        track = Track(
            vehicle="v",
            loop="loop",
            lap_m=400.0,
            start_m=90.0,
            top_speed_mps=10.0,
            rounds=(Round("before", "round", "first"), Round("", "onward", "second")),
            edges=((0.0, "before"),),
            legs=(Leg(StateId("before_0"), 0.0, 100.0), Leg(StateId("after_0"), 120.0, 170.0)),
        )
        paths = {"v": "before_0 after_0", "w": "after_0 before_0"}
        roads = system(paths, capacity={"before_0": 10, "after_0": 5}, fifo=("before_0", "after_0"))
        tables = make_tables([track, replace(track, vehicle="w")], roads, Recorder(None).code, step_s=1.0)
        driver = Driver(0, track, tables)
        driver.drives_like(Dynamics(5.0, 2.6, 4.5, 1.0))
        driver.row["line_m"] = 100.0
        next_state = roads.paths[0][1]
        keeper = Mock(
            room=lambda state: 5 - others_in_next if state == next_state else 0,
            holders=lambda _: [1] * others_in_next,
            wanted=lambda _: next_state,
        )
        way = Way(
            lane="before_0",
            line_m=100.0,
            movements=(
                Movement(
                    from_m=0.0,
                    across=("foe_0",),
                    approaches=(Approach("priority", "after", signal),),
                    length_m=20.0,
                    speed_mps=10.0,
                    wait_m=0.0,
                ),
            ),
            between=(),
            next=Place("after_0", 0.0, 50.0, ("junction_0",)),
        )
        self.arrivals: list[Arrival] = []
        self.tight = False
        self.traffic = FakeTraffic({"v": FakeVehicle(STREET, 90.0)})
        drivers: list[Any] = [driver, SimpleNamespace(id="w", robot=1, speed_mps=5.0, length_m=5.0)]
        self.others = Others(
            self.traffic,
            drivers,
            {"loop": [way, way]},
            keeper,
            Timetable(self.traffic),
            Sight(Mock(connections=()), self.traffic, drivers),
            Mock(arrivals=lambda: {("priority", "after"): self.arrivals}),
            Mock(too_tight=lambda _: self.tight),
        )

    def put(self, name: str, edge: str, position_m: float, speed: float = 0.0) -> None:
        """Put an ordinary vehicle on the road."""
        self.traffic.fleet[name] = FakeVehicle(STREET, BEGINS[edge] + position_m)
        self.traffic.fleet[name].speed_mps = speed

    def says(self) -> Reason | None:
        """Ask in a new step."""
        self.traffic.now_s += 1.0
        return self.others.in_the_way(0)


def test_an_empty_road_is_free() -> None:
    """Gated vehicles are no ordinary ones: they are the gate's."""
    scene = Scene()
    scene.traffic.fleet["w"] = FakeVehicle(STREET, BEGINS["foe"] + 5.0)
    assert scene.says() is None
    assert scene.others.blockers(0) == []


def test_an_ordinary_vehicle_before_it_on_its_lane() -> None:
    """Behind it does not matter."""
    scene = Scene()
    scene.put("o", "before", 50.0)
    assert scene.says() is None
    scene.put("o", "before", 97.0)
    assert scene.says() is Reason.TRAFFIC
    assert scene.others.blockers(0) == [["o"]]


def test_an_ordinary_vehicle_across_its_way() -> None:
    """Inside the junction, on a movement that conflicts."""
    scene = Scene()
    scene.put("o", "foe", 3.0)
    assert scene.says() is Reason.TRAFFIC
    assert scene.others.blockers(0) == [["o"]]


def test_ordinary_vehicles_take_room_in_the_next_state() -> None:
    """Three gated vehicles and two ordinary ones leave 12.5 m of 50; a third on its way there takes that."""
    scene = Scene(others_in_next=3)
    scene.put("o", "after", 40.0)
    scene.put("p", "after", 30.0)
    assert scene.says() is None
    scene.put("q", "junction", 10.0)
    assert scene.says() is Reason.TRAFFIC
    (some,) = scene.others.blockers(0)
    assert sorted(set(some)) == ["o", "p", "q", "w"]


def test_a_circle_of_places_with_too_little_room() -> None:
    """Anybody else may have to move on first."""
    scene = Scene()
    scene.put("o", "after", 40.0)
    scene.tight = True
    assert scene.says() is Reason.TRAFFIC
    assert scene.others.blockers(0) == [["w"]]


def test_one_that_comes_with_the_right_of_way() -> None:
    """It takes some 7 s to be over: 4 s away is too near, at the line is past before, 9 s is far enough."""
    scene = Scene()
    scene.put("o", "priority", 60.0)
    for arrival, reason in (
        (Arrival(4.0, 4.0), Reason.TRAFFIC),
        (Arrival(0.0, 0.2), None),
        (Arrival(9.0, 12.0), None),
        (Arrival(5.0, 12.0), Reason.TRAFFIC),
    ):
        scene.arrivals = [arrival]
        assert scene.says() is reason


def test_one_that_has_a_red_light_is_not_coming() -> None:
    """Its right of way counts only while its light is green."""
    scene = Scene(signal=("t", 0))
    scene.put("o", "priority", 60.0)
    scene.arrivals = [Arrival(4.0, 4.0)]
    scene.traffic.programs["t"] = Program((), fixed=False)
    scene.traffic.lights["t"] = Light("r", 0.0)
    assert scene.says() is None
    scene.traffic.lights["t"] = Light("G", 0.0)
    assert scene.says() is Reason.TRAFFIC


def test_who_stands_at_its_line_with_its_grant_sets_out_when_nobody_comes() -> None:
    """SUMO's right of way, which stopped it, may let both go at once; after a minute it decides alone."""
    scene = Scene()
    driver = scene.others._drivers[0]
    driver.row["front"], driver.row["speed"], driver.row["granted"] = 98.0, 0.0, 1
    stands: list[tuple[str, bool]] = []
    scene.traffic.stand = lambda vehicle, *, still: stands.append((vehicle, still))  # type: ignore[method-assign]
    scene.put("o", "priority", 60.0)

    def look(arrivals: list[Arrival]) -> list[tuple[str, bool]]:
        stands.clear()
        scene.arrivals = arrivals
        scene.traffic.now_s += 1.0
        scene.others.look()
        return list(stands)

    assert look([]) == []
    assert look([Arrival(4.0, 4.0)]) == [("v", True)]
    assert look([Arrival(4.0, 4.0)]) == []
    assert look([]) == [("v", False)]
    driver.row["front"] = 60.0
    assert look([Arrival(4.0, 4.0)]) == []
    driver.row["front"] = 98.0
    assert look([Arrival(4.0, 4.0)]) == [("v", True)]
    scene.others._drivers.reverse()  # type: ignore[attr-defined]
    assert look([]) == [("v", False)]
    assert look([Arrival(4.0, 4.0)]) == [("v", True)]
    scene.traffic.now_s += 60.0
    assert look([Arrival(4.0, 4.0)]) == [("v", False)]
    assert look([Arrival(4.0, 4.0)]) == []
