"""One run from scenario to summary."""

from collections.abc import Callable, Container, Mapping, Sequence
from contextlib import ExitStack, closing
from dataclasses import replace
from math import isnan, nan
from pathlib import Path
from time import perf_counter
from typing import Any

from loopgate.audit import read_layout, write_layout
from loopgate.drive.gatekeeper import Gatekeeper
from loopgate.folders import remove_abandoned, temporary_folder
from loopgate.network import Edge, RoadNetwork, read_loops
from loopgate.network.coverage import measure_coverage
from loopgate.network.sumo_config import is_sumo_config
from loopgate.simulation import outcome
from loopgate.simulation.assembly import Assembly, assemble
from loopgate.simulation.checking import audit_run
from loopgate.simulation.fleet.departures import Departures
from loopgate.simulation.loop_run import Mishaps, RunCourse, Tick, drive
from loopgate.simulation.monitoring import monitoring_figures, shape_text, write_streets
from loopgate.simulation.outcome import Folder, Tally
from loopgate.simulation.plain_run import run_plainly
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.session import Session, open_session
from loopgate.simulation.sumo.start import TRIPS, check_backend, check_outputs
from loopgate.simulation.watching.flow import FlowMeter, flow_table, loop_table
from loopgate.simulation.watching.fronts import FrontRecorder
from loopgate.simulation.watching.trips import gated_trips, read_trips, trip_figures
from loopgate.simulation.watching.verdicts import Verdicts
from loopgate.simulation.watching.watch import Watch
from loopgate.simulation.ways_driven import as_driven

_ON_SEGMENTS = (
    "lights: on segments no state ends at a light, so a vehicle holds its zone while it waits there at a red"
)


def simulate(
    scenario: Scenario,
    out: Path | str | None = None,
    *,
    tick: Tick | None = None,
    backend: str = "libsumo",
    overwrite: bool = False,
    watch: type[Watch] = Watch,
) -> dict[str, Any]:
    """Run a scenario and leave a run folder.

    Parameters
    ----------
    out
        The run folder; None keeps nothing but the summary that is returned.
    backend
        ``libsumo``, ``traci`` or ``gui``.
    overwrite
        Whether an earlier run in `out` may be replaced.
    watch
        What recognises deadlocks, for studies of it.

    Returns
    -------
    dict
        What ``summary.json`` holds.

    Raises
    ------
    LoopgateError
        If the scenario does not fit together, SUMO refuses it, or the disk is full; the text says which part.
    """
    check_backend(backend)
    with ExitStack() as stack:
        if out is None:
            check_outputs(scenario)
            out, overwrite = stack.enter_context(temporary_folder()), True
        else:
            remove_abandoned()
        folder = stack.enter_context(Folder(Path(out), overwrite=overwrite))
        return _run(scenario, folder, tick, backend, watch)


def _run(
    scenario: Scenario,
    folder: Folder,
    tick: Tick | None,
    backend: str,
    watch_class: type[Watch],
) -> dict[str, Any]:
    tick = tick or (lambda _now, _course: None)
    if is_plain(scenario):
        return run_plainly(scenario, folder, tick, backend)
    began = perf_counter()
    assembly = assemble(scenario)
    with (
        open_session(scenario, assembly, folder, backend=backend) as session,
        closing(
            FrontRecorder(folder / outcome.FRONTS, session.traffic, session.engine, session.recorder)
        ) as fronts,
    ):
        prepared_s = perf_counter() - began
        traffic, engine, recorder = session.traffic, session.engine, session.recorder
        flow = FlowMeter(traffic, engine)
        own, once = frozenset(assembly.names), assembly.trips
        among = bool(scenario.traffic or assembly.ordinary)
        mixed = own if among else None
        judged = among and session.keeper is not None
        verdicts = Verdicts(assembly.network, traffic, engine) if judged else None
        watch = watch_class(
            traffic,
            after_s=scenario.deadlock_after_s,
            at_gate=engine.refused,
            own=mixed,
            trails=verdicts.trails if verdicts else None,
        )
        course = drive(
            engine,
            traffic,
            watch,
            Mishaps(traffic, recorder, RunCourse(), own=own, verdicts=verdicts),
            scenario=scenario,
            tick=_after(flow.look, tick),
            each_step=[*session.each_step, fronts.look],
            over=lambda: bool(once) and session.departures.over,
        )
        engine.settle()
        tallies = _tallies(assembly, session, watch, course)
        surrounded = session.around.report() if session.around else {}
        surrounded |= session.stops.report() | session.departures.report(course.end_s)
        if session.rerouting is not None:
            surrounded |= session.rerouting.report()
            layout = read_layout(folder / outcome.LAYOUT)
            write_layout(as_driven(layout, session.rerouting.turns), folder / outcome.LAYOUT)
        if "at_lights" in surrounded and scenario.abstraction == "segments":
            surrounded["warnings"] = [_ON_SEGMENTS]
    keeper, departed = session.keeper, session.departures.departed_s
    if assembly.trips:
        tallies = _with_trips(assembly, session.departures, tallies, folder, course)
        surrounded.pop("mean_depart_delay_s", None)  # that of trips is told with their other delays
    folder.write_table(flow_table(flow.rows), outcome.FLOW)
    ways = {loop.id: [(span.begin_m, span.edge) for span in loop.roads] for loop in assembly.loops}
    folder.write_table(loop_table(ways), outcome.LOOPS)
    summary = _summary(scenario, assembly, keeper, course, tallies, folder, engine.stood_s, departed)
    summary |= {name: getattr(engine, name) for name in ("overruns", "trespasses", "strays")}
    summary["clean"] = outcome.is_clean(summary) if keeper else None
    added = [*outcome.mishaps(summary), *surrounded.pop("warnings", [])]
    summary["warnings"] = [*session.notes, *summary["warnings"], *added]
    summary |= surrounded
    if among:
        summary["collisions_by_others"] = sum(one.erred == "ordinary" for one in course.verdicts)
        others = summary.setdefault("others", {})
        others["collisions"] = course.collisions_of_others
        others["verdicts"] = [one.figures() for one in course.verdicts]
    if assembly.ordinary:
        mine = {vehicle.id for vehicle in assembly.ordinary}
        trips = read_trips(folder / TRIPS, interrupted=course.outcome == "interrupted").values()
        summary["others"] |= trip_figures(trip for trip in trips if trip.vehicle in mine)
    summary["wall_s"] |= {"prepared": round(prepared_s, 3), "total": round(perf_counter() - began, 3)}
    folder.write_summary(summary)
    return summary


def _after(look: Callable[[], None], tick: Tick) -> Tick:
    """Return what looks, and then tells."""

    def both(now: float, course: RunCourse) -> None:
        look()
        tick(now, course)

    return both


def _with_trips(
    assembly: Assembly, departures: Departures, tallies: Sequence[Tally], folder: Folder, course: RunCourse
) -> list[Tally]:
    """Return what each vehicle did, with what SUMO says of those that drive once."""
    mine = [tally for tally in tallies if tally.vehicle in assembly.trips]
    trips = gated_trips(
        read_trips(folder / TRIPS, held=True, interrupted=course.outcome == "interrupted"),
        {tally.vehicle: tally.depart_delay_s for tally in mine},
        {tally.vehicle: tally.stopped_s for tally in mine},
        departures.arrived,
        departures.wanted_s.keys() - departures.departed_s.keys(),
    )
    return [replace(tally, trip=trips.get(tally.vehicle)) for tally in tallies]


def is_plain(scenario: Scenario) -> bool:
    """Return whether vehicles are run as they are, and not on loops.

    Those of a ``.sumocfg`` under ``open``, or of a route file under ``open`` that drive their routes once.
    """
    if scenario.gated or scenario.loops or scenario.counts_vehicles:
        return False
    if not scenario.routes:
        return is_sumo_config(scenario.network) and not scenario.traffic
    network = RoadNetwork.open(scenario.network)
    file = read_loops(network, scenario.routes, stops=scenario.stop_files, once=True)
    return any(vehicle.once for vehicle in file.vehicles)


def _tallies(assembly: Assembly, session: Session, watch: Watch, course: RunCourse) -> list[Tally]:
    """Return what each vehicle did; one that has not departed did nothing."""
    now, drivers, departures = course.end_s, session.engine.driver_of, session.departures
    on_road = set(session.traffic.vehicles())
    loops = {start.vehicle: start.loop for start in assembly.everybody}
    tallies = []
    for vehicle in assembly.names:
        driver, loop = drivers.get(vehicle), loops[vehicle]
        wanted_s = departures.wanted_s.get(vehicle)
        if wanted_s is not None and wanted_s > now:
            continue
        departed_s = course.begin_s if wanted_s is None else departures.departed_s.get(vehicle, nan)
        seen_s = 0.0 if isnan(departed_s) else now - max(departed_s, course.begin_s)
        stops = session.stops.of(vehicle)
        gone = departures.arrived.get(vehicle)
        if gone is not None:
            seen_s = gone.at_s - max(departed_s, course.begin_s)
        tally = Tally(
            vehicle=vehicle,
            loop=loop.id,
            loop_length_m=loop.length_m,
            laps=driver.laps if driver else 0,
            distance_m=driver.distance_m if driver else gone.distance_m if gone else 0.0,
            hold_s=driver.total_hold_s(now) if driver else gone.hold_s if gone else 0.0,
            longest_wait_s=driver.worst_wait_s(now) if driver else gone.longest_wait_s if gone else 0.0,
            standing_s=watch.standing_s(vehicle),
            position_m=session.traffic.position(vehicle) if vehicle in on_road else (nan, nan),
            stood_s=driver.stood_s if driver else gone.stood_s if gone else 0.0,
            driven_s=max(0.0, seen_s),
            depart_delay_s=departures.delay_s(vehicle, now),
            stops=stops.served,
            stopped_s=stops.stood_s,
        )
        tallies.append(tally)
    return tallies


def _summary(
    scenario: Scenario,
    assembly: Assembly,
    keeper: Gatekeeper | None,
    course: RunCourse,
    tallies: list[Tally],
    folder: Folder,
    stood_s: Mapping[str, float],
    departed: Container[str],
) -> dict[str, Any]:
    duration = max(0.0, course.end_s - course.begin_s)
    folder.write_vehicles(tallies)
    rows = {
        edge: _edge_row(assembly.network.edge(edge), stood_s.get(edge, 0.0))
        for loop in assembly.loops
        for edge in loop.edges
    }
    edges, watch = None, dict[str, Any]()
    if duration > 0:
        edges = folder.write_edges(list(rows.values()), begin_s=course.begin_s, end_s=course.end_s)
        watch = write_streets(scenario, assembly, tallies, folder, begin_s=course.begin_s, end_s=course.end_s)
    waits: dict[str, Any] = {}
    findings: list[str] = []
    audited: dict[str, Any] = {}
    if keeper is not None:
        findings, audited = audit_run(scenario, assembly, tallies, folder, departed)
        waits = outcome.waits(folder, course)
    figures = outcome.summary(
        scenario,
        course,
        tallies,
        loops=len(assembly.loops),
        folder=folder,
        keeper=keeper,
        findings=findings,
        warnings=(*assembly.warnings, *(assembly.abstraction.warnings if assembly.abstraction else ())),
    )
    figures |= waits | audited | monitoring_figures(edges, measure_coverage(assembly.network, assembly.loops))
    return figures | {"watch": watch}


def _edge_row(edge: Edge, stood_s: float) -> tuple[str, float, str, str, float]:
    return edge.id, edge.length_m, shape_text(edge), edge.to_junction, stood_s
