"""The diaries of vehicles: the edges, laps and places that they pass, and their counters."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import Final

from loopgate.abstraction.itinerary import DrawnLeg, Track
from loopgate.control.ledger import GRANTED, LEFT, REFUSED, TRESPASSED, Ledger
from loopgate.control.places import STANDING_MPS, Leg, Vehicle

Row = tuple[float, str, str, str, str]
"""An event: time [s], vehicle, event, place, reason."""

LEAP_MPS: Final = 5.0
"""An odometer that is this much faster than the top speed of its vehicle has leapt [m/s]."""

# Values of `loopgate.results.columns.Event`.
EDGE: Final = "edge"
LAP: Final = "lap"
ENTER: Final = "enter"
LEAVE: Final = "leave"
GRANT: Final = "grant"
REFUSE: Final = "refuse"


class Queue:
    """The vehicles that stand on an edge on their way to the next edge.

    `now`: how many were counted so far in this step. `steps`: in how many steps so many stood there.
    """

    __slots__ = ("now", "steps")

    def __init__(self) -> None:
        self.now = 0
        self.steps: dict[int, int] = {}


class Diary:
    """The record of one vehicle: what it has passed on its path, and its counters.

    The counters begin with the measured time. `track`: the path with its legs as the abstraction drew them.
    `path`: the same legs as objects of the ledger. `all_laps`: laps so far, from the start on. `edge`: the
    edge that the front is on, or has left last. `queue`: the queue that it is in if it stands there, once it
    was asked for. `leapt_m`: the leaps of its odometer, which are not driven [m]. `halted_s`: since when it
    stands at the stop line where it is held [s]; infinite if it does not. `longest_stood_s`: the longest time
    for which it stood, for whatever cause [s].
    """

    def __init__(self, vehicle: Vehicle, track: Track, path: Sequence[Leg]) -> None:
        self.vehicle: Final = vehicle
        self.all_laps = self._laps_before = 0
        self.leapt_m = 0.0
        self.halted_s = inf
        self._held_s = 0.0
        self.longest_stood_s = self._stands_s = 0.0
        self._stood_at_s = -inf
        self._from_m = vehicle.front_m
        self._lap_m = vehicle.front_m + vehicle.lap_m
        begins = [(begin_m, edge) for begin_m, edge in track.edges if begin_m <= vehicle.front_m]
        begin_m, edge = max(begins, default=(0.0, ""))
        self._start: Final = edge, vehicle.front_m - begin_m
        """Where its laps begin and end: an edge, and the distance from its beginning [m]."""
        self._follow(track, path)

    def turns_off(self, track: Track, path: Sequence[Leg], by_m: float) -> None:
        """Note that the vehicle is now on another path, where arc lengths are `by_m` larger."""
        self._from_m += by_m
        self._lap_m += by_m
        if self.track.rounds and track.rounds:
            self._lap_m = self._next_lap_m(track, (self._lap_m - self.vehicle.front_m) / self.track.lap_m)
        self._follow(track, path)

    def _next_lap_m(self, track: Track, left: float) -> float:
        """Return where the lap ends on another path [m]; `left` is the share that was left of it before.

        A lap ends where it began, if the path leads there. Where a detour leads round that point, the lap is
        complete once the vehicle is beyond it on its own loop.
        """
        edge, beyond_m = self._start
        front_m, lap_m = self.vehicle.front_m, self.vehicle.lap_m
        starts = [begin_m + beyond_m for begin_m, name in track.edges if name == edge]
        if not starts:
            return front_m + left * lap_m
        # If the path leads there twice: the time that is as far ahead as the lap had to go.
        aheads = [(start_m - front_m) % lap_m / lap_m for start_m in starts]
        ahead = min(aheads, key=lambda share: abs((share - left + 0.5) % 1.0 - 0.5))
        return front_m + (ahead + round(left - ahead)) * lap_m

    def _follow(self, track: Track, path: Sequence[Leg]) -> None:
        """Record what the vehicle passes on a path, from where it is."""
        vehicle = self.vehicle
        self.track, self.path = track, path
        self._edges = [edge for _, edge in track.edges]
        self._renewed_on = track.renewed_on
        self._begins_m = [float(begin_m) for begin_m, _ in track.edges]
        self.edge = self._edges[-1]
        self._edge = 0
        self._edge_laps_m = 0.0
        self._edge_m = self._begins_m[0]
        self.queue: Queue | None = None
        while self._edge_m <= vehicle.front_m:
            self._next_edge()
        self._entered = vehicle.granted
        self._leg_m = inf
        self._find_next()

    def jumped(self, skipped_m: float) -> None:
        """Note that SUMO moved the vehicle `skipped_m` ahead, so that its lap ends later."""
        self._lap_m += skipped_m
        self.aim()

    def drawn(self, number: int) -> DrawnLeg:
        """Return a leg of the vehicle's endless path, as the abstraction drew it."""
        return self.track.legs[number % len(self.track.legs)]

    def aim(self) -> None:
        """After a grant, find where the next event to record will be."""
        self._leg_m = self._next_leg_m()
        self._find_next()

    def _next_leg_m(self) -> float:
        """Return where the next leg begins that is granted and not yet entered [m]; infinite if none is."""
        number = self._entered + 1
        if number > self.vehicle.granted:
            return inf
        laps = number // len(self.path)
        return laps * self.vehicle.lap_m + self.path[number - laps * len(self.path)].begin_m

    def _find_next(self) -> None:
        next_m = self._edge_m
        if self._lap_m < next_m:  # noqa: PLR1730  calls of `min` cost three times this
            next_m = self._lap_m
        if self._leg_m < next_m:  # noqa: PLR1730  as above
            next_m = self._leg_m
        self.vehicle.noted_m = next_m

    def pass_by(self, now_s: float, rows: list[Row]) -> bool:
        """Record what the front has passed; return whether SUMO has renewed the route there."""
        name, front_m, renewed = self.vehicle.name, self.vehicle.front_m, False
        while front_m >= self._edge_m:
            edge = self._edges[self._edge]
            if edge == self._renewed_on:
                renewed = True
            rows.append((now_s, name, EDGE, edge, ""))
            self._next_edge()
        while front_m >= self._lap_m:
            self.all_laps += 1
            self._lap_m += self.vehicle.lap_m
            rows.append((now_s, name, LAP, self.track.loop, ""))
        while front_m >= self._leg_m:
            self._entered += 1
            rows.append((now_s, name, ENTER, self.path[self._entered % len(self.path)].place.name, ""))
            self._leg_m = self._next_leg_m()
        self._find_next()
        return renewed

    def _next_edge(self) -> None:
        self.edge = self._edges[self._edge]
        self._edge += 1
        if self._edge == len(self._edges):
            self._edge = 0
            self._edge_laps_m += self.vehicle.lap_m
        self._edge_m = self._edge_laps_m + self._begins_m[self._edge]
        self.queue = None

    @property
    def movement(self) -> tuple[str, str]:
        """The edge, and the edge that comes next; "" if none does."""
        last = self._edge == 0 and not self.track.rounds
        return self.edge, "" if last else self._edges[self._edge]

    @property
    def laps(self) -> int:
        """Number of laps since the measured time began."""
        return self.all_laps - self._laps_before

    @property
    def stood_s(self) -> float:
        """How long it has stood, anywhere [s]."""
        return self.vehicle.stood_s

    def stands(self, step_s: float, now_s: float) -> None:
        """Count a step in which the vehicle stood."""
        self.vehicle.stood_s += step_s
        goes_on = now_s - self._stood_at_s < 1.5 * step_s
        self._stands_s = self._stands_s + step_s if goes_on else step_s
        self._stood_at_s = now_s
        if self._stands_s > self.longest_stood_s:  # noqa: PLR1730  a call of `max` costs three times this
            self.longest_stood_s = self._stands_s

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

    def goes_on(self, now_s: float) -> bool:
        """Note that the vehicle is no longer held; return whether it stood at its stop line."""
        halted = self.halted_s < inf
        self._held_s = self.total_hold_s(now_s)
        self.halted_s = inf
        return halted

    def measure_from_now(self, now_s: float) -> None:
        """Begin the measured time: set the counters to zero."""
        self._from_m, self._laps_before = self.vehicle.front_m, self.all_laps
        self._held_s = self.leapt_m = self.vehicle.longest_s = 0.0
        self.halted_s = max(self.halted_s, now_s)  # stays infinite for a vehicle that is not held


class StepSeen:
    """What `look` has found.

    `driven_m`: how far all vehicles came together [m]. `renewed`: the vehicles whose route SUMO has renewed.
    `still`: the vehicles that stand. `leapt`: the vehicles that came farther than they can drive, with the
    distances [m].
    """

    __slots__ = ("driven_m", "leapt", "renewed", "still")

    def __init__(self) -> None:
        self.driven_m = 0.0
        self.renewed: list[Vehicle] = []
        self.still: list[Vehicle] = []
        self.leapt: list[tuple[Vehicle, float]] = []


def look(
    vehicles: list[Vehicle], diaries: list[Diary], odometers_m: list[float], ledger: Ledger, rows: list[Row]
) -> StepSeen:
    """Set the fronts and speeds of all vehicles from their odometers [m], and record what they reached."""
    seen, due, step_s = StepSeen(), list[Vehicle](), ledger.step_s
    still, leapt, driven_m = seen.still, seen.leapt, 0.0
    still_m, fast_m = STANDING_MPS * step_s, LEAP_MPS * step_s
    for vehicle, odometer_m in zip(vehicles, odometers_m, strict=True):
        front_m = odometer_m + vehicle.offset_m
        moved_m = front_m - vehicle.front_m
        driven_m += moved_m
        vehicle.front_m = front_m
        vehicle.speed = moved_m / step_s
        if front_m >= vehicle.due_m or front_m >= vehicle.noted_m:
            due.append(vehicle)
        if moved_m < still_m:
            still.append(vehicle)
        elif moved_m > fast_m and moved_m > (vehicle.make.top + LEAP_MPS) * step_s:
            leapt.append((vehicle, moved_m))
    seen.driven_m = driven_m
    now_s = ledger.now_s
    for vehicle in due:
        if vehicle.front_m >= vehicle.noted_m and diaries[vehicle.row].pass_by(now_s, rows):
            seen.renewed.append(vehicle)
        if vehicle.front_m >= vehicle.due_m:
            ledger.passed(vehicle)
    return seen


def write_down(
    ledger: Ledger, diaries: list[Diary], rows: list[Row], stages: dict[int, str]
) -> tuple[list[Vehicle], list[Vehicle]]:
    """Write the ledger's log as events; return the vehicles to release, and the vehicles to hold.

    `stages`: gets the stage of the gate that decided, by number of the event.
    """
    moved: dict[Vehicle, None] = {}
    stays: dict[Vehicle, None] = {}
    now_s = ledger.now_s
    for what, vehicle, place, reason, stage in ledger.log:
        if stage:
            stages[len(rows)] = stage
        if what == LEFT:
            rows.append((now_s, vehicle.name, LEAVE, place.name, ""))
        elif what == TRESPASSED:
            rows.append((now_s, vehicle.name, ENTER, place.name, reason))
        elif what == GRANTED:
            rows.append((now_s, vehicle.name, GRANT, place.name, "free"))
            diaries[vehicle.row].aim()
            moved[vehicle] = None
            stays.pop(vehicle, None)
        else:
            if what == REFUSED:
                rows.append((now_s, vehicle.name, REFUSE, place.name, reason))
            stays[vehicle] = None
    ledger.log.clear()
    return list(moved), list(stays)
