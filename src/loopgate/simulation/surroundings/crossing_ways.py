"""Finds what a vehicle must check before each crossing: lanes and approaches of ordinary traffic."""

from __future__ import annotations

import math
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from statistics import fmean
from typing import Protocol

import numpy as np
from shapely import LineString, Point, Polygon, STRtree, get_coordinates, shortest_line
from shapely.ops import substring

from loopgate.abstraction.itinerary import DrawnLeg
from loopgate.abstraction.rectangles import ABOVE_M
from loopgate.network import RoadNetwork
from loopgate.network.bridges import Bridge, find_bridges
from loopgate.network.road import Connection

__all__ = ["ComingWay", "CrossingAhead", "CrossingWays", "WaitingPart", "WayOver"]

_ABREAST_M = 2.3
"""Vehicles touch where the middles of their paths are nearer than this, also in a bend [m]."""

_CAR_M = 5.0


class DrivenWay(Protocol):
    """The path of a vehicle as a sequence of legs, as this module needs it."""

    @property
    def legs(self) -> Sequence[DrawnLeg]:
        """Its places in driving order."""


@dataclass(frozen=True, slots=True)
class ComingWay:
    """A way over the junction whose vehicles do not yield to a vehicle that sets out."""

    from_edge: str
    to_edge: str
    signal: tuple[str, int] | None


@dataclass(frozen=True, slots=True)
class WayOver:
    """A movement over a junction, with the lanes and approaches that must be free before it is used.

    Attributes
    ----------
    from_m
        Distance of its beginning from the end of the state before the crossing [m].
    across
        Lanes inside the junction, or inside one beside it, that must be empty when a vehicle sets out.
    unseen
        Lanes of `across` on which SUMO overlooks vehicles in the way, and would drive on.
    approaches
        Movements over the junction on which no vehicle may be about to come. These have the right of way; or
        touch this movement without any right of way; or wait for it inside the junction, in its way; or leave
        no place to wait except across the same crossing.
    length_m, speed_mps
        Length of the movement [m], and lowest speed limit on it [m/s].
    wait_m
        Distance to the point inside the junction where a vehicle may have to wait [m]; 0 if there is none.
    waits_in_way
        Whether a vehicle that waits there would touch the vehicles that it waits for.
    past_m
        For each lane, the position from which a vehicle's rear is out of the way [m]; on other lanes it never
        is.
    """

    from_m: float
    across: tuple[str, ...]
    unseen: tuple[str, ...]
    approaches: tuple[ComingWay, ...]
    length_m: float
    speed_mps: float
    wait_m: float
    waits_in_way: bool = False
    past_m: Mapping[str, float] = field(default_factory=dict)
    between: tuple[tuple[str, str], ...] = field(init=False)

    def __post_init__(self) -> None:
        """Collect the edges before and after each approach."""
        between = ((approach.from_edge, approach.to_edge) for approach in self.approaches)
        object.__setattr__(self, "between", tuple(dict.fromkeys(between)))


@dataclass(frozen=True, slots=True)
class WaitingPart:
    """The position of a state on the road.

    Attributes
    ----------
    lane, begin_m, end_m
        The stretch of a lane [m].
    into
        Lanes inside the junction that lead into the state.
    """

    lane: str
    begin_m: float
    end_m: float
    into: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class CrossingAhead:
    """The crossing ahead of a vehicle that stands at the end of a state, and what must be free there.

    Attributes
    ----------
    lane, line_m
        The lane and the position [m] of the stop line.
    movements
        Movements of the crossing, in driving order.
    between
        Lanes between the junctions of the crossing. They must be empty too when a vehicle sets out.
    next
        Position of the next state.
    across
        All lanes that must be empty when a vehicle sets out.
    """

    lane: str
    line_m: float
    movements: tuple[WayOver, ...]
    between: tuple[str, ...]
    next: WaitingPart
    across: frozenset[str] = field(init=False)

    def __post_init__(self) -> None:
        """Collect all lanes that must be empty."""
        across = (lane for movement in self.movements for lane in movement.across)
        object.__setattr__(self, "across", frozenset((*across, *self.between)))


class CrossingWays:
    """The crossings ahead of vehicles on their paths, with the lanes that must be free.

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
        self._ends = {lane: _end(movement) for movement in network.connections for lane in movement.via}
        """By lane inside a junction, the lane after the junction."""
        self._behind = {movement.to_edge: movement.junction for movement in network.connections}
        """By edge, the junction at which the edge begins."""
        self._lines: dict[tuple[str, ...], LineString] = {}
        self._inside = [movement for movement in network.connections if movement.via]
        for movement in network.connections:
            self._at.setdefault(movement.junction, []).append(movement)
            self._into.setdefault(_end(movement), []).extend(movement.via)

    def of(self, track: DrivenWay) -> tuple[CrossingAhead, ...]:
        """Return the crossing at the end of each leg of a path."""
        return tuple(self.way(track, position) for position in range(len(track.legs)))

    def knows(self, movement: str) -> bool:
        """Return whether the network has a movement."""
        return movement in self._movements

    def place(self, track: DrivenWay, position: int) -> WaitingPart:
        """Return the lanes of a state on the road, by its index on a path."""
        end = track.legs[position].line
        length_m = track.legs[position].end_m - track.legs[position].begin_m
        lane = f"{end.edge}_{end.lane}"
        return WaitingPart(lane, end.position_m - length_m, end.position_m, tuple(self._into.get(lane, ())))

    def way(self, track: DrivenWay, position: int) -> CrossingAhead:
        """Return the crossing at the end of the leg at an index of a path."""
        line = track.legs[position].line
        crossings = track.legs[position].crossings
        crossing = [self._movements[c.id] for c in crossings if c.id in self._movements]
        return CrossingAhead(
            lane=f"{line.edge}_{line.lane}",
            line_m=line.position_m,
            movements=tuple(self._crossed(crossing, line.position_m)),
            between=tuple(dict.fromkeys(_end(movement) for movement in crossing[:-1])),
            next=self.place(track, (position + 1) % len(track.legs)),
        )

    def _crossed(self, crossing: Sequence[Connection], line_m: float) -> Iterator[WayOver]:
        """Yield the movements of a crossing whose stop line is at `line_m` on the lane before the first."""
        own = {lane for movement in crossing for lane in (_begin(movement), *movement.via, _end(movement))}
        junctions = {movement.junction for movement in crossing}
        from_m = -line_m
        for movement in crossing:
            from_m += self._network.edges[movement.from_edge].lanes[movement.from_lane].length_m
            lanes = [self._network.lanes[lane] for lane in movement.via]
            length_m = sum(lane.length_m for lane in lanes)
            foes, unseen, comers = self._foes(movement, junctions, own)
            yield WayOver(
                from_m=from_m,
                across=tuple(lane for lane in foes if lane not in own),
                unseen=tuple(lane for lane in unseen if lane not in own),
                approaches=comers,
                length_m=length_m,
                past_m=self._past(movement, foes),
                speed_mps=min((lane.speed_mps for lane in lanes), default=math.inf),
                wait_m=sum(lane.length_m for lane in lanes[:-1]),
                waits_in_way=any(
                    self._yields(movement, other) and self._waits_in_way(movement, other)
                    for other in self._at[movement.junction]
                ),
            )
            from_m += length_m

    def _foes(
        self, movement: Connection, junctions: Container[str], own: Container[str]
    ) -> tuple[tuple[str, ...], tuple[str, ...], tuple[ComingWay, ...]]:
        """Return the lanes that must be empty for a movement, the lanes SUMO overlooks, and the approaches.

        The movement belongs to a crossing over `junctions`, and over the lanes `own`.
        """
        lanes: dict[str, None] = {}
        unseen: dict[str, None] = {}
        comers: dict[ComingWay, None] = {}
        for other in self._at[movement.junction]:
            touches = self._touches(movement, other)
            conflict = touches or self._network.are_foes(movement, other)
            if conflict:
                lanes.update(dict.fromkeys(other.via))
            within = other.from_edge != movement.from_edge and self._stands_across(other, junctions)
            if touches or self._yields(movement, other) or (conflict and within):
                comers[ComingWay(other.from_edge, other.to_edge, other.signal)] = None
            if touches:
                unseen.update(dict.fromkeys(other.via))
        for other in self._beside(movement, junctions, own):
            lanes.update(dict.fromkeys(other.via))
            unseen.update(dict.fromkeys(other.via))
        return tuple(lanes), tuple(unseen), tuple(comers)

    def _beside(
        self, movement: Connection, junctions: Container[str], own: Container[str]
    ) -> Iterator[Connection]:
        """Yield the movements at other junctions whose vehicles touch those on a movement.

        Where short roads join junctions, a vehicle at its stop line may stand with its rear inside the
        junction before, across a way over this one. SUMO drives both. The movement belongs to a crossing over
        `junctions` and over the lanes `own`: who comes from one of these lanes, or drives into one, is minded
        at that lane's junction.
        """
        if not movement.via:
            return
        for number in sorted(self._tree.query(self._swept(movement), "intersects").tolist()):
            other = self._inside[number]
            joins = _begin(other) in own or _end(other) in own
            if other.junction not in junctions and not joins and not self._lies_above(movement, other):
                yield other

    @cached_property
    def _tree(self) -> STRtree:
        return STRtree([self._swept(movement) for movement in self._inside])

    def _swept(self, movement: Connection) -> Polygon:
        """Return where vehicles on a movement may be, up to the end of a road too short for them."""
        end = _end(movement)
        short = self._network.lanes[end].length_m < _CAR_M
        return self._line((*movement.via, end) if short else movement.via).buffer(
            _ABREAST_M / 2.0, cap_style="flat"
        )

    @cached_property
    def _bridges(self) -> tuple[Bridge, ...]:
        return find_bridges(self._network, self._network.lanes)

    def _lies_above(self, movement: Connection, other: Connection) -> bool:
        """Return whether one of two ways is on a bridge over the other."""
        heights = [
            [z for lane in one.via for z in self._network.lanes[lane].heights] for one in (movement, other)
        ]
        if all(heights):
            return abs(fmean(heights[0]) - fmean(heights[1])) > ABOVE_M
        x_m, y_m = get_coordinates(shortest_line(self._line(movement.via), self._line(other.via)))[:1].T
        pairs = [(np.array([one]), np.array([two])) for one in movement.via for two in other.via]
        return any(bridge.parts(*pair, x_m, y_m).any() for bridge in self._bridges for pair in pairs)

    def _past(self, movement: Connection, foes: Iterable[str]) -> dict[str, float]:
        """Return for each lane the position from which a rear is out of the movement's way [m].

        From a lane beside the junction that ends before the way, it is out once it has left the lane.
        """
        if not movement.via:
            return {}
        here = {lane for other in self._at[movement.junction] for lane in other.via}
        near, beside = (
            self._line(movement.via).buffer(_ABREAST_M),
            self._swept(movement).buffer(_ABREAST_M / 2.0),
        )
        past: dict[str, float] = {}
        for lane in foes:
            if self._ends[lane] != _end(movement):
                line = self._line((lane,))
                there = get_coordinates(line.intersection(near if lane in here else beside))
                never = 0.0 if lane in here else math.inf
                past[lane] = max((line.project(Point(at)) for at in there), default=never)
        return past

    def _stands_across(self, other: Connection, junctions: Container[str]) -> bool:
        """Return whether a car that waits before the movement `other` has its rear in one of `junctions`."""
        lane = self._network.edges[other.from_edge].lanes[other.from_lane]
        return lane.length_m < _CAR_M and self._behind.get(other.from_edge) in junctions

    def _yields(self, movement: Connection, other: Connection) -> bool:
        rows = self._network.junctions[movement.junction].yields_to
        return 0 <= movement.link < len(rows) and other.link in rows[movement.link]

    def _touches(self, movement: Connection, other: Connection) -> bool:
        """Return whether vehicles on two movements may touch although SUMO drives both.

        SUMO's right of way does not know the conflict, or a vehicle on `other` waits inside the junction, in
        the way.
        """
        same = movement.from_edge, movement.from_lane
        if not (movement.via and other.via) or (other.from_edge, other.from_lane) == same:
            return False
        if not self._network.are_foes(movement, other):
            return self._line(other.via).distance(self._line(movement.via)) < _ABREAST_M
        return not self._yields(movement, other) and self._waits_in_way(other, movement)

    def _waits_in_way(self, movement: Connection, other: Connection) -> bool:
        """Return whether a vehicle that waits inside the junction would touch vehicles on `other`."""
        if len(movement.via) == 1 or not other.via:
            return False
        first = self._line(movement.via[:1])
        waiting = substring(first, max(0.0, first.length - _CAR_M), first.length)
        return float(waiting.distance(self._line(other.via))) < _ABREAST_M

    def _line(self, lanes: tuple[str, ...]) -> LineString:
        if lanes not in self._lines:
            self._lines[lanes] = LineString([p for lane in lanes for p in self._network.lanes[lane].shape])
        return self._lines[lanes]


def _begin(movement: Connection) -> str:
    return f"{movement.from_edge}_{movement.from_lane}"


def _end(movement: Connection) -> str:
    return f"{movement.to_edge}_{movement.to_lane}"
