"""Writes a run folder from FCD output: figures, idleness, deadlocks and positions."""

from __future__ import annotations

import gzip
import shlex
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import chain, islice
from math import inf, nan
from pathlib import Path
from time import perf_counter
from typing import IO, Any

from shapely import LineString, Point

from loopgate.analysis.watching import compute_watch
from loopgate.audit.position_table import ATTRIBUTES
from loopgate.disk import writing
from loopgate.errors import NetworkError, ResultsError
from loopgate.network import RoadNetwork
from loopgate.network.projection import Projection
from loopgate.results.columns import (
    BEGINS,
    EDGE,
    EDGE_LENGTH,
    FLOW_EVERY_S,
    SHAPE,
    STREET,
    STREET_COLUMNS,
    Event,
)
from loopgate.results.recorder import Recorder, read_events
from loopgate.simulation import run_folder
from loopgate.simulation.fcd.film import Film, FilmAhead
from loopgate.simulation.fcd.frames import Frame, SeenVehicle, read_frames
from loopgate.simulation.loop_run import RunCourse, note_deadlock
from loopgate.simulation.monitoring import STREETS, monitoring_figures, shape_text, watch_figures
from loopgate.simulation.run_folder import Folder, Tally
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.watching.deadlock_detector import DeadlockDetector
from loopgate.simulation.watching.flow import Row, flow_table
from loopgate.simulation.watching.road_waits import RoadWaits

_UNKNOWN = (
    "FCD output holds neither collisions, teleports, lights, stops nor lengths: vehicles are taken to be 5 m "
    "long, to depart with the rear at the begin of a lane, and to arrive at the end of one"
)
_LONGEST_STEP_S = 10.0
_OUTSIDE_M = 50.0
"""A vehicle is not farther from the middle of its lane than this, not even on a parking lot [m]."""

_HALF_TURN_DEG = 180.0


def write_fcd_run(
    file: Path,
    network: str,
    out: Path,
    *,
    deadlock_after_s: float = 40.0,
    overwrite: bool = False,
    tell: Callable[[int], None] = lambda _: None,
) -> dict[str, Any]:
    """Write a run folder from FCD output; return the content of its ``summary.json``.

    Deadlocks are circular waits of vehicles that have stood for `deadlock_after_s` without space to go on;
    see `loopgate.simulation.fcd.film`. They are looked for every ten seconds.

    Raises `ResultsError` if the file is no FCD output of this network, `NetworkError` if there is no such
    network, `ScenarioError` if the folder cannot be written.

    Parameters
    ----------
    file
        The file that SUMO wrote with ``--fcd-output``, plain or compressed.
    network
        As for `RoadNetwork.open`.
    out
        The run folder to write.
    deadlock_after_s
        How long vehicles must stand in a circular wait before it counts [s].
    overwrite
        Whether an earlier run in `out` may be replaced.
    tell
        Called from time to time with the simulated seconds so far.
    """
    roads = RoadNetwork.open(network)
    frames = read_frames(file)
    first = list(islice(frames, 2))
    if len(first) < 2:  # noqa: PLR2004  the step is known from two
        msg = f"{file}: there are {len(first)} frames in it; two are needed at least"
        raise ResultsError(msg)
    (begin_s, _), (second_s, _) = first
    step_s = second_s - begin_s
    if step_s > _LONGEST_STEP_S:
        msg = f"{file}: frames are {step_s:g} s apart; expected at most {_LONGEST_STEP_S:g}"
        raise ResultsError(msg)
    with Folder(out, overwrite=overwrite) as folder:
        began = perf_counter()
        film = Film(roads, step_s)
        course = RunCourse(begin_s=begin_s)
        recorder = Recorder(folder / run_folder.EVENTS)
        detector = DeadlockDetector(film, RoadWaits(roads, film), after_s=deadlock_after_s)
        detector.ahead = FilmAhead(file)
        played = _checked(chain(first, frames), file, roads, step_s)
        positions = folder / run_folder.POSITIONS
        try:
            with writing(positions), gzip.open(positions, "wt", 5) as table:
                rows = _play(played, film, detector, recorder, course, table, tell, deadlock_after_s)
            recorder.close()
        except BaseException:
            recorder.close()
            for name in (run_folder.EVENTS, run_folder.POSITIONS):
                (folder / name).unlink(missing_ok=True)
            raise
        course.end_s = film.now_s
        course.total_s = course.sumo_s = perf_counter() - began
        scenario = Scenario(
            network=network, gate="open", lights="keep", step_s=step_s, duration_s=course.end_s - begin_s
        )
        with writing(folder / run_folder.SCENARIO):
            scenario.write(folder / run_folder.SCENARIO)
        tallies = [tally(vehicle, film) for vehicle in sorted(film.courses)]
        of: dict[str, Any] = {"loops": 0, "folder": folder, "warnings": (_UNKNOWN,)}
        summary = run_folder.summary(scenario, course, tallies, **of)
        summary |= write_tables(folder, film, course, rows, roads, tallies)
        summary |= dict.fromkeys(("collisions", "teleports"))  # not known
        words = ["loopgate", "read-fcd", str(file), network, "-o", str(out)]
        summary |= {"command": shlex.join(words), "source": str(file)}
        folder.write_summary(summary)
    return summary


class Reel:
    """Takes frames one after the other: writes positions, and collects the rows of the flow table.

    `table` is the file of positions; `begin_s` when the first interval of the flow begins [s].
    """

    def __init__(self, film: Film, table: IO[str], begin_s: float) -> None:
        self._film, self._table = film, table
        self.rows: list[Row] = []
        self._next_s, self._still, self._steps, self._before_m = begin_s + FLOW_EVERY_S, 0, 0, 0.0
        table.write(";".join(("timestep_time", *(f"vehicle_{name}" for name in ATTRIBUTES))) + "\n")

    def take(self, time_s: float, vehicles: Sequence[SeenVehicle]) -> list[tuple[str, str]]:
        """Take a frame; return the edges that vehicles have entered, each with its vehicle."""
        film = self._film
        entered = film.show(time_s, vehicles)
        for one in vehicles:
            driven = film.courses[one.vehicle].driven_m
            place = f"{one.lane};{one.pos_m:.2f};{one.speed_mps:.2f};{driven:.2f}"
            self._table.write(
                f"{time_s:.2f};{one.vehicle};{place};{one.x_m:.2f};{one.y_m:.2f};{one.angle_deg:.2f}\n"
            )
        self._still, self._steps = self._still + film.standing(), self._steps + 1
        if film.now_s >= self._next_s:
            self._next_s += FLOW_EVERY_S
            driven_m = film.driven_m()
            mean = self._still / self._steps
            self.rows.append((film.now_s, len(vehicles), mean, driven_m - self._before_m, 0))
            self._still, self._steps, self._before_m = 0, 0, driven_m
        return entered


def _play(
    frames: Iterable[Frame],
    film: Film,
    detector: DeadlockDetector,
    recorder: Recorder,
    course: RunCourse,
    table: IO[str],
    tell: Callable[[int], None],
    deadlock_after_s: float,
) -> list[Row]:
    """Play all frames; record entered edges, positions and deadlocks; return the rows of the flow table."""
    reel = Reel(film, table, course.begin_s)
    for time_s, vehicles in frames:
        known = len(reel.rows)
        for vehicle, edge in reel.take(time_s, vehicles):
            recorder.note(film.now_s, vehicle, Event.EDGE, edge)
        if len(reel.rows) == known:
            continue
        tell(int(film.now_s - course.begin_s))
        deadlock = detector.check()
        if deadlock is not None:  # what follows is known, so it counts from when it had lasted long enough
            told_s = min(deadlock.noticed_at_s, deadlock.closed_at_s + deadlock_after_s)
            note_deadlock(replace(deadlock, noticed_at_s=told_s), course, recorder)
    course.roots = detector.roots()
    return reel.rows


def _checked(frames: Iterable[Frame], file: Path, roads: RoadNetwork, step_s: float) -> Iterator[Frame]:
    """Yield the frames with coordinates in metres.

    Refuses missing frames, another network, and a file without vehicles.
    """
    last_s, known, globe = inf, set[str](), None
    for time_s, vehicles in frames:
        if abs(time_s - last_s - step_s) > step_s / 2.0 and last_s < inf:
            msg = f"{file}: after the frame at {last_s:g} s comes {time_s:g} s; expected every {step_s:g} s"
            raise ResultsError(msg)
        last_s = time_s
        if vehicles and not known:
            globe = _globe(vehicles[0], file, roads)
        seen = vehicles if globe is None else _in_metres(vehicles, globe)
        for one in seen:
            if one.vehicle not in known:
                known.add(one.vehicle)
                _check_place(one, file, roads)
        yield time_s, seen
    if not known:
        msg = f"{file}: there is no vehicle in it"
        raise ResultsError(msg)


def _globe(one: SeenVehicle, file: Path, roads: RoadNetwork) -> Projection | None:
    """Return the network's projection if positions are longitude and latitude; None if they are metres."""
    if abs(one.x_m) > _HALF_TURN_DEG or abs(one.y_m) > _HALF_TURN_DEG / 2.0:
        return None
    try:
        globe = Projection.of(roads)
        (there,) = _in_metres([one], globe)
    except NetworkError:
        return None
    return globe if _off_lane_m(there, file, roads) < _off_lane_m(one, file, roads) else None


def _in_metres(vehicles: Sequence[SeenVehicle], globe: Projection) -> list[SeenVehicle]:
    points = globe.plane([(one.x_m, one.y_m) for one in vehicles]).tolist()
    return [one._replace(x_m=x, y_m=y) for one, (x, y) in zip(vehicles, points, strict=True)]


def _off_lane_m(one: SeenVehicle, file: Path, roads: RoadNetwork) -> float:
    """Return how far a vehicle is from its lane [m]; refuse a lane that the network does not have."""
    lane = roads.lanes.get(one.lane)
    if lane is None:
        msg = f"{file}: vehicle {one.vehicle} is on lane {one.lane}, which {roads.file.name} does not have"
        raise ResultsError(msg)
    return LineString(lane.shape).distance(Point(one.x_m, one.y_m))


def _check_place(one: SeenVehicle, file: Path, roads: RoadNetwork) -> None:
    """Refuse output of another network, and coordinates that are none of the network's."""
    if not _off_lane_m(one, file, roads) <= _OUTSIDE_M:
        msg = (
            f"{file}: vehicle {one.vehicle} is at {one.x_m:g}, {one.y_m:g}, far from its lane {one.lane}; "
            "write the FCD output without --fcd-output.geo and --fcd-output.utm"
        )
        raise ResultsError(msg)


def write_tables(
    folder: Folder,
    film: Film,
    course: RunCourse,
    rows: list[Row],
    roads: RoadNetwork,
    tallies: Sequence[Tally],
) -> dict[str, Any]:
    """Write the tables of a film and of the events of its folder; return the figures of streets."""
    period = {"begin_s": course.begin_s, "end_s": course.end_s, "since_s": course.begin_s}
    folder.write_table(flow_table(rows), run_folder.FLOW)
    folder.write_vehicles(tallies)
    events = read_events(folder / run_folder.EVENTS, (Event.EDGE,))
    visited = [roads.edges[name] for name in sorted(set(events["place"])) if name in roads.edges]
    edges = folder.write_edges(
        [
            (e.id, e.length_m, shape_text(e), e.to_junction, film.stood_on.get(e.id, 0.0), e.street)
            for e in visited
        ],
        **period,
    )
    streets = [edge.id for edge in roads.edges.values() if edge.allows("passenger")]
    watched = compute_watch(events=events, streets=streets, bound_s=dict.fromkeys(streets, inf), **period)
    records = [roads.edge(str(name)) for name in watched[EDGE]]
    watched[STREET] = [edge.street for edge in records]
    watched[EDGE_LENGTH] = [edge.length_m for edge in records]
    watched[SHAPE] = [shape_text(edge) for edge in records]
    watched = watched[list(STREET_COLUMNS)]
    folder.write_table(watched, STREETS)
    figures = monitoring_figures(edges, None) | {BEGINS: round(course.begin_s, 3)}
    return figures | {"watch": watch_figures(watched, bound_s=inf)}


def tally(vehicle: str, film: Film) -> Tally:
    """Return the row of a vehicle, without a loop."""
    course = film.courses[vehicle]
    return Tally(
        vehicle=vehicle,
        loop="",
        loop_length_m=0.0,
        laps=0,
        distance_m=course.driven_m,
        hold_s=0.0,
        longest_wait_s=0.0,
        standing_s=film.now_s - course.since_s if film.position(vehicle) else 0.0,
        position_m=film.position(vehicle) or (nan, nan),
        stood_s=course.stood_s,
        longest_stood_s=course.longest_s,
        driven_s=course.last_s - course.first_s,
    )
