"""Parks vehicles beside the road while their road is blocked and no path leads round."""

from __future__ import annotations

from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from typing import Any

from loopgate.control.diary import Diary
from loopgate.control.motion import STANDING_MPS
from loopgate.errors import TrafficError
from loopgate.network.stops import Stop
from loopgate.results.columns import Event
from loopgate.results.recorder import Recorder
from loopgate.simulation.leading import Leading
from loopgate.traffic.base import Traffic

NO_WAY = "no way round"
"""The reason why a vehicle leaves the road."""

_FOR_EVER_S = 1e7
_SOON_STEPS = 3

_ROUNDING_M = 0.1

_SPAN_M = 1.0
"""Length of the stop that lets a vehicle park [m]."""


@dataclass(slots=True)
class Beside:
    """A vehicle that has left the road: its place, the next place, and the times off the road [s]."""

    vehicle: str
    place: str
    ahead: str
    from_s: float
    to_s: float | None = None
    parked: bool = False
    called: bool = False

    def figures(self) -> dict[str, Any]:
        """Return the vehicle, its place and its times off the road for ``summary.json``."""
        return {"vehicle": self.vehicle, "place": self.place, "from_s": self.from_s, "to_s": self.to_s}


class Roadside:
    """Parks vehicles beside the road where they stand, and calls them back.

    A vehicle beside the road holds no slot, so other vehicles pass it. It returns like any parked vehicle.
    """

    def __init__(self, traffic: Traffic, leading: Leading, recorder: Recorder) -> None:
        self._traffic, self._leading, self._recorder = traffic, leading, recorder
        self._out: dict[str, Beside] = {}
        self._every: list[Beside] = []

    def take(self, diary: Diary) -> None:
        """Let a vehicle leave the road, if it stands and holds its place only."""
        vehicle, traffic = diary.vehicle.name, self._traffic
        if vehicle in self._out or not self._leading.sets_aside or not diary.vehicle.is_settled():
            return
        lane, at_m = traffic.lane(vehicle)
        if diary.vehicle.speed > STANDING_MPS or not lane or lane.startswith(":"):
            return
        place, ahead = (diary.drawn(diary.vehicle.granted + n).state for n in (0, 1))
        self._leading.wait_for_nothing(vehicle)
        try:
            traffic.set_stop(vehicle, _stop(lane, at_m, diary.vehicle.left_m()))
        except TrafficError:
            self._leading.wait_again(vehicle)
            return
        self._out[vehicle] = Beside(vehicle, place, ahead, traffic.now_s)

    def look(self, avoided: AbstractSet[str]) -> None:
        """Record which vehicles have parked or are back; call back vehicles whose places are free.

        `avoided`: the blocked places.
        """
        if not self._out:
            return
        now, there = self._traffic.now_s, set(self._traffic.vehicles())
        coming = {one.place for one in self._out.values() if one.called}
        for one in list(self._out.values()):
            if one.vehicle not in there:
                self._over(one, now)
            elif not one.parked:
                self._note_parked(one)
            elif one.called and self._traffic.lane(one.vehicle)[0]:
                self._over(one, now)
            elif not one.called and avoided.isdisjoint((one.place, one.ahead)) and one.place not in coming:
                coming.add(one.place)  # one at a time: vehicles may have parked side by side
                self.call_back(one.vehicle)

    def call_back(self, vehicle: str) -> None:
        """Let a parked vehicle return as soon as possible."""
        one = self._out.get(vehicle)
        if one is None or one.called:
            return
        one.called = True
        if vehicle in self._leading.diaries:
            self._leading.call_back(vehicle)
        if self._traffic.parks(vehicle):
            self._traffic.stay(vehicle, _SOON_STEPS * self._traffic.step_s)

    def _note_parked(self, one: Beside) -> None:
        known = one.vehicle in self._leading.diaries
        if not self._traffic.parks(one.vehicle):
            return
        one.parked = not known or self._leading.step_aside(one.vehicle, NO_WAY)
        if not known:
            self._recorder.note(self._traffic.now_s, one.vehicle, Event.PARK, one.place, NO_WAY)
        if one.parked:
            self._every.append(one)

    def _over(self, one: Beside, now: float) -> None:
        one.to_s = now
        del self._out[one.vehicle]

    def report(self) -> list[dict[str, Any]]:
        """Return the vehicles that left the road, in the order of time, for ``summary.json``."""
        return [one.figures() for one in self._every]


def _stop(lane: str, at_m: float, left_m: float) -> Stop:
    """Return a stop beside the lane where a vehicle stands, `left_m` before the end of its place.

    SUMO removes a vehicle that returns to the road beyond the end of its lane.
    """
    end_m = at_m + min(_ROUNDING_M, max(left_m, 0.0))
    return Stop(NO_WAY, "lane", lane, max(0.0, at_m - _SPAN_M), end_m, _FOR_EVER_S, parks=True)
