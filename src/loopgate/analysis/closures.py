"""What a closure changed, from the events of its own run: who was led round or waited, and how late it made.

A place is shut while it is closed, or a vehicle stands in it; `compute_blocked` has these times.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import inf, nan

import pandas as pd

from loopgate.analysis.frames import check_columns, table
from loopgate.analysis.stops import compute_stops
from loopgate.analysis.waits import compute_wait_causes
from loopgate.gates import Reason
from loopgate.results import columns as c
from loopgate.results.columns import Event

BEFORE, DURING, AFTER = "before", "during", "after"
_SHUT = Reason.CLOSED.value, Reason.BLOCKED.value
_DELAYED = c.VEHICLE, c.LOOP, c.LED, c.LONGER, c.LATER, c.SHUT_WAIT, c.SHUT_QUEUE
_PHASES = (
    *(c.STOP, c.LOOP, c.PHASE, c.VISITS, c.HEADWAY, c.LONGEST_HEADWAY),
    *(c.TIMED, c.LATENESS, c.WORST_LATENESS),
)

Times = Sequence[tuple[float, float]]


def _shut(blocked: pd.DataFrame) -> Times:
    """Return the times in which some place was shut, those that touch as one."""
    begins, ends = (blocked[name].astype(float).fillna(inf).tolist() for name in (c.FROM, c.UNTIL))
    merged: list[tuple[float, float]] = []
    for begin, end in sorted(zip(begins, ends, strict=True)):
        if merged and begin <= merged[-1][1]:
            merged[-1] = merged[-1][0], max(merged[-1][1], end)
        else:
            merged.append((begin, end))
    return merged


def compute_stop_phases(*, visits: pd.DataFrame, blocked: pd.DataFrame) -> pd.DataFrame:
    """Return how the stops were kept before, during and after the times in which some place was shut.

    Three rows per stop and loop: `STOP`, `LOOP`, `PHASE` (before the first such time, during one, after or
    between them; by when the vehicle might go on), and as in `compute_stops` `VISITS`, `HEADWAY`,
    `LONGEST_HEADWAY`, `TIMED`, `LATENESS` and `WORST_LATENESS` of the visits of that phase. Empty if nothing
    was shut. Where nobody came, headways and lateness are unknown (NaN).

    Raises `AnalysisError` on a missing column.

    Parameters
    ----------
    visits
        `VISIT_COLUMNS`: ``visits.parquet``.
    blocked
        What `compute_blocked` returns.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_stop_phases
    >>> told = [("b1", "market", "line", 100, 120, 110), ("b2", "market", "line", 400, 480, 410)]
    >>> columns = ["vehicle", "stop", "loop", "came_s", "went_on_s", "due_s"]
    >>> blocked = pd.DataFrame({"from_s": [200.0], "to_s": [450.0]})
    >>> made = compute_stop_phases(visits=pd.DataFrame(told, columns=columns), blocked=blocked)
    >>> made[["phase", "visits", "late_s"]].values.tolist()
    [['before', 1, 10.0], ['during', 0, nan], ['after', 1, 70.0]]
    """
    check_columns(visits, c.VISIT_COLUMNS, "visits")
    check_columns(blocked, (c.FROM, c.UNTIL), "blocked")
    shut = _shut(blocked)
    if not shut:
        return table([], _PHASES)
    when = visits[c.WENT_ON].map(
        lambda at: DURING if any(a <= at < b for a, b in shut) else BEFORE if at < shut[0][0] else AFTER
    )
    by_phase = {
        phase: compute_stops(visits=visits[when == phase]).set_index([c.STOP, c.LOOP])
        for phase in (BEFORE, DURING, AFTER)
    }
    rows = []
    for stop, loop in sorted(
        set(zip(visits[c.STOP], visits[c.LOOP], strict=True)), key=lambda one: one[::-1]
    ):
        for phase, made in by_phase.items():
            known = made.loc[(stop, loop)].to_dict() if (stop, loop) in made.index else {}
            rows.append(
                {c.STOP: stop, c.LOOP: loop, c.PHASE: phase}
                | {name: known.get(name, 0 if name in (c.VISITS, c.TIMED) else nan) for name in _PHASES[3:]}
            )
    return table(rows, _PHASES).astype({c.VISITS: int, c.TIMED: int})


def compute_delayed(
    *,
    events: pd.DataFrame,
    vehicles: pd.DataFrame,
    loops: pd.DataFrame,
    streets: pd.DataFrame,
    blocked: pd.DataFrame,
    end_s: float,
) -> pd.DataFrame:
    """Return the vehicles that were led round what was shut, or waited before it.

    One row per vehicle, those that waited longest first: `VEHICLE`, `LOOP`, `LED` (how often it was led
    round), `LONGER` [m] and `LATER` [s] (by how much its ways round were longer and took longer in all),
    `SHUT_WAIT` [s] (how long the gate refused it because the place ahead was shut) and `SHUT_QUEUE` [s] (how
    long it was in a place behind such a vehicle). Vehicles to which nothing happened are left out.

    A way round begins and ends where an edge of the loop begins. Its length is that of its edges less that of
    the edges which it replaces, junctions not counted. Its time is compared with the median time that
    vehicles of the loop took for what it replaces while nothing was shut. Both are unknown (NaN) of a vehicle
    one of whose ways round had not ended or has nothing to be compared with. The times of waits are unknown
    where no gate decided. Vehicles in queues that reach back into places before are not counted.

    Raises `AnalysisError` on a missing column.

    Parameters
    ----------
    events
        `EVENT_COLUMNS` up to the reason.
    vehicles, loops
        `VEHICLE_COLUMNS` and `LOOP_COLUMNS`: the loop of each vehicle, and its edges.
    streets
        `EDGE` and `EDGE_LENGTH`, as in ``streets.parquet``.
    blocked
        What `compute_blocked` returns.
    end_s
        End of the run [s].

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_delayed
    >>> drove = [(0, "a"), (10, "b"), (20, "c"), (30, "a"), (45, "x"), (70, "c"), (80, "a")]
    >>> events = pd.DataFrame(drove, columns=["time_s", "place"]).assign(event="edge", reason="")
    >>> events.loc[3.5] = [31, "a", "reroute", "line~b"]
    >>> found = compute_delayed(
    ...     events=events.sort_index().assign(vehicle="v1"),
    ...     vehicles=pd.DataFrame({"vehicle": ["v1"], "loop": "line"}),
    ...     loops=pd.DataFrame({"loop": "line", "edge": ["a", "b", "c"], "begin_m": [0.0, 100.0, 200.0]}),
    ...     streets=pd.DataFrame({"edge": ["a", "b", "c", "x"], "length_m": [90.0, 90.0, 90.0, 250.0]}),
    ...     blocked=pd.DataFrame({"from_s": [30.0], "to_s": [60.0]}),
    ...     end_s=100,
    ... )
    >>> found[["vehicle", "led_round", "longer_m", "later_s"]].values.tolist()
    [['v1', 1, 160.0, 20.0]]
    """
    check_columns(events, c.EVENT_COLUMNS[:5], "events")
    check_columns(vehicles, (c.VEHICLE, c.LOOP), "vehicles")
    check_columns(loops, c.LOOP_COLUMNS, "loops")
    check_columns(streets, (c.EDGE, c.EDGE_LENGTH), "streets")
    check_columns(blocked, (c.FROM, c.UNTIL), "blocked")
    shut = _shut(blocked)
    if not shut:
        return table([], _DELAYED)
    told = events[list(c.EVENT_COLUMNS[:5])].astype(
        {c.VEHICLE: str, c.EVENT: str, c.PLACE: str, c.REASON: str}
    )
    loop_of = dict(zip(vehicles[c.VEHICLE].astype(str), vehicles[c.LOOP].astype(str), strict=True))
    led = _ways_round(
        told, loop_of, loops, dict(zip(streets[c.EDGE], streets[c.EDGE_LENGTH], strict=True)), shut
    )
    decided = told[c.EVENT].isin((Event.REFUSE, Event.GRANT)).any()
    causes = compute_wait_causes(events=told, end_s=end_s)
    waits = causes[causes[c.CAUSE].isin(_SHUT)].groupby(c.VEHICLE)[c.WAIT].sum()
    waited = {str(vehicle): float(time_s) for vehicle, time_s in waits.items()}
    behind = _behind(told, end_s)
    rows = [
        {
            c.VEHICLE: vehicle,
            c.LOOP: loop_of.get(vehicle, ""),
            c.LED: len(led.get(vehicle, ())),
            c.LONGER: sum(one[0] for one in led.get(vehicle, ())),
            c.LATER: sum(one[1] for one in led.get(vehicle, ())),
            c.SHUT_WAIT: waited.get(vehicle, 0.0) if decided else nan,
            c.SHUT_QUEUE: behind.get(vehicle, 0.0) if decided else nan,
        }
        for vehicle in sorted({*led, *waited, *behind})
    ]
    made = table(rows, _DELAYED)
    order = made.assign(longest=made[[c.SHUT_WAIT, c.SHUT_QUEUE, c.LATER]].fillna(0.0).sum(axis=1))
    return order.sort_values(["longest", c.VEHICLE], ascending=[False, True])[list(_DELAYED)].reset_index(
        drop=True
    )


@dataclass(frozen=True, slots=True)
class _Round:
    """A way round: from the edge of the loop with index `first` to that with index `last`, and its times."""

    first: int
    last: int | None
    """None if it has not ended."""
    since_s: float
    until_s: float
    edges: Sequence[str]
    """The edges driven, with the first and without the last."""


class _Drive:
    """What a vehicle drove, by its events ``edge`` and ``reroute``: along its loop, and its ways round."""

    def __init__(self, edges: Sequence[str], own: str, told: pd.DataFrame) -> None:
        self._edges, self._led = edges, False
        self._away: list[str] = []
        self.stretches: list[list[tuple[int, float]]] = [[]]
        """Index on the loop and time of each edge entered, without a gap."""
        self.rounds: list[_Round] = []
        for time_s, event, place, reason in told.itertuples(index=False):
            if event == Event.REROUTE:
                self._led = reason != own
            elif place in edges:
                self._on_loop(place, time_s)
            elif self._away:
                self._away.append(place)
            elif self._led and self.stretches[-1]:
                self._away = [edges[self.stretches[-1][-1][0]], place]
            else:
                self.stretches.append([])
        if self._away:
            first, since_s = self.stretches[-1][-1]
            self.rounds.append(_Round(first, None, since_s, inf, self._away))

    def _on_loop(self, edge: str, time_s: float) -> None:
        stretch = self.stretches[-1]
        if not stretch:
            stretch.append((self._edges.index(edge), time_s))
            return
        first, since_s = stretch[-1]
        following = (first + 1) % len(self._edges)
        if not self._away and self._edges[following] == edge:
            stretch.append((following, time_s))
            return
        # The same edge again, after a way round, is where it is; otherwise the vehicle has gone on.
        ahead = range(first, first + len(self._edges))
        last = next(k % len(self._edges) for k in ahead if self._edges[k % len(self._edges)] == edge)
        if self._away or self._led:
            driven = self._away or [self._edges[first]]
            self.rounds.append(_Round(first, last, since_s, time_s, driven))
        self._away = []
        self.stretches.append([(last, time_s)])


def _ways_round(
    told: pd.DataFrame,
    loop_of: Mapping[str, str],
    loops: pd.DataFrame,
    length_m: Mapping[str, float],
    shut: Times,
) -> dict[str, list[tuple[float, float]]]:
    """Return for each vehicle by how much each of its ways round was longer [m] and took longer [s]."""
    by_loop = loops.groupby(c.LOOP, sort=False)
    edges_of = {str(loop): part[c.EDGE].astype(str).tolist() for loop, part in by_loop}
    drives: defaultdict[str, dict[str, _Drive]] = defaultdict(dict)
    drove = told[told[c.EVENT].isin((Event.EDGE, Event.REROUTE))].sort_values(c.TIME, kind="stable")
    for vehicle, part in drove.groupby(c.VEHICLE, sort=True):
        loop = loop_of.get(str(vehicle), "")
        if loop in edges_of:
            parts = part[[c.TIME, c.EVENT, c.PLACE, c.REASON]]
            drives[loop][str(vehicle)] = _Drive(edges_of[loop], loop, parts)
    found: defaultdict[str, list[tuple[float, float]]] = defaultdict(list)
    for loop, some in drives.items():
        edges, usual = edges_of[loop], dict[tuple[int, int], float]()
        for vehicle, one in ((name, way) for name, drive in some.items() for way in drive.rounds):
            if one.last is None:
                found[vehicle].append((nan, nan))
                continue
            steps = (one.last - one.first) % len(edges)
            instead = [edges[(one.first + k) % len(edges)] for k in range(steps)]
            longer = sum(length_m.get(e, nan) for e in one.edges) - sum(length_m.get(e, nan) for e in instead)
            if (one.first, steps) not in usual:
                times = pd.Series(list(_usual(some.values(), one.first, steps, shut)), dtype=float)
                usual[one.first, steps] = float(times.median()) if steps else 0.0
            found[vehicle].append((longer, one.until_s - one.since_s - usual[one.first, steps]))
    return dict(found)


def _usual(drives: Iterable[_Drive], first: int, steps: int, shut: Times) -> Iterator[float]:
    """Yield the times that vehicles took along their loop while nothing was shut."""
    for drive in drives:
        for stretch in drive.stretches:
            for (at, since_s), (_, until_s) in zip(stretch, stretch[steps:], strict=False):
                if at == first and not any(since_s < end and begin < until_s for begin, end in shut):
                    yield until_s - since_s


class _Queues:
    """Who is in a place behind a vehicle that is refused since the place ahead is shut, and how long."""

    def __init__(self) -> None:
        self._inside: defaultdict[str, dict[str, float]] = defaultdict(dict)
        """By place: its vehicles, and since when each is in it."""
        self._at: dict[str, str] = {}
        """By vehicle, the place that its front is in."""
        self.refused: dict[str, float] = {}
        self.total_s: defaultdict[str, float] = defaultdict(float)

    def enter(self, vehicle: str, place: str, now: float) -> None:
        self._inside[place][vehicle], self._at[vehicle] = now, place

    def leave(self, vehicle: str, place: str, now: float) -> None:
        if self._at.get(vehicle) == place:
            self.go(vehicle, now)
        self._inside[place].pop(vehicle, None)

    def go(self, vehicle: str, now: float) -> None:
        """Count the wait of a vehicle for those behind it, if it waited."""
        since, mine = self.refused.pop(vehicle, now), self._inside[self._at.get(vehicle, "")]
        for other, entered in mine.items():
            if entered > mine.get(vehicle, inf) and now > since:
                self.total_s[other] += now - max(since, entered)


def _behind(told: pd.DataFrame, end_s: float) -> dict[str, float]:
    """Return how long vehicles were in a place behind one that was refused since the place ahead was shut."""
    enters, leaves = (Event.START, Event.ENTER, Event.RETURN), (Event.LEAVE, Event.END)
    chosen = told[told[c.EVENT].isin((*enters, *leaves, Event.REFUSE, Event.GRANT))]
    queues = _Queues()
    for now, vehicle, event, place, reason in chosen.sort_values(c.TIME, kind="stable").itertuples(
        index=False
    ):
        if event in enters:
            queues.enter(vehicle, place, now)
        elif event in leaves:
            queues.leave(vehicle, place, now)
        elif event == Event.REFUSE and reason in _SHUT:
            queues.refused.setdefault(vehicle, now)
        else:
            queues.go(vehicle, now)
    for vehicle in list(queues.refused):
        queues.go(vehicle, end_s)
    return dict(queues.total_s)
