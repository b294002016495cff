"""One vehicle under way, for Python: its track, and what its row of the table says."""

from __future__ import annotations

import math
from typing import cast

import numpy as np

from loopgate.abstraction.itinerary import Leg
from loopgate.abstraction.track import Track
from loopgate.drive.tables import Tables
from loopgate.traffic.base import Dynamics

__all__ = ["Driver"]


class Driver:
    """A vehicle on its track. Where it is and what it was granted is in the tables, and only there.

    Parameters
    ----------
    robot
        Its number in the system, and its row.
    track
        Its loop.
    tables
        Those of the drive.
    """

    def __init__(self, robot: int, track: Track, tables: Tables) -> None:
        self.id = track.vehicle
        self.stops = 0
        """Stops made since the simulator last forgot them."""
        self._measured_from_m = track.front_m
        self._laps_before = 0
        self.leapt_m = 0.0
        """By how much its odometer has leapt since the warm-up [m]: none of that is driven."""
        self.track = track
        self.goes_on(robot, tables)

    def goes_on(self, robot: int, tables: Tables) -> None:
        """Take over another number and row."""
        self.robot = robot
        self.row = cast("np.void", tables.vehicles[robot])
        """Its row, to be read and set by column."""

    def drives_like(self, dynamics: Dynamics, step_s: float = 0.0) -> None:
        """Take over what the vehicle can do; one that is told to drive beyond any limit goes on so."""
        row = self.row
        row["length_m"] = dynamics.length_m
        row["accel"] = dynamics.accel_mps2
        row["decel"] = dynamics.decel_mps2
        row["haste"] = max(1.0, dynamics.speed_factor)
        row["top"] = self.track.top_speed_mps * row["haste"]
        if step_s and row["speed"] > row["top"]:
            row["top"] = row["speed"] + row["accel"] * step_s

    @property
    def front_m(self) -> float:
        """Where its front was after the last step, in arc length that grows from lap to lap [m]."""
        return float(self.row["front"])

    @property
    def odometer_m(self) -> float:
        """What its odometer read after the last step [m]."""
        return float(self.row["front"] - self.row["offset"])

    @property
    def speed_mps(self) -> float:
        """Its speed in the last step [m/s]."""
        return float(self.row["speed"])

    @property
    def length_m(self) -> float:
        """Its length [m]."""
        return float(self.row["length_m"])

    @property
    def decel_mps2(self) -> float:
        """Its deceleration [m/s2]."""
        return float(self.row["decel"])

    @property
    def offset_m(self) -> float:
        """How much more its arc length is than what its odometer reads [m]."""
        return float(self.row["offset"])

    @property
    def stop_m(self) -> float:
        """Where it stops next by itself [m]; infinity if it does not."""
        return float(self.row["stop_m"])

    @property
    def halted(self) -> bool:
        """Whether it stands at the line at which it is held."""
        return not math.isnan(self.row["halted_s"])

    @property
    def top_mps(self) -> float:
        """Its top speed on its loop [m/s]."""
        return float(self.row["top"])

    @property
    def accel_mps2(self) -> float:
        """Its acceleration [m/s2]."""
        return float(self.row["accel"])

    @property
    def line_m(self) -> float:
        """Where the last granted leg ends [m]."""
        return float(self.row["line_m"])

    @property
    def granted(self) -> int:
        """The last granted leg."""
        return int(self.row["granted"])

    @property
    def held(self) -> range:
        """The legs whose states it holds."""
        return range(int(self.row["tail"]), self.granted + 1)

    @property
    def crossed(self) -> range:
        """The legs behind whose lines its rear is not yet over the junction."""
        return range(int(self.row["crossed"]), self.granted)

    @property
    def settled(self) -> bool:
        """Whether it is in one place, and holds nothing else."""
        row = self.row
        return bool(row["tail"] == row["crossed"] == row["granted"] == row["entered"])

    @property
    def stops_here(self) -> bool:
        """Whether it is to stop before it gets to the end of its last grant, or does."""
        return bool(self.row["stop_m"] < self.end_m(self.granted))

    @property
    def parks_here(self) -> bool:
        """Whether it leaves its lane for that."""
        return bool(self.row["parks"]) and self.stops_here

    def leg(self, number: int) -> Leg:
        """Return a leg of its endless way."""
        return self.track.legs[number % len(self.track.legs)]

    def end_m(self, number: int) -> float:
        """Return where a leg of its endless way ends [m]; infinity where there is but one."""
        if len(self.track.legs) == 1:
            return math.inf
        return number // len(self.track.legs) * self.track.lap_m + self.leg(number).end_m

    def begin_m(self, number: int) -> float:
        """Return where a leg of its endless way begins [m]."""
        return number // len(self.track.legs) * self.track.lap_m + self.leg(number).begin_m

    def holds(self, state: str) -> bool:
        """Return whether it holds a state."""
        return any(self.leg(n).state == state for n in self.held)

    def inside_m(self, state: str) -> float:
        """Return how far its front is behind the beginning of a state that it holds, the nearest time [m]."""
        return min(self.front_m - self.begin_m(n) for n in self.held if self.leg(n).state == state)

    def left_m(self, state: str) -> float:
        """Return how far it is to the end of a state that it holds [m], the nearest time."""
        return min(self.end_m(n) - self.front_m for n in self.held if self.leg(n).state == state)

    def correct(self, front_m: float) -> None:
        """Take note that the front is elsewhere on the loop than the odometer said [m]."""
        self.row["offset"] += front_m - self.row["front"]
        self.row["front"] = front_m

    def turns_off(self, track: Track, by_m: float) -> None:
        """Go on by another way, on which arc lengths are so much more [m]."""
        self.track = track
        self._measured_from_m += by_m

    def skipped(self, distance_m: float) -> None:
        """Take note that it was moved ahead: that part of the lap is not driven [m]."""
        self.row["offset"] += distance_m
        self.row["next_lap_m"] += distance_m

    def measure_from_now(self, now_s: float) -> None:
        """Forget what was counted so far."""
        row = self.row
        self._measured_from_m, self._laps_before = self.front_m, int(row["laps"])
        self.leapt_m = 0.0
        row["hold_s"] = row["longest_s"] = 0.0
        if not math.isnan(row["halted_s"]):
            row["halted_s"] = now_s

    @property
    def laps(self) -> int:
        """Laps since the warm-up."""
        return int(self.row["laps"]) - self._laps_before

    @property
    def stood_s(self) -> float:
        """For how long it has stood, wherever that was, since the warm-up [s]."""
        return float(self.row["stood_s"])

    @property
    def distance_m(self) -> float:
        """The distance it has driven since the warm-up [m]."""
        return self.front_m - self._measured_from_m - self.leapt_m

    def total_hold_s(self, now_s: float) -> float:
        """Return the hold time until now, a hold under way included [s]."""
        halted_s = float(self.row["halted_s"])
        return float(self.row["hold_s"]) + (0.0 if math.isnan(halted_s) else now_s - halted_s)

    def worst_wait_s(self, now_s: float) -> float:
        """Return the longest time from asking to being granted, a wait under way included [s]."""
        waits = self.row["pending"] and not self.stops_here
        waiting_s = now_s - float(self.row["since_s"]) if waits else 0.0
        return max(float(self.row["longest_s"]), waiting_s)
