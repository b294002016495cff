"""Keeps vehicles on the lanes of their loops, and makes them change lanes where their loop does.

A steered vehicle (`Vehicle.steered`) has guides ahead of it: points where it can wait at a stop that SUMO
knows. It makes no request meanwhile.

A vehicle changes lanes on a change stretch, once its rear has left the place before. If no gap opens, it
stands at the guide until one does. Since crossings exclude each other, the other vehicles on the stretch make
the same change or stay on the first lane. The vehicle holds a slot beyond the stretch, so the vehicles in its
way move up. It asks SUMO for the change only when no vehicle ahead of it has yet to make the same change, and
when the vehicle in the slot ahead of its own will be ahead of it by its full length after the next step too.
SUMO lets a vehicle drive before it changes lanes, and nobody slows it down on its old lane. Otherwise it
could overtake, and the line on the road would differ from the line in the ledger.

A stray, which SUMO has taken to a lane outside its loop, is led back in the same way. It keeps its slot
beside that lane. If no gap opens for a minute, it is put on its lane.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from contextlib import suppress
from math import inf
from typing import Final

from loopgate.abstraction.itinerary import Guide
from loopgate.control.diary import Diary, Row
from loopgate.control.part import Part
from loopgate.control.places import STANDING_MPS, Vehicle
from loopgate.errors import TrafficError
from loopgate.network.loop import LanePosition
from loopgate.results.columns import Event
from loopgate.traffic.base import Traffic

_AT_GUIDE_M: Final = 1.0
_LOOK_EVERY_S: Final = 10.0
"""Vehicles that stand are checked for strays in this interval [s]."""

_LONG_S: Final = 60.0
"""A stray is put on the lane of its loop after this time, if there is space [s]."""


class _Guides:
    """The guides ahead of a vehicle, counted from `from_m`, the end of the place before them [m].

    `astray_s`: since when the vehicle is led back to its lane [s]; infinite if it is not. `still`: whether it
    stands at a guide and waits for a gap.
    """

    def __init__(self, vehicle: Vehicle, from_m: float) -> None:
        self.vehicle: Final = vehicle
        self.from_m = from_m
        self.guides: deque[Guide] = deque()
        self.astray_s = inf
        self.still = False

    def past_m(self) -> float:
        """Return how far the front is beyond the point where the first guide becomes active [m]."""
        return self.vehicle.front_m - self.from_m - self.guides[0].from_m

    def is_due(self) -> bool:
        """Return whether the first guide is active.

        A vehicle that changes lanes must be past that point with its full length.
        """
        return self.past_m() >= (0.0 if self.guides[0].to_lane is None else self.vehicle.make.length_m)


class Steering(Part):
    """Sets the stops that keep vehicles on their lanes, and removes them in time."""

    def __init__(self, traffic: Traffic, rows: list[Row]) -> None:
        self._traffic, self._rows = traffic, rows
        self._ways: dict[Vehicle, _Guides] = {}
        self._look_s = 0.0
        self.strays = 0
        """Number of vehicles that were on a lane outside their loop."""

    def begin(self, vehicle: Vehicle, guides: Sequence[Guide], from_m: float) -> None:
        """Give a vehicle its guides: stops that keep it to its lanes after a place; the first is set in SUMO.

        While the vehicle is led back to its lane, the guides wait. `from_m`: where the place ends, as an arc
        length of the vehicle [m].
        """
        way = self._ways.get(vehicle)
        if way is not None:  # the vehicle got a grant while it was led back
            way.from_m = from_m
            way.guides.extend(guides)
        elif guides:
            way = self._ways[vehicle] = _Guides(vehicle, from_m)
            way.guides.extend(guides)
            self._set(way)

    def forget(self, vehicle: Vehicle) -> None:
        """Drop a vehicle that has left the ledger."""
        self._ways.pop(vehicle, None)

    def leads_back(self, vehicle: Vehicle) -> bool:
        """Return whether a vehicle is on its way back to the lane of its loop."""
        way = self._ways.get(vehicle)
        return way is not None and way.astray_s < inf

    def renew(self, vehicle: Vehicle, edge: str) -> None:
        """Set the vehicle's stop again if it lies on the edge where SUMO has just renewed the route."""
        way = self._ways.get(vehicle)
        if way is not None and way.guides[0].edge == edge and not way.still:
            self._traffic.release(vehicle.name)
            self._set(way)

    def lead_back(self, vehicle: Vehicle, line: LanePosition) -> None:
        """Lead a vehicle back to the lane of a stop line on its edge."""
        way = self._ways.setdefault(vehicle, _Guides(vehicle, vehicle.front_m))
        if way.astray_s < inf:
            return
        way.astray_s = self._traffic.now_s
        vehicle.steered, vehicle.guide_m = True, -inf
        self.strays += 1
        on = self._traffic.lane_index(vehicle.name)
        self._rows.append((way.astray_s, vehicle.name, Event.STRAY, f"{line.edge}_{on}", ""))
        way.guides.appendleft(Guide(line.edge, on, line.position_m, -inf, to_lane=line.lane))
        self._traffic.release(vehicle.name)
        try:
            self._traffic.hold(vehicle.name, line.edge, on, line.position_m)
        except TrafficError:  # too late to stop there
            self._traffic.brake(vehicle.name)

    def step(self) -> list[Vehicle]:
        """Remove guides that vehicles have passed, set the next; return vehicles without more guides."""
        done: list[Vehicle] = []
        for vehicle, way in list(self._ways.items()):
            if way.is_due() and self._reached(way):
                self._drop(way)
            if not way.guides:
                del self._ways[vehicle]
                vehicle.steered, vehicle.guide_m = False, inf
                done.append(vehicle)
        return done

    def look_for_strays(self, diaries: Sequence[Diary]) -> None:
        """Lead back each vehicle that stands on a wrong lane of its place, where its path may not go on."""
        if self._traffic.now_s < self._look_s:
            return
        self._look_s = self._traffic.now_s + _LOOK_EVERY_S
        for diary in diaries:
            vehicle = diary.vehicle
            if vehicle.speed >= STANDING_MPS or vehicle.held or vehicle.steered or not vehicle.bodies:
                continue
            body = vehicle.bodies[0]
            line = diary.drawn(vehicle.granted - len(vehicle.bodies) + 1).line
            lane, _ = self._traffic.lane(vehicle.name)
            beside = lane.startswith(f"{line.edge}_") and lane != f"{line.edge}_{line.lane}"
            if beside and body.begin_m <= vehicle.front_m <= body.out_m - vehicle.make.length_m:
                self.lead_back(vehicle, line)

    def _reached(self, way: _Guides) -> bool:
        """Return whether the first guide is done with; else let the vehicle change lanes if it may."""
        vehicle, guide = way.vehicle, way.guides[0]
        if guide.to_lane is not None:
            return self._has_changed(way, guide.edge, guide.to_lane)
        edge, _, on = self._traffic.lane(vehicle.name)[0].rpartition("_")
        if edge != guide.edge:  # the vehicle is not there yet, or has passed it in one step
            return way.past_m() > guide.position_m
        if int(on) != guide.lane:
            way.guides.popleft()
            self.lead_back(vehicle, LanePosition(guide.edge, guide.lane, guide.position_m))
            return False
        return True

    def _has_changed(self, way: _Guides, edge: str, lane: int) -> bool:
        """Return whether a vehicle is on the lane that it must change to; else ask SUMO for the change."""
        vehicle, astray, name = way.vehicle, way.astray_s < inf, way.vehicle.name
        if astray and self._traffic.lane(name)[0].rpartition("_")[0] != edge:
            return True  # its path went on from the wrong lane too
        if self._traffic.lane_index(name) == lane:
            return True
        at_guide = self._traffic.lane(name)[1] > way.guides[0].position_m - _AT_GUIDE_M
        if not way.still and vehicle.speed < STANDING_MPS and at_guide:
            way.still = True
            self._traffic.release(name)
            self._traffic.keep_to(name, 0.0)
        if self._traffic.now_s - way.astray_s >= _LONG_S:
            return self._traffic.put_on_lane(name, lane)
        if astray or _is_next(way, self._ways.values(), self._traffic.step_s):
            self._traffic.change_lane(name, lane)
        return False

    def _drop(self, way: _Guides) -> None:
        way.guides.popleft()
        way.astray_s = inf
        if way.still:
            way.still = False
            self._traffic.keep_to(way.vehicle.name, None)
        else:
            self._traffic.release(way.vehicle.name)
        if way.guides:
            self._set(way)

    def _set(self, way: _Guides) -> None:
        guide = way.guides[0]
        way.vehicle.guide_m = way.from_m + guide.stop_m
        with suppress(TrafficError):  # too late to stop there; `_reached` still checks the lane
            self._traffic.hold(way.vehicle.name, guide.edge, guide.lane, guide.position_m)


def _is_next(way: _Guides, ways: Iterable[_Guides], step_s: float) -> bool:
    """Return whether a vehicle may change lanes now: no vehicle before it must, and it overtakes none.

    It changes after the next step, of `step_s` [s]. In it, it may speed up, and the vehicle ahead brake.
    """
    vehicle, guide, past_m = way.vehicle, way.guides[0], way.past_m()
    change = guide.edge, guide.lane, guide.to_lane
    for other in ways:
        first = other.guides[0]
        same = (first.edge, first.lane, first.to_lane) == change and other.astray_s == inf
        if same and other.past_m() > past_m:
            return False
    body = vehicle.bodies[-1]
    at = body.place.bodies.index(body)
    if at == 0:
        return True
    ahead = body.place.bodies[at - 1]
    before, make = ahead.vehicle, vehicle.make
    least_mps = max(0.0, before.speed - before.make.decel * step_s)
    most_mps = 0.0 if way.still else vehicle.speed + make.accel * step_s
    gap_m = before.front_m - ahead.begin_m - before.make.length_m - (vehicle.front_m - body.begin_m)
    return gap_m + (least_mps - most_mps) * step_s >= 0.0
