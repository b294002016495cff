"""Judge exclusion and room from the times at which vehicles enter and leave each stretch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from loopgate.arrays import Flags, Floats, Ints
from loopgate.audit.stretches import StretchGroup

_ROUNDING_M = 1e-3
_MARGIN_STEP_S = 0.1
_LONGEST_MARGIN_S = 60.0


@dataclass(frozen=True, slots=True)
class Passages:
    """Passages as rows: `key` (the same on entering and leaving), group, side, vehicle, time [s]."""

    key: Ints
    group: Ints
    side: Ints
    vehicle: Ints
    time_s: Floats

    def __len__(self) -> int:
        return len(self.key)

    @classmethod
    def join(cls, parts: Sequence[Passages]) -> Passages:
        """Return the rows of several tables in one."""
        none = np.zeros(0, dtype=np.int64)
        every = [cls(none, none, none, none, np.zeros(0)), *parts]
        return cls(*(np.concatenate([getattr(p, name) for p in every]) for name in cls.__slots__))

    def where(self, mask: Flags) -> Passages:
        """Return the rows that `mask` selects."""
        return type(self)(*(getattr(self, name)[mask] for name in self.__slots__))


@dataclass(frozen=True, slots=True)
class Clash:
    """A finding: `vehicle` came onto a stretch while `other` was on it, or came to a place that was full.

    ``by``: on a stretch, how many seconds too early the vehicle came. `there`: the vehicles in the place.
    """

    time_s: float
    group: int
    vehicle: int
    other: int
    by: float
    there: tuple[int, ...] = ()


class Margins:
    """A histogram of times from the rear of a vehicle leaving a shared stretch to the front of a foe [s].

    Each passage counts once, with the last foe before it. The size of the histogram does not grow with the
    run. Times of a minute and more are left out, and foes that have not left by the end of the piece.
    """

    def __init__(self) -> None:
        self.least_s = np.inf
        self._counts = np.zeros(round(_LONGEST_MARGIN_S / _MARGIN_STEP_S), dtype=np.int64)

    def add(self, margins_s: Floats) -> None:
        """Count some margins [s]."""
        near = margins_s[np.isfinite(margins_s) & (margins_s < _LONGEST_MARGIN_S)]
        if len(near):
            self.least_s = min(self.least_s, float(near.min()))
            bins = np.clip((near / _MARGIN_STEP_S).astype(np.int64), 0, len(self._counts) - 1)
            self._counts += np.bincount(bins, minlength=len(self._counts))

    def summary(self) -> dict[str, float | int]:
        """Return the number of margins, the least and some percentiles [s], to a tenth of a second."""
        total = int(self._counts.sum())
        if not total:
            return {"count": 0}
        filled = np.cumsum(self._counts)

        def percentile(share: float) -> float:
            return round(float(np.searchsorted(filled, share * total)) * _MARGIN_STEP_S, 3)

        return {
            "count": total,
            "least": round(self.least_s, 3),
            "p1": percentile(0.01),
            "p10": percentile(0.1),
            "median": percentile(0.5),
        }


class Exclusion:
    """Judge passages over shared stretches in the order of time.

    A group is a place, with its slots and metres, or a pair of movements that share a stretch. Of a pair,
    only one movement at a time may have bodies on the stretch, any number of them.
    """

    def __init__(self, groups: Sequence[StretchGroup], needed_m: Floats) -> None:
        self._groups, self._needed_m = groups, needed_m
        self._is_place = np.array([group.kind == "place" for group in groups], dtype=bool)
        self._is_drawn = np.array([group.kind == "drawn" for group in groups], dtype=bool)
        self._room = np.array([group.room for group in groups], dtype=np.int64)
        self._metres = np.array([group.metres for group in groups], dtype=np.float64) + _ROUNDING_M
        self._inside = np.zeros(len(groups), dtype=np.int64)
        self._inside_m = np.zeros(len(groups))
        self._left_s = np.full((2, len(groups)), -np.inf)  # by side: when the last rear left
        self._left_by = np.full((2, len(groups)), -1, dtype=np.int64)
        self._open = Passages.join([])
        self.margins = {"crossing": Margins(), "drawn": Margins()}

    def judge(self, entered: Passages, left: Passages) -> list[Clash]:
        """Judge the passages since the last call, and return the clashes.

        All times are later than those of the call before. O(n log n).
        """
        rows = Passages.join([self._open, entered])
        fresh = np.zeros(len(rows), dtype=bool)
        fresh[len(self._open) :] = True
        out_s = _match(rows.key, left)
        clashes = self._crowds(rows, fresh, out_s) + self._meetings(rows, fresh, out_s)
        self._open = rows.where(np.isinf(out_s))
        return sorted(clashes, key=lambda c: (c.time_s, c.group, c.vehicle))

    def _crowds(self, rows: Passages, fresh: Flags, out_s: Floats) -> list[Clash]:
        place = self._is_place[rows.group]
        came, went = fresh & place, ~np.isinf(out_s) & place
        group = np.concatenate((rows.group[came], rows.group[went]))
        time = np.concatenate((rows.time_s[came], out_s[went]))
        change = np.concatenate((np.ones(came.sum(), dtype=np.int64), -np.ones(went.sum(), dtype=np.int64)))
        vehicle = np.concatenate((rows.vehicle[came], rows.vehicle[went]))
        if not len(group):
            return []
        order = np.lexsort((change, time, group))  # who leaves at the time another comes has left
        group, time, change, vehicle = group[order], time[order], change[order], vehicle[order]
        change_m = change * self._needed_m[vehicle]
        count = pd.Series(change).groupby(group).cumsum().to_numpy() + self._inside[group]
        metres = pd.Series(change_m).groupby(group).cumsum().to_numpy() + self._inside_m[group]
        full = (count > self._room[group]) & (metres > self._metres[group])
        clashes = [
            Clash(at_s, int(group[k]), int(vehicle[k]), -1, 0.0, _there(rows, out_s, group[k], at_s))
            for k, at_s in ((k, float(time[k])) for k in np.flatnonzero((change > 0) & full))
        ]
        np.add.at(self._inside, group, change)
        np.add.at(self._inside_m, group, change_m)
        return clashes

    def _meetings(self, rows: Passages, fresh: Flags, out_s: Floats) -> list[Clash]:
        pairs = ~self._is_place[rows.group]
        rows, fresh, out_s = rows.where(pairs), fresh[pairs], out_s[pairs]
        order = np.lexsort((rows.time_s, rows.group))
        group, side = rows.group[order], rows.side[order]
        time, vehicle, fresh, out = rows.time_s[order], rows.vehicle[order], fresh[order], out_s[order]
        last_s = np.full(len(order), -np.inf)
        last_by = np.full(len(order), -1, dtype=np.int64)
        for one in (0, 1):  # for the rows of the other side: when the last of this side left
            theirs = np.where(side == one, out, -np.inf)
            latest, by = _running_max(group, theirs)
            earlier = self._left_s[one][group] > latest
            latest = np.where(earlier, self._left_s[one][group], latest)
            by = np.where(earlier, self._left_by[one][group], np.where(by >= 0, vehicle[by], -1))
            last_s = np.where(side == one, last_s, latest)
            last_by = np.where(side == one, last_by, by)
        met = fresh & (last_by >= 0) & (last_by != vehicle)
        margin = np.where(met, time - last_s, np.inf)
        for kind, mine in (("crossing", ~self._is_drawn[group]), ("drawn", self._is_drawn[group])):
            self.margins[kind].add(margin[met & mine])
        self._remember(group, side, vehicle, out)
        return [
            Clash(float(time[k]), int(group[k]), int(vehicle[k]), int(last_by[k]), float(-margin[k]))
            for k in np.flatnonzero(margin < 0.0)
        ]

    def _remember(self, group: Ints, side: Ints, vehicle: Ints, out_s: Floats) -> None:
        closed = np.flatnonzero(~np.isinf(out_s))
        closed = closed[np.argsort(out_s[closed], kind="stable")]  # the latest is written last
        later = out_s[closed] >= self._left_s[side[closed], group[closed]]
        closed = closed[later]
        self._left_s[side[closed], group[closed]] = out_s[closed]
        self._left_by[side[closed], group[closed]] = vehicle[closed]


def _there(rows: Passages, out_s: Floats, group: int, at_s: float) -> tuple[int, ...]:
    """Return the vehicles that are in a place at a time."""
    inside = (rows.group == group) & (rows.time_s <= at_s) & (out_s > at_s)
    return tuple(rows.vehicle[inside].tolist())


def _match(key: Ints, left: Passages) -> Floats:
    """Return, for each key, the time at which its passage ended [s]; infinity if it has not ended."""
    out = np.full(len(key), np.inf)
    if not len(left):
        return out
    order = np.argsort(left.key, kind="stable")
    sorted_keys = left.key[order]
    at = np.minimum(np.searchsorted(sorted_keys, key), len(sorted_keys) - 1)
    found = sorted_keys[at] == key
    out[found] = left.time_s[order][at[found]]
    return out


def _running_max(group: Ints, values: Floats) -> tuple[Floats, Ints]:
    """Return the greatest value so far within each group of the sorted rows, and its row; -1 for none."""
    if not len(group):
        return values, np.zeros(0, dtype=np.int64)
    top = np.asarray(pd.Series(values).groupby(group, sort=False).cummax(), dtype=np.float64)
    holds = np.where((values == top) & (values > -np.inf), np.arange(len(values)), -1)
    row = np.maximum.accumulate(holds)
    first = np.flatnonzero(np.concatenate(([True], group[1:] != group[:-1])))
    start = np.repeat(first, np.diff(np.append(first, len(group))))
    return top, np.asarray(np.where(row >= start, row, -1), dtype=np.int64)
