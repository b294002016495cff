"""A gated vehicle before a junction, and ordinary vehicles about it, without SUMO."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

from fake_traffic import FakeTraffic, FakeVehicle

from builders import system
from loopgate.abstraction.itinerary import Leg
from loopgate.drive.driver import Driver
from loopgate.drive.ground import Ground
from loopgate.drive.timetable import Signal, Timetable
from loopgate.drive.track import Round, Track
from loopgate.gates import Reason
from loopgate.model import StateId
from loopgate.results.recorder import Recorder
from loopgate.simulation.around.coming import Arrival
from loopgate.simulation.around.crossing_ways import Approach, Movement, Place, Way
from loopgate.simulation.around.others import Others
from loopgate.simulation.around.sight import Sight
from loopgate.simulation.around.yielding import Yielding
from loopgate.traffic.base import Dynamics

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
        other = replace(track, vehicle="w")
        tables = Ground.of([track, other], roads, Recorder(None).code, step_s=1.0).tables
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
                    unseen=(),
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
        self.slowed: list[tuple[str, float | None]] = []
        self.tight = False
        self.traffic = FakeTraffic({"v": FakeVehicle(STREET, 90.0)})
        self.traffic.keep_to = lambda *told: self.slowed.append(told)  # type: ignore[method-assign]
        drivers: list[Any] = [driver, Driver(1, other, tables)]
        drivers[1].drives_like(Dynamics(5.0, 2.6, 4.5, 1.0))
        sight = Sight(Mock(connections=()), self.traffic, drivers)
        self.ways = ways = {"loop": [way, way]}
        coming: Any = Mock(arrivals=lambda *between: {("priority", "after"): self.arrivals}[between])
        self.vehicles: Any = tables.vehicles
        engine: Any = SimpleNamespace(
            drivers=drivers, tables=tables, vehicles=self.vehicles, driver_of={one.id: one for one in drivers}
        )
        timetable = Timetable(self.traffic, [Signal("over", *signal, 10.0)] if signal else [])
        self.yielding = Yielding(self.traffic, engine, ways, timetable, sight, coming)
        circles: Any = Mock(too_tight=lambda _: self.tight, asked=())
        self.others = Others(drivers, ways, keeper, sight, self.yielding, circles)
        self.drivers = drivers

    def put(self, name: str, edge: str, position_m: float, speed: float = 0.0) -> None:
        """Put an ordinary vehicle on the road."""
        self.traffic.fleet[name] = FakeVehicle(STREET, BEGINS[edge] + position_m)
        self.traffic.fleet[name].speed_mps = speed

    def make_unseen(self) -> None:
        """Let SUMO not see who is in the way."""
        way = self.ways["loop"][0]
        self.ways["loop"][0] = replace(way, movements=(replace(way.movements[0], unseen=("foe_0",)),))

    def make_waiting(self) -> None:
        """Let the vehicle have to wait 8 m inside the junction, in others' way."""
        way = self.ways["loop"][0]
        movement = replace(way.movements[0], wait_m=8.0, waits_in_way=True)
        self.ways["loop"][0] = replace(way, movements=(movement,))

    def says(self) -> Reason | None:
        """Ask in a new step."""
        self.traffic.now_s += 1.0
        return self.others.in_the_way(0)
