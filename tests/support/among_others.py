"""A vehicle among ordinary ones on roads made by hand, without SUMO."""

from __future__ import annotations

from math import inf
from typing import Any

from loopgate.control.ledger import Ledger
from loopgate.control.ordinary import traffic
from loopgate.control.places import ConflictGroup, Leg, Make, Movement, Pass, Place, path_of
from loopgate.control.roads import (
    Across,
    Approach,
    Coming,
    Lookout,
    Other,
    RoadEdge,
    RoadLane,
    RoadStretch,
    RoadTurn,
)
from loopgate.control.sight import Map, Sight
from loopgate.control.slack import Slack

CAR = Make(5.0, 2.6, 4.5, 10.0, 1.0)


class Told:
    """A simulation that remembers what vehicles have been told."""

    step_s = 1.0

    def __init__(self) -> None:
        self.now_s = 0.0
        self.speeds: dict[str, float | None] = {}
        self.first: dict[str, bool] = {}
        self.kept: list[tuple[str, float | None]] = []
        """What vehicles were told of their speed, in order."""

    def keep_to(self, vehicle: str, speed_mps: float | None) -> None:
        """Remember how fast a vehicle may drive."""
        self.speeds[vehicle] = speed_mps
        self.kept.append((vehicle, speed_mps))

    def give_way(self, vehicle: str, *, gives: bool) -> None:
        """Remember whether a vehicle goes first."""
        self.first[vehicle] = not gives


class Scene:
    """A vehicle 10 m before the line of `here`; `next` holds two behind a junction of 20 m; `foe` crosses."""

    def __init__(self, **figures: Any) -> None:  # noqa: ANN401  of the lookout
        edges = {name: RoadEdge(100.0, 10.0) for name in ("here", "next", "side")}
        self.lanes = {
            name: RoadLane(name, edges[name], 100.0, 10.0, inside=False) for name in ("here", "next", "side")
        }
        self.foe = RoadLane("foe", RoadEdge(inf, 0.0), 20.0, 10.0, inside=True)
        self.turn = RoadTurn(20.0)
        self.edges = edges
        self.told = Told()
        self.sight = Sight(Map({}, {}, {}), self.told)  # type: ignore[arg-type]
        self.slack = Slack()
        places = Place("here", 9), Place("next", figures.pop("slots", 9))
        self.path: list[Leg] = path_of(list(places), closed=True)
        here, after = self.path
        here.stretch = RoadStretch(self.lanes["here"], 0.0, 100.0, [], [])
        after.stretch = RoadStretch(self.lanes["next"], 0.0, 100.0, [], [])
        for leg, begin_m in ((here, 0.0), (after, 120.0)):
            leg.begin_m, leg.end_m = begin_m, begin_m + 100.0  # type: ignore[misc]
        over = Pass(Movement("over", ConflictGroup()), 10.0, -inf)
        over.lookout = Lookout(
            [Across(self.foe, 15.0, unseen=False)], [Approach(self.turn)], 0.0, 20.0, 10.0, **figures
        )
        here.passes = [over]
        self.slack.know(self.path)
        self.rule = traffic(self.sight, self.slack)
        self.ledger = Ledger([self.rule])
        self.car = self.ledger.take_in("car", self.path, 0, CAR, 220.0)
        self.car.front_m, self.car.speed = 90.0, 0.0

    def put(self, lane: str, position_m: float, speed: float = 0.0, length_m: float = 5.0) -> Other:
        """Put an ordinary vehicle on the road."""
        other = Other(f"o{len(self.sight.others)}", length_m, 2.6, 4.5, 1.0)
        other.parks = False
        other.position_m, other.speed = position_m, speed
        other.lane = self.foe if lane == "foe" else self.lanes[lane]
        other.lane.fronts.append(other)
        self.sight.others[other.name] = other
        return other

    def let_come(self, other: Other, left_m: float) -> None:
        """Let a vehicle be so far before the turn across."""
        self.turn.coming.append(Coming(other, self.turn, other.position_m + left_m, 10.0, first=True))

    def is_refused(self, now_s: float = 0.0) -> bool:
        """Return whether ordinary traffic keeps the vehicle."""
        return self.rule(self.car, now_s) is not None
