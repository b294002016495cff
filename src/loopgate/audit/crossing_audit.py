"""Check from recorded positions alone that vehicles exclude each other at crossings and fit into places."""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import scipy
import shapely

from loopgate.arrays import Floats, Ints
from loopgate.audit.drawing import Drawn, Side, conflicts_by_loop, find_meetings, lies_above
from loopgate.audit.drawn_bodies import jumps
from loopgate.audit.exclusion import Clash, Exclusion, Passages
from loopgate.audit.layout import Layout, LoopLeg, LoopWay, VehicleBody
from loopgate.audit.position_table import Positions, read_positions
from loopgate.audit.stretches import ROUNDING_M, LoopStretches, StretchGroup, lay_stretches
from loopgate.audit.trace_audit import Finding
from loopgate.errors import ResultsError
from loopgate.results.columns import EVENT, PLACE, REASON, TAKEN_OUT, TIME, VEHICLE, Event

_STEPS_APART_M = 1e6
"""Steps are laid so far apart that bodies of different steps are never near [m]."""

_ROUNDING_M = 0.02
"""Rectangles are taken this much smaller: recorded positions are rounded [m]."""


def overlapping(positions: Positions, length_m: Floats, width_m: Floats, bent: Mapping[int, Floats]) -> Ints:
    """Return the pairs of rows, shape (n, 2), of one step whose bodies overlap.

    Each body is a rectangle behind its recorded front, in its recorded direction. O(n log n) for vehicles
    on roads, of which few are near each other.

    Parameters
    ----------
    positions
        Rows of any number of steps.
    length_m, width_m
        Size of each row's vehicle [m].
    bent
        By row, for bodies that are not one rectangle: the points at which its parts meet, see `bends`.
    """
    angle = np.deg2rad(positions.angle_deg)
    ahead = np.stack((np.sin(angle), np.cos(angle)), axis=1)
    front = np.stack((positions.x_m, positions.y_m), axis=1)
    row = np.arange(len(front))
    if bent:
        first = np.concatenate([points[:-1] for points in bent.values()])
        rear = np.concatenate([points[1:] for points in bent.values()])
        whole = np.setdiff1d(row, list(bent))
        size = np.hypot(*(first - rear).T)
        row = np.concatenate((whole, np.repeat(list(bent), [len(points) - 1 for points in bent.values()])))
        front = np.concatenate((front[whole], first))
        ahead = np.concatenate((ahead[whole], (first - rear) / size[:, None]))
        length_m, width_m = np.concatenate((length_m[whole], size)), width_m[row]
    centre = front - ahead * (length_m / 2)[:, None]
    half = np.stack((length_m, width_m), axis=1) / 2 - _ROUNDING_M
    _, step = np.unique(positions.time_s, return_inverse=True)
    reach = 2.0 * float(np.hypot(half[:, 0], half[:, 1]).max(initial=0.0))
    tree = scipy.spatial.cKDTree(np.column_stack((centre, step[row] * _STEPS_APART_M)))
    pairs = tree.query_pairs(reach, output_type="ndarray").astype(np.int64)
    pairs = pairs[row[pairs[:, 0]] != row[pairs[:, 1]]]
    if not len(pairs):
        return np.zeros((0, 2), dtype=np.int64)
    a, b = pairs[:, 0], pairs[:, 1]
    between = centre[b] - centre[a]
    apart = np.zeros(len(pairs), dtype=bool)
    for one, other in ((a, b), (b, a)):  # a line along a side of either keeps two rectangles apart, or none
        along = ahead[one]
        across = np.stack((along[:, 1], -along[:, 0]), axis=1)
        cos = np.abs((ahead[other] * along).sum(axis=1))
        sin = np.abs((ahead[other] * across).sum(axis=1))
        apart |= (
            np.abs((between * along).sum(axis=1))
            >= half[one, 0] + half[other, 0] * cos + half[other, 1] * sin
        )
        apart |= (
            np.abs((between * across).sum(axis=1))
            >= half[one, 1] + half[other, 0] * sin + half[other, 1] * cos
        )
    return np.unique(np.sort(row[pairs[~apart]], axis=1), axis=0)


def bends(layout: Layout, names: Sequence[str], positions: Positions, arcs_m: Floats) -> dict[int, Floats]:
    """Return the points at which jointed bodies bend, by row, from front to rear, shape (n, 2) [m].

    They bend where lanes end, as SUMO draws them; the angle that SUMO records is that of the first part.

    Parameters
    ----------
    layout, names
        The run's; the vehicles by number.
    arcs_m
        Where the front is on its loop [m]; NaN off it: then the recorded angle has to do.
    """
    jointed = np.array([layout.vehicles[name].jointed for name in names], dtype=bool)
    found = {}
    for row in np.flatnonzero(jointed[positions.vehicle] & ~np.isnan(arcs_m)).tolist():
        body = layout.vehicles[names[int(positions.vehicle[row])]]
        front = np.array([positions.x_m[row], positions.y_m[row]])
        at_m, lane = float(positions.pos_m[row]), str(positions.lane_name[row])
        loop = layout.loops[body.loop]
        points = [front, *_behind(layout, loop, lane, at_m, float(arcs_m[row]), body.length_m)]
        apart = [np.hypot(*(one - two)) > _ROUNDING_M for one, two in pairwise(points)]
        if any(apart):
            found[row] = np.array([front, *(p for p, far in zip(points[1:], apart, strict=True) if far)])
    return found


def _behind(
    layout: Layout, loop: LoopWay, lane: str, pos_m: float, arc_m: float, length_m: float
) -> Iterator[Floats]:
    """Yield the ends of the lanes behind the front's on which the body lies, and its rear."""
    begin_m, half_m = arc_m - pos_m, loop.length_m / 2
    off = [abs((span.begin_m - begin_m + half_m) % loop.length_m - half_m) for span in loop.spans]
    k = int(np.argmin(off))
    at_m, size_m, rear_m = 0.0, loop.spans[k].end_m - loop.spans[k].begin_m, pos_m - length_m
    for _ in loop.spans:
        if rear_m >= at_m:
            break
        k -= 1
        lane, size_m = loop.spans[k].lanes[0], loop.spans[k].end_m - loop.spans[k].begin_m
        at_m -= size_m
        yield np.asarray(layout.shapes[lane][-1])
    share = min(max((rear_m - at_m) / max(size_m, _ROUNDING_M), 0.0), 1.0)
    rear = shapely.LineString(layout.shapes[lane]).interpolate(share, normalized=True)
    yield np.array([rear.x, rear.y])


_STANDING_MPS = 0.1
_MOST_PASSAGES = 5_000_000
"""An upper bound on the passages of a vehicle in one piece of its record, of some ten thousand rows."""

_LAPS = 1 << 20  # more laps than a vehicle drives: numbers of passages are counted in this base
TOLERANCE_M = 0.1
"""How far beyond the end of its leg a front may be [m]: SUMO's own tolerance for stops."""


class LoopTable:
    """A loop as arrays: the beginnings of its lanes, its legs, and the gaps between their places [m]."""

    def __init__(self, loop: LoopWay, lanes: dict[str, int], stretches: LoopStretches) -> None:
        self.lap_m = loop.length_m
        self.stretches = stretches
        self.begins: dict[int, list[float]] = {}
        for span in loop.spans:
            for lane in span.lanes:
                self.begins.setdefault(lanes[lane], []).append(span.begin_m)
        self.first = np.full(len(lanes) + 1, np.nan)
        for lane_number, begins in self.begins.items():
            self.first[lane_number] = begins[0]
        self.twice = {number: np.array(begins) for number, begins in self.begins.items() if len(begins) > 1}
        self.leg_ends = np.array([leg.end_m for leg in loop.legs])
        self.states = [leg.state for leg in loop.legs]
        following = [*loop.legs[1:], *loop.legs[:1]]
        laps = [0.0] * (len(loop.legs) - 1) + [loop.length_m]
        gaps = [
            (leg.end_m + TOLERANCE_M, after.begin_m + lap)
            for leg, after, lap in zip(loop.legs, following, laps, strict=True)
            if after.begin_m + lap - leg.end_m > 2 * TOLERANCE_M
        ]
        around = [(b + k * self.lap_m, e + k * self.lap_m) for k in (-1, 0, 1, 2) for b, e in gaps]
        table = np.array(sorted(around), dtype=np.float64).reshape(-1, 2)
        self.gap_begins, self.gap_ends = table[:, 0], table[:, 1]


def _stretches_of(length_m: float, stretches: LoopStretches) -> LoopStretches:
    """Return the stretches that a body of some length can be on.

    A stretch is shared by bodies of several lengths: it lasts from the first front to the last rear of those
    that touch the foe. If it begins farther beyond its end than this body is long, only longer bodies touch.
    The rules *drawn* and *conflict* check that the abstraction leaves out no body that can touch.
    """
    on_it = stretches.begin_m - stretches.end_m <= length_m + 2 * ROUNDING_M
    on_it &= (stretches.above_m < length_m) & (length_m <= stretches.up_to_m)
    if on_it.all():
        return stretches
    columns = {one.name: getattr(stretches, one.name) for one in fields(stretches) if one.name != "first"}
    return replace(stretches, **{name: column[on_it] for name, column in columns.items()})


class Traveller:
    """Follows a vehicle through consecutive pieces of its recorded positions.

    Parameters
    ----------
    grants_s
        The times at which the gate granted its states to the vehicle, in order [s].
    leaves_s
        The times at which, by the trace, its rear left its states, in order [s].
    begin_s, end_s
        The times at which, by the trace, it came under the gate, and went off the road [s]; infinity if it
        did not. SUMO may have had it on the road before: a vehicle is taken out again at once that has
        departed together with others so that no slot is left for it.
    """

    def __init__(
        self,
        number: int,
        body: VehicleBody,
        loop: LoopTable,
        grants_s: Floats,
        leaves_s: Floats,
        begin_s: float = -np.inf,
        end_s: float = np.inf,
    ) -> None:
        self.begin_s, self.end_s = begin_s, end_s
        self.number = number
        self.body = body
        self._loop = loop
        self._stretches = _stretches_of(body.length_m, loop.stretches)
        self._grants_s = grants_s
        self._leaves_s = leaves_s
        # Legs are counted from the one in which it starts; the layout's `start_m` may be some laps off.
        end = float(loop.leg_ends[body.leg]) if len(loop.leg_ends) else 0.0
        start = body.start_m
        while start > end + 1e-6:
            start -= loop.lap_m
        while start <= end - loop.lap_m:
            start += loop.lap_m
        self._start_m = start
        self._origin_m: float | None = None
        self._last: tuple[float, float] | None = None
        self._stand: tuple[float, float, int] | None = None  # from, until, lane number

    def arcs(self, lane: Ints, pos_m: Floats, odometer_m: Floats) -> Floats:
        """Return the positions of the front, counted on over laps [m]; NaN on lanes not on its loop.

        The lane says where on the loop the front is, the odometer in which lap. If the loop has the lane
        twice, the odometer also says at which of the two it is.
        """
        if self._origin_m is None and len(odometer_m):
            self._origin_m = self._start_m - float(odometer_m[0])
        expected = odometer_m + (self._origin_m or 0.0)
        arcs = self._loop.first[lane] + pos_m
        for number, begins in self._loop.twice.items():
            rows = np.flatnonzero(lane == number)
            if len(rows):
                choices = begins[None, :] + pos_m[rows][:, None]
                off = choices - expected[rows][:, None]
                off -= np.round(off / self._loop.lap_m) * self._loop.lap_m
                arcs[rows] = choices[np.arange(len(rows)), np.argmin(np.abs(off), axis=1)]
        return np.asarray(arcs + np.round((expected - arcs) / self._loop.lap_m) * self._loop.lap_m)

    def pass_over(self, time_s: Floats, arcs_m: Floats) -> tuple[Passages, Passages]:
        """Return the stretches that the front has reached and those that the rear has left, with the times.

        A vehicle keeps its speed within a step, as SUMO moves it.
        """
        s = self._stretches
        entered: list[Passages] = []
        if self._last is None:
            entered.append(self._at_start(float(time_s[0]), float(arcs_m[0])))
            self._last = float(time_s[0]), float(arcs_m[0])
        time = np.concatenate(([self._last[0]], time_s))
        arcs = np.maximum.accumulate(np.concatenate(([self._last[1]], arcs_m)))
        self._last = float(time[-1]), float(arcs[-1])
        entered.append(self._reached(s.begin_m, time, arcs))
        left_m = np.maximum(s.end_m + self.body.length_m, s.begin_m)  # but for rounding the same
        return Passages.join(entered), self._reached(left_m, time, arcs)

    def gone(self, at_s: float) -> Passages:
        """Return the stretches that the vehicle was on when it went off the road, left at `at_s`."""
        s, arc_m = self._stretches, self._last[1] if self._last else -np.inf
        lap = np.floor((arc_m - s.begin_m) / self._loop.lap_m)
        on_it = (arc_m - self.body.length_m < s.end_m + lap * self._loop.lap_m) & np.isfinite(lap)
        rows = np.flatnonzero(on_it)
        return self._passages(rows, lap[rows].astype(np.int64), np.full(len(rows), at_s))

    def ungranted(self, time_s: Floats, arcs_m: Floats, tolerance_m: float) -> tuple[Ints, Floats]:
        """Return the rows with the front beyond the legs granted before that step, and how far beyond [m]."""
        count = len(self._loop.leg_ends)
        if count < 2:  # noqa: PLR2004  one state all along: no gate
            return np.zeros(0, dtype=np.int64), np.zeros(0)
        leg = self.body.leg + np.searchsorted(self._grants_s, time_s, side="left")
        beyond = arcs_m - self._end_m(leg)
        rows = np.flatnonzero(beyond > tolerance_m)
        return rows, beyond[rows]

    def left_too_early(self, time_s: Floats, arcs_m: Floats) -> tuple[Ints, Floats]:
        """Return the rows with the rear in a state that it has left by the trace, and how far inside [m]."""
        count = len(self._loop.leg_ends)
        if count < 2:  # noqa: PLR2004  as above
            return np.zeros(0, dtype=np.int64), np.zeros(0)
        given_up = self.body.leg - 1 + np.searchsorted(self._leaves_s, time_s, side="right")
        within = self._end_m(given_up) - (arcs_m - self.body.length_m)
        rows = np.flatnonzero((given_up >= self.body.leg) & (within > ROUNDING_M))
        return rows, within[rows]

    def leaving(self, at_s: float) -> list[str]:
        """Return the states that it holds at a time and has a grant to leave."""
        left = np.searchsorted(self._leaves_s, at_s, side="right")
        granted = np.searchsorted(self._grants_s, at_s, side="right")
        states = self._loop.states
        return [states[leg % len(states)] for leg in range(self.body.leg + left, self.body.leg + granted)]

    def stands(
        self, time_s: Floats, arcs_m: Floats, speed_mps: Floats, lane: Ints
    ) -> list[tuple[float, float, int]]:
        """Return the stands in crossings that have ended: from, until [s], number of the front's lane."""
        loop = self._loop
        where = arcs_m - np.floor(arcs_m / loop.lap_m) * loop.lap_m
        if not len(loop.gap_ends):
            return []
        at = np.searchsorted(loop.gap_ends, where - self.body.length_m, side="right")
        inside = where > loop.gap_begins[np.minimum(at, len(loop.gap_begins) - 1)]
        standing = inside & (speed_mps < _STANDING_MPS)
        ended: list[tuple[float, float, int]] = []
        if not standing.any() and self._stand is None:
            return ended
        for k in range(len(time_s)):
            if standing[k]:
                begin = self._stand[0] if self._stand else float(time_s[k])
                self._stand = (begin, float(time_s[k]), int(lane[k]))
            elif self._stand:
                ended.append(self._stand)
                self._stand = None
        return ended

    def last_stand(self) -> list[tuple[float, float, int]]:
        """Return the stand at the end of the record, if there is one."""
        return [self._stand] if self._stand else []

    def _end_m(self, leg: Ints) -> Floats:
        lap, position = np.divmod(leg, len(self._loop.leg_ends))
        return np.asarray(lap * self._loop.lap_m + self._loop.leg_ends[position])

    def _at_start(self, time_s: float, arc_m: float) -> Passages:
        """Return the stretches that the body is on when the record begins."""
        s, lap_m = self._stretches, self._loop.lap_m
        lap = np.floor((arc_m - s.begin_m) / lap_m)  # the last lap in which the front had reached it
        inside = arc_m - self.body.length_m < s.end_m + lap * lap_m
        rows = np.flatnonzero(inside)
        return self._passages(rows, lap[rows].astype(np.int64), np.full(len(rows), time_s))

    def _reached(self, marks_m: Floats, time_s: Floats, arcs_m: Floats) -> Passages:
        lap_m = self._loop.lap_m
        first = np.floor((arcs_m[0] - marks_m) / lap_m).astype(np.int64) + 1
        last = np.floor((arcs_m[-1] - marks_m) / lap_m).astype(np.int64)
        times = np.maximum(last - first + 1, 0)
        if times.sum() > _MOST_PASSAGES:
            msg = f"vehicle {self.number + 1} of the record: it drives {times.max()} laps between two rows"
            raise ResultsError(msg)
        rows = np.repeat(np.arange(len(marks_m)), times)
        lap = np.arange(len(rows)) - np.repeat(np.cumsum(times) - times, times) + first[rows]
        at_m = marks_m[rows] + lap * lap_m
        k = np.clip(np.searchsorted(arcs_m, at_m, side="left"), 1, len(arcs_m) - 1)
        gained = arcs_m[k] - arcs_m[k - 1]
        share = np.where(gained > 0, (at_m - arcs_m[k - 1]) / np.where(gained > 0, gained, 1.0), 1.0)
        return self._passages(rows, lap, time_s[k - 1] + share * (time_s[k] - time_s[k - 1]))

    def _passages(self, rows: Ints, lap: Ints, time_s: Floats) -> Passages:
        s = self._stretches
        key = ((s.first + rows) * _LAPS + lap + _LAPS // 2) * _LAPS + self.number
        vehicle = np.full(len(rows), self.number, dtype=np.int64)
        return Passages(key.astype(np.int64), s.group[rows], s.side[rows], vehicle, time_s)


_BESIDE_M = 0.5
"""How far a drawn stretch may reach beyond the stretch of the abstraction [m]."""

Stretch = tuple[float, float] | None


def find_unmodelled(layout: Layout, drawn: Drawn) -> list[tuple[str, str, str]]:
    """Return the drawn conflicts that the abstraction does not cover: two lanes and the fault.

    No body may touch a body that waits in a place. Of two bodies that are between places, some movement of
    the first must be a foe of some movement of the second, over the whole drawn stretch. A layout without
    crossings has no movements: the list is then empty.
    """
    if not any(leg.crossings for loop in layout.loops.values() for leg in loop.legs):
        return []
    found: dict[tuple[str, str], str] = {}
    for meeting in drawn:
        one, other = (
            side._replace(begin_m=side.begin_m + loops[side.loop], end_m=side.end_m + loops[side.loop])
            for side, loops in zip((meeting.one, meeting.other), meeting.loops, strict=True)
        )
        if one.waits or other.waits:
            found[one.lane, other.lane] = "can touch as drawn, where one of them may wait"
            continue
        said = list(_foes(layout, one, other))
        if not said:
            found[one.lane, other.lane] = "can touch as drawn, but are no foes"
            continue
        beyond = max(_beyond(layout, side, [s[k] for s in said]) for k, side in enumerate((one, other)))
        if beyond > _BESIDE_M:
            found[one.lane, other.lane] = f"can touch as drawn {beyond:.1f} m beyond the stretch they share"
    return [(one, other, text) for (one, other), text in sorted(found.items())]


def _foes(layout: Layout, one: Side, other: Side) -> Iterator[tuple[Stretch, Stretch]]:
    """Yield the stretches that two conflicting movements share by the abstraction, each along its own way."""
    theirs = [(leg, movement) for leg in _under_way(layout, other) for movement, _ in leg.crossings]
    for leg in _under_way(layout, one):
        for movement, _ in leg.crossings:
            for there, foe in theirs:
                mine = list(leg.shared(movement, foe, one.length_m, other.length_m))
                back = list(there.shared(foe, movement, other.length_m, one.length_m))
                yield from zip(mine, back, strict=False)


def _under_way(layout: Layout, side: Side) -> list[LoopLeg]:
    """Return the legs between whose place and the next place a body of this side may be."""
    loop = layout.loops[side.loop]
    legs = []
    for leg, following in zip(loop.legs, [*loop.legs[1:], *loop.legs[:1]], strict=True):
        over_m = (following.begin_m - leg.end_m) % loop.length_m
        front = (side.begin_m - leg.end_m + _BESIDE_M) % loop.length_m
        rear = (side.end_m - leg.end_m) % loop.length_m
        if front <= over_m + side.begin_m - side.end_m + _BESIDE_M or rear <= over_m:
            legs.append(leg)
    return legs


def _beyond(layout: Layout, side: Side, stretches: Sequence[Stretch]) -> float:
    """Return how far bodies touch outside the abstraction's stretches, on either end [m]."""
    lap_m = layout.loops[side.loop].length_m
    before, behind = math.inf, math.inf
    for stretch in stretches:
        if stretch is None:
            return 0.0
        lap = round((side.begin_m - stretch[0]) / lap_m) * lap_m
        before = min(before, stretch[0] + lap - side.begin_m)
        behind = min(behind, side.end_m - stretch[1] - lap)
    return max(before, behind)


_MOST_FINDINGS = 200
"""How many findings of one rule are reported with their text; further ones are only counted."""

_LAST_STEPS = 1.5
"""How many steps after the last row of its record a vehicle goes off the road, at most."""

_LONG_STAND_S = 3.0
"""A stand in a crossing that lasts longer than this is counted [s].

A vehicle that follows another may stand there for a shorter time.
"""


class _Parked(NamedTuple):
    """A vehicle that parked beside the road at a place, from `begin_s` to `end_s` [s]."""

    vehicle: str
    place: str
    begin_s: float
    end_s: float

    def at(self, time_s: float) -> bool:
        """Return whether the vehicle was parked at a time."""
        return self.begin_s <= time_s <= self.end_s


@dataclass(frozen=True, slots=True)
class PositionAudit:
    """The result of `audit_positions`: the violations that it found, and figures for the summary."""

    findings: Sequence[Finding]
    figures: dict[str, Any]


def audit_positions(
    file: Path,
    layout: Layout,
    events: pd.DataFrame | Iterable[pd.DataFrame],
    *,
    tick: Callable[[float], None] | None = None,
) -> PositionAudit:
    """Check the recorded positions of all vehicles against the layout and the grants.

    A vehicle's body reaches from its front back along its loop, by its length. Between two steps it keeps its
    speed. The rules:

    - *crossing*: two vehicles on conflicting movements are never both on the stretch that these share;
    - *drawn*: the same for stretches that the audit itself finds from the lanes on the map;
    - *conflict*: the layout has each conflict seen on the map over its whole length, and no movement leads
      over a place where a vehicle may wait (no positions needed);
    - *bodies*: no two bodies overlap, as rectangles on the ground at SUMO's positions;
    - *room*: a place never has more bodies than slots; those with a grant to leave it do not count;
    - *ahead*: no front is beyond the last granted place;
    - *behind*: no rear is in a place that the vehicle has left according to the trace;
    - *lane*: no vehicle is on a lane outside its loop.

    Parameters
    ----------
    file
        The positions that SUMO recorded, see `loopgate.audit.position_table`.
    layout
        States, crossings and vehicles.
    events
        `EVENT_COLUMNS` of the same run; or consecutive pieces of this table.
    tick
        Called with the simulated time that has been audited [s].

    Returns
    -------
    PositionAudit
        Findings in the order of time, the conflicts first. Time O(n log n) in rows; memory does not grow
        with the length of the run.

    Examples
    --------
    >>> from pathlib import Path
    >>> from loopgate import Scenario, run
    >>> from loopgate.audit import audit_positions, read_layout
    >>> roads = {"network": "networks/ring3.net.xml", "routes": "routes/ring3.rou.xml"}
    >>> made = run(Scenario(**roads, duration_s=60, positions=True), "out/ring3")
    >>> layout = read_layout(Path("out/ring3/layout.json"))
    >>> audit = audit_positions(Path("out/ring3/positions.csv.gz"), layout, made.events)
    >>> audit.findings, audit.figures["rows"]
    ([], 183)
    """
    pieces = [events] if isinstance(events, pd.DataFrame) else events
    return _Audit(layout, pieces).check(file, tick or (lambda _time_s: None))


class _Audit:
    def __init__(self, layout: Layout, events: Iterable[pd.DataFrame]) -> None:
        self._layout = layout
        self._names = list(layout.vehicles)
        lanes = dict.fromkeys(
            lane for loop in layout.loops.values() for span in loop.spans for lane in span.lanes
        )
        self._lanes = {lane: number for number, lane in enumerate(lanes)}
        self._lane_names = list(lanes)
        drawn = find_meetings(layout)
        self._findings: list[Finding] = []
        self._told: Counter[str] = Counter()
        for one, other, text in find_unmodelled(layout, drawn):
            self._add(0.0, "", one, "conflict", f"{one} and {other} {text}")
        stretches = lay_stretches(layout, conflicts_by_loop(layout, drawn))
        needed_m = np.array([body.needed_m for body in layout.vehicles.values()])
        self._exclusion = Exclusion(stretches.groups, needed_m)
        self._groups = stretches.groups
        tables = {
            name: LoopTable(loop, self._lanes, stretches.loops[name]) for name, loop in layout.loops.items()
        }
        parked: list[pd.DataFrame] = []
        kinds = Event.START, Event.GRANT, Event.LEAVE, Event.END
        starts, grants, leaves, ends = _times(_watched(events, parked), kinds)
        taken = {name for rows in parked for name in rows[VEHICLE][rows[REASON] == TAKEN_OUT].astype(str)}
        for name in taken & ends.keys():  # SUMO tells it a step late
            ends[name] = ends[name] - layout.step_s
        none = np.zeros(0)
        absent = np.inf if starts else -np.inf  # without a gate there are no such events
        self._travellers = [
            Traveller(
                number,
                body,
                tables[body.loop],
                grants.get(name, none),
                leaves.get(name, none),
                float(starts[name][0]) if name in starts else absent,
                float(ends[name][-1]) if name in ends else np.inf,
            )
            for number, (name, body) in enumerate(layout.vehicles.items())
        ]
        bodies = layout.vehicles.values()
        self._length_m = np.array([body.length_m for body in bodies])
        self._width_m = np.array([body.width_m for body in bodies])
        self._jumped_to = {
            span.driven[0]
            for loop in layout.loops.values()
            for k, span in enumerate(loop.spans)
            if jumps(loop.spans[k - 1], span)
        }
        self._beside = _parked(parked)
        self._touching: set[tuple[int, int]] = set()
        self._astray: dict[int, str] = {}
        self._rows = 0
        self._stands = 0
        self._longest_stand: tuple[float, int, int, float] = (0.0, -1, -1, 0.0)

    def check(self, file: Path, tick: Callable[[float], None]) -> PositionAudit:
        numbers = {name: number for number, name in enumerate(self._names)}
        for positions in read_positions(file, numbers, self._lanes, self._layout.step_s):
            self._piece(positions)
            tick(float(positions.time_s[-1]))
        for traveller in self._travellers:
            self._note_stands(traveller.number, traveller.last_stand())
        order = sorted(self._findings, key=lambda f: f.at_s)
        more = [
            Finding(0.0, "", "", rule, f"{count - _MOST_FINDINGS} more findings of the rule {rule!r}")
            for rule, count in sorted(self._told.items())
            if count > _MOST_FINDINGS
        ]
        return PositionAudit([*order, *more], self._figures())

    def _figures(self) -> dict[str, Any]:
        longest, vehicle, lane, from_s = self._longest_stand
        figures: dict[str, Any] = {
            "rows": self._rows,
            "margin_s": self._exclusion.margins["crossing"].summary(),
            "drawn_margin_s": self._exclusion.margins["drawn"].summary(),
            "stands_in_crossings": self._stands,
            "longest_stand_s": round(longest, 3),
        }
        if vehicle >= 0:
            figures["longest_stand"] = {
                "vehicle": self._names[vehicle],
                "lane": self._lane_names[lane],
                "at_s": from_s,
            }
        return figures

    def _piece(self, positions: Positions) -> None:
        self._rows += len(positions.time_s)
        order = np.argsort(positions.vehicle, kind="stable")
        vehicle = positions.vehicle[order]
        cuts = np.flatnonzero(np.diff(vehicle)) + 1
        entered: list[Passages] = []
        left: list[Passages] = []
        arcs = np.full(len(order), np.nan)
        for rows in np.split(order, cuts):
            number = int(positions.vehicle[rows[0]])
            if number >= 0:
                arcs[rows] = self._vehicle(self._travellers[number], positions, rows, entered, left)
        self._bodies(positions, arcs)
        for clash in self._exclusion.judge(Passages.join(entered), Passages.join(left)):
            self._clash(clash)

    def _vehicle(
        self,
        traveller: Traveller,
        positions: Positions,
        rows: Ints,
        entered: list[Passages],
        left: list[Passages],
    ) -> Floats:
        """Judge the rows of one vehicle; return the positions of its front, see `Traveller.arcs`."""
        name = self._names[traveller.number]
        before = positions.time_s[rows] < traveller.begin_s
        if before.any():
            found = np.full(len(rows), np.nan)
            if not before.all():
                found[~before] = self._vehicle(traveller, positions, rows[~before], entered, left)
            return found
        lane, time, speed = positions.lane[rows], positions.time_s[rows], positions.speed_mps[rows]
        found = arcs = traveller.arcs(lane, positions.pos_m[rows], positions.odometer_m[rows])
        known = ~np.isnan(arcs)
        if not known.all():
            self._stray(traveller.number, positions, rows[~known])
            arcs, lane, time, speed = arcs[known], lane[known], time[known], speed[known]
            if not len(arcs):
                return found
        came, went = traveller.pass_over(time, arcs)
        entered.append(came)
        left.append(went)
        if time[-1] >= traveller.end_s - _LAST_STEPS * self._layout.step_s:
            left.append(traveller.gone(traveller.end_s))
        for rule, (at, by) in (
            ("ahead", traveller.ungranted(time, arcs, TOLERANCE_M)),
            ("behind", traveller.left_too_early(time, arcs)),
        ):
            for k, metres in zip(at.tolist(), by.tolist(), strict=True):
                where = self._lane_names[int(lane[k])]
                what = "beyond its grant" if rule == "ahead" else "still in a place it is said to have left"
                self._add(float(time[k]), name, where, rule, f"{name}: on {where}, {metres:.1f} m {what}")
        self._note_stands(traveller.number, traveller.stands(time, arcs, speed, lane))
        return found

    def _stray(self, number: int, positions: Positions, rows: Ints) -> None:
        for row in rows.tolist():
            lane = str(positions.lane_name[row])
            if self._astray.get(number) != lane:
                self._astray[number] = lane
                text = f"{self._names[number]}: on {lane}, which is not on its loop"
                self._add(float(positions.time_s[row]), self._names[number], lane, "lane", text)

    def _note_stands(self, vehicle: int, stands: Iterable[tuple[float, float, int]]) -> None:
        for begin, end, lane in stands:
            lasted = end - begin + self._layout.step_s
            self._stands += lasted > _LONG_STAND_S
            if lasted > self._longest_stand[0]:
                self._longest_stand = (lasted, vehicle, lane, begin)

    def _clash(self, clash: Clash) -> None:
        group = self._groups[clash.group]
        name = self._names[clash.vehicle]
        if group.kind == "place":
            place = group.names[0]
            there = [one for one in clash.there if not self._gives_back(one, place, group, clash.time_s)]
            needs_m = sum(self._layout.vehicles[self._names[one]].needed_m for one in there)
            if len(there) <= group.room or needs_m <= group.metres:
                return
            text = f"{place}: holds {group.room}, but {name} is number {len(there)} on it"
            self._add(clash.time_s, name, place, "room", text)
            return
        one, two = group.names
        early = "is still there" if np.isinf(clash.by) else f"leaves {clash.by:.2f} s later"
        text = f"{name}: on the stretch that {one} and {two} share, while {self._names[clash.other]} {early}"
        self._add(clash.time_s, name, one, group.kind, text)

    def _gives_back(self, vehicle: int, place: str, group: StretchGroup, at_s: float) -> bool:
        """Return whether a vehicle in a place takes no slot there: it is parked, or leaves a queue."""
        name = self._names[vehicle]
        if any(one.vehicle == name and one.place == place and one.at(at_s) for one in self._beside):
            return True
        return group.room > 1 and place in self._travellers[vehicle].leaving(at_s)

    def _bodies(self, positions: Positions, arcs_m: Floats) -> None:
        known = positions.vehicle >= 0
        if not known.all():
            columns = (getattr(positions, name)[known] for name in Positions.__slots__)
            positions, arcs_m = Positions(*columns), arcs_m[known]
        if not len(positions.time_s):
            return
        vehicle = positions.vehicle
        last = positions.time_s[-1]
        now: set[tuple[int, int]] = set()
        before: dict[tuple[int, int], float] = dict.fromkeys(self._touching, -np.inf)
        bent = bends(self._layout, self._names, positions, arcs_m)
        hits = overlapping(positions, self._length_m[vehicle], self._width_m[vehicle], bent)
        for a, b in hits[np.argsort(positions.time_s[hits[:, 0]], kind="stable")].tolist():
            lanes = str(positions.lane_name[a]), str(positions.lane_name[b])
            middle = (positions.x_m[a] + positions.x_m[b]) / 2, (positions.y_m[a] + positions.y_m[b]) / 2
            if lies_above(self._layout, *lanes, middle) or self._cannot_touch(positions, a, b):
                continue
            time = float(positions.time_s[a])
            names = self._names[int(vehicle[a])], self._names[int(vehicle[b])]
            pair = (int(vehicle[a]), int(vehicle[b]))
            pair = (min(pair), max(pair))
            if time == last:
                now.add(pair)
            if any(one.vehicle in names and one.at(time) for one in self._beside):
                continue
            since = before.get(pair)
            before[pair] = time
            if since is not None and (np.isinf(since) or time - since <= self._layout.step_s + 1e-6):
                continue  # reported when the overlap began
            text = f"{names[0]} on {lanes[0]} and {names[1]} on {lanes[1]}: their bodies overlap"
            self._add(time, names[0], lanes[0], "bodies", text)
        self._touching = now

    def _cannot_touch(self, positions: Positions, a: int, b: int) -> bool:
        """Return whether two bodies whose drawn rectangles overlap cannot touch on the road.

        A lane may be drawn shorter than it is: then the rectangles of two vehicles, one behind the other on
        that lane, overlap, although their positions along the lane do not.
        """
        for row in (a, b):
            length_m = self._length_m[positions.vehicle[row]]
            if positions.lane_name[row] in self._jumped_to and positions.pos_m[row] < length_m + TOLERANCE_M:
                return True  # without lanes inside junctions there is no direction while it gets over
        if positions.lane_name[a] != positions.lane_name[b]:
            return False
        first, last = (a, b) if positions.pos_m[a] >= positions.pos_m[b] else (b, a)
        length_m = self._length_m[positions.vehicle[first]]
        return bool(positions.pos_m[first] - length_m >= positions.pos_m[last])

    def _add(self, at_s: float, vehicle: str, place: str, rule: str, text: str) -> None:
        self._told[rule] += 1
        if self._told[rule] <= _MOST_FINDINGS:
            self._findings.append(Finding(at_s, vehicle, place, rule, f"{at_s:.0f} s: {text}"))


def _times(pieces: Iterable[pd.DataFrame], kinds: Sequence[Event]) -> list[dict[str, Floats]]:
    """Return, for each kind of event, the times of each vehicle's events of that kind [s]."""
    found: list[dict[str, list[Floats]]] = [{} for _ in kinds]
    for events in pieces:
        for kind, times in zip(kinds, found, strict=True):
            rows = events[events[EVENT] == kind.value]
            for name, group in rows.groupby(VEHICLE, sort=False, observed=True)[TIME]:
                times.setdefault(str(name), []).append(group.to_numpy(dtype=np.float64))
    return [{name: np.concatenate(parts) for name, parts in times.items()} for times in found]


def _watched(pieces: Iterable[pd.DataFrame], kept: list[pd.DataFrame]) -> Iterator[pd.DataFrame]:
    """Yield the pieces unchanged, and add to `kept` the events of parking, returning and leaving for good."""
    for events in pieces:
        kept.append(events[events[EVENT].isin([Event.PARK.value, Event.RETURN.value, Event.END.value])])
        yield events


def _parked(pieces: Iterable[pd.DataFrame]) -> list[_Parked]:
    """Return each time that a vehicle was parked beside the road."""
    found: list[_Parked] = []
    begun: dict[str, _Parked] = {}
    for events in pieces:
        columns = [events[name].astype(str).to_list() for name in (VEHICLE, EVENT, PLACE)]
        for vehicle, event, place, at_s in zip(*columns, events[TIME].to_list(), strict=True):
            if event == Event.PARK:
                begun[vehicle] = _Parked(vehicle, place, at_s, np.inf)
            elif vehicle in begun:
                found.append(begun.pop(vehicle)._replace(end_s=at_s))
    return [*found, *begun.values()]
