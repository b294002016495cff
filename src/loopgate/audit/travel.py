"""Follow a vehicle along its loop by its recorded positions: stretches that it enters, and stands."""

import numpy as np

from loopgate.arrays import Floats, Ints
from loopgate.audit.exclusion import Passages
from loopgate.audit.layout import LoopWay, VehicleBody
from loopgate.audit.stretches import ROUNDING_M, LoopStretches
from loopgate.errors import ResultsError

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

    A stretch is shared by bodies of all lengths: it lasts from the first front to the last rear of those that
    touch the foe. If it begins farther beyond its end than this body is long, only longer bodies touch. The
    rules *drawn* and *conflict* check that the abstraction leaves out no body that can touch.
    """
    on_it = stretches.begin_m - stretches.end_m <= length_m + 2 * ROUNDING_M
    if on_it.all():
        return stretches
    return LoopStretches(
        stretches.begin_m[on_it],
        stretches.end_m[on_it],
        stretches.group[on_it],
        stretches.side[on_it],
        stretches.first,
    )


class Traveller:
    """Follows a vehicle through consecutive pieces of its recorded positions.

    Parameters
    ----------
    grants_s
        The times at which the gate granted its states to the vehicle, in order [s].
    leaves_s
        The times at which, by the trace, its rear left its states, in order [s].
    end_s
        The time at which, by the trace, it went off the road [s]; infinity if it did not.
    """

    def __init__(
        self,
        number: int,
        body: VehicleBody,
        loop: LoopTable,
        grants_s: Floats,
        leaves_s: Floats,
        end_s: float = np.inf,
    ) -> None:
        self.end_s = end_s
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
