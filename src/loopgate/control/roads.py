"""Roads, ordinary vehicles on them, and what a gated vehicle checks before it drives over a junction."""

from __future__ import annotations

from math import inf
from typing import Final

from loopgate.control.lamps import OPEN, Lamp

CREEPS_MPS: Final = 1.0
"""An ordinary vehicle that is no faster may stand in the next second [m/s]."""

BEYOND_M: Final = 0.3
"""A vehicle may stand this far beyond the end of its place [m]."""


_CLEARS_S: Final = 30.0
"""An ordinary vehicle has left a junction this long after it came, unless it stands in the way [s]."""


class RoadEdge:
    """An edge of the network.

    `length_m`: length of its longest lane [m]. `limit`: speed limit of its fastest lane [m/s]. `coming`: the
    ordinary vehicles that have the edge among the next edges of their routes.
    """

    __slots__ = ("coming", "length_m", "limit")

    def __init__(self, length_m: float, limit: float) -> None:
        self.length_m: Final = length_m
        self.limit: Final = limit
        self.coming: dict[Other, None] = {}


class RoadTurn:
    """The way from one edge over a junction to another edge.

    `through_m`: its length [m]. `coming`: the ordinary vehicles that may be there soon. `came_s`: when one of
    them last came there, or went another way [s].
    """

    __slots__ = ("came_s", "coming", "through_m")

    def __init__(self, through_m: float) -> None:
        self.through_m: Final = through_m
        self.coming: list[Coming] = []
        self.came_s = -inf


class RoadLane:
    """A lane of an edge, or a lane `inside` a junction.

    `length_m`: its length [m]. `limit`: its speed limit [m/s]. `ahead`: the lane that follows, by the edge
    that it leads to. `behind`: the lane before, by the edge that it comes from; by None if that is the same
    for every edge. `fronts`: the ordinary vehicles with their fronts on it. `rears`: the rears on it of
    vehicles whose fronts have left it.
    """

    __slots__ = ("ahead", "behind", "edge", "fronts", "inside", "length_m", "limit", "name", "rears")

    def __init__(self, name: str, edge: RoadEdge, length_m: float, limit: float, *, inside: bool) -> None:
        self.name: Final = name
        self.edge: Final = edge
        self.length_m: Final = length_m
        self.limit: Final = limit
        self.inside: Final = inside
        self.ahead: dict[RoadEdge | None, RoadLane] = {}
        self.behind: dict[RoadEdge | None, RoadLane] = {}
        self.fronts: list[Other] = []
        self.rears: list[Rear] = []

    def is_used(self, past_m: float) -> bool:
        """Return whether an ordinary vehicle's front is on the lane, or its rear before `past_m` [m]."""
        if self.fronts:
            return True
        for rear in self.rears:  # noqa: SIM110  a generator costs five times this
            if rear.rear_m < past_m:
                return True
        return False

    def is_blocked(self, past_m: float) -> bool:
        """Return whether one of the vehicles of `is_used` stands or creeps."""
        for other in self.fronts:
            if other.speed <= CREEPS_MPS:
                return True
        for rear in self.rears:  # noqa: SIM110  as above
            if rear.rear_m < past_m and rear.other.speed <= CREEPS_MPS:
                return True
        return False

    def from_edge(self, edge: RoadEdge | None) -> RoadLane | None:
        """Return the lane before this one on the way from an edge, if there is one."""
        return self.behind.get(None) or self.behind.get(edge)


class Other:
    """An ordinary vehicle: its lane, its position there [m], its speed [m/s] and its route.

    `at`: index on its route of the edge that it is on or has just left. `on`: the lane for which `at` is
    known. `until_s`: when its route is read again [s]. `haste`: its speed as a multiple of the limits.
    `parks`: whether it stands beside the road, or is on no lane. `stood_s`: since when it stands at a stop
    line though it may drive [s]. `seen_s`: when it was last seen so [s]. `entries`: its entries among the
    vehicles that come to turns.
    """

    __slots__ = (
        "accel", "at", "coming_to", "decel", "edges", "entries", "haste", "lane", "lane_name", "length_m",
        "name", "on", "parks", "position_m", "route_name", "seen_s", "speed", "stood_s", "turns", "until_s",
    )  # fmt: skip

    def __init__(self, name: str, length_m: float, accel: float, decel: float, haste: float) -> None:
        self.name: Final = name
        self.length_m: Final = length_m
        self.accel: Final = accel
        self.decel: Final = decel
        self.haste: Final = haste
        self.lane: RoadLane | None = None
        self.lane_name = ""
        self.position_m = 0.0
        self.speed = 0.0
        self.parks = True
        self.edges: list[RoadEdge] = []
        self.turns: list[RoadTurn | None] = []
        self.route_name = ""
        self.at = 0
        self.on: RoadLane | None = None
        self.until_s = -inf
        self.stood_s = self.seen_s = -inf
        self.entries: list[Coming] = []
        self.coming_to: list[RoadEdge] = []


class Rear:
    """The rear of an ordinary vehicle at `rear_m` on a lane that its front has left [m]."""

    __slots__ = ("other", "rear_m")

    def __init__(self, other: Other, rear_m: float) -> None:
        self.other: Final = other
        self.rear_m: Final = rear_m


class Coming:
    """An ordinary vehicle that drives towards a turn.

    `to_m`: position of the turn, from the beginning of the vehicle's lane [m]. `limit`: speed limit of the
    edge before the turn [m/s]. `first`: whether the vehicle is on that edge.
    """

    __slots__ = ("first", "limit", "other", "to_m", "turn")

    def __init__(self, other: Other, turn: RoadTurn, to_m: float, limit: float, *, first: bool) -> None:
        self.other: Final = other
        self.turn: Final = turn
        self.to_m: Final = to_m
        self.limit: Final = limit
        self.first: Final = first


class RoadStretch:
    """The part of a lane where the place of a leg lies, from `begin_m` to `end_m` [m].

    `into`: lanes inside the junction before it from which vehicles drive into the place. `between`: lanes
    between the junctions of the crossing that follows. `is_away`: whether vehicles arrive there.
    """

    __slots__ = ("begin_m", "between", "end_m", "into", "is_away", "lane")

    def __init__(
        self,
        lane: RoadLane,
        begin_m: float,
        end_m: float,
        into: list[RoadLane],
        between: list[RoadLane],
        *,
        is_away: bool = False,
    ) -> None:
        self.lane: Final = lane
        self.begin_m: Final = begin_m
        self.end_m: Final = end_m
        self.into: Final = into
        self.between: Final = between
        self.is_away: Final = is_away

    def holds(self, other: Other) -> bool:
        """Return whether a vehicle on the lane is in the place."""
        return self.begin_m <= other.position_m <= self.end_m + BEYOND_M


class Across:
    """A lane inside a junction that crosses or joins a movement.

    `past_m`: a rear beyond this position is out of the way [m]; infinite if the lane joins. `unseen`: whether
    SUMO overlooks a vehicle on the lane and would drive on.
    """

    __slots__ = ("lane", "past_m", "unseen")

    def __init__(self, lane: RoadLane, past_m: float, *, unseen: bool) -> None:
        self.lane: Final = lane
        self.past_m: Final = past_m
        self.unseen: Final = unseen


class Approach:
    """A turn that crosses or joins a movement, and its light: `lamp`, and index `link` of its letter."""

    __slots__ = ("lamp", "link", "turn")

    def __init__(self, turn: RoadTurn, lamp: Lamp | None = None, link: int = 0) -> None:
        self.turn: Final = turn
        self.lamp: Final = lamp
        self.link: Final = link

    def is_open(self, now_s: float) -> bool:
        """Return whether vehicles may drive there now or in the next step: by its light, if there is one.

        A vehicle that gets a grant sets out in the next step, as does one that waits there for green.
        """
        lamp = self.lamp
        if lamp is None:
            return True
        state = lamp.next_step(now_s)[0]
        return lamp.state[self.link] in OPEN or state[self.link] in OPEN


class Lookout:
    """What a vehicle checks about ordinary traffic before it drives over a movement.

    `from_m`: distance of the movement from the stop line before it [m]. `length_m`: its length [m]. `speed`:
    the lowest speed limit on it [m/s]. `wait_m`: how far into it a vehicle may have to wait [m]; 0 for
    nowhere. `waits_in_way`: whether a vehicle that waits there would touch the vehicles for which it waits.
    `across`: lanes inside the junction that cross or join it. `approaches`: turns to which no
    ordinary vehicle may be coming; `loopgate.simulation.surroundings.crossing_ways` finds them. `first`:
    whether it is the first movement behind the stop line.
    """

    __slots__ = (
        "across", "approaches", "first", "from_m", "length_m", "speed", "wait_m", "waits_in_way",
    )  # fmt: skip

    def __init__(
        self,
        across: list[Across],
        approaches: list[Approach],
        from_m: float = 0.0,
        length_m: float = 0.0,
        speed: float = inf,
        wait_m: float = 0.0,
        *,
        waits_in_way: bool = False,
        first: bool = True,
    ) -> None:
        self.across: Final = across
        self.approaches: Final = approaches
        self.from_m: Final = from_m
        self.length_m: Final = length_m
        self.speed: Final = speed
        self.wait_m: Final = wait_m
        self.waits_in_way: Final = waits_in_way
        self.first: Final = first

    def is_used(self) -> bool:
        """Return whether an ordinary vehicle inside the junction is in the way."""
        for one in self.across:  # noqa: SIM110  as above
            if one.lane.is_used(one.past_m):
                return True
        return False

    def is_blocked(self) -> bool:
        """Return whether an ordinary vehicle inside the junction keeps others out.

        One that drives on into the same lane is followed, as SUMO's drivers do, unless SUMO overlooks it. Who
        may have to wait inside does not follow: it could come to rest there in the way of others.
        """
        for one in self.across:
            follows = one.past_m == inf and not one.unseen and self.wait_m == 0.0
            if one.lane.is_blocked(inf) if follows else one.lane.is_used(one.past_m):
                return True
        return False

    def is_used_unseen(self) -> bool:
        """Return whether an ordinary vehicle is in the way that SUMO overlooks."""
        for one in self.across:  # noqa: SIM110  as above
            if one.unseen and one.lane.is_used(one.past_m):
                return True
        return False

    def is_quiet(self) -> bool:
        """Return whether no ordinary vehicle is in the way, and none comes to a turn that crosses."""
        for approach in self.approaches:
            if approach.turn.coming:
                return False
        return not self.is_used()

    def was_quiet(self, now_s: float) -> bool:
        """Return whether no ordinary vehicle has come to a turn that crosses for some time."""
        for approach in self.approaches:  # noqa: SIM110  as above
            if now_s - approach.turn.came_s < _CLEARS_S:
                return False
        return True
