"""A route over lanes, closed or driven once, and its map between arc length and lane position."""

from bisect import bisect_right
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from loopgate.arrays import Floats
from loopgate.errors import RouteError
from loopgate.network.road import Connection, Points

_ROUNDING_M = 1e-6


def cut_curve(points: Floats, arcs: Floats, lap_m: float, begin_m: float, end_m: float) -> Floats:
    """Return the part of a closed curve between two arc lengths, shape (n, 2) with n at least 2 [m].

    Parameters
    ----------
    points, arcs
        Points of the curve, shape (n, 2), and the arc length of each, ascending from 0 to `lap_m` [m].
    begin_m, end_m
        From where to where; they may lie beyond the curve's ends, at most a lap apart.
    """
    end_m, begin_m = begin_m % lap_m + max(0.0, end_m - begin_m), begin_m % lap_m
    laps = (0.0, lap_m) if end_m > lap_m else (0.0,)
    all_points = np.concatenate([points for _ in laps])
    all_arcs = np.concatenate([arcs + lap for lap in laps])
    return cut_line(all_points, all_arcs, begin_m, end_m)


def cut_line(points: Floats, arcs: Floats, begin_m: float, end_m: float) -> Floats:
    """Return the part of an open line between two arc lengths."""
    inside = (arcs > begin_m) & (arcs < end_m)
    first, last = (
        [float(np.interp(at, arcs, points[:, axis])) for axis in (0, 1)] for at in (begin_m, end_m)
    )
    return np.vstack((first, points[inside], last))


def gap(lap_m: float, from_m: float, to_m: float) -> float:
    """Return the distance from one arc length to another on a loop [m]; 0 if only rounding differs."""
    far = (to_m - from_m) % lap_m
    return 0.0 if far > lap_m - _ROUNDING_M else far


HOLD_MARGIN_M = 0.1
"""Distance before the end of a lane at which a vehicle can be held [m]: SUMO's own tolerance for stops."""

AWAY_M = 1000.0
"""Arc length added beyond a route that is driven once, for the state of vehicles that have arrived [m]."""

_SHORTEST_HOLD_LANE_M = 0.5


class LanePosition(NamedTuple):
    """A position on the road: edge, lane index, position on the lane [m]."""

    edge: str
    lane: int
    position_m: float


@dataclass(frozen=True, slots=True)
class LaneSpan:
    """One lane of a loop, with the arc lengths of its beginning and end."""

    edge: str
    lane: int
    lane_id: str
    """`edge`, `lane` and `lane_id`: SUMO's names; `lane` is the index of the lane on which the vehicle leaves
    the edge."""
    internal: bool
    """Whether the lane lies inside a junction; `edge` is then the internal edge."""
    begin_m: float
    end_m: float
    """`begin_m` and `end_m`: arc length on the loop at the beginning and the end of the lane."""
    lane_ids: tuple[str, ...]
    """Lanes on which the vehicle may be, `lane_id` first. More than one lane if the vehicle may change lanes
    (`changes`)."""
    shapes: tuple[Points, ...]
    """Centre lines of `lane_ids`."""
    entered: int | None = None
    """Index of the lane on which the vehicle enters; None if that is `lane`."""

    @property
    def lane_in(self) -> int:
        """The index of the lane on which a vehicle enters the edge."""
        return self.lane if self.entered is None else self.entered

    @property
    def length_m(self) -> float:
        """The length of the lane from `begin_m` to `end_m` [m]."""
        return self.end_m - self.begin_m

    @property
    def changes(self) -> bool:
        """Whether the vehicle may change lanes on this part of the loop."""
        return len(self.lane_ids) > 1


@dataclass(frozen=True, slots=True)
class Loop:
    """A route through the network, closed unless said otherwise; arc length 0 is the start of its first edge.

    Arc length is the sum of SUMO's lengths of lanes and internal lanes, not of the drawn shapes. Make a loop
    with `loopgate.network.make_loop`.

    Attributes
    ----------
    edges
        Normal edges in driving order; the last leads to the first, if it is closed.
    spans
        Lanes and internal lanes in driving order, without gaps.
    movements
        Movements over the junctions, from each edge to the next.
    stops_on
        Edges on which some vehicle stops.
    closed
        Whether vehicles drive it round and round. Vehicles drive an open route once and leave the road at its
        end.

    Examples
    --------
    >>> from loopgate import RoadNetwork, read_loops
    >>> network = RoadNetwork.open("networks/ring3.net.xml")
    >>> loop = read_loops(network, "routes/ring3.rou.xml").loops[0]
    >>> loop.arc("s1", 10.0)
    386.22
    >>> loop.locate(386.0).edge, loop.locate(386.0 + loop.length_m).edge
    ('s1', 's1')
    >>> loop.span_at(430.0).internal, round(loop.hold_before(430.0), 2), round(loop.hold_after(430.0), 2)
    (True, 426.92, 436.32)
    >>> points, arcs_m = loop.curve()
    >>> round(float(arcs_m[-1]), 2) == round(loop.length_m, 2)
    True
    """

    id: str
    edges: tuple[str, ...]
    spans: tuple[LaneSpan, ...]
    movements: tuple[Connection, ...] = field(default=(), repr=False, compare=False)
    stops_on: frozenset[str] = frozenset()
    closed: bool = True

    _ends: tuple[float, ...] = field(init=False, repr=False, compare=False)

    def __hash__(self) -> int:
        """Return the hash of the name: loops are keys of many tables, and have hundreds of spans."""
        return hash(self.id)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_ends", tuple(span.end_m for span in self.spans))

    def __repr__(self) -> str:
        shape = "" if self.closed else ", not closed"
        return f"<Loop {self.id}: {len(self.edges)} edges, {self.length_m:.0f} m{shape}>"

    @property
    def roads(self) -> list[LaneSpan]:
        """The lanes outside junctions: for each edge the lane on which the loop leaves it."""
        return [span for span in self.spans if not span.internal]

    @property
    def length_m(self) -> float:
        """The length of all lanes of the loop [m]; on a closed loop, the length of one lap."""
        return self._ends[-1]

    @property
    def lap_m(self) -> float:
        """The arc length added with each lap [m]; for a route driven once, more than its whole length."""
        return self.length_m if self.closed else self.length_m + AWAY_M

    def span_at(self, arc_m: float) -> LaneSpan:
        """Return the lane at an arc length, which is taken modulo the loop's length; O(log spans)."""
        return self.spans[self._number_at(arc_m)]

    def locate(self, arc_m: float) -> LanePosition:
        """Return edge, lane and position on the lane at an arc length, taken modulo the loop's length."""
        span = self.span_at(arc_m)
        return LanePosition(span.edge, span.lane, min(arc_m % self.lap_m - span.begin_m, span.length_m))

    def arc(self, edge: str, position_m: float, *, after_m: float = 0.0) -> float:
        """Return the arc length of a position on an edge: the first that is at least `after_m`.

        Raises `RouteError` if the loop does not use the edge.

        Parameters
        ----------
        edge
            A normal or internal edge of the loop.
        position_m
            Position on its lane [m]; SUMO lets vehicles stand a hair beyond the end.
        after_m
            Arc length from which to look, for loops that use an edge twice.
        """
        return self.arcs(edge, position_m, after_m=after_m)[0]

    def arcs(self, edge: str, position_m: float, *, after_m: float = 0.0) -> list[float]:
        """Return the arc length of a position on each pass of an edge, in order from `after_m`; see `arc`."""
        found = [span.begin_m + min(position_m, span.length_m) for span in self.spans if span.edge == edge]
        if not found:
            msg = f"loop {self.id}: edge {edge} is not on it"
            raise RouteError(msg)
        return sorted(found, key=lambda arc: (arc - after_m) % self.length_m)

    def hold_before(self, arc_m: float) -> float:
        """Return the last arc length up to `arc_m` at which SUMO can make a vehicle stop.

        Vehicles can stop on a normal lane, at least `HOLD_MARGIN_M` from both ends. The result is below 0 if
        it lies before the loop's beginning.

        Raises `RouteError` if the loop has no lane long enough.
        """
        lap = arc_m - arc_m % self.length_m
        here = self._number_at(arc_m)
        for number in range(here, here - len(self.spans) - 1, -1):
            first, last = self._hold_range(number, lap)
            if first <= last and arc_m >= first - _ROUNDING_M:
                return min(arc_m, last)
        raise self._no_hold()

    def hold_after(self, arc_m: float) -> float:
        """Return the first arc length from `arc_m` on at which SUMO can make a vehicle stop.

        Vehicles can stop on a normal lane, at least `HOLD_MARGIN_M` from both ends. The result may exceed the
        loop's length.
        """
        lap = arc_m - arc_m % self.length_m
        here = self._number_at(arc_m)
        for number in range(here, here + len(self.spans) + 1):
            first, last = self._hold_range(number, lap)
            if first <= last and arc_m <= last + _ROUNDING_M:
                return max(arc_m, first)
        raise self._no_hold()

    def _number_at(self, arc_m: float) -> int:
        return min(bisect_right(self._ends, arc_m % self.lap_m), len(self.spans) - 1)

    def _hold_range(self, number: int, lap_m: float) -> tuple[float, float]:
        """Return the first and last hold position on a span, numbered over all laps; first > last if none."""
        laps, index = divmod(number, len(self.spans))
        span = self.spans[index]
        offset = lap_m + laps * self.length_m
        if span.internal or span.length_m < _SHORTEST_HOLD_LANE_M:
            return 1.0, 0.0
        return offset + span.begin_m + HOLD_MARGIN_M, offset + span.end_m - HOLD_MARGIN_M

    def _no_hold(self) -> RouteError:
        return RouteError(f"loop {self.id}: no lane on it is long enough to hold a vehicle")

    def curve(self) -> tuple[Floats, Floats]:
        """Return the loop as drawn: points [m], shape (n, 2), and the arc length of each [m], shape (n,).

        Shapes are scaled so that arc lengths agree with lane lengths. On a closed loop the last point is the
        first point again. Consecutive lanes may repeat a point or leave a small gap, as drawn.
        """
        points: list[Floats] = []
        arcs: list[Floats] = []
        for span in self.spans:
            shape = np.asarray(span.shapes[0], dtype=np.float64)
            points.append(shape)
            arcs.append(arc_lengths(shape, span.begin_m, span.end_m))
        return np.concatenate(points), np.concatenate(arcs)


def arc_lengths(shape: Floats, begin_m: float, end_m: float) -> Floats:
    """Return the arc length of each point of a polyline, stretched to begin and end at the given values."""
    steps = np.hypot(*np.diff(shape, axis=0).T)
    along = np.concatenate(([0.0], np.cumsum(steps)))
    drawn = float(along[-1])
    if drawn <= 0.0:
        return np.linspace(begin_m, end_m, len(shape))
    return np.asarray(begin_m + along * ((end_m - begin_m) / drawn), dtype=np.float64)
