"""Gated vehicles among ordinary ones, without SUMO."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from random import Random
from types import SimpleNamespace
from typing import Any, NamedTuple

from fake_traffic import FakeTraffic, FakeVehicle

from builders import system
from loopgate.abstraction.itinerary import Leg
from loopgate.abstraction.track import Round, Track
from loopgate.drive import step as drive
from loopgate.drive.codes import NOBODY, NOTHING
from loopgate.drive.engine import Engine
from loopgate.drive.gatekeeper import Gatekeeper
from loopgate.drive.timetable import Signal, Timetable
from loopgate.gates import Reason, make_gate
from loopgate.model import StateId, System
from loopgate.negotiation.simple import OldestFirst
from loopgate.network import Loop, RoadNetwork
from loopgate.network.vehicle_type import DEFAULT_TYPE
from loopgate.results.recorder import Recorder
from loopgate.simulation.around.crossing_ways import Approach, Movement, Place, Way
from loopgate.simulation.around.roads import Roads
from loopgate.simulation.around.sight import Sight
from loopgate.simulation.around.ways import Ways
from loopgate.simulation.attaching.plan import Plan

STREET = [("before", 100.0), ("junction", 20.0), ("after", 50.0), ("foe", 20.0), ("priority", 100.0)]
BEGINS = {"before": 0.0, "junction": 100.0, "after": 120.0, "foe": 170.0, "priority": 190.0}


def road_network(lengths_m: Mapping[str, float], connected: Sequence[tuple[str, str]]) -> Any:  # noqa: ANN401
    """Return roads of one lane with these connections over points."""
    lanes = {
        f"{edge}_0": SimpleNamespace(length_m=length_m, speed_mps=10.0, edge=edge, internal=False)
        for edge, length_m in lengths_m.items()
    }
    connections = [
        SimpleNamespace(from_edge=one, from_lane=0, to_edge=other, to_lane=0, via=())
        for one, other in connected
    ]
    edges = {edge: SimpleNamespace(lanes=[lanes[f"{edge}_0"]]) for edge in lengths_m}
    return SimpleNamespace(lanes=lanes, edges=edges, connections=connections)


class Found:
    """Finds what a test says: by loop, the ways behind its places, and where these are."""

    def __init__(self, ways: Mapping[str, Sequence[Way]], places: Mapping[str, Place]) -> None:
        self.ways, self.places = ways, places

    def of(self, track: Track) -> Sequence[Way]:
        """Return the way ahead at the end of each position of a track."""
        return self.ways[track.loop]

    def place(self, track: Track, position: int) -> Place:
        """Return where the state at a position of a track is."""
        return self.places[str(track.legs[position].state)]


class Watched:
    """A drive whose vehicles are where a test says, among ordinary ones.

    Parameters
    ----------
    robots, tracks
        The system, and one track for each robot.
    traffic, network
        Where the ordinary vehicles are, and the roads.
    find
        Finds what lies before the gated vehicles.
    signals
        All lights that there are.
    """

    def __init__(
        self,
        robots: System,
        tracks: Sequence[Track],
        traffic: Any,  # noqa: ANN401  a fake or a mock
        network: Any,  # noqa: ANN401  roads, or what stands for them
        find: Any,  # noqa: ANN401  `CrossingWays`, or `Found`
        signals: Sequence[Signal] = (),
    ) -> None:
        self.traffic, self.recorder = traffic, Recorder(None)
        self.keeper = Gatekeeper(OldestFirst(Random(1)))
        self.keeper.change(robots, make_gate("collision", robots))
        self.engine = Engine(traffic, tracks, self.keeper, self.recorder)
        self.roads = Roads(network)
        self.sight = Sight(self.roads, traffic, self.engine, self.keeper, Timetable(traffic, signals))
        self._find, self._tracks = find, tracks
        self.plan()

    def plan(self) -> None:
        """Take over what is found, the first time or anew."""
        self.sight.plan(Ways(self._find, self.roads, self._tracks, self.recorder.code))
        self.tables: Mapping[str, Any] = self.sight._tables

    def look(self) -> None:
        """See where the ordinary vehicles are."""
        self.engine.run["now_s"] = self.traffic.now_s
        self.engine.run["answers"] = 0
        self.sight.look()

    def is_barred(self, robot: int = 0) -> bool:
        """Ask whether ordinary traffic bars a vehicle."""
        self.look()
        run = self.engine.run
        run["turn"], run["granted"], self.engine.vehicles["reason"][robot] = 1, -1, NOTHING
        return not self.keeper.ask(drive.STILL_FREE, robot)

    def blockers(self, robot: int = 0) -> list[list[str]]:
        """Ask who is in the way of a vehicle."""
        self.engine.vehicles["pending"][robot] = True
        return self.keeper.outside_blockers(robot, [driver.id for driver in self.engine.drivers])

    def _listed(self, table: str, row: int) -> Iterator[Any]:
        rows = self.tables[table]
        while row != NOBODY:
            yield rows[row]
            row = int(rows[row]["following"])

    def upon(self, lane: str) -> list[str]:
        """Return those who are on a lane with some part."""
        row = self.tables["lanes"][self.roads.lanes[lane]]
        fronts, names = list(self._listed("others", int(row["first"]))), self.sight._names
        others = [int((self.tables["others"]["listed"] == one["listed"]).argmax()) for one in fronts]
        others += (int(rear["other"]) for rear in self._listed("rears", int(row["over"])))
        return [names[other] for other in others]

    def arrivals(self, from_edge: str, to_edge: str) -> list[Any]:
        """Return who comes from one edge to another: rows of `ArrivalRow`."""
        row = self.tables["junctions"][self.roads.junctions[from_edge, to_edge]]
        return list(self._listed("arrivals", int(row["first"])))


def alone_on(network: RoadNetwork, loop: Loop) -> tuple[System, list[Track]]:
    """Return the only gated vehicle, ``alone`` on a loop."""
    (track,) = Plan(network, ((loop, DEFAULT_TYPE),)).tracks
    return system({"alone": " ".join(leg.state for leg in track.legs)}), [replace(track, vehicle="alone")]


class Arrival(NamedTuple):
    """When a vehicle gets to the junction, whether it stands and may set out, or cannot stop any more."""

    first_s: float
    last_s: float
    stands: str = ""
    near: bool = False


class Scene(Watched):
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
        names = ["v", *(f"w{number}" for number in range(others_in_next))]
        paths = {name: "after_0 before_0" if name != "v" else "before_0 after_0" for name in names}
        roads = system(paths, capacity={"before_0": 10, "after_0": 5}, fifo=("before_0", "after_0"))
        tracks = [
            replace(
                track, vehicle=name, start_position=int(name != "v"), start_m=90.0 if name == "v" else 165.0
            )
            for name in names
        ]
        approach = Approach("priority", "after", signal)
        movement = Movement(0.0, ("foe_0",), (), (approach,), 20.0, 10.0, 0.0)
        next_place = Place("after_0", 0.0, 50.0, ("junction_0",))
        self.way = Way("before_0", 100.0, (movement,), (), next_place)
        self.ways = {"loop": [self.way, self.way]}
        places = {"before_0": Place("before_0", 0.0, 100.0, ()), "after_0": next_place}
        self.given: Sequence[Arrival] = ()
        self.slowed: list[tuple[str, float | None]] = []
        traffic = FakeTraffic({"v": FakeVehicle(STREET, 90.0)})
        traffic.keep_to = lambda *told: self.slowed.append(told)  # type: ignore[method-assign]
        network = road_network(dict(STREET), [("priority", "after")])
        signals = [Signal("over", *signal, 10.0)] if signal else []
        super().__init__(roads, tracks, traffic, network, Found(self.ways, places), signals)
        for driver in self.engine.drivers:
            driver.drives_like(traffic.dynamics(driver.id))
        self.row = self.engine.drivers[0].row
        self.row["line_m"] = 100.0

    def look(self) -> None:
        """See where the others are, and who of them comes."""
        super().look()
        self._let_come()

    def _let_come(self) -> None:
        tables = self.tables
        for number, one in enumerate(self.given):
            other = self.sight._rows.get(one.stands, 0)
            following = number + 1 if number + 1 < len(self.given) else int(NOBODY)
            row = (other, 0, one.first_s, one.last_s, bool(one.stands), one.near, following)
            tables["arrivals"][number] = row
        tables["junctions"]["first"][0] = 0 if self.given else NOBODY
        self.engine.run["arrivals"] = len(self.given)

    def put(self, name: str, edge: str, position_m: float, speed: float = 0.0) -> None:
        """Put an ordinary vehicle on the road."""
        self.traffic.fleet[name] = FakeVehicle(STREET, BEGINS[edge] + position_m)
        self.traffic.fleet[name].speed_mps = speed

    def change(self, **figures: Any) -> None:  # noqa: ANN401  of a movement
        """Let the movement be another one."""
        movement = replace(self.way.movements[0], **figures)
        self.ways["loop"][0] = replace(self.way, movements=(movement,))
        self.plan()

    def says(self) -> Reason | None:
        """Ask in a new step."""
        self.traffic.now_s += 1.0
        barred = self.is_barred()
        return Reason.TRAFFIC if barred else None
