"""What vehicles have done since the measured time began: way, laps, time at gates, and time stood."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import Final

import numpy as np

from loopgate.arrays import Floats
from loopgate.control.diary import Diary
from loopgate.control.motion import STANDING_MPS
from loopgate.traffic.base import Traffic

_LEAP_MPS: Final = 5.0
"""An odometer that goes by so much faster than its vehicle can has leapt [m/s]."""


class Account:
    """What one vehicle has done.

    `stood_s`: for how long it has stood, wherever that was [s]. `leapt_m`: by how much its odometer has
    leapt: none of that is driven [m]. `halted_s`: since when it stands at its line; infinite if it does not.
    """

    def __init__(self, diary: Diary) -> None:
        self.diary = diary
        self.vehicle: Final = diary.vehicle
        self.stood_s = self.leapt_m = 0.0
        self.halted_s = inf
        self._held_s = 0.0
        self._from_m = diary.vehicle.front_m
        self._laps_before = 0

    @property
    def laps(self) -> int:
        """Laps."""
        return self.diary.laps - self._laps_before

    @property
    def distance_m(self) -> float:
        """Distance [m]."""
        return self.vehicle.front_m - self._from_m - self.leapt_m

    def total_hold_s(self, now_s: float) -> float:
        """Return the time at gates until now [s]."""
        return self._held_s + max(0.0, now_s - self.halted_s)

    def worst_wait_s(self, now_s: float) -> float:
        """Return the longest time from asking to being granted, a wait under way included [s]."""
        waits = self.vehicle.asks and not self.vehicle.stops_here()
        return max(self.vehicle.longest_s, now_s - self.vehicle.since_s if waits else 0.0)

    def turns_off(self, diary: Diary, by_m: float) -> None:
        """Note that the vehicle goes on by another way, on which arc lengths are so much more [m]."""
        self.diary = diary
        self._from_m += by_m

    def goes_on(self, now_s: float) -> bool:
        """Note that the vehicle is held no longer; return whether it stood at its line."""
        halted = self.halted_s < inf
        self._held_s = self.total_hold_s(now_s)
        self.halted_s = inf
        return halted

    def measure_from_now(self, now_s: float) -> None:
        """Forget what was counted so far."""
        self._from_m, self._laps_before = self.vehicle.front_m, self.diary.laps
        self._held_s = self.leapt_m = self.vehicle.longest_s = 0.0
        self.halted_s = max(self.halted_s, now_s)  # infinite if it does not stand


class Accounts:
    """The accounts of all vehicles on the road, and figures of all of them together.

    `of`: by name. `stood_s`: for how long vehicles have stood on each edge, from `counts_from_s` on [s].
    `leaps`: whose odometers have leapt, when [s], and by how much [m].
    """

    def __init__(self, traffic: Traffic) -> None:
        self._traffic = traffic
        self.of: dict[str, Account] = {}
        self.stood_s: dict[str, float] = {}
        self.counts_from_s = 0.0
        self.leaps: list[tuple[str, float, float]] = []
        self._steps = self._standing = 0
        self._driven_m = 0.0
        self._laps = self._told_laps = 0
        """Laps of vehicles that have left, and all that have been told of."""

    def open(self, diary: Diary) -> Account:
        """Open an account for a vehicle that has come."""
        account = self.of[diary.vehicle.name] = Account(diary)
        return account

    def close(self, account: Account) -> None:
        """Take note that a vehicle has left."""
        del self.of[account.vehicle.name]
        self._laps += account.diary.laps

    def look(self, diaries: Sequence[Diary], moved_m: Floats, tops: Floats) -> None:
        """Count a step, in which vehicles moved so far [m]; `tops` are their top speeds [m/s]."""
        step_s, now_s = self._traffic.step_s, self._traffic.now_s
        self._steps += 1
        self._driven_m += float(moved_m.sum())
        for row in np.flatnonzero(moved_m > (tops + _LEAP_MPS) * step_s).tolist():
            self._note_leap(diaries[row], float(moved_m[row]), now_s)
        standing = np.flatnonzero(moved_m < STANDING_MPS * step_s).tolist()
        self._stand([diaries[row] for row in standing], step_s, now_s)

    def _stand(self, diaries: Sequence[Diary], step_s: float, now_s: float) -> None:
        self._standing += len(diaries)
        if now_s >= self.counts_from_s:
            of, stood_s = self.of, self.stood_s
            for diary in diaries:
                of[diary.vehicle.name].stood_s += step_s
                stood_s[diary.edge] = stood_s.get(diary.edge, 0.0) + step_s

    def _note_leap(self, diary: Diary, moved_m: float, now_s: float) -> None:
        name = diary.vehicle.name
        true_mps = self._traffic.speed(name)
        leap_m = moved_m - true_mps * self._traffic.step_s
        self.of[name].leapt_m += leap_m
        self._driven_m -= leap_m
        self.leaps.append((name, now_s, leap_m))
        if true_mps < STANDING_MPS:
            self._stand([diary], self._traffic.step_s, now_s)

    def take_flow(self) -> tuple[int, float, float, int]:
        """Return how many there are, and since the last call the mean number that stand, metres, and laps."""
        laps = self._laps + sum(account.diary.laps for account in self.of.values())
        told = len(self.of), self._standing / self._steps, self._driven_m, laps - self._told_laps
        self._steps = self._standing = 0
        self._driven_m = 0.0
        self._told_laps = laps
        return told
