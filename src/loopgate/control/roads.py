"""Roads with ordinary traffic on them, and what of it vehicles under the gate look out for."""

from __future__ import annotations

from math import inf
from typing import Final

from loopgate.control.lamps import OPEN, Lamp

BEYOND_M: Final = 0.3
"""How far past the end of a place vehicles may stand that are in it [m]."""


class Edge:
    """A road: length of its longest lane [m], limit on its fastest [m/s].

    `coming`: the ordinary vehicles that have it among the next edges on their routes.
    """

    __slots__ = ("coming", "length_m", "limit")

    def __init__(self, length_m: float, limit: float) -> None:
        self.length_m: Final = length_m
        self.limit: Final = limit
        self.coming: dict[Other, None] = {}


class Turn:
    """The way from an edge to another over a junction, and how long that is [m].

    `coming`: the ordinary vehicles that may come there soon.
    """

    __slots__ = ("coming", "through_m")

    def __init__(self, through_m: float) -> None:
        self.through_m: Final = through_m
        self.coming: list[Coming] = []


class Lane:
    """A lane, `inside` a junction or not: length [m], limit [m/s], its edge.

    `ahead`: the lane to which it leads by edge; `behind`: from which it comes, by edge, or from any.
    `fronts`: the ordinary vehicles with their fronts on it. `rears`: those whose fronts have left it.
    """

    __slots__ = ("ahead", "behind", "edge", "fronts", "inside", "length_m", "limit", "name", "rears")

    def __init__(self, name: str, edge: Edge, length_m: float, limit: float, *, inside: bool) -> None:
        self.name: Final = name
        self.edge: Final = edge
        self.length_m: Final = length_m
        self.limit: Final = limit
        self.inside: Final = inside
        self.ahead: dict[Edge | None, Lane] = {}
        self.behind: dict[Edge | None, Lane] = {}
        self.fronts: list[Other] = []
        self.rears: list[Rear] = []

    def is_used(self, past_m: float) -> bool:
        """Return whether a front is on it, or some part before `past_m` of a vehicle that has left it."""
        if self.fronts:
            return True
        for rear in self.rears:  # noqa: SIM110  a generator costs five times this
            if rear.rear_m < past_m:
                return True
        return False

    def from_edge(self, edge: Edge | None) -> Lane | None:
        """Return the lane from which vehicles of an edge come, or of any if it is inside a junction."""
        return self.behind.get(None) or self.behind.get(edge)


class Other:
    """An ordinary vehicle: where its front is, how fast it is [m/s], where its route leads.

    `at`: which edge of its route it is on or has just left. `on`: the lane for which that is known.
    `until_s`: when its route is looked at again. `haste`: at how many times the limits it drives. `parks`:
    whether it stands beside the road, or is on none. `stood_s`, `seen_s`: since when it stands at a line
    though it may drive, and when it was seen so last. `entries`: where it is listed as coming.
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
        self.lane: Lane | None = None
        self.lane_name = ""
        self.position_m = 0.0
        self.speed = 0.0
        self.parks = True
        self.edges: list[Edge] = []
        self.turns: list[Turn | None] = []
        self.route_name = ""
        self.at = 0
        self.on: Lane | None = None
        self.until_s = -inf
        self.stood_s = self.seen_s = -inf
        self.entries: list[Coming] = []
        self.coming_to: list[Edge] = []


class Rear:
    """Where the rear of a vehicle is on a lane that its front has left [m]."""

    __slots__ = ("other", "rear_m")

    def __init__(self, other: Other, rear_m: float) -> None:
        self.other: Final = other
        self.rear_m: Final = rear_m


class Coming:
    """A vehicle on its way to a turn, which begins `to_m` behind the beginning of its lane.

    `limit`: that of the edge before the turn. `first`: whether that is the edge on which the vehicle is.
    """

    __slots__ = ("first", "limit", "other", "to_m", "turn")

    def __init__(self, other: Other, turn: Turn, to_m: float, limit: float, *, first: bool) -> None:
        self.other: Final = other
        self.turn: Final = turn
        self.to_m: Final = to_m
        self.limit: Final = limit
        self.first: Final = first


class Stretch:
    """Where a leg's place lies: from where to where on a lane [m].

    `into`: lanes inside the junction before it from which others drive into it. `between`: lanes between the
    junctions of the crossing behind it. `is_away`: whether it is where vehicles go that arrive.
    """

    __slots__ = ("begin_m", "between", "end_m", "into", "is_away", "lane")

    def __init__(
        self,
        lane: Lane,
        begin_m: float,
        end_m: float,
        into: list[Lane],
        between: list[Lane],
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
        """Return whether a vehicle on its lane is in it."""
        return self.begin_m <= other.position_m <= self.end_m + BEYOND_M


class Across:
    """A lane across a movement.

    `past_m`: from where on a rear there is past it [m]. `unseen`: whether SUMO does not see who is there.
    """

    __slots__ = ("lane", "past_m", "unseen")

    def __init__(self, lane: Lane, past_m: float, *, unseen: bool) -> None:
        self.lane: Final = lane
        self.past_m: Final = past_m
        self.unseen: Final = unseen


class Approach:
    """A turn across a movement, and the light before it with the number of its link, if it has one."""

    __slots__ = ("lamp", "link", "turn")

    def __init__(self, turn: Turn, lamp: Lamp | None = None, link: int = 0) -> None:
        self.turn: Final = turn
        self.lamp: Final = lamp
        self.link: Final = link

    def is_open(self, now_s: float) -> bool:
        """Return whether vehicles may drive there now, as far as lights go."""
        lamp = self.lamp
        if lamp is None:
            return True
        lamp.look(now_s)
        return lamp.state[self.link] in OPEN


class Lookout:
    """What a vehicle looks out for on a movement behind the line of its place.

    `from_m`: how far behind the line that begins. `length_m`, `speed`: its length, and the lowest limit on it
    [m/s]. `wait_m`: how much of it lies before where the vehicle may have to wait inside; 0 for nowhere.
    `waits_in_way`: whether it would touch those there for whom it waits. `across`: lanes inside the junction
    on which nobody may be. `approaches`: turns to which nobody may be about to come.
    `loopgate.simulation.around.crossing_ways` says why. `first`: whether it is the first behind the line.
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
        """Return whether anybody inside the junction is in the way."""
        for one in self.across:  # noqa: SIM110  as above
            if one.lane.is_used(one.past_m):
                return True
        return False

    def is_used_unseen(self) -> bool:
        """Return whether anybody is in the way whom SUMO does not see."""
        for one in self.across:  # noqa: SIM110  as above
            if one.unseen and one.lane.is_used(one.past_m):
                return True
        return False

    def is_quiet(self) -> bool:
        """Return whether nobody is in the way, and nobody comes on any turn across."""
        for approach in self.approaches:
            if approach.turn.coming:
                return False
        return not self.is_used()
