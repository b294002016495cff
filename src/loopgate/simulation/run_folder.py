"""The run folder: its files, its tables, and the figures of ``summary.json``."""

import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from math import nan
from pathlib import Path
from typing import Any, Self

import pandas as pd

from loopgate.analysis.junctions import compute_junctions, movement_table
from loopgate.analysis.monitoring import compute_edges
from loopgate.analysis.waits import compute_wait_causes, wait_figures
from loopgate.disk import disk_error, writing
from loopgate.errors import ScenarioError
from loopgate.folders import FolderLock
from loopgate.reading import is_plain
from loopgate.results.columns import (
    ARRIVAL,
    ARRIVED,
    DEPART_DELAY,
    DISTANCE,
    EDGE,
    EDGE_LENGTH,
    HOLD,
    JUNCTION,
    LAPS,
    LONGEST_STOOD,
    LONGEST_WAIT,
    LOOP,
    LOOP_LENGTH,
    MEAN_SPEED,
    SHAPE,
    STANDING,
    STOOD,
    STOPPED,
    STOPS,
    STREET,
    TIME_LOSS,
    TRIP_TIME,
    VEHICLE,
    VEHICLE_COLUMNS,
    WAITING,
    Event,
    X,
    Y,
)
from loopgate.results.histogram import Histogram
from loopgate.results.recorder import read_events
from loopgate.simulation.drive import Drive
from loopgate.simulation.loop_run import RunCourse
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.watching.deadlock_detector import Deadlock
from loopgate.simulation.watching.trips import Trip, trip_figures
from loopgate.versions import versions

EVENTS = "events.parquet"
VEHICLES = "vehicles.parquet"
EDGES = "edges.parquet"
JUNCTIONS = "junctions.parquet"
STOPS_TABLE = "stops.parquet"
VISITS_TABLE = "visits.parquet"
PERSONS_TABLE = "persons.parquet"
FLOW = "flow.parquet"
LOOPS = "loops.parquet"
FRONTS = "fronts.parquet"
SUMMARY = "summary.json"
SCENARIO = "scenario.toml"
SYSTEM = "system.json"
SUMO_LOG = "sumo.log"
POSITIONS = "positions.csv.gz"
LAYOUT = "layout.json"
ORDINARY = "ordinary.rou.xml"
PERSONS = "persons.add.xml"


@dataclass(frozen=True, slots=True)
class Tally:
    """The row of a vehicle in ``vehicles.parquet``: laps, distance and times in the measured time.

    `driven_s`: how long the vehicle was there in that time [s]. `trip`: SUMO's figures of a vehicle that
    drives once.
    """

    vehicle: str
    loop: str
    loop_length_m: float
    laps: int
    distance_m: float
    hold_s: float
    longest_wait_s: float
    standing_s: float
    position_m: tuple[float, float] = (nan, nan)
    stood_s: float = 0.0
    longest_stood_s: float = 0.0
    driven_s: float = 0.0
    depart_delay_s: float = 0.0
    stops: int = 0
    stopped_s: float = 0.0
    trip: Trip | None = None


class Folder:
    """A run folder that one run writes; use it in a ``with`` statement.

    Parameters
    ----------
    path
        The folder; it is made if it does not exist.
    overwrite
        Whether the results of an earlier run in it may be replaced.

    Raises
    ------
    ScenarioError
        If it has results already, another run writes to it, it cannot be made, or SUMO cannot write into it.
    """

    def __init__(self, path: Path, *, overwrite: bool) -> None:
        self.path = path
        for mark, what in {":": "a colon for a port", ",": "a comma for another file"}.items():
            if mark in str(path.relative_to(path.anchor)):
                msg = f"{path}: SUMO takes what follows {what}; choose a folder without one"
                raise ScenarioError(msg)
        if not is_plain(str(path)):
            msg = f"{path}: SUMO takes no name with control characters or outside of UTF-8; choose another"
            raise ScenarioError(msg)
        self._lock = FolderLock(path)
        try:
            self._is_new = not path.exists()
            path.mkdir(parents=True, exist_ok=True)
            self._take(overwrite=overwrite)
        except OSError as error:
            self._lock.release()
            msg = f"{path}: cannot make the run folder ({disk_error(error)})"
            raise ScenarioError(msg) from error
        except BaseException:
            self._lock.release()
            raise

    def _take(self, *, overwrite: bool) -> None:
        if not self._lock.acquire():
            msg = f"{self.path}: another run is writing to it; wait for it, or choose another folder"
            raise ScenarioError(msg)
        if (self / SUMMARY).exists() and not overwrite:
            msg = f"{self.path}: it holds the results of a run; choose another folder, or --overwrite"
            raise ScenarioError(msg)
        for name in (
            SUMMARY,
            EVENTS,
            VEHICLES,
            EDGES,
            JUNCTIONS,
            STOPS_TABLE,
            VISITS_TABLE,
            PERSONS_TABLE,
            FLOW,
            LOOPS,
            FRONTS,
            SYSTEM,
            POSITIONS,
            LAYOUT,
        ):
            (self / name).unlink(missing_ok=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self._lock.release()
        if self._is_new:
            with suppress(OSError):  # it holds results
                self.path.rmdir()

    def __truediv__(self, name: str) -> Path:
        return self.path / name

    def write_vehicles(self, tallies: Sequence[Tally]) -> None:
        """Write ``vehicles.parquet``, with more columns where vehicles drive once."""
        rows = [
            {
                VEHICLE: tally.vehicle,
                LOOP: tally.loop,
                LOOP_LENGTH: tally.loop_length_m,
                LAPS: tally.laps,
                DISTANCE: tally.distance_m,
                MEAN_SPEED: tally.distance_m / tally.driven_s if tally.driven_s > 0 else 0.0,
                HOLD: tally.hold_s,
                LONGEST_WAIT: tally.longest_wait_s,
                STANDING: tally.standing_s,
                X: tally.position_m[0],
                Y: tally.position_m[1],
                STOOD: tally.stood_s,
                LONGEST_STOOD: tally.longest_stood_s,
                STOPS: tally.stops,
                STOPPED: tally.stopped_s,
                DEPART_DELAY: tally.depart_delay_s,
                **_trip_row(tally.trip),
            }
            for tally in tallies
        ]
        columns = [*VEHICLE_COLUMNS, STOOD, LONGEST_STOOD, STOPS, STOPPED, DEPART_DELAY]
        columns += _trip_row(None) if any(tally.trip for tally in tallies) else []
        with writing(self / VEHICLES):
            frame = pd.DataFrame(rows, columns=columns)
            frame.to_parquet(self / VEHICLES, index=False)

    def write_edges(
        self,
        edges: Sequence[tuple[str, float, str, str, float, str]],
        *,
        begin_s: float,
        end_s: float,
        since_s: float = 0.0,
    ) -> pd.DataFrame:
        """Write ``edges.parquet`` from the events.

        `edges`: name, length [m], shape, junction at the end, standing time of vehicles [s], and name of the
        street.
        """
        events = read_events(self / EVENTS, (Event.EDGE, Event.HOLD, Event.GO))
        frame = pd.DataFrame(edges, columns=[EDGE, EDGE_LENGTH, SHAPE, JUNCTION, STOOD, STREET])
        table = compute_edges(
            events=events,
            edges=frame[[EDGE, EDGE_LENGTH, SHAPE]],
            begin_s=begin_s,
            end_s=end_s,
            since_s=since_s,
        )
        table[JUNCTION], table[STOOD] = frame[JUNCTION], frame[STOOD].astype(float)
        table[STREET] = frame[STREET].astype(str)
        self.write_table(table, EDGES)
        return table

    def write_junctions(
        self, movements: Sequence[Mapping[str, Any]], *, begin_s: float, end_s: float
    ) -> None:
        """Write ``junctions.parquet`` from the events; the rest is as in `compute_junctions`."""
        kinds = Event.EDGE, Event.STOP, Event.SERVED, Event.REFUSE, Event.GRANT
        of = {"events": read_events(self / EVENTS, kinds), "movements": movement_table(movements)}
        self.write_table(compute_junctions(**of, begin_s=begin_s, end_s=end_s), JUNCTIONS)

    def write_table(self, table: pd.DataFrame, name: str) -> None:
        """Write a table as a Parquet file of this name."""
        with writing(self / name):
            table.to_parquet(self / name, index=False)

    def write_summary(self, summary: Mapping[str, Any]) -> None:
        """Write ``summary.json``, last of all: a folder with a summary is complete."""
        whole = self / f"{SUMMARY}.part"
        with writing(whole):
            whole.write_text(json.dumps(summary, indent=1) + "\n", encoding="utf-8")
            whole.replace(self / SUMMARY)


_PROMISE_OF = {
    "everyone": "in the model of the trace everyone can go on for ever, after every move, as long as {}; not "
    "how soon",
    "somebody": "in the model of the trace some vehicle can always move and no circular wait forms, as long "
    "as {}; not which vehicle",
}


def summary(
    scenario: Scenario,
    course: RunCourse,
    tallies: Sequence[Tally],
    *,
    loops: int,
    folder: Folder,
    gated: Drive | None = None,
    findings: Sequence[str] = (),
    warnings: Sequence[str] = (),
) -> dict[str, Any]:
    """Return the content of ``summary.json``.

    Parameters
    ----------
    scenario, course, tallies
        The run, its course, and the row of each vehicle.
    folder
        The run folder, for the command that repeats the run.
    gated
        The drive of a gated run; None without a gate.
    findings
        Findings of the audit of a gated run.
    warnings
        Warnings about loops and abstraction.
    """
    duration = max(0.0, course.end_s - course.begin_s)
    times = gated.decision_us if gated else {}
    decisions = Histogram(times.values())
    stage_us = {s: {"count": h.count, **h.summary()} for s, h in sorted(times.items()) if s}
    return {
        "network": scenario.network,
        "abstraction": scenario.abstraction,
        "gate": scenario.gate,
        "negotiation": scenario.rule_for_negotiation if gated else "",
        **promise_figures(
            gated,
            lights=scenario.rule_for_lights != "off",
            others=bool(gated and gated.driving.sight and gated.driving.sight.met),
        ),
        "decide": scenario.decide,
        "lights": scenario.rule_for_lights,
        "spacing": scenario.rule_for_spacing,
        "drivers": scenario.drivers,
        "starts": scenario.rule_for_starts,
        "seed": scenario.seed,
        "vehicles": len(tallies),
        "loops": loops,
        "duration_s": round(duration, 3),
        **_traffic_figures(tallies, duration),
        **_truncated(scenario, course, duration, tallies),
        "outcome": course.outcome,
        "deadlocks": [deadlock_figures(deadlock) for deadlock in course.deadlocks],
        "roots": [asdict(root) for root in course.roots],
        "starving": [sink.figures() for sink in course.starving],
        "collisions": course.collisions,
        "teleports": course.teleports,
        "decisions": decisions.count,
        "refusals": dict(sorted(gated.refusals.items())) if gated else {},
        "stages": {stage: times["count"] for stage, times in stage_us.items()},
        "messages": gated.sent if gated else 0,
        "decision_us": decisions.summary(),
        "stage_us": stage_us,
        "wall_s": {
            "sumo": round(course.sumo_s, 3),
            "gate": round(course.total_s - course.sumo_s - course.ahead_s, 3),
            "ahead": round(course.ahead_s, 3),
            "total": round(course.total_s, 3),
        },
        "audit": (list(findings) or "clean") if gated else "not gated",
        "warnings": list(warnings),
        "versions": versions("eclipse-sumo", "libsumo"),
        "command": scenario.command(str(folder.path)),
    }


def promise_figures(gated: Drive | None, *, lights: bool, others: bool) -> dict[str, str]:
    """Return which vehicles can always go on, as proved for a run like this, and under which conditions.

    `lights`: whether vehicles wait at red lights. `others`: whether there are ordinary vehicles.
    """
    promise = gated.promise(others=others) if gated else ""
    if gated is None or not promise:
        return {"promise": promise, "promise_if": "", "promise_of": ""}
    given = " and ".join(gated.assumptions(lights=lights))
    return {"promise": promise, "promise_if": given, "promise_of": _PROMISE_OF[promise].format(given)}


def waits(folder: Folder, course: RunCourse, streets: Mapping[str, str]) -> dict[str, Any]:
    """Return the longest waits of a gated run and their causes, from its events.

    `streets`: the name of its street by edge.
    """
    if course.end_s <= course.begin_s:
        return wait_figures(None)
    events = read_events(folder / EVENTS, (Event.REFUSE, Event.GRANT))
    causes = compute_wait_causes(events=events, begin_s=course.begin_s, end_s=course.end_s)
    return wait_figures(causes, streets)


def _traffic_figures(tallies: Sequence[Tally], duration_s: float) -> dict[str, Any]:
    laps = sum(t.laps for t in tallies)
    km = sum(t.distance_m for t in tallies) / 1000.0
    hours = duration_s / 3600.0
    vehicle_s = sum(t.driven_s for t in tallies)
    return {
        "laps": laps,
        "distance_km": round(km, 6),
        "mean_speed_mps": round(km * 1000.0 / vehicle_s, 6) if vehicle_s > 0 else 0.0,
        "laps_per_h": round(laps / hours, 6) if hours > 0 else 0.0,
        "km_per_h": round(km / hours, 6) if hours > 0 else 0.0,
        "hold_s": round(sum(t.hold_s for t in tallies), 3),
        "stood_s": round(sum(t.stood_s for t in tallies), 3),
        "stood_share": round(sum(t.stood_s for t in tallies) / vehicle_s, 6) if vehicle_s > 0 else 0.0,
        **_longest_stood(tallies),
        "longest_wait_s": round(max((t.longest_wait_s for t in tallies), default=0.0), 3),
        "vehicles_without_a_lap": sum(1 for t in tallies if t.laps == 0 and t.trip is None),
        **trip_figures(t.trip for t in tallies if t.trip is not None),
    }


def _longest_stood(tallies: Sequence[Tally]) -> dict[str, Any]:
    longest = max(tallies, key=lambda tally: tally.longest_stood_s, default=None)
    if longest is None or longest.longest_stood_s <= 0.0:
        return {"longest_stood_s": 0.0, "longest_stood": None}
    return {"longest_stood_s": round(longest.longest_stood_s, 3), "longest_stood": longest.vehicle}


def _truncated(
    scenario: Scenario, course: RunCourse, duration_s: float, tallies: Sequence[Tally]
) -> dict[str, Any]:
    """Return the throughput over the whole duration, for a run that stopped early at its deadlock."""
    if course.outcome != "deadlock" or scenario.on_deadlock != "stop" or duration_s >= scenario.duration_s:
        return {}
    km, hours = sum(t.distance_m for t in tallies) / 1000.0, scenario.duration_s / 3600.0
    return {"truncated": {"asked_s": scenario.duration_s, "km_per_h": round(km / hours, 6)}}


def _trip_row(trip: Trip | None) -> dict[str, Any]:
    """Return the columns of a vehicle's trip in ``vehicles.parquet``; None is for a vehicle on a loop."""
    return {
        TIME_LOSS: trip.time_loss_s if trip else nan,
        WAITING: trip.waiting_s if trip else nan,
        TRIP_TIME: trip.duration_s if trip else nan,
        ARRIVAL: trip.arrival_s if trip else nan,
        ARRIVED: trip is not None and trip.arrived,
    }


_LAST = "vehicle", "at_s", "gated"


def deadlock_figures(deadlock: Deadlock) -> dict[str, Any]:
    """Return the facts of a deadlock for ``summary.json``."""
    return {
        "closed_at_s": deadlock.closed_at_s,
        "noticed_at_s": deadlock.noticed_at_s,
        "vehicles": list(deadlock.vehicles),
        "places": list(deadlock.places),
        "held_up": deadlock.held_up,
        **({"by": deadlock.by} if deadlock.by else {}),
        **({"last": dict(zip(_LAST, deadlock.last, strict=True))} if deadlock.last else {}),
    }
