"""One vehicle under way: where it is, what it holds, and when to look at it again."""

from __future__ import annotations

import math
from bisect import bisect_right

from loopgate.simulation.track import Track
from loopgate.traffic.base import Dynamics

__all__ = ["Driver"]

_MARGIN_M = 1.0
"""Room kept beyond the braking distance when a stop is set [m]."""

_TOLERANCE_M = 0.5
"""Rounding allowed before a front beyond its leg counts as one [m]; stop lines keep more than this clear."""

_ROUNDING = 1e-6
"""Share of a step that a time may be longer by rounding."""

_REACTION_S = 1.0
"""Headway that SUMO adds to the braking distance before it accepts a stop: tau of its default model [s]."""

NOWHERE = math.inf


class Driver:
    """The progress of one vehicle along its endless way.

    Arc length is unwrapped: it grows by `Track.lap_m` per lap. Leg ``j`` of the way is position ``j % n``
    of the path in lap ``j // n``. The vehicle holds the legs ``tail`` to ``granted``.

    Parameters
    ----------
    robot
        Its number in the system (and in the run).
    track
        Its loop.
    """

    def __init__(self, robot: int, track: Track) -> None:
        self.robot = robot
        self.track = track
        self.id = track.vehicle
        self._legs = len(track.states)
        start = track.start_m
        if self._legs:
            while start > track.ends_m[track.start_position] + 1e-6:
                start -= track.lap_m
            while start < track.begins_m[track.start_position] - 1e-6:
                start += track.lap_m
        self.start_m = start
        self.front_m = start
        self.offset_m = start
        self.speed = 0.0
        self.granted = track.start_position
        self.tail = track.start_position
        self.crossed = track.start_position
        self.entered = track.start_position
        self.next_lap_m = start + track.lap_m
        self._edge = bisect_right([begin for begin, _ in track.edges], start % track.lap_m)
        self._edge_lap = math.floor(start / track.lap_m) * track.lap_m
        self.due_step = -1
        self.seen_step = -1
        self.trespassing = False
        self.held = False
        self.halted_since: float | None = None
        self.asked_s: float | None = None
        self.laps = 0
        self.hold_s = 0.0
        self.longest_wait_s = 0.0
        self.measured_from_m = start
        self.drives_like(Dynamics(0.0, 1.0, 1.0, 1.0), 1.0)

    def odometer_reads(self, odometer_m: float) -> None:
        """Take note of what the odometer reads [m] while the vehicle stands at its start."""
        self.offset_m = self.start_m - odometer_m

    def drives_like(self, dynamics: Dynamics, step_s: float) -> None:
        """Take over what the vehicle can do, and the length of a simulation step [s]."""
        self.length = dynamics.length_m
        self.accel = a = dynamics.accel_mps2
        self.decel = b = dynamics.decel_mps2
        self.top = self.track.top_speed_mps * max(1.0, dynamics.speed_factor)
        self._step_s = step_s
        self._reaction_s = max(step_s, _REACTION_S)
        # For `_earliest_ask_s`, which is asked at every look.
        self._cruising_m = self.top * step_s + self.braking_m(self.top) + _MARGIN_M
        self._ahead_s = step_s + self._reaction_s
        self._linear_s = self._ahead_s + step_s / 2
        self._quadratic = a / 2 + a * a / (2 * b)
        self.aim()

    def aim(self) -> None:
        """Look up where the next thing to note is, and the stop line; call when any of them has changed."""
        target = min(self.next_lap_m, self.next_edge()[0])
        self.line_m = NOWHERE
        if self._legs > 1:
            self.line_m = self.end_m(self.granted)
            if self.entered < self.granted:
                target = min(target, self.begin_m(self.entered + 1))
            if self.tail < self.granted:
                target = min(target, self.end_m(self.tail) + self.length)
            if self.crossed < self.granted:
                target = min(target, self.begin_m(self.crossed + 1) + self.length)
        self.note_m = target

    def measure_from(self, front_m: float, now_s: float) -> None:
        """Forget what was counted so far."""
        self.laps = 0
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

    def end_m(self, leg: int) -> float:
        """Return where leg `leg` of the way ends [m]; infinity where there are no legs."""
        if self._legs <= 1:
            return NOWHERE
        lap, position = divmod(leg, self._legs)
        return lap * self.track.lap_m + self.track.ends_m[position]

    def begin_m(self, leg: int) -> float:
        """Return where leg `leg` of the way begins [m]."""
        lap, position = divmod(leg, self._legs)
        return lap * self.track.lap_m + self.track.begins_m[position]

    def position(self, leg: int) -> int:
        """Return the position on the path of leg `leg`."""
        return leg % self._legs

    def edge(self) -> str:
        """Return the edge the vehicle is on, or has left last."""
        return self.track.edges[self._edge - 1][1]

    def next_edge(self) -> tuple[float, str]:
        """Return where the next edge begins [m], and its name."""
        edges = self.track.edges
        if self._edge >= len(edges):
            self._edge = 0
            self._edge_lap += self.track.lap_m
        begin, name = edges[self._edge]
        return self._edge_lap + begin, name

    def pass_edge(self) -> None:
        """Take note that the next edge has been entered."""
        self._edge += 1

    def trespasses(self) -> bool:
        """Return whether the front is past the last granted leg: no gate let it in there."""
        return self.front_m > self.line_m + _TOLERANCE_M

    def must_ask(self) -> bool:
        """Return whether the next step could take the vehicle past the point where it must brake."""
        fast = min(self.top, self.speed + self.accel * self._step_s)
        needed = fast * self._step_s + self.braking_m(fast) + _MARGIN_M
        return self.line_m - self.front_m < needed

    def may_brake(self) -> bool:
        """Return whether the vehicle can still stop before the end of its last granted leg."""
        return self.line_m - self.front_m >= self.braking_m(self.speed) - self.speed * self._reaction_s

    def quiet_steps(self, *, asking: bool) -> int:
        """Return in how many steps, at the earliest, anything about the vehicle is to be noted.

        Parameters
        ----------
        asking
            Whether the point where it must ask counts.
        """
        # SUMO's Euler update drives a whole step at the speed it ends with: half a step's gain more.
        a, distance = self.accel, self.note_m - self.front_m
        v = self.speed + a * self._step_s / 2
        wait = 0.0
        if distance > 0:
            wait = max((math.sqrt(v * v + 2 * a * distance) - v) / a, distance / self.top)
        if asking:
            wait = min(wait, self._earliest_ask_s())
        return max(1, math.ceil(wait / self._step_s - _ROUNDING))

    def braking_m(self, speed: float) -> float:
        """Return the braking distance from `speed` [m], SUMO's reaction time included.

        It is that of SUMO's Euler update: a step at each speed on the way down to zero.
        """
        step_s = self._step_s
        loss = self.decel * step_s
        steps = int(speed / loss)
        return step_s * (steps * speed - loss * steps * (steps + 1) / 2) + speed * self._reaction_s

    def _earliest_ask_s(self) -> float:
        """Return a lower bound of the time until `must_ask`.

        Two bounds: the vehicle does not exceed its top speed; and it does not accelerate harder than it
        can, so that after t the braking distance from v + at has to fit into what is left.
        """
        a, b, distance = self.accel, self.decel, self.line_m - self.front_m
        u = self.speed + a * self._step_s
        # x(t) + u(t) * ahead + u(t)^2 / 2b + margin = distance, with u(t) = u + at and, by the Euler update,
        # x(t) = (v + a * step / 2) t + at^2/2 at whole steps.
        constant = self._ahead_s * u + u * u / (2 * b) + _MARGIN_M - distance
        if constant >= 0:
            return 0.0
        linear = self.speed + self._linear_s * a + u * a / b
        pushing = (math.sqrt(linear * linear - 4 * self._quadratic * constant) - linear) / (
            2 * self._quadratic
        )
        return max((distance - self._cruising_m) / self.top, pushing)
