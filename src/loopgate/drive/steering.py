"""Keeps vehicles to the lanes of their loops where the simulator has a choice, and lets them change lanes."""

from __future__ import annotations

import contextlib
import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from loopgate.abstraction.itinerary import Guide
from loopgate.arrays import Floats
from loopgate.drive.driver import Driver
from loopgate.drive.sense import STANDING_MPS
from loopgate.errors import TrafficError
from loopgate.results.columns import Event
from loopgate.results.recorder import Recorder
from loopgate.traffic.base import Traffic

__all__ = ["Steering"]

_AT_GUIDE_M = 1.0

_LONG_S = 60.0
"""After this long beside the lane of its loop a vehicle is put there, if there is room [s]."""


@dataclass(slots=True)
class _Way:
    """The rest of a vehicle's way between two states: its guides, and where the first state ended [m]."""

    driver: Driver
    guides: deque[Guide]
    from_m: float
    still: bool = False
    stray_since_s: float | None = None

    def past_m(self, front_m: float) -> float:
        """Return how far a front is behind where the first guide is to be looked at [m]."""
        return front_m - self.from_m - self.guides[0].from_m

    def is_due(self, front_m: float) -> bool:
        """Return whether the vehicle, its front there, has come so far; to change lanes as a whole."""
        return self.past_m(front_m) >= (0.0 if self.guides[0].to_lane is None else self.driver.length_m)


class Steering:
    """Sets the stops, `Guide`, by which vehicles keep to their lanes, and drops them in time.

    While a vehicle is steered it does not ask for its next state: it can stop at each guide, and in the state
    it has been granted. A vehicle changes lanes in the stretch made for that, its rear out of the state
    before; if nobody lets it in, it stands at the guide until somebody does. By the exclusion of crossings
    there are only those on the stretch that make the same change, or stay on the lane that it leaves; and
    there is a slot for it beyond, so those that stand in its way there move up. It does not ask for that
    while another is before it that is to make the same change, nor before the vehicle whose slot is the one
    ahead of its own is ahead of it as a whole: else it could get past one that waits for a gap, and the line
    of the place beyond would be another on the road than in the books.

    A vehicle that SUMO has taken to another lane than its loop's is led back in the same way: it can stop at
    its line on the lane where it is, and changes lanes as soon as it can. It has a slot beside it, which the
    gate gave it. Where nobody lets it in for a minute it is put there.

    Parameters
    ----------
    traffic
        The running simulation.
    recorder
        Takes the events.
    ahead_of
        Returns who is right ahead of a vehicle in the state of its last grant, by the books, if anybody.
    """

    def __init__(
        self, traffic: Traffic, recorder: Recorder, ahead_of: Callable[[Driver], Driver | None]
    ) -> None:
        self._traffic = traffic
        self._recorder = recorder
        self._ahead_of = ahead_of
        self._ways: dict[str, _Way] = {}
        self.strays = 0
        """Vehicles that were on another lane than their loop's."""

    def begin(self, driver: Driver, granted: int) -> None:
        """Set the first guide of the way to the leg just granted, if it has any."""
        leg = granted - 1
        guides = driver.leg(leg).guides
        way = self._ways.get(driver.id)
        if way is not None:  # it was granted while it was led back
            way.from_m = driver.end_m(leg)
            way.guides.extend(guides)
        elif guides:
            self._ways[driver.id] = _Way(driver, deque(guides), driver.end_m(leg))
            self._set(driver, guides[0])

    def is_due(self, odometers: Floats) -> bool:
        """Return whether `step` may have to do anything, by what the odometers of all vehicles read [m]."""
        return any(
            way.is_due(float(odometers[way.driver.robot] + way.driver.row["offset"]))
            for way in self._ways.values()
        )

    def leads_back(self, driver: Driver) -> bool:
        """Return whether the vehicle is on its way back to the lane of its loop."""
        way = self._ways.get(driver.id)
        return way is not None and way.stray_since_s is not None

    def forget(self, vehicle: str) -> None:
        """Take note that the vehicle is under the gate no longer."""
        self._ways.pop(vehicle, None)

    def renew(self, driver: Driver) -> None:
        """Set a stop again on the edge on which SUMO has just renewed the route; see `Engine`."""
        way = self._ways.get(driver.id)
        if way is not None and way.guides[0].edge == driver.track.rerouted_on and not way.still:
            self._traffic.release(driver.id)
            self._set(driver, way.guides[0])

    def lead_back(self, driver: Driver, edge: str, lane: int, position_m: float) -> None:
        """Lead a vehicle back to `lane` of the edge that it is on; it can stop at a position on it [m]."""
        way = self._ways.get(driver.id)
        if way is None:
            way = self._ways[driver.id] = _Way(driver, deque(), driver.front_m)
        if way.stray_since_s is not None:
            return
        way.stray_since_s = self._traffic.now_s
        driver.row["steered"] = True
        on = self._traffic.lane_index(driver.id)
        self.strays += 1
        self._recorder.note(self._traffic.now_s, driver.id, Event.STRAY, f"{edge}_{on}")
        # Its way was longer or shorter than that of its loop, by which its odometer is read.
        at_m = self._traffic.lane(driver.id)[1]
        front_m = driver.track.near(edge, at_m, driver.front_m)
        driver.correct(front_m)
        way.guides.appendleft(Guide(edge, on, position_m, -math.inf, to_lane=lane))
        self._traffic.release(driver.id)
        try:
            self._traffic.hold(driver.id, edge, on, position_m)
        except TrafficError:  # too late to stop there
            self._traffic.brake(driver.id)

    def step(self) -> list[Driver]:
        """Move the steered vehicles on; return those that need it no longer."""
        done: list[Driver] = []
        for vehicle, way in list(self._ways.items()):
            if self._reached(way):
                self._drop(way)
            if not way.guides:
                del self._ways[vehicle]
                done.append(way.driver)
        return done

    def _reached(self, way: _Way) -> bool:
        """Return whether the first guide has done its work; else let the vehicle change lanes if it may."""
        driver, guide = way.driver, way.guides[0]
        if not way.is_due(driver.front_m):
            return False
        if guide.to_lane is not None:
            return self._changed(way, guide.edge, guide.to_lane)
        edge, _, on = self._traffic.lane(driver.id)[0].rpartition("_")
        if edge != guide.edge:  # not yet, with its front right where that begins, or past it in a single step
            return way.past_m(driver.front_m) > guide.position_m
        if int(on) == guide.lane:
            return True
        way.guides.popleft()
        self.lead_back(driver, guide.edge, guide.lane, guide.position_m)
        return False

    def _changed(self, way: _Way, edge: str, to_lane: int) -> bool:
        """Return whether the vehicle is on the lane that it is to change to; else ask for it."""
        driver, since_s = way.driver, way.stray_since_s
        if since_s is not None and self._traffic.lane(driver.id)[0].rpartition("_")[0] != edge:
            return True  # its way went on from where it was
        if self._traffic.lane_index(driver.id) == to_lane:
            return True
        standing = driver.speed_mps < STANDING_MPS
        if not way.still and standing and self._at(driver, way.guides[0]):
            way.still = True
            self._traffic.release(driver.id)
            self._traffic.keep_to(driver.id, 0.0)
        if since_s is not None and self._traffic.now_s - since_s >= _LONG_S:
            return self._traffic.put_on_lane(driver.id, to_lane)
        if since_s is not None or self._is_next(way):
            self._traffic.change_lane(driver.id, to_lane)
        return False

    def _is_next(self, way: _Way) -> bool:
        """Return whether nobody is before a vehicle that is to change lanes first, nor beside it."""
        driver = way.driver
        past_m, guide = way.past_m(driver.front_m), way.guides[0]
        for other in self._ways.values():
            first = other.guides[0]
            same = (first.edge, first.lane, first.to_lane) == (guide.edge, guide.lane, guide.to_lane)
            if same and other.stray_since_s is None and other.past_m(other.driver.front_m) > past_m:
                return False
        ahead = self._ahead_of(driver)
        state = driver.leg(driver.granted).state
        return ahead is None or ahead.inside_m(state) - ahead.length_m >= driver.inside_m(state)

    def _at(self, driver: Driver, guide: Guide) -> bool:
        # Only there is it clear of those that wait behind the stretch: further back they could block it.
        return self._traffic.lane(driver.id)[1] > guide.position_m - _AT_GUIDE_M

    def _drop(self, way: _Way) -> None:
        vehicle = way.driver.id
        way.guides.popleft()
        way.stray_since_s = None
        if way.still:
            way.still = False
            self._traffic.keep_to(vehicle, None)
        else:
            self._traffic.release(vehicle)
        if way.guides:
            self._set(way.driver, way.guides[0])

    def _set(self, driver: Driver, guide: Guide) -> None:
        # Where it is too late for that, the lane it gets to is looked at all the same.
        with contextlib.suppress(TrafficError):
            self._traffic.hold(driver.id, guide.edge, guide.lane, guide.position_m)
