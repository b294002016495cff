"""Drives vehicles on closed loops through the ledger: steps, reads, answers, holds and lets go."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import process_time
from typing import Final

import numpy as np

from loopgate.abstraction.itinerary import Leg as Drawn
from loopgate.arrays import Floats
from loopgate.control.layout import Layout
from loopgate.control.ledger import GRANTED, LEFT, REFUSED, Ledger
from loopgate.control.places import Leg, Make, Vehicle
from loopgate.results.columns import Event
from loopgate.traffic.base import Traffic

STANDING_MPS: Final = 0.1

Note = Callable[[float, str, Event, str, str], None]
"""Takes an event: time [s], vehicle, event, place, reason."""


@dataclass(frozen=True, slots=True)
class Way:
    """A vehicle's loop: its name, its length [m], its top speed [m/s], its legs, and where its edges begin.

    `position` and `front_m`: the leg in which the vehicle starts, and where its front is. `renewed_on`: the
    edge on which the simulator renews its route.
    """

    vehicle: str
    loop: str
    lap_m: float
    top: float
    legs: tuple[Drawn, ...]
    edges: tuple[tuple[float, str], ...]
    position: int
    front_m: float
    renewed_on: str


class _Diary:
    """Up to where the way of a vehicle has been noted: edges, laps and places that its front has come to."""

    def __init__(self, way: Way, vehicle: Vehicle) -> None:
        self.way, self.vehicle = way, vehicle
        self.laps = 0
        self.lap_m = way.front_m + way.lap_m
        self._edge, self._edge_laps = 0, 0
        while self.edge_m <= way.front_m:
            self._next_edge()
        self.entered = vehicle.granted

    @property
    def edge_m(self) -> float:
        """Where its next edge begins [m]."""
        return self._edge_laps * self.way.lap_m + self.way.edges[self._edge][0]

    @property
    def leg_m(self) -> float:
        """Where the next leg that it was granted begins [m]."""
        if self.entered >= self.vehicle.granted:
            return np.inf
        laps, leg = divmod(self.entered + 1, len(self.way.legs))
        return laps * self.way.lap_m + self.way.legs[leg].begin_m

    @property
    def due_m(self) -> float:
        """Where something is to be noted next [m]."""
        return min(self.edge_m, self.lap_m, self.leg_m)

    def pass_by(self, now_s: float, note: Note) -> bool:
        """Note what the front has passed; return whether the simulator renewed the route there."""
        name, front_m, renewed = self.way.vehicle, self.vehicle.front_m, False
        while front_m >= self.edge_m:
            edge = self.way.edges[self._edge][1]
            renewed |= edge == self.way.renewed_on
            note(now_s, name, Event.EDGE, edge, "")
            self._next_edge()
        while front_m >= self.lap_m:
            self.laps += 1
            self.lap_m += self.way.lap_m
            note(now_s, name, Event.LAP, self.way.loop, "")
        while front_m >= self.leg_m:
            self.entered += 1
            note(now_s, name, Event.ENTER, self.way.legs[self.entered % len(self.way.legs)].state, "")
        return renewed

    def _next_edge(self) -> None:
        self._edge += 1
        if self._edge == len(self.way.edges):
            self._edge, self._edge_laps = 0, self._edge_laps + 1


class Driving:
    """Vehicles on loops, under the rules of a ledger.

    One lane, no lights, no ordinary traffic, no stops: what the tables of `loopgate.drive` do besides is
    missing. All vehicles are read in one go after a step; the rest costs only for vehicles that reached
    something.

    Parameters
    ----------
    traffic
        The running simulation.
    layout, ledger
        Places and paths; who holds and waits. The ledger is empty.
    note
        Takes the events.
    """

    def __init__(self, traffic: Traffic, layout: Layout, ledger: Ledger, note: Note) -> None:
        self._traffic, self._layout, self.ledger, self._note = traffic, layout, ledger, note
        self._paths: dict[int, list[Leg]] = {}
        self.diaries: list[_Diary] = []
        self._ids: list[str] = []
        self._offset: Floats = np.zeros(0)
        self._front: Floats = np.zeros(0)
        self._due: Floats = np.zeros(0)
        self._note_due: Floats = np.zeros(0)
        self.driven_m = self.sumo_s = 0.0
        self.trespasses = 0

    def take_in(self, ways: Sequence[Way]) -> None:
        """Take vehicles in that are on the road, at the beginning or later, the first in line first."""
        traffic, first = self._traffic, len(self._ids)
        for way in ways:
            path = self._paths.setdefault(id(way.legs), [])
            path += path or self._layout.path(way.legs)
            like = traffic.dynamics(way.vehicle)
            haste = max(1.0, like.speed_factor)
            make = Make(like.length_m, like.accel_mps2, like.decel_mps2, way.top * haste, haste)
            vehicle = self.ledger.take_in(way.vehicle, path, way.position, make, way.lap_m)
            vehicle.number = len(self._ids)
            vehicle.front_m, vehicle.speed = way.front_m, traffic.speed(way.vehicle)
            self._ids.append(way.vehicle)
            self.diaries.append(_Diary(way, vehicle))
            traffic.put_under_gate(way.vehicle, keeps_lane=False)
            self._note(traffic.now_s, way.vehicle, Event.START, vehicle.leg.place.name, "")
        fresh = self.diaries[first:]
        fronts = np.array([diary.way.front_m for diary in fresh])
        self._offset = np.append(self._offset, fronts - traffic.odometers(self._ids[first:]))
        self._front = np.append(self._front, fronts)
        self._note_due = np.append(self._note_due, [diary.due_m for diary in fresh])
        self._due = np.append(self._due, np.full(len(fresh), -np.inf))
        for diary in fresh:
            self.ledger.passed(diary.vehicle)
        self._answer(traffic.now_s)

    def step(self) -> None:
        """Advance the traffic by one step and do what is due."""
        began = process_time()
        self._traffic.step()
        self.sumo_s += process_time() - began
        now_s = self._traffic.now_s
        fronts = self._traffic.odometers(self._ids) + self._offset
        moved = fronts - self._front
        self.driven_m += float(moved.sum())
        speeds = moved / self._traffic.step_s
        self._front = fronts
        for diary, front_m, speed in zip(self.diaries, fronts.tolist(), speeds.tolist(), strict=True):
            diary.vehicle.front_m = front_m
            diary.vehicle.speed = speed
        for number in np.flatnonzero(fronts >= self._note_due).tolist():
            diary = self.diaries[number]
            if diary.pass_by(now_s, self._note) and diary.vehicle.held:
                self._hold_anew(diary)
            self._note_due[number] = diary.due_m
        for number in np.flatnonzero(fronts >= self._due).tolist():
            vehicle = self.diaries[number].vehicle
            self.ledger.passed(vehicle)
            if vehicle.front_m > vehicle.line_m + 0.5:
                self.trespasses += 1
        for name in self._traffic.halted():
            wanted = self.ledger.vehicles[name].wanted()
            self._note(now_s, name, Event.HOLD, wanted.name if wanted else "", "")
        self._answer(now_s)

    def _answer(self, now_s: float) -> None:
        """Answer requests, and carry out what comes of it."""
        ledger, note = self.ledger, self._note
        ledger.answer(now_s)
        moved: dict[Vehicle, None] = {}
        stays: dict[Vehicle, None] = {}
        for what, vehicle, place, reason in ledger.log:
            if what == LEFT:
                note(now_s, vehicle.name, Event.LEAVE, place.name, "")
            elif what == GRANTED:
                note(now_s, vehicle.name, Event.GRANT, place.name, "free")
                self._note_due[vehicle.number] = self.diaries[vehicle.number].due_m
                moved[vehicle] = None
                stays.pop(vehicle, None)
            else:
                if what == REFUSED:
                    note(now_s, vehicle.name, Event.REFUSE, place.name, reason)
                stays[vehicle] = None
        ledger.log.clear()
        for vehicle in moved:
            if vehicle.held:
                vehicle.held = False
                self._traffic.release(vehicle.name)
        for vehicle in stays:
            if not vehicle.held:
                self._hold(vehicle)
        for vehicle in ledger.aimed:
            self._due[vehicle.number] = vehicle.due_m
        ledger.aimed.clear()

    def _hold(self, vehicle: Vehicle) -> None:
        line = self.diaries[vehicle.number].way.legs[vehicle.leg.number].line
        vehicle.held = True
        self._traffic.hold(vehicle.name, line.edge, line.lane, line.position_m)

    def _hold_anew(self, diary: _Diary) -> None:
        """Set a stop again: one on the edge where the route was renewed has moved on to the next round."""
        vehicle = diary.vehicle
        if vehicle.speed > 0.0 and diary.way.legs[vehicle.leg.number].line.edge == diary.way.renewed_on:
            self._traffic.release(vehicle.name)
            self._hold(vehicle)
