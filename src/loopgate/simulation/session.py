"""A simulation under way: its parts, and its results at the end."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf, nan
from typing import Any, Protocol

import pandas as pd

from loopgate.analysis.junctions import FREE, GREEN, LIT, queue_figures
from loopgate.analysis.standing import edge_of
from loopgate.analysis.stops import compute_stops
from loopgate.audit import audit_events, audit_positions, read_layout
from loopgate.audit.layout import LoopLeg
from loopgate.control.driving import Driving
from loopgate.disk import writing
from loopgate.gates import Reason
from loopgate.model import Robot, RobotId, StateId
from loopgate.network import Edge
from loopgate.network.coverage import measure_coverage
from loopgate.reading import counted, listed
from loopgate.results.columns import (
    BEGINS,
    EDGE,
    FLOW_EVERY_S,
    JUNCTION,
    MOVEMENT,
    QUEUE,
    QUEUE_95,
    QUEUE_MOST,
    TIME,
    TO_EDGE,
    VISIT_COLUMNS,
    WAITING_COLUMNS,
    WENT_ON,
    Event,
)
from loopgate.results.recorder import Recorder, read_event_pieces, read_events
from loopgate.simulation import run_folder
from loopgate.simulation.assembly import Assembly
from loopgate.simulation.containment import Containment
from loopgate.simulation.departures import Arrived, Departures
from loopgate.simulation.drive import Drive
from loopgate.simulation.lane_choice import LaneChoice
from loopgate.simulation.loop_run import RunCourse
from loopgate.simulation.monitoring import monitoring_figures, note_unwatched, shape_text, write_streets
from loopgate.simulation.rerouting import Rerouting
from loopgate.simulation.run_folder import Folder, Tally
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.sumo.greens import take_greens
from loopgate.simulation.sumo.start import TRIPS
from loopgate.simulation.watching.deadlock_detector import DeadlockDetector
from loopgate.simulation.watching.flow import Row, flow_table, loop_table, with_last_parts
from loopgate.simulation.watching.trips import (
    Trip,
    gated_trips,
    read_trips,
    trip_figures,
    write_depart_delays,
)
from loopgate.simulation.ways_round import TurnOff
from loopgate.traffic.base import Traffic

_ALWAYS = ("places", "capacities", "progress", "entries")
"""Checks that need only the events of a gated run."""


def audit_run(
    scenario: Scenario,
    assembly: Assembly,
    tallies: Sequence[Tally],
    folder: Folder,
    departed: Container[str],
    turned: Collection[str] = (),
) -> tuple[list[str], dict[str, Any]]:
    """Audit a run from its folder; return the findings, and figures for ``summary.json``.

    Where positions were recorded, bodies and crossings are checked too. `departed`: the vehicles that
    departed during the run. `turned`: the vehicles that changed to another path.
    """
    abstraction = assembly.abstraction
    if abstraction is None:
        return [], {}
    trace = folder / run_folder.EVENTS
    laps = {tally.vehicle: tally.laps for tally in tallies}
    layout = read_layout(folder / run_folder.LAYOUT)
    ways = {vehicle: layout.loops[body.loop].legs for vehicle, body in layout.vehicles.items()}
    joined = [
        Robot(
            RobotId(one.vehicle),
            tuple(StateId(leg.state) for leg in ways[one.vehicle]),
            closed=one.loop.closed and one.vehicle not in turned,
            start=one.track.position,
        )
        for one in assembly.departures
        if one.track.legs and one.vehicle in departed
    ]
    joined += _turned(assembly, ways, turned)
    laps = {vehicle: count for vehicle, count in laps.items() if vehicle not in turned}
    room = abstraction.room if joined else {}
    found = audit_events(
        read_event_pieces(trace),
        abstraction.system,
        laps=laps,
        joined=joined,
        room=room,
        metres=layout.metres,
        needed_m={name: body.needed_m for name, body in layout.vehicles.items()},
    )
    findings = [finding.text for finding in found]
    figures: dict[str, Any] = {"audited": list(_ALWAYS)}
    if scenario.positions:
        seen = audit_positions(folder / run_folder.POSITIONS, layout, read_event_pieces(trace))
        findings += [finding.text for finding in seen.findings]
        figures = {"audited": [*_ALWAYS, "crossings", "bodies"], "positions": seen.figures}
    return findings, figures


def _turned(
    assembly: Assembly, ways: Mapping[str, Sequence[LoopLeg]], turned: Collection[str]
) -> list[Robot]:
    """Return each vehicle that left its loop for another, with all that it drove as one open path."""
    return [
        Robot(
            RobotId(start.vehicle),
            tuple(StateId(leg.state) for leg in ways[start.vehicle]),
            closed=False,
            start=start.track.position,
        )
        for start in assembly.starts
        if start.vehicle in turned and start.loop.closed
    ]


_MOST_SINKS = 5


def is_clean(summary: Mapping[str, Any]) -> bool:
    """Return whether a gated run had no collision, overrun or trespass, and no finding of the audit."""
    counted = (summary[name] for name in ("collisions", "overruns", "trespasses"))
    return summary["audit"] == "clean" and not any(counted)


def _starved(sink: Mapping[str, Any], promise: str) -> str:
    """Say which vehicle stood, why, when, and how many vehicles starved behind it."""
    others = [vehicle for vehicle in sink["vehicles"] if vehicle != sink["behind"]]
    time = f"from {sink['noticed_s']:g} s to {sink['until_s']:g} s"
    time += f", when the promise that {promise} can go on did not hold" if promise else ""
    if not sink["behind"]:
        return f"{counted(len(others), 'vehicle')} starved at gates ({sink['why']}): {time}"
    stood = f"{sink['behind']} stood on lane {sink['lane']} ({sink['why']})"
    behind = f", and {counted(len(others), 'vehicle')} starved behind it" if others else ""
    return f"{stood}{behind}: {time}"


def warnings_of(summary: Mapping[str, Any]) -> list[str]:
    """Return warnings about vehicles that broke a refusal, strayed or starved."""
    lines = []
    if summary["overruns"]:
        lines.append(
            f"{counted(summary['overruns'], 'held vehicle')} could not brake for their line, or did not, and "
            "were stopped as hard as possible: the events 'overrun' name them and the places"
        )
    if summary["trespasses"]:
        lines.append(
            f"{counted(summary['trespasses'], 'vehicle')} entered a state without a grant: the events "
            "'enter' with the reason 'not granted' name them and the places"
        )
    if summary["strays"]:
        lines.append(
            f"SUMO took {counted(summary['strays'], 'vehicle')} to a lane outside their loop; they were led "
            "back: the events 'stray' name them and the places"
        )
    sinks = sorted(summary["starving"], key=lambda sink: -len(sink["vehicles"]))
    lines += [_starved(sink, summary["promise"]) for sink in sinks[:_MOST_SINKS]]
    if len(sinks) > _MOST_SINKS:
        lines.append(f"vehicles starved at {len(sinks) - _MOST_SINKS} more places: the summary lists all")
    if no_way := summary.get("standing", {}).get("no_way_round"):
        lines.append(
            f"vehicles on {listed(no_way)} had no way round what stood, or must stop on their loop: "
            "they waited before it"
        )
    if faults := summary["refusals"].get(Reason.FAULT.value):
        lines.append(
            f"{faults} moves were refused because the witness failed the gate's own check; this is a "
            "fault of loopgate: please report it with the scenario"
        )
    return lines


@dataclass(frozen=True, slots=True)
class Made:
    """How many stops a vehicle has made, and for how long it stood at them [s]."""

    served: int = 0
    stood_s: float = 0.0


class Reports(Protocol):
    """A part of a run that reports figures at the end."""

    def report(self) -> Mapping[str, Any]:
        """Return figures for ``summary.json``."""


class StopFigures:
    """Figures of the stops that vehicles make in a run."""

    def __init__(self, driving: Driving, traffic: Traffic) -> None:
        self._stops, self._parking, self._traffic = driving.stops, driving.parking, traffic
        self.bus_stops = driving.stops.bus_stops
        self._next_s = -inf
        self._waiting: list[tuple[float, str, int]] = []
        self._peopled = False
        """Whether there have been persons in the simulation."""

    def look(self) -> None:
        """Count the persons who wait at each bus stop; once in `FLOW_EVERY_S`."""
        now_s = self._traffic.now_s
        if now_s < self._next_s:
            return
        self._next_s = now_s + FLOW_EVERY_S
        for name in self.bus_stops:
            count = self._traffic.persons_at(name)
            self._peopled |= count is not None
            self._waiting.append((now_s, name, count or 0))

    def waiting(self, since_s: float) -> pd.DataFrame:
        """Return how many persons waited at bus stops since a time [s], with `WAITING_COLUMNS`.

        The table is empty if there have been no persons at all: the first may come late, all may go home.
        """
        rows = self._waiting if self._peopled else []
        return pd.DataFrame(rows, columns=list(WAITING_COLUMNS)).query(f"{TIME} >= {since_s}")

    def of(self, vehicle: str) -> Made:
        """Return the figures of the stops of a vehicle."""
        return Made(*self._stops.made.get(vehicle, (0, 0.0)))

    def visits(self, since_s: float) -> pd.DataFrame:
        """Return the stops completed since a time [s], with the columns `VISIT_COLUMNS`."""
        return pd.DataFrame(self._stops.visits, columns=list(VISIT_COLUMNS)).query(f"{WENT_ON} > {since_s}")

    def report(self) -> dict[str, Any]:
        """Return the figures of stops for ``summary.json``."""
        stops, parking = self._stops, self._parking
        if not stops.any:
            return {}
        return {
            "stops": {
                "served": stops.served,
                "missed": stops.missed,
                "stopped_s": round(sum(stood_s for _, stood_s in stops.made.values()), 3),
                "under_way": sum(1 for _ in stops.made_now()),
                "late_back_s": round(parking.late_s, 3),
                "longest_late_back_s": round(parking.latest_s, 3),
            }
        }


_ON_SEGMENTS = (
    "lights: on segments no state ends at a light, so a vehicle holds its zone while it waits there at a red"
)

_COUNTED = "distance_m", "hold_s", "stood_s", "longest_stood_s", "longest_wait_s"
"""Figures of a vehicle that has arrived; 0 if it arrived before the measured time."""


@dataclass(frozen=True, slots=True)
class Session:
    """The parts of a running simulation.

    Attributes
    ----------
    traffic, drive, recorder
        The simulation, the drive, and the recorder of events.
    gated
        The drive, if a gate rules; otherwise None.
    surroundings
        Figures of lights and ordinary traffic; None without a gate.
    stops, departures
        Figures of stops; wanted and real departures.
    rerouting, lanes, containment
        Reroutes trips; chooses lanes for trips; leads vehicles round standing ones. None without.
    each_step
        Functions to call after each step.
    notes
        Warnings to show before the warnings of the run: settings that SUMO did not get, ordinary vehicles
        that are left out, places that parked vehicles keep.
    close
        Ends the processes that the run started beside SUMO.
    """

    traffic: Traffic
    drive: Drive
    recorder: Recorder
    gated: Drive | None
    surroundings: Reports | None
    stops: StopFigures
    departures: Departures
    rerouting: Rerouting | None
    lanes: LaneChoice | None
    containment: Containment | None
    each_step: tuple[Callable[[], None], ...]
    notes: tuple[str, ...]
    close: Callable[[], None] = lambda: None

    @property
    def turns(self) -> Mapping[str, Sequence[TurnOff]]:
        """The changes to other paths, by name of the vehicle."""
        every = (self.rerouting, self.lanes, self.containment)
        return {vehicle: some for one in every if one for vehicle, some in one.turns.items() if some}

    def tallies(self, assembly: Assembly, detector: DeadlockDetector, course: RunCourse) -> list[Tally]:
        """Return the row of each vehicle that has wanted to depart by now."""
        now, drivers, departures = course.end_s, self.drive.records, self.departures
        on_road = set(self.traffic.vehicles())
        loops = {start.vehicle: start.loop for start in assembly.everybody}
        tallies = []
        for vehicle in assembly.names:
            driver, loop = drivers.get(vehicle), loops[vehicle]
            wanted_s = departures.wanted_s.get(vehicle)
            if wanted_s is not None and wanted_s > now:
                continue
            came_s = course.begin_s
            if wanted_s is not None:  # a vehicle does not move in the step in which it departs
                came_s = max(departures.departed_s.get(vehicle, now) + self.traffic.step_s, came_s)
            stops = self.stops.of(vehicle)
            gone = departures.arrived.get(vehicle)
            if gone is not None and gone.at_s <= course.begin_s:
                none = dict.fromkeys(_COUNTED, 0.0)
                gone = replace(gone, **none)
            seen_s = (now if gone is None else gone.at_s) - came_s
            tally = Tally(
                vehicle=vehicle,
                loop=loop.id,
                loop_length_m=loop.length_m,
                laps=driver.laps if driver else 0,
                distance_m=driver.distance_m if driver else gone.distance_m if gone else 0.0,
                hold_s=driver.total_hold_s(now) if driver else gone.hold_s if gone else 0.0,
                longest_wait_s=driver.worst_wait_s(now) if driver else gone.longest_wait_s if gone else 0.0,
                standing_s=detector.standing_s(vehicle),
                position_m=self.traffic.position(vehicle) if vehicle in on_road else (nan, nan),
                stood_s=driver.stood_s if driver else gone.stood_s if gone else 0.0,
                longest_stood_s=driver.longest_stood_s if driver else gone.longest_stood_s if gone else 0.0,
                driven_s=max(0.0, seen_s),
                depart_delay_s=departures.delay_s(vehicle, now),
                stops=stops.served,
                stopped_s=stops.stood_s,
            )
            tallies.append(tally)
        return tallies

    def report(self, end_s: float) -> dict[str, Any]:
        """Return the figures of lights, stops, departures, rerouting and messages at the end of the run.

        `end_s`: when the run ended [s].
        """
        told = dict(self.surroundings.report() if self.surroundings else {})
        told |= {**self.stops.report(), **self.departures.report(end_s)}
        told |= self.rerouting.report() if self.rerouting else {}
        told |= self.lanes.report() if self.lanes else {}
        told |= self.containment.report() if self.containment else {}
        return told | dict(self.gated.report() if self.gated else {})


def sum_up(
    scenario: Scenario,
    assembly: Assembly,
    session: Session,
    course: RunCourse,
    tallies: Sequence[Tally],
    told: dict[str, Any],
    flow: list[Row],
    folder: Folder,
) -> dict[str, Any]:
    """Write the tables of a finished run; return the content of ``summary.json``.

    Parameters
    ----------
    session
        Its simulation is closed, so that SUMO's files are complete.
    tallies, told
        The rows of vehicles, and the figures of `Session.report`.
    flow
        The rows of the flow table.
    """
    if assembly.trips:
        tallies = _with_trips(assembly, session, tallies, folder, course)
        told.pop("mean_depart_delay_s", None)  # trips have it among their other delays
    folder.write_table(flow_table(with_last_parts(flow, _last_parts(session, tallies))), run_folder.FLOW)
    ways = {loop.id: [(span.begin_m, span.edge) for span in loop.roads] for loop in assembly.loops}
    folder.write_table(loop_table(ways), run_folder.LOOPS)
    summary = _summary(scenario, assembly, session, course, tallies, folder)
    summary |= {name: getattr(session.drive, name) for name in ("overruns", "trespasses", "strays")}
    summary["clean"] = is_clean(summary) if session.gated else None
    of_lights = told.pop("warnings", [])
    if "at_lights" in told and scenario.abstraction == "segments":
        of_lights = [_ON_SEGMENTS]
    summary["warnings"] = [*session.notes, *summary["warnings"], *warnings_of(summary | told), *of_lights]
    if taken := session.drive.taken_out:
        summary["warnings"].append(
            f"{taken[0]}: SUMO took it out before the end of its route, as calibrators do "
            f"({counted(len(taken), 'vehicle')} in all); they count as unfinished"
        )
    if leaps := session.drive.leaps:
        vehicle, at_s, by_m = leaps[0]
        summary["warnings"].append(
            f"{vehicle}: its odometer leapt by {by_m:.0f} m at {at_s:.0f} s, as where a train turns round or "
            f"a vehicle is moved ({len(leaps)} leaps in all); distances count what was driven"
        )
    if standing := told.get("standing"):
        tracks = [start.track for start in assembly.everybody]
        events = read_events(folder / run_folder.EVENTS, (Event.EDGE,))
        period = {"begin_s": course.begin_s, "end_s": course.end_s}
        note_unwatched(standing["blocked"], tracks, events, **period)
        for one in standing["blocked"]:
            edge = assembly.network.edges.get(edge_of(one["place"]))
            one["street"] = edge.street if edge else ""
    summary |= told
    if scenario.traffic or assembly.others:
        summary["collisions_by_others"] = sum(one.erred == "ordinary" for one in course.verdicts)
        others = summary.setdefault("others", {})
        others["collisions"] = course.collisions_of_others
        others["verdicts"] = [one.figures() for one in course.verdicts]
    if assembly.others:
        mine = set(assembly.others)
        trips = read_trips(folder / TRIPS, interrupted=course.outcome == "interrupted").values()
        summary["others"] |= trip_figures(trip for trip in trips if trip.vehicle in mine)
    return summary


def _with_trips(
    assembly: Assembly, session: Session, tallies: Sequence[Tally], folder: Folder, course: RunCourse
) -> list[Tally]:
    """Return the rows of the vehicles, with SUMO's figures of trips."""
    mine, departures = [tally for tally in tallies if tally.vehicle in assembly.trips], session.departures
    delays_s = {tally.vehicle: tally.depart_delay_s for tally in mine}
    driven = read_trips(folder / TRIPS, held=True, interrupted=course.outcome == "interrupted")
    if driven:
        with writing(folder / TRIPS):
            write_depart_delays(folder / TRIPS, delays_s)
    trips = gated_trips(
        driven,
        delays_s,
        {tally.vehicle: tally.stopped_s for tally in mine},
        departures.arrived,
        departures.wanted_s.keys() - departures.departed_s.keys(),
    )
    return [_with_trip(tally, trips.get(tally.vehicle), session, course) for tally in tallies]


def _with_trip(tally: Tally, trip: Trip | None, session: Session, course: RunCourse) -> Tally:
    """Return the row of a trip with the distance of its last step, for which it has no odometer."""
    gone = session.departures.arrived.get(tally.vehicle)
    if trip is None or gone is None or gone.at_s <= course.begin_s:
        return replace(tally, trip=trip)
    return replace(tally, trip=trip, distance_m=tally.distance_m + _last_part_m(gone, trip, session))


def _last_part_m(gone: Arrived, trip: Trip, session: Session) -> float:
    return trip.last_part_m(gone.odometer_m, gone.top_mps * session.traffic.step_s)


def _last_parts(session: Session, tallies: Sequence[Tally]) -> Iterator[tuple[float, float]]:
    """Yield when each trip arrived [s], and its distance in the last step [m]."""
    for tally in tallies:
        gone = session.departures.arrived.get(tally.vehicle)
        if gone is not None and tally.trip is not None:
            yield gone.at_s, _last_part_m(gone, tally.trip, session)


def _summary(
    scenario: Scenario,
    assembly: Assembly,
    session: Session,
    course: RunCourse,
    tallies: Sequence[Tally],
    folder: Folder,
) -> dict[str, Any]:
    gated, step_s = session.gated, session.traffic.step_s
    duration = max(0.0, course.end_s - course.begin_s)
    folder.write_vehicles(tallies)
    queues, stood_s = session.drive.queues, dict[str, float]()
    for (edge, _), lengths in queues.items():
        stood_s[edge] = stood_s.get(edge, 0.0) + sum(
            length * steps * step_s for length, steps in lengths.items()
        )
    rows = {
        edge: _edge_row(assembly.network.edge(edge), stood_s.get(edge, 0.0))
        for loop in assembly.loops
        for edge in loop.edges
    }
    edges, watch = None, dict[str, Any]()
    if duration > 0:
        period = {"begin_s": course.begin_s, "end_s": course.end_s}
        edges = folder.write_edges(list(rows.values()), since_s=assembly.begin_s, **period)
        watch = write_streets(scenario, assembly, tallies, folder, **period)
        lit = scenario.rule_for_lights == "obey" or not scenario.gated
        greens = take_greens(folder.path, **period)
        movements = _movements(assembly, queues, round(duration / step_s), lit=lit, greens=greens)
        folder.write_junctions(movements, **period)
        waiting = session.stops.waiting(course.begin_s)
        if len(waiting):
            folder.write_table(waiting, run_folder.PERSONS_TABLE)
        if len(visits := session.stops.visits(course.begin_s)):
            folder.write_table(visits, run_folder.VISITS_TABLE)
            folder.write_table(
                compute_stops(visits=visits, waiting=waiting),
                run_folder.STOPS_TABLE,
            )
    waits: dict[str, Any] = {}
    findings: list[str] = []
    audited: dict[str, Any] = {}
    if gated is not None:
        findings, audited = audit_run(
            scenario, assembly, tallies, folder, session.departures.departed_s, session.turns
        )
        streets = {edge.id: edge.street for edge in assembly.network.edges.values()}
        waits = run_folder.waits(folder, course, streets)
    figures = run_folder.summary(
        scenario,
        course,
        tallies,
        loops=len(assembly.loops),
        folder=folder,
        gated=gated,
        findings=findings,
        warnings=(*assembly.warnings, *(assembly.abstraction.warnings if assembly.abstraction else ())),
    )
    figures |= waits | audited | monitoring_figures(edges, measure_coverage(assembly.network, assembly.loops))
    return figures | {BEGINS: assembly.begin_s, "watch": watch}


def _movements(
    assembly: Assembly,
    queues: Mapping[tuple[str, str], Mapping[int, int]],
    steps: int,
    *,
    lit: bool,
    greens: Mapping[tuple[str, str], float],
) -> list[dict[str, Any]]:
    """Return the movements on all paths, each with its time at the speed limits and its queue.

    `lit`: whether vehicles obey traffic lights. `greens`: the green time of each movement [lane s].
    """
    lanes, found = assembly.network.lanes, dict[tuple[str, str], dict[str, Any]]()
    named = {edge.id: edge.street or edge.id for edge in assembly.network.edges.values()}
    for way in {start.loop.id: start.loop for start in (*assembly.everybody, *assembly.other_ways)}.values():
        for turn in way.movements:
            on = [lanes[name] for name in (f"{turn.from_edge}_{turn.from_lane}", *turn.via)]
            mean, most, longest = queue_figures(queues.get((turn.from_edge, turn.to_edge), {}), steps)
            found[turn.from_edge, turn.to_edge] = {
                JUNCTION: turn.junction,
                EDGE: turn.from_edge,
                TO_EDGE: turn.to_edge,
                MOVEMENT: f"{named[turn.from_edge]} → {named[turn.to_edge]}",
                FREE: sum(lane.length_m / lane.speed_mps for lane in on if lane.speed_mps > 0.0),
                LIT: lit and turn.signal is not None,
                GREEN: greens.get((turn.from_edge, turn.to_edge), 0.0) if turn.signal else 0.0,
                QUEUE: mean,
                QUEUE_95: most,
                QUEUE_MOST: longest,
            }
    alike = Counter(one[MOVEMENT] for one in found.values())
    for (before, after), one in found.items():
        if alike[one[MOVEMENT]] > 1:  # several junctions of one street
            street = named[before] if named[before] == named[after] else one[MOVEMENT]
            one[MOVEMENT] = f"{street} ({before} → {after})"
    return list(found.values())


def _edge_row(edge: Edge, stood_s: float) -> tuple[str, float, str, str, float, str]:
    return edge.id, edge.length_m, shape_text(edge), edge.to_junction, stood_s, edge.street
