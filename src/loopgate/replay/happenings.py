"""Turns the events of a run into spans of time: places and links held, refusals, and stands at gates.

Under a gate, these spans follow from the events. Under SUMO's own rules there are no grants: the vehicles in
each place then follow from the distances that they have driven.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import pandas as pd

from loopgate.arrays import Floats, Ints
from loopgate.audit.layout import Layout, LoopWay
from loopgate.gates import Reason
from loopgate.replay.lines import DrawnLines
from loopgate.replay.tracks import PER_M, Tracks
from loopgate.results.columns import EVENT, PLACE, REASON, TIME, VEHICLE, Event

WHY: dict[str, str] = {
    Reason.STAYS: "it has arrived",
    Reason.BEHIND: "another stands before it",
    Reason.OCCUPIED: "the next place is full",
    Reason.CROSSING: "a conflicting movement has the crossing",
    Reason.RED: "a traffic light is not green for long enough",
    Reason.TRAFFIC: "ordinary traffic is in the way",
    Reason.DEADLOCK: "the move would cause a deadlock, or may lead to one",
    Reason.RESERVE: "a slot is kept free there",
    Reason.SERVICE: "the slot is kept for a vehicle that has waited long",
    Reason.SPACING: "it is ahead of the middle between its neighbours on the loop",
    Reason.NEGOTIATION: "another vehicle goes first",
    Reason.BUDGET: "the gate could not decide in time",
    Reason.FAULT: "the witness failed the gate's own check",
    Reason.STOP: "the vehicle stops before that",
    Reason.ANSWER: "no answer has come yet",
}
"""The reason of a refusal, in words for readers."""

_MOVED_M = 2.0
"""A deadlock is over when one of its vehicles has moved farther than this [m]."""


class TimeSpan(NamedTuple):
    """A span of time: its place, way or reason, its vehicle, its first and last step."""

    what: int
    vehicle: int
    begin: int
    end: int
    why: int = 0


@dataclass(frozen=True, slots=True)
class Circle:
    """A deadlock: vehicles that each wait for the next, from step `begin` to step `end`."""

    vehicles: tuple[int, ...]
    begin: int
    end: int


@dataclass(slots=True)
class Happenings:
    """All events of a run for the replay, encoded as numbers."""

    visits: list[TimeSpan] = field(default_factory=list)
    """Spans in which a vehicle held a slot of a place."""
    passages: list[TimeSpan] = field(default_factory=list)
    """Spans in which a vehicle held a link: from its grant until its rear was in the next place."""
    refusals: list[TimeSpan] = field(default_factory=list)
    """Spans in which a vehicle was refused on a link, with the number of the reason in `WHY`."""
    holds: list[TimeSpan] = field(default_factory=list)
    """Spans in which a vehicle stood at a gate; `what` is 0."""
    laps: list[tuple[int, int]] = field(default_factory=list)
    mishaps: list[tuple[int, int, str]] = field(default_factory=list)
    """`laps`: vehicle and step of each lap. `mishaps`: vehicle and step of each mishap, and its kind."""
    circles: list[Circle] = field(default_factory=list)
    """Deadlocks in the order in which they were detected."""


def find_happenings(
    events: pd.DataFrame, tracks: Tracks, layout: Layout | None, ways: DrawnLines
) -> Happenings:
    """Return the spans of a run.

    Parameters
    ----------
    events
        `EVENT_COLUMNS`, in the order of time.
    tracks
        Its vehicles are those of the layout first.
    layout, ways
        Places and ways, as far as known; without them there are laps, holds, mishaps and deadlocks only.
    """
    found = Happenings()
    reader = _Reader(tracks, layout, ways, found)
    names = {name: number for number, name in enumerate(tracks.vehicles)}
    columns = (events[name].to_numpy() for name in (TIME, VEHICLE, EVENT, PLACE, REASON))
    for time_s, name, event, place, reason in zip(*columns, strict=True):
        vehicle = names.get(name)
        if vehicle is not None:
            reader.take(tracks.frame(time_s), vehicle, event, place, names.get(reason, -1), reason)
    reader.close()
    if layout is not None and not found.visits:
        found.visits.extend(
            _visits_as_driven(tracks, layout, {name: n for n, name in enumerate(ways.places)})
        )
    for spans in (found.visits, found.passages):
        spans.sort(key=lambda span: (span.what, span.begin))
    for spans in (found.refusals, found.holds):
        spans.sort(key=lambda span: (span.vehicle, span.begin))
    return found


class _Reader:
    """Reads events one by one and closes the spans that they end."""

    def __init__(self, tracks: Tracks, layout: Layout | None, ways: DrawnLines, found: Happenings) -> None:
        self._tracks = tracks
        self._rows = tracks.rows_of()
        self._found = found
        self._places = {name: number for number, name in enumerate(ways.places)}
        self._why = {reason: number for number, reason in enumerate(WHY)}
        bodies = list(layout.vehicles.values()) if layout else []
        self._links = [ways.after[body.loop] for body in bodies]
        self._leg = [body.leg for body in bodies]
        self._length_m = [body.length_m for body in bodies]
        self._inside: list[list[tuple[int, int]]] = [[] for _ in tracks.vehicles]
        self._passing: list[list[tuple[int, int]]] = [[] for _ in tracks.vehicles]
        self._refused: dict[int, tuple[int, int, int]] = {}
        self._held: dict[int, int] = {}
        self._waiting: dict[int, list[tuple[int, int]]] = {}

    def take(self, frame: int, vehicle: int, event: str, place: str, other: int, reason: str) -> None:
        """Read an event; `other` is the vehicle that its reason names, if there is one."""
        if event == Event.LAP:
            self._found.laps.append((vehicle, frame))
        elif event == Event.HOLD:
            self._held.setdefault(vehicle, frame)
        elif event == Event.GO:
            self._go(vehicle, frame)
        elif event == Event.DEADLOCK:
            self._waiting.setdefault(frame, []).append((vehicle, other))
        elif event in {Event.COLLISION, Event.TELEPORT, Event.OVERRUN, Event.STRAY}:
            self._found.mishaps.append((vehicle, frame, str(event)))
        elif vehicle < len(self._leg) and place in self._places:
            self._move(frame, vehicle, event, self._places[place], reason)

    def _move(self, frame: int, vehicle: int, event: str, place: int, reason: str) -> None:
        if event in {Event.START, Event.GRANT}:
            if event == Event.GRANT:
                self._answered(vehicle, frame)
                self._passing[vehicle].append((self._link(vehicle), frame))
                self._leg[vehicle] += 1
            self._inside[vehicle].append((place, frame))
        elif event == Event.REFUSE:
            self._answered(vehicle, frame)
            self._refused[vehicle] = (self._link(vehicle), frame, self._why.get(reason, -1))
        elif event == Event.ENTER and self._passing[vehicle]:
            link, begin = self._passing[vehicle].pop(0)
            self._found.passages.append(TimeSpan(link, vehicle, begin, self._rear_in(vehicle, frame)))
        elif event == Event.LEAVE:
            at = next((k for k, (here, _) in enumerate(self._inside[vehicle]) if here == place), None)
            if at is not None:
                _, begin = self._inside[vehicle].pop(at)
                self._found.visits.append(TimeSpan(place, vehicle, begin, frame))

    def close(self) -> None:
        """End the open spans at the end of the run, and measure its deadlocks."""
        last = self._tracks.frames
        for vehicle, inside in enumerate(self._inside):
            self._found.visits.extend(TimeSpan(place, vehicle, begin, last) for place, begin in inside)
        for vehicle, passing in enumerate(self._passing):
            self._found.passages.extend(TimeSpan(link, vehicle, begin, last) for link, begin in passing)
        for vehicle in list(self._refused):
            self._answered(vehicle, last)
        for vehicle in list(self._held):
            self._go(vehicle, last)
        for noticed, waiting in sorted(self._waiting.items()):
            vehicles = tuple(vehicle for vehicle, _ in waiting)
            over = min(self._moves_on(vehicle, noticed) for vehicle in vehicles)
            begin = max(self._stands_from(vehicle, noticed) for vehicle in vehicles)
            self._found.circles.append(Circle(vehicles, begin, over))

    def _link(self, vehicle: int) -> int:
        links = self._links[vehicle]
        return links[self._leg[vehicle] % len(links)]

    def _answered(self, vehicle: int, frame: int) -> None:
        before = self._refused.pop(vehicle, None)
        if before is not None:
            link, begin, why = before
            self._found.refusals.append(TimeSpan(link, vehicle, begin, frame, why))

    def _go(self, vehicle: int, frame: int) -> None:
        begin = self._held.pop(vehicle, None)
        if begin is not None:
            self._found.holds.append(TimeSpan(0, vehicle, begin, frame))

    def _rear_in(self, vehicle: int, frame: int) -> int:
        """Return the step in which the rear is where the front was at step `frame`."""
        for begin, rows in self._rows.get(vehicle, ()):
            driven = self._tracks.odometer_m[rows]
            if begin <= frame < begin + len(driven):
                behind = driven[frame - begin] + self._length_m[vehicle]
                return begin + int(np.searchsorted(driven, behind))
        return frame

    def _stands_from(self, vehicle: int, frame: int) -> int:
        """Return the first step since which a vehicle has stood where it is at step `frame`."""
        for begin, rows in self._rows.get(vehicle, ()):
            x, y = self._tracks.x[rows], self._tracks.y[rows]
            if begin <= frame < begin + len(x):
                k = frame - begin
                far = np.hypot(x[: k + 1] - x[k], y[: k + 1] - y[k]) > _MOVED_M * PER_M
                return begin + int(np.flatnonzero(far)[-1]) + 1 if far.any() else begin
        return frame

    def _moves_on(self, vehicle: int, frame: int) -> int:
        for begin, rows in self._rows.get(vehicle, ()):
            x, y = self._tracks.x[rows], self._tracks.y[rows]
            if begin <= frame < begin + len(x):
                k = frame - begin
                far = np.hypot(x[k:] - x[k], y[k:] - y[k]) > _MOVED_M * PER_M
                return frame + int(far.argmax()) if far.any() else begin + len(x)
        return frame


def _visits_as_driven(tracks: Tracks, layout: Layout, places: dict[str, int]) -> Iterable[TimeSpan]:
    """Yield the visits of vehicles to places, from the distance that each vehicle has driven on its loop."""
    rows_of = tracks.rows_of()
    for vehicle, body in enumerate(layout.vehicles.values()):
        loop = layout.loops[body.loop]
        numbers = np.array([places[leg.state] for leg in loop.legs])
        tracked = rows_of.get(vehicle, ())
        began = tracks.odometer_m[tracked[0][1]][0] if tracked else 0.0
        for begin, rows in tracked:
            arc = tracks.odometer_m[rows] - began + body.start_m
            leg, first, last = _rounds(loop, arc, body.length_m)
            for k, come, gone in zip(leg.tolist(), first.tolist(), last.tolist(), strict=True):
                yield TimeSpan(int(numbers[k]), vehicle, begin + come, begin + gone)


def _rounds(loop: LoopWay, arc: Floats, length_m: float) -> tuple[Ints, Ints, Ints]:
    """Return the legs that a vehicle drove over, and the rows in which its front came and its rear left."""
    lap = loop.length_m
    rounds = np.arange(np.floor(arc[0] / lap) - 1, np.ceil(arc[-1] / lap) + 1)[:, None] * lap
    come = (np.array([leg.begin_m for leg in loop.legs])[None] + rounds).ravel()
    gone = (np.array([leg.end_m for leg in loop.legs])[None] + rounds).ravel() + length_m
    legs = np.tile(np.arange(len(loop.legs)), len(rounds))
    seen = (come <= arc[-1]) & (gone > arc[0])
    return legs[seen], np.searchsorted(arc, come[seen]), np.searchsorted(arc, gone[seen])
