"""Finds where SUMO could leave the lane of a loop, and the stops that keep a vehicle on it."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from loopgate.abstraction.itinerary import Guide
from loopgate.network.loop import HOLD_MARGIN_M
from loopgate.network.records import Connection
from loopgate.network.road import RoadNetwork

_SHORTEST_M = 0.5
"""The shortest lane on which SUMO accepts a stop [m]."""


@dataclass(frozen=True, slots=True)
class Turn:
    """A movement between two places, and the distance from the first place to its end [m]."""

    movement: Connection
    ahead_m: float


@dataclass(frozen=True, slots=True)
class Target:
    """A lane to reach: the lane of the next place, or a lane from which to change."""

    edge: str
    lane: int
    """`edge` and `lane`: the lane."""
    end_m: float
    """Where the place, or the change stretch, ends on the lane [m]."""
    ahead_m: float
    """Distance from the place before to its beginning [m]."""
    to_lane: int | None = None
    """The lane to change to; None for a place."""

    def guide(self) -> Guide:
        """Return the stop that leads a vehicle to the target lane."""
        return Guide(self.edge, self.lane, self.end_m - HOLD_MARGIN_M, self.ahead_m, self.to_lane)


def find_guides(
    network: RoadNetwork, course: Sequence[Turn | Target], vclass: str
) -> tuple[Guide, ...] | Connection:
    """Find the stops that keep a vehicle on the lanes of its loop from place to place.

    Without stops, SUMO chooses among the lanes after a movement by the part of the route that it sees. A
    vehicle with a stop on a lane takes the lanes that lead there. Where several sequences of lanes lead
    there, each lane in question gets a stop.

    `course`: the movements and lanes ahead, in order; the last is the next place.

    Returns
    -------
    tuple of Guide, or Connection
        The stops; or the movement whose next lane is too short for a stop.
    """
    guides: list[Guide] = []
    turns: list[Turn] = []
    for item in course:
        if isinstance(item, Turn):
            turns.append(item)
            continue
        choices = [turn for turn in turns if _ways(network, turn.movement, vclass) > 1]
        leads = bool(choices)
        if choices and _ways_round(network, turns, item.lane, vclass) > 1:
            leads = choices[-1] is turns[-1]
            for turn in choices[:-1] if leads else choices:
                c = turn.movement
                length_m = network.edges[c.to_edge].length_m
                if length_m < _SHORTEST_M:
                    return c
                guides.append(Target(c.to_edge, c.to_lane, length_m, turn.ahead_m).guide())
        if leads or item.to_lane is not None:
            guides.append(item.guide())
        turns = []
    return tuple(guides)


def _ways(network: RoadNetwork, movement: Connection, vclass: str) -> int:
    """Return the number of lanes of the next edge to which the movement's lane leads."""
    between = network.between(movement.from_edge, movement.to_edge, vclass)
    return sum(c.from_lane == movement.from_lane for c in between)


def _ways_round(network: RoadNetwork, turns: Sequence[Turn], lane: int, vclass: str) -> int:
    """Return the number of sequences of lanes over which the turns lead to a lane without lane changes."""
    ways = Counter({turns[0].movement.from_lane: 1})
    for turn in turns:
        onward: Counter[int] = Counter()
        for c in network.between(turn.movement.from_edge, turn.movement.to_edge, vclass):
            onward[c.to_lane] += ways[c.from_lane]
        ways = onward
    return ways[lane]
