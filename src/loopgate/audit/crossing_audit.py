"""Check from recorded positions alone that vehicles exclude each other at crossings and fit into places."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from loopgate.arrays import Floats, Ints
from loopgate.audit.bodies import bends, overlapping
from loopgate.audit.drawing import conflicts_by_loop, find_meetings, lies_above
from loopgate.audit.drawn_bodies import jumps
from loopgate.audit.exclusion import Clash, Exclusion, Passages
from loopgate.audit.layout import Layout
from loopgate.audit.position_table import Positions, read_positions
from loopgate.audit.stretches import lay_stretches
from loopgate.audit.trace_audit import Finding
from loopgate.audit.travel import TOLERANCE_M, LoopTable, Traveller
from loopgate.audit.unmodelled_conflicts import find_unmodelled
from loopgate.results.columns import EVENT, PLACE, REASON, TAKEN_OUT, TIME, VEHICLE, Event

_MOST_FINDINGS = 200
"""How many findings of one rule are reported with their text; further ones are only counted."""

_LAST_STEPS = 1.5
"""How many steps after the last row of its record a vehicle goes off the road, at most."""

_LONG_STAND_S = 3.0
"""A stand in a crossing that lasts longer than this is counted [s].

A vehicle that follows another may stand there for a shorter time.
"""


class _Parked(NamedTuple):
    """A vehicle that parked beside the road at a place, from `begin_s` to `end_s` [s]."""

    vehicle: str
    place: str
    begin_s: float
    end_s: float

    def at(self, time_s: float) -> bool:
        """Return whether the vehicle was parked at a time."""
        return self.begin_s <= time_s <= self.end_s


@dataclass(frozen=True, slots=True)
class PositionAudit:
    """The result of `audit_positions`: the violations that it found, and figures for the summary."""

    findings: Sequence[Finding]
    figures: dict[str, Any]


def audit_positions(
    file: Path,
    layout: Layout,
    events: pd.DataFrame | Iterable[pd.DataFrame],
    *,
    tick: Callable[[float], None] | None = None,
) -> PositionAudit:
    """Check the recorded positions of all vehicles against the layout and the grants.

    A vehicle's body reaches from its front back along its loop, by its length. Between two steps it keeps its
    speed. The rules:

    - *crossing*: two vehicles on conflicting movements are never both on the stretch that these share;
    - *drawn*: the same for stretches that the audit itself finds from the lanes on the map;
    - *conflict*: the layout has each conflict seen on the map over its whole length, and no movement leads
      over a place where a vehicle may wait (no positions needed);
    - *bodies*: no two bodies overlap, as rectangles on the ground at SUMO's positions;
    - *room*: a place never has more bodies than slots;
    - *ahead*: no front is beyond the last granted place;
    - *behind*: no rear is in a place that the vehicle has left according to the trace;
    - *lane*: no vehicle is on a lane outside its loop.

    Parameters
    ----------
    file
        The positions that SUMO recorded, see `loopgate.audit.position_table`.
    layout
        States, crossings and vehicles.
    events
        `EVENT_COLUMNS` of the same run; or consecutive pieces of this table.
    tick
        Called with the simulated time that has been audited [s].

    Returns
    -------
    PositionAudit
        Findings in the order of time, the conflicts first. Time O(n log n) in rows; memory does not grow
        with the length of the run.

    Examples
    --------
    >>> from pathlib import Path
    >>> from loopgate import Scenario, run
    >>> from loopgate.audit import audit_positions, read_layout
    >>> roads = {"network": "networks/ring3.net.xml", "routes": "routes/ring3.rou.xml"}
    >>> made = run(Scenario(**roads, duration_s=60, positions=True), "out/ring3")
    >>> layout = read_layout(Path("out/ring3/layout.json"))
    >>> audit = audit_positions(Path("out/ring3/positions.csv.gz"), layout, made.events)
    >>> audit.findings, audit.figures["rows"]
    ([], 183)
    """
    pieces = [events] if isinstance(events, pd.DataFrame) else events
    return _Audit(layout, pieces).check(file, tick or (lambda _time_s: None))


class _Audit:
    def __init__(self, layout: Layout, events: Iterable[pd.DataFrame]) -> None:
        self._layout = layout
        self._names = list(layout.vehicles)
        lanes = dict.fromkeys(
            lane for loop in layout.loops.values() for span in loop.spans for lane in span.lanes
        )
        self._lanes = {lane: number for number, lane in enumerate(lanes)}
        self._lane_names = list(lanes)
        drawn = find_meetings(layout)
        self._findings: list[Finding] = []
        self._told: Counter[str] = Counter()
        for one, other, text in find_unmodelled(layout, drawn):
            self._add(0.0, "", one, "conflict", f"{one} and {other} {text}")
        stretches = lay_stretches(layout, conflicts_by_loop(layout, drawn))
        self._exclusion = Exclusion(stretches.groups)
        self._groups = stretches.groups
        tables = {
            name: LoopTable(loop, self._lanes, stretches.loops[name]) for name, loop in layout.loops.items()
        }
        parked: list[pd.DataFrame] = []
        grants, leaves, ends = _times(_watched(events, parked), (Event.GRANT, Event.LEAVE, Event.END))
        taken = {name for rows in parked for name in rows[VEHICLE][rows[REASON] == TAKEN_OUT].astype(str)}
        for name in taken & ends.keys():  # SUMO tells it a step late
            ends[name] = ends[name] - layout.step_s
        none = np.zeros(0)
        self._travellers = [
            Traveller(
                number,
                body,
                tables[body.loop],
                grants.get(name, none),
                leaves.get(name, none),
                float(ends[name][-1]) if name in ends else np.inf,
            )
            for number, (name, body) in enumerate(layout.vehicles.items())
        ]
        bodies = layout.vehicles.values()
        self._length_m = np.array([body.length_m for body in bodies])
        self._width_m = np.array([body.width_m for body in bodies])
        self._jumped_to = {
            span.driven[0]
            for loop in layout.loops.values()
            for k, span in enumerate(loop.spans)
            if jumps(loop.spans[k - 1], span)
        }
        self._beside = _parked(parked)
        self._touching: set[tuple[int, int]] = set()
        self._astray: dict[int, str] = {}
        self._rows = 0
        self._stands = 0
        self._longest_stand: tuple[float, int, int, float] = (0.0, -1, -1, 0.0)

    def check(self, file: Path, tick: Callable[[float], None]) -> PositionAudit:
        numbers = {name: number for number, name in enumerate(self._names)}
        for positions in read_positions(file, numbers, self._lanes, self._layout.step_s):
            self._piece(positions)
            tick(float(positions.time_s[-1]))
        for traveller in self._travellers:
            self._note_stands(traveller.number, traveller.last_stand())
        order = sorted(self._findings, key=lambda f: f.at_s)
        more = [
            Finding(0.0, "", "", rule, f"{count - _MOST_FINDINGS} more findings of the rule {rule!r}")
            for rule, count in sorted(self._told.items())
            if count > _MOST_FINDINGS
        ]
        return PositionAudit([*order, *more], self._figures())

    def _figures(self) -> dict[str, Any]:
        longest, vehicle, lane, from_s = self._longest_stand
        figures: dict[str, Any] = {
            "rows": self._rows,
            "margin_s": self._exclusion.margins["crossing"].summary(),
            "drawn_margin_s": self._exclusion.margins["drawn"].summary(),
            "stands_in_crossings": self._stands,
            "longest_stand_s": round(longest, 3),
        }
        if vehicle >= 0:
            figures["longest_stand"] = {
                "vehicle": self._names[vehicle],
                "lane": self._lane_names[lane],
                "at_s": from_s,
            }
        return figures

    def _piece(self, positions: Positions) -> None:
        self._rows += len(positions.time_s)
        order = np.argsort(positions.vehicle, kind="stable")
        vehicle = positions.vehicle[order]
        cuts = np.flatnonzero(np.diff(vehicle)) + 1
        entered: list[Passages] = []
        left: list[Passages] = []
        arcs = np.full(len(order), np.nan)
        for rows in np.split(order, cuts):
            number = int(positions.vehicle[rows[0]])
            if number >= 0:
                arcs[rows] = self._vehicle(self._travellers[number], positions, rows, entered, left)
        self._bodies(positions, arcs)
        for clash in self._exclusion.judge(Passages.join(entered), Passages.join(left)):
            self._clash(clash)

    def _vehicle(
        self,
        traveller: Traveller,
        positions: Positions,
        rows: Ints,
        entered: list[Passages],
        left: list[Passages],
    ) -> Floats:
        """Judge the rows of one vehicle; return the positions of its front, see `Traveller.arcs`."""
        name = self._names[traveller.number]
        lane, time, speed = positions.lane[rows], positions.time_s[rows], positions.speed_mps[rows]
        found = arcs = traveller.arcs(lane, positions.pos_m[rows], positions.odometer_m[rows])
        known = ~np.isnan(arcs)
        if not known.all():
            self._stray(traveller.number, positions, rows[~known])
            arcs, lane, time, speed = arcs[known], lane[known], time[known], speed[known]
            if not len(arcs):
                return found
        came, went = traveller.pass_over(time, arcs)
        entered.append(came)
        left.append(went)
        if time[-1] >= traveller.end_s - _LAST_STEPS * self._layout.step_s:
            left.append(traveller.gone(traveller.end_s))
        for rule, (at, by) in (
            ("ahead", traveller.ungranted(time, arcs, TOLERANCE_M)),
            ("behind", traveller.left_too_early(time, arcs)),
        ):
            for k, metres in zip(at.tolist(), by.tolist(), strict=True):
                where = self._lane_names[int(lane[k])]
                what = "beyond its grant" if rule == "ahead" else "still in a place it is said to have left"
                self._add(float(time[k]), name, where, rule, f"{name}: on {where}, {metres:.1f} m {what}")
        self._note_stands(traveller.number, traveller.stands(time, arcs, speed, lane))
        return found

    def _stray(self, number: int, positions: Positions, rows: Ints) -> None:
        for row in rows.tolist():
            lane = str(positions.lane_name[row])
            if self._astray.get(number) != lane:
                self._astray[number] = lane
                text = f"{self._names[number]}: on {lane}, which is not on its loop"
                self._add(float(positions.time_s[row]), self._names[number], lane, "lane", text)

    def _note_stands(self, vehicle: int, stands: Iterable[tuple[float, float, int]]) -> None:
        for begin, end, lane in stands:
            lasted = end - begin + self._layout.step_s
            self._stands += lasted > _LONG_STAND_S
            if lasted > self._longest_stand[0]:
                self._longest_stand = (lasted, vehicle, lane, begin)

    def _clash(self, clash: Clash) -> None:
        group = self._groups[clash.group]
        name = self._names[clash.vehicle]
        if group.kind == "place":
            place = group.names[0]
            beside = [one for one in self._beside if one.place == place and one.at(clash.time_s)]
            if clash.by - len(beside) <= group.room:
                return  # vehicles that are parked take no slot
            text = f"{place}: holds {group.room}, but {name} is number {clash.by:.0f} on it"
            self._add(clash.time_s, name, place, "room", text)
            return
        one, two = group.names
        early = "is still there" if np.isinf(clash.by) else f"leaves {clash.by:.2f} s later"
        text = f"{name}: on the stretch that {one} and {two} share, while {self._names[clash.other]} {early}"
        self._add(clash.time_s, name, one, group.kind, text)

    def _bodies(self, positions: Positions, arcs_m: Floats) -> None:
        known = positions.vehicle >= 0
        if not known.all():
            columns = (getattr(positions, name)[known] for name in Positions.__slots__)
            positions, arcs_m = Positions(*columns), arcs_m[known]
        if not len(positions.time_s):
            return
        vehicle = positions.vehicle
        last = positions.time_s[-1]
        now: set[tuple[int, int]] = set()
        before: dict[tuple[int, int], float] = dict.fromkeys(self._touching, -np.inf)
        bent = bends(self._layout, self._names, positions, arcs_m)
        hits = overlapping(positions, self._length_m[vehicle], self._width_m[vehicle], bent)
        for a, b in hits[np.argsort(positions.time_s[hits[:, 0]], kind="stable")].tolist():
            lanes = str(positions.lane_name[a]), str(positions.lane_name[b])
            if lies_above(self._layout, *lanes) or self._cannot_touch(positions, a, b):
                continue
            time = float(positions.time_s[a])
            names = self._names[int(vehicle[a])], self._names[int(vehicle[b])]
            pair = (int(vehicle[a]), int(vehicle[b]))
            pair = (min(pair), max(pair))
            if time == last:
                now.add(pair)
            if any(one.vehicle in names and one.at(time) for one in self._beside):
                continue
            since = before.get(pair)
            before[pair] = time
            if since is not None and (np.isinf(since) or time - since <= self._layout.step_s + 1e-6):
                continue  # reported when the overlap began
            text = f"{names[0]} on {lanes[0]} and {names[1]} on {lanes[1]}: their bodies overlap"
            self._add(time, names[0], lanes[0], "bodies", text)
        self._touching = now

    def _cannot_touch(self, positions: Positions, a: int, b: int) -> bool:
        """Return whether two bodies whose drawn rectangles overlap cannot touch on the road.

        A lane may be drawn shorter than it is: then the rectangles of two vehicles, one behind the other on
        that lane, overlap, although their positions along the lane do not.
        """
        for row in (a, b):
            length_m = self._length_m[positions.vehicle[row]]
            if positions.lane_name[row] in self._jumped_to and positions.pos_m[row] < length_m + TOLERANCE_M:
                return True  # without lanes inside junctions there is no direction while it gets over
        if positions.lane_name[a] != positions.lane_name[b]:
            return False
        first, last = (a, b) if positions.pos_m[a] >= positions.pos_m[b] else (b, a)
        length_m = self._length_m[positions.vehicle[first]]
        return bool(positions.pos_m[first] - length_m >= positions.pos_m[last])

    def _add(self, at_s: float, vehicle: str, place: str, rule: str, text: str) -> None:
        self._told[rule] += 1
        if self._told[rule] <= _MOST_FINDINGS:
            self._findings.append(Finding(at_s, vehicle, place, rule, f"{at_s:.0f} s: {text}"))


def _times(pieces: Iterable[pd.DataFrame], kinds: Sequence[Event]) -> list[dict[str, Floats]]:
    """Return, for each kind of event, the times of each vehicle's events of that kind [s]."""
    found: list[dict[str, list[Floats]]] = [{} for _ in kinds]
    for events in pieces:
        for kind, times in zip(kinds, found, strict=True):
            rows = events[events[EVENT] == kind.value]
            for name, group in rows.groupby(VEHICLE, sort=False, observed=True)[TIME]:
                times.setdefault(str(name), []).append(group.to_numpy(dtype=np.float64))
    return [{name: np.concatenate(parts) for name, parts in times.items()} for times in found]


def _watched(pieces: Iterable[pd.DataFrame], kept: list[pd.DataFrame]) -> Iterator[pd.DataFrame]:
    """Yield the pieces unchanged, and add to `kept` the events of parking, returning and leaving for good."""
    for events in pieces:
        kept.append(events[events[EVENT].isin([Event.PARK.value, Event.RETURN.value, Event.END.value])])
        yield events


def _parked(pieces: Iterable[pd.DataFrame]) -> list[_Parked]:
    """Return each time that a vehicle was parked beside the road."""
    found: list[_Parked] = []
    begun: dict[str, _Parked] = {}
    for events in pieces:
        columns = [events[name].astype(str).to_list() for name in (VEHICLE, EVENT, PLACE)]
        for vehicle, event, place, at_s in zip(*columns, events[TIME].to_list(), strict=True):
            if event == Event.PARK:
                begun[vehicle] = _Parked(vehicle, place, at_s, np.inf)
            elif vehicle in begun:
                found.append(begun.pop(vehicle)._replace(end_s=at_s))
    return [*found, *begun.values()]
