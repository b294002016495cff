"""One vehicle under way: what it holds, and whether it is held."""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

from loopgate.simulation.fleet import NOWHERE
from loopgate.simulation.sensing import must_ask
from loopgate.simulation.track import Track
from loopgate.traffic.base import Dynamics

__all__ = ["Driver", "Joint"]


class Joint(NamedTuple):
    """Where one leg ends and the next begins, along the way [m], and the number of the grant of the next."""

    end_m: float
    begin_m: float
    grant: int


class Driver:
    """The grants of one vehicle along its endless way.

    Leg ``j`` of the way is position ``j % n`` of the path in lap ``j // n``. The vehicle holds the legs
    ``tail`` to ``granted``, and the crossings behind the legs ``crossed`` to ``granted - 1``.

    Parameters
    ----------
    robot
        Its number in the system, and in the fleet.
    track
        Its loop.
    """

    def __init__(self, robot: int, track: Track) -> None:
        self.robot = robot
        self.track = track
        self.id = track.vehicle
        self.legs = len(track.states)
        start = track.start_m
        if self.legs:
            while start > track.ends_m[track.start_position] + 1e-6:
                start -= track.lap_m
            while start < track.begins_m[track.start_position] - 1e-6:
                start += track.lap_m
        self.start_m = start
        self.granted = track.start_position
        self.tail = track.start_position
        self.crossed = track.start_position
        self.line_m = self.end_m(self.granted)
        """Where the last granted leg ends [m]."""
        self.behind: deque[Joint] = deque()
        """Between the legs `crossed` to `granted`: where each ends and the next begins."""
        self.held = False
        self.halted_since: float | None = None
        self.stops = 0
        self.asked_s: float | None = None
        self.hold_s = 0.0
        self.longest_wait_s = 0.0
        self.measured_from_m = start
        self.laps_before = 0
        self.drives_like(Dynamics(0.0, 1.0, 1.0, 1.0), 1.0)

    def drives_like(self, dynamics: Dynamics, step_s: float) -> None:
        """Take over what the vehicle can do, and the length of a simulation step [s]."""
        self.length = dynamics.length_m
        self.accel = dynamics.accel_mps2
        self.decel = dynamics.decel_mps2
        self.top = self.track.top_speed_mps * max(1.0, dynamics.speed_factor)
        self._step_s = step_s

    def measure_from(self, front_m: float, laps: int, now_s: float) -> None:
        """Forget what was counted so far."""
        self.laps_before = laps
        self.hold_s = 0.0
        self.longest_wait_s = 0.0
        self.measured_from_m = front_m
        if self.halted_since is not None:
            self.halted_since = now_s

    def total_hold_s(self, now_s: float) -> float:
        """Return the hold time until now, a hold under way included [s]."""
        return self.hold_s + (now_s - self.halted_since if self.halted_since is not None else 0.0)

    def worst_wait_s(self, now_s: float) -> float:
        """Return the longest time from asking to being granted, a wait under way included [s]."""
        return max(self.longest_wait_s, now_s - self.asked_s if self.asked_s is not None else 0.0)

    def grant(self, number: int) -> None:
        """Go on to the next leg; grants of all vehicles are numbered in their order."""
        self.granted += 1
        self.behind.append(Joint(self.line_m, self.begin_m(self.granted), number))
        self.line_m = self.end_m(self.granted)

    def rear_leaves(self, rear_m: float) -> bool:
        """Let the rear at `rear_m` leave the leg `tail`; return whether it is out of it."""
        if self.tail == self.granted or rear_m < self.behind[self.tail - self.crossed].end_m:
            return False
        self.tail += 1
        return True

    def rear_clears(self, rear_m: float) -> bool:
        """Let the rear at `rear_m` clear the crossings behind the leg `crossed`; return whether it has."""
        if self.crossed == self.tail or rear_m < self.behind[0].begin_m:
            return False
        self.crossed += 1
        self.behind.popleft()
        return True

    def end_m(self, leg: int) -> float:
        """Return where leg `leg` of the way ends [m]; infinity where there are no legs."""
        if self.legs <= 1:
            return NOWHERE
        lap, position = divmod(leg, self.legs)
        return lap * self.track.lap_m + self.track.ends_m[position]

    def begin_m(self, leg: int) -> float:
        """Return where leg `leg` of the way begins [m]."""
        lap, position = divmod(leg, self.legs)
        return lap * self.track.lap_m + self.track.begins_m[position]

    def position(self, leg: int) -> int:
        """Return the position on the path of leg `leg`."""
        return leg % self.legs

    def must_ask(self, left_m: float, speed: float) -> bool:
        """Return whether the next step could take it past the point where it must brake."""
        return must_ask(left_m, speed, self.top, self.accel, self.decel, self._step_s)
