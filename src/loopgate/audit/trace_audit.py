"""Mutual exclusion, capacities, order and progress, re-checked from the events alone."""

import math
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import pandas as pd

from loopgate.model import Robot, StateId, System
from loopgate.results.columns import EVENT, PLACE, REASON, TAKEN_OUT, TIME, VEHICLE, Event

_NONE: Mapping[str, int] = {}
_NO_METRES: Mapping[str, float] = {}
_ROUNDING_M = 1e-3


@dataclass(frozen=True, slots=True)
class Finding:
    """A violation of a rule, found by the audit."""

    at_s: float
    """Time of the violation [s]."""
    vehicle: str
    place: str
    """`vehicle` and `place`: the vehicle and the state concerned; `place` may be empty."""
    rule: str
    """``capacity``, ``trespass``, ``path``, ``order``, ``release``, ``entry``, ``exit``, ``start``,
    ``collision``, ``teleport``, ``progress`` or ``laps``."""
    text: str
    """One line for people."""


def audit_events(
    events: pd.DataFrame | Iterable[pd.DataFrame],
    system: System,
    *,
    laps: Mapping[str, int] | None = None,
    starved_after_s: float | None = None,
    joined: Sequence[Robot] = (),
    room: Mapping[str, int] = _NONE,
    metres: Mapping[str, float] = _NO_METRES,
    needed_m: Mapping[str, float] = _NO_METRES,
) -> list[Finding]:
    """Check a finished run by its events: capacities, order, and a grant for every entry.

    The audit counts the vehicles in each state by the events ``start``, ``grant`` and ``leave``. The rules:

    - *capacity*: a state never has more vehicles than it holds, from the grant until the rear has left; in a
      FIFO state for two or more, until the grant to leave it;
    - *trespass*: a vehicle's front, as SUMO reports it, enters only granted states, in order;
    - *path*: a vehicle gets grants for the states of its path, in order;
    - *order*: vehicles get grants to leave a FIFO state in the order in which they entered it;
    - *release*: a vehicle leaves states in the order in which it entered them, and leaves its last state only
      when it leaves the road or parks beside it; it returns from parking into that state;
    - *entry*: a vehicle enters the road once, where its path begins, and its place has a free slot;
    - *exit*: a vehicle on a trip leaves the road in the last place of its route;
    - *collision*, *teleport*: SUMO reports none;
    - *laps*: no vehicle has more laps than its grants allow;
    - *progress*: if asked for, no vehicle is without a grant for longer than `starved_after_s`.

    Parameters
    ----------
    events
        `EVENT_COLUMNS`, in the order in which they happened; or consecutive pieces of this table.
    system
        The system of the run (``system.json``).
    laps
        Number of laps that the run counted, by vehicle.
    starved_after_s
        Longest allowed time without a grant [s]; None for no limit.
    joined
        Robots that joined during the run, each in the state where its vehicle was.
    room
        Capacity of the states on the paths of `joined`, by name; all of these states are FIFO.
    metres, needed_m
        The length of states that hold more than their capacity while the vehicles fit [m]; and the length of
        each vehicle with its gap [m].

    Returns
    -------
    list of Finding
        Empty if the run is clean. O(events).

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate import Robot, System
    >>> from loopgate.audit import audit_events
    >>> from loopgate.results.columns import EVENT_COLUMNS
    >>> system = System([Robot("a", ("a1", "s")), Robot("b", ("b1", "s"))])
    >>> happened = [(0, "a", "start", "a1"), (0, "b", "start", "b1")]
    >>> happened += [(1, "a", "grant", "s"), (2, "b", "grant", "s")]
    >>> events = pd.DataFrame([(*row, "", "") for row in happened], columns=EVENT_COLUMNS)
    >>> [(finding.rule, finding.vehicle, finding.at_s) for finding in audit_events(events, system)]
    [('capacity', 'b', 2)]
    """
    pieces = [events] if isinstance(events, pd.DataFrame) else events
    books = _Books(system, joined, room)
    books.metres, books.needed_m = metres, needed_m
    return books.check(pieces, laps or {}, starved_after_s)


class _Books:
    def __init__(self, system: System, joined: Sequence[Robot], room: Mapping[str, int]) -> None:
        later = {robot.id for robot in joined}
        robots = [*(robot for robot in system.robots if robot.id not in later), *joined]
        self._path: dict[str, tuple[StateId, ...]] = {robot.id: robot.path for robot in robots}
        self._next: dict[str, list[int | None]] = {
            robot.id: [robot.next_position(p) for p in range(len(robot.path))] for robot in robots
        }
        self._position: dict[str, int] = {robot.id: robot.start for robot in robots}
        visitors = Counter(state for robot in robots for state in set(robot.path))
        most = {**{StateId(state): number for state, number in room.items()}, **system.capacity}
        self._room = {state: most.get(state, 1) for state, count in visitors.items() if count > 1}
        self._fifo = system.fifo | most.keys() if joined else system.fifo
        self._held: defaultdict[StateId, list[str]] = defaultdict(list)
        self._queue: defaultdict[StateId, list[str]] = defaultdict(list)
        self._holding: dict[str, list[StateId]] = {}
        self._entering: dict[str, list[StateId]] = {}
        self._granted: Counter[str] = Counter()
        self._last_grant: dict[str, float] = {}
        self._open = {robot.id for robot in robots if not robot.closed}
        self._gone: set[str] = set()
        self._findings: list[Finding] = []
        self.metres = self.needed_m = _NO_METRES

    def check(
        self, pieces: Iterable[pd.DataFrame], laps: Mapping[str, int], starved_after_s: float | None
    ) -> list[Finding]:
        end = 0.0
        for events in pieces:
            end = float(events[TIME].iloc[-1]) if len(events) else end
            self._read(events, starved_after_s)
        for vehicle in self._path:
            if vehicle in self._gone and vehicle not in self._holding:
                continue
            if vehicle not in self._holding:
                self._add(0.0, vehicle, "", "start", f"{vehicle}: the trace has no start of it")
            elif starved_after_s is not None:
                self._progress(end, vehicle, starved_after_s)
            most = self._granted[vehicle] // len(self._path[vehicle]) + 1
            if len(self._path[vehicle]) > 1 and laps.get(vehicle, 0) > most:
                text = f"{vehicle}: {laps[vehicle]} laps counted, but its grants allow {most}"
                self._add(end, vehicle, "", "laps", text)
        return self._findings

    def _read(self, events: pd.DataFrame, starved_after_s: float | None) -> None:
        watched = events[events[EVENT].isin([e.value for e in (*_RULES, Event.END, Event.RETURN)])]
        for at_s, vehicle, event, place, reason in zip(
            watched[TIME].to_list(),
            watched[VEHICLE].astype(str).to_list(),
            watched[EVENT].astype(str).to_list(),
            watched[PLACE].astype(str).to_list(),
            watched[REASON].astype(str).to_list(),
            strict=True,
        ):
            if starved_after_s is not None and event == Event.GRANT:
                self._progress(at_s, vehicle, starved_after_s)
            if event == Event.RETURN:
                self.back(at_s, vehicle, StateId(place), reason)
            elif event == Event.END:
                self.end(at_s, vehicle, StateId(place), reason)
            else:
                _RULES[Event(event)](self, at_s, vehicle, StateId(place))

    def start(self, at_s: float, vehicle: str, place: StateId) -> None:
        if vehicle not in self._path:
            self._add(
                at_s, vehicle, place, "start", f"{vehicle}: starts in {place}, but is not in the system"
            )
            return
        if vehicle in self._holding or vehicle in self._gone:
            text = f"{vehicle}: comes onto the road in {place}, but has come onto it before"
            self._add(at_s, vehicle, place, "entry", text)
            return
        self._holding[vehicle] = [place]
        self._last_grant[vehicle] = at_s
        if self._path[vehicle][self._position[vehicle]] != place:
            self._add(at_s, vehicle, place, "path", f"{vehicle}: starts in {place}, not where its path says")
        self._take(at_s, vehicle, place)

    def grant(self, at_s: float, vehicle: str, place: StateId) -> None:
        if vehicle not in self._holding:
            self._add(at_s, vehicle, place, "start", f"{vehicle}: granted {place} before it started")
            return
        position = self._next[vehicle][self._position[vehicle]]
        wanted = None if position is None else self._path[vehicle][position]
        if wanted != place:
            text = f"{vehicle}: granted {place}, but {wanted or 'nothing'} is next on its path"
            self._add(at_s, vehicle, place, "path", text)
            return
        here = self._path[vehicle][self._position[vehicle]]
        if here in self._fifo and here in self._room:
            queue = self._queue[here]
            if queue and queue[0] != vehicle:
                text = f"{vehicle}: granted the way out of {here} before {queue[0]}, which stands before it"
                self._add(at_s, vehicle, place, "order", text)
            if vehicle in queue:  # not if it started elsewhere, which has been found already
                queue.remove(vehicle)
        self._position[vehicle] = position if position is not None else 0
        self._granted[vehicle] += 1
        self._last_grant[vehicle] = at_s
        self._holding[vehicle].append(place)
        self._entering.setdefault(vehicle, []).append(place)
        self._take(at_s, vehicle, place)

    def enter(self, at_s: float, vehicle: str, place: StateId) -> None:
        expected = self._entering.get(vehicle, [])
        if not expected or expected[0] != place:
            self._add(at_s, vehicle, place, "trespass", f"{vehicle}: entered {place}, which was not granted")
            return
        expected.pop(0)

    def leave(self, at_s: float, vehicle: str, place: StateId) -> None:
        holding = self._holding.get(vehicle, [])
        if len(holding) < 2 or holding[0] != place:  # noqa: PLR2004  the last one it holds stays
            text = f"{vehicle}: left {place}, but held {', '.join(holding) or 'nothing'}"
            self._add(at_s, vehicle, place, "release", text)
            return
        holding.pop(0)
        self._held[place].remove(vehicle)

    def park(self, at_s: float, vehicle: str, place: StateId) -> None:
        if self._holding.get(vehicle, []) != [place]:
            held = ", ".join(self._holding.get(vehicle, [])) or "nothing"
            self._add(at_s, vehicle, place, "release", f"{vehicle}: parks in {place}, but held {held}")
        for books in (self._held, self._queue):
            if vehicle in books[place]:
                books[place].remove(vehicle)

    def back(self, at_s: float, vehicle: str, place: StateId, ahead: str) -> None:
        if self._holding.get(vehicle, []) != [place] or vehicle in self._held[place]:
            text = f"{vehicle}: comes back into {place}, where it did not park"
            self._add(at_s, vehicle, place, "release", text)
            return
        self._take(at_s, vehicle, place)
        queue = self._queue[place]
        if vehicle in queue:
            queue.remove(vehicle)
            queue.insert(queue.index(ahead) + 1 if ahead in queue else 0, vehicle)

    def end(self, at_s: float, vehicle: str, place: StateId, reason: str) -> None:
        holding = self._holding.pop(vehicle, [])
        self._gone.add(vehicle)
        if holding != [place]:
            text = f"{vehicle}: went off {place}, but held {', '.join(holding) or 'nothing'}"
            self._add(at_s, vehicle, place, "release", text)
        for held in holding:
            if vehicle in self._held[held]:
                self._held[held].remove(vehicle)
            if vehicle in self._queue[held]:
                self._queue[held].remove(vehicle)
        last = len(self._path.get(vehicle, ())) - 2  # the last place on the road
        if vehicle in self._open and self._position[vehicle] < last and reason != TAKEN_OUT:
            text = f"{vehicle}: went off the road in {place}, not at the end of its route"
            self._add(at_s, vehicle, place, "exit", text)

    def collision(self, at_s: float, vehicle: str, place: StateId) -> None:
        self._add(at_s, vehicle, place, "collision", f"{vehicle}: SUMO reports a collision on {place}")

    def teleport(self, at_s: float, vehicle: str, place: StateId) -> None:
        self._add(at_s, vehicle, place, "teleport", f"{vehicle}: SUMO teleported it")

    def overrun(self, at_s: float, vehicle: str, place: StateId) -> None:
        self._add(
            at_s, vehicle, place, "overrun", f"{vehicle}: held before {place}, it did not brake in time"
        )

    def _take(self, at_s: float, vehicle: str, place: StateId) -> None:
        held = self._held[place]
        held.append(vehicle)
        if place in self._fifo and place in self._room:
            self._queue[place].append(vehicle)
        most = self._room.get(place, len(held))
        if most > 1 and place in self._fifo:  # those with a grant to leave are on their way out of it
            held = [one for one in held if self._holding[one][-1] == place]
        if len(held) > most and not self._fit(place, held):
            text = f"{place}: holds {most}, but {', '.join(held)} hold it at once"
            self._add(at_s, vehicle, place, "capacity", text)

    def _fit(self, place: StateId, held: Sequence[str]) -> bool:
        """Return whether more vehicles than the capacity fit into a place by their lengths."""
        if place not in self.metres:
            return False
        return sum(self.needed_m.get(name, math.inf) for name in held) <= self.metres[place] + _ROUNDING_M

    def _progress(self, at_s: float, vehicle: str, starved_after_s: float) -> None:
        waited = at_s - self._last_grant.get(vehicle, at_s)
        if waited > starved_after_s and len(self._path.get(vehicle, ())) > 1:
            text = f"{vehicle}: no grant for {waited:.0f} s"
            self._add(at_s, vehicle, "", "progress", text)

    def _add(self, at_s: float, vehicle: str, place: str, rule: str, text: str) -> None:
        self._findings.append(Finding(at_s, vehicle, place, rule, f"{at_s:.0f} s: {text}"))


_RULES = {
    Event.START: _Books.start,
    Event.GRANT: _Books.grant,
    Event.ENTER: _Books.enter,
    Event.LEAVE: _Books.leave,
    Event.COLLISION: _Books.collision,
    Event.TELEPORT: _Books.teleport,
    Event.OVERRUN: _Books.overrun,
    Event.PARK: _Books.park,
}
