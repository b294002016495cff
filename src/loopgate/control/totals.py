"""Sums over all vehicles: standing times, leaps of odometers, and the flow."""

from __future__ import annotations

from collections.abc import Sequence

from loopgate.control.diary import LEAP_MPS, Diary, Seen
from loopgate.control.motion import STANDING_MPS
from loopgate.traffic.base import Traffic


class Totals:
    """Sums over the vehicles on the road and the vehicles that have left.

    `stood_s`: how long vehicles have stood on each edge since `counts_from_s` [s]. `leaps`: vehicle, time [s]
    and length [m] of each leap of an odometer.
    """

    def __init__(self, traffic: Traffic) -> None:
        self._traffic = traffic
        self.stood_s: dict[str, float] = {}
        self.counts_from_s = 0.0
        self.leaps: list[tuple[str, float, float]] = []
        self._steps = self._standing = 0
        self._driven_m = 0.0
        self._laps = self._told_laps = 0
        """Laps of vehicles that have left, and laps that `take_flow` has returned so far."""

    def leaves(self, diary: Diary) -> None:
        """Keep the laps of a vehicle that leaves."""
        self._laps += diary.all_laps

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
                diary.stands(step_s, now_s)
                stood_s[diary.edge] = stood_s.get(diary.edge, 0.0) + step_s

    def _note_leap(self, diary: Diary, moved_m: float, now_s: float) -> None:
        name = diary.vehicle.name
        true_mps = self._traffic.speed(name)
        leap_m = moved_m - true_mps * self._traffic.step_s
        diary.leapt_m += leap_m
        self._driven_m -= leap_m
        self.leaps.append((name, now_s, leap_m))
        if true_mps < STANDING_MPS:
            self._stand([diary], self._traffic.step_s, now_s)

    def take_flow(self, diaries: Sequence[Diary]) -> tuple[int, float, float, int]:
        """Return the number of vehicles and the flow since the last call.

        The flow is the mean number of vehicles that stood, the distance of all vehicles [m], and their laps.
        """
        laps = self._laps + sum(diary.all_laps for diary in diaries)
        told = len(diaries), self._standing / max(1, self._steps), self._driven_m, laps - self._told_laps
        self._steps = self._standing = 0
        self._driven_m = 0.0
        self._told_laps = laps
        return told
