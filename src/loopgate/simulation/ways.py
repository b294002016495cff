"""What lies before a gated vehicle at the end of each state, where ordinary traffic could be in its way."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from loopgate.drive.track import Track
from loopgate.network import RoadNetwork
from loopgate.network.records import Connection

__all__ = ["Approach", "Way", "Ways"]


@dataclass(frozen=True, slots=True)
class Approach:
    """A lane from which others come that have the right of way.

    Attributes
    ----------
    lane, length_m
        The lane before the junction.
    signal
        Light and link of the way across, or None.
    """

    lane: str
    length_m: float
    signal: tuple[str, int] | None


@dataclass(frozen=True, slots=True)
class Way:
    """What lies before a vehicle at the end of a state.

    Attributes
    ----------
    lane, line_m
        Where it would be held: lane, and position on it [m].
    across
        Lanes on which nobody may be when it sets out: those of conflicting movements inside the junctions,
        and the lanes between the junctions of one crossing.
    approaches
        Lanes whose traffic has the right of way, where SUMO would let the vehicle wait for it inside the
        first junction, often so near the way of the other that it is hit; empty where it waits before it.
    over_m, speed_mps
        Length of the movement over the first junction and the lowest speed limit on it.
    into
        Lanes inside the junction from which others drive into the next state.
    next_lane, next_begin_m, next_end_m
        Where the next state is [m].
    slot_m
        What a slot of the next state measures [m].
    """

    lane: str
    line_m: float
    across: tuple[str, ...]
    approaches: tuple[Approach, ...]
    over_m: float
    speed_mps: float
    into: tuple[str, ...]
    next_lane: str
    next_begin_m: float
    next_end_m: float
    slot_m: float


class Ways:
    """Finds the ways of vehicles in a network; all its movements count, also those that no loop makes.

    Parameters
    ----------
    network
        The roads.
    """

    def __init__(self, network: RoadNetwork) -> None:
        self._network = network
        self._movements = {movement.id: movement for movement in network.connections}
        self._at: dict[str, list[Connection]] = {}
        self._into: dict[str, list[str]] = {}
        for movement in network.connections:
            self._at.setdefault(movement.junction, []).append(movement)
            self._into.setdefault(_end(movement), []).extend(movement.via)

    def of(self, track: Track, room: Mapping[str, int]) -> tuple[Way, ...]:
        """Return the way ahead at the end of each position of a track.

        `room` says how many vehicles a state holds, by name.
        """
        return tuple(self._way(track, room, position) for position in range(len(track.legs)))

    def _way(self, track: Track, room: Mapping[str, int], position: int) -> Way:
        line = track.stop_lines[position]
        ahead = (position + 1) % len(track.legs)
        end = track.stop_lines[ahead]
        length_m = track.legs[ahead].end_m - track.legs[ahead].begin_m
        crossings = track.legs[position].crossings
        crossing = [self._movements[c.id] for c in crossings if c.id in self._movements]
        first = [self._network.lanes[lane] for lane in crossing[0].via] if crossing else []
        next_lane = f"{end.edge}_{end.lane_index}"
        return Way(
            lane=f"{line.edge}_{line.lane_index}",
            line_m=line.position_m,
            across=self._across(crossing),
            approaches=self._approaches(crossing[0]) if len(first) > 1 else (),
            over_m=sum(lane.length_m for lane in first),
            speed_mps=min((lane.speed_mps for lane in first), default=math.inf),
            into=tuple(self._into.get(next_lane, ())),
            next_lane=next_lane,
            next_begin_m=end.position_m - length_m,
            next_end_m=end.position_m,
            slot_m=length_m / max(1, room[track.legs[ahead].state]),
        )

    def _across(self, crossing: Sequence[Connection]) -> tuple[str, ...]:
        lanes: dict[str, None] = {}
        for movement in crossing:
            for other in self._at[movement.junction]:
                if self._network.are_foes(movement, other):
                    lanes.update(dict.fromkeys(other.via))
        for movement in crossing[:-1]:
            lanes[_end(movement)] = None
        own = {lane for movement in crossing for lane in movement.via}
        return tuple(lane for lane in lanes if lane not in own)

    def _approaches(self, movement: Connection) -> tuple[Approach, ...]:
        rows = self._network.junctions[movement.junction].yields_to
        yields_to = rows[movement.link] if 0 <= movement.link < len(rows) else frozenset()
        found: dict[tuple[str, tuple[str, int] | None], None] = {}
        for other in self._at[movement.junction]:
            lane = f"{other.from_edge}_{other.from_lane}"
            if other.link in yields_to and lane != f"{movement.from_edge}_{movement.from_lane}":
                found[lane, other.signal] = None
        return tuple(Approach(lane, self._network.lanes[lane].length_m, signal) for lane, signal in found)


def _end(movement: Connection) -> str:
    return f"{movement.to_edge}_{movement.to_lane}"
