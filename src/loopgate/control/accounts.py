"""Counters of vehicles since the measured time began: distance, laps, hold time and standing time."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import Final

from loopgate.control.diary import LEAP_MPS, Diary, Seen
from loopgate.control.motion import STANDING_MPS
from loopgate.traffic.base import Traffic


class Account:
    """The counters of one vehicle.

    `leapt_m`: the leaps of its odometer, which are not driven [m]. `halted_s`: since when it stands at the
    stop line where it is held [s]; infinite if it does not.
    """

    def __init__(self, diary: Diary) -> None:
        self.diary = diary
        self.vehicle: Final = diary.vehicle
        self.leapt_m = 0.0
        self.halted_s = inf
        self._held_s = 0.0
        self._from_m = diary.vehicle.front_m
        self._laps_before = 0

    @property
    def laps(self) -> int:
        """Number of laps since the measured time began."""
        return self.diary.laps - self._laps_before

    @property
    def stood_s(self) -> float:
        """How long it has stood, anywhere [s]."""
        return self.vehicle.stood_s

    @property
    def distance_m(self) -> float:
        """Distance since the measured time began [m]."""
        return self.vehicle.front_m - self._from_m - self.leapt_m

    def total_hold_s(self, now_s: float) -> float:
        """Return the hold time until now [s]."""
        return self._held_s + max(0.0, now_s - self.halted_s)

    def worst_wait_s(self, now_s: float) -> float:
        """Return the longest wait from a request to its grant [s]; a wait that still lasts counts."""
        waits = self.vehicle.asks and not self.vehicle.stops_here()
        return max(self.vehicle.longest_s, now_s - self.vehicle.since_s if waits else 0.0)

    def turns_off(self, diary: Diary, by_m: float) -> None:
        """Note that the vehicle changes to another path, where arc lengths are `by_m` larger."""
        self.diary = diary
        self._from_m += by_m

    def goes_on(self, now_s: float) -> bool:
        """Note that the vehicle is no longer held; return whether it stood at its stop line."""
        halted = self.halted_s < inf
        self._held_s = self.total_hold_s(now_s)
        self.halted_s = inf
        return halted

    def measure_from_now(self, now_s: float) -> None:
        """Begin the measured time: set the counters to zero."""
        self._from_m, self._laps_before = self.vehicle.front_m, self.diary.laps
        self._held_s = self.leapt_m = self.vehicle.longest_s = 0.0
        self.halted_s = max(self.halted_s, now_s)  # stays infinite for a vehicle that is not held


class Accounts:
    """The counters of all vehicles on the road, and their sums.

    `of`: by name of the vehicle. `stood_s`: how long vehicles have stood on each edge since `counts_from_s`
    [s]. `leaps`: vehicle, time [s] and length [m] of each leap of an odometer.
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
        """Laps of vehicles that have left, and laps that `take_flow` has returned so far."""

    def open(self, diary: Diary) -> Account:
        """Begin to count for a vehicle that has come."""
        account = self.of[diary.vehicle.name] = Account(diary)
        return account

    def close(self, account: Account) -> None:
        """End the account of a vehicle that has left."""
        del self.of[account.vehicle.name]
        self._laps += account.diary.laps

    def look(self, seen: Seen, there: int, driven_m: float) -> None:
        """Count one step, in which the first `there` vehicles came `driven_m` [m] in all."""
        self._steps += 1
        self._driven_m += driven_m
        for diary, moved_m in seen.fast:
            if moved_m > (diary.vehicle.make.top + LEAP_MPS) * self._traffic.step_s:
                self._note_leap(diary, moved_m, self._traffic.now_s)
        # A vehicle does not move in the step in which it departs.
        standing = [diary for diary in seen.still if diary.vehicle.row < there]
        self._stand(standing, self._traffic.step_s, self._traffic.now_s)

    def _stand(self, diaries: Sequence[Diary], step_s: float, now_s: float) -> None:
        self._standing += len(diaries)
        if now_s >= self.counts_from_s:
            stood_s = self.stood_s
            for diary in diaries:
                diary.vehicle.stood_s += step_s
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
        """Return the number of vehicles and the flow since the last call.

        The flow is the mean number of vehicles that stood, the distance of all vehicles [m], and their laps.
        """
        laps = self._laps + sum(account.diary.laps for account in self.of.values())
        told = len(self.of), self._standing / self._steps, self._driven_m, laps - self._told_laps
        self._steps = self._standing = 0
        self._driven_m = 0.0
        self._told_laps = laps
        return told
