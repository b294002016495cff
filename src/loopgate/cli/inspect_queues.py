"""`loopgate inspect` on queues: places, crossings, conflicts, and the reasons of refused loops."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

from rich.console import Console

from loopgate.abstraction.itinerary import Abstraction
from loopgate.abstraction.queue_survey import QueueSurvey, survey_queues
from loopgate.abstraction.queues import make_queues
from loopgate.abstraction.stopping import fit_stops
from loopgate.abstraction.sumo_shapes import write_shapes
from loopgate.abstraction.survey import Survey, survey
from loopgate.cli.inspect_shared import (
    Wanted,
    common_data,
    loops_data,
    print_reach,
    print_warnings,
    undrivable,
)
from loopgate.cli.tables import console, print_table
from loopgate.cli.terminal import print_json
from loopgate.errors import ScenarioError
from loopgate.model import write_system
from loopgate.network import Loop, RoadNetwork, RoutesFile, VehicleDemand, VehicleType
from loopgate.network.coverage import Coverage, measure_coverage
from loopgate.network.ungated import in_ordinary_traffic
from loopgate.reading import counted, listed
from loopgate.simulation.demand.apart import of_no_safe_type
from loopgate.simulation.demand.shared_lanes import share_lanes

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

_User = tuple[str, Loop, VehicleType]
"""A vehicle: its name, its loop and its type."""


@dataclass(frozen=True, slots=True)
class _Seen:
    """Loops as queues, with their vehicles or the reason why these cannot start."""

    file: RoutesFile
    vehicles: int
    found: QueueSurvey
    shares: Survey
    coverage: Coverage
    placed: Abstraction | None
    problem: ScenarioError | None

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about the loops and the rest of the file."""
        return (*self.file.left_out, *(self.placed.warnings if self.placed else ()))


def look_at_queues(roads: RoadNetwork, file: RoutesFile, wanted: Wanted) -> ScenarioError | None:
    """Print and write the output of the options; return the error, or None.

    Loops that cannot work are left out of all figures but their own table.
    """
    seen = _look(roads, file, wanted)
    found = seen.found
    if wanted.as_json:
        print_json(_data(seen))
    else:
        _print(seen)
    if wanted.picture is not None:
        from loopgate.report.queue_map import draw_queues

        loops, places = counted(len(found.loops), "loop"), counted(len(found.places), "place")
        title = f"{roads.name}: {loops}, {places} for {counted(found.holds, 'vehicle')}"
        draw_queues(roads, found, wanted.picture, title=title)
    if wanted.additional is not None:
        room = {place.id: place.capacity for place in found.places}
        refused = [(one.loop, one.reason, one.edge) for one in found.refused]
        write_shapes(wanted.additional, found.itineraries, room, refused)
    if seen.problem is None and wanted.out is not None and seen.placed is not None:
        write_system(seen.placed.system, wanted.out, note=f"{roads.name}, {file.file.name}: queues")
    return seen.problem


def _without_ordinary(roads: RoadNetwork, file: RoutesFile, step_s: float) -> RoutesFile:
    """Return the file without the vehicles that `loopgate run` leaves to ordinary traffic; name them."""
    whys = of_no_safe_type(roads, file.vehicles, step_s, obeys=False)
    rest = tuple(v for v in file.vehicles if v.id not in whys)
    if not rest:  # the run is refused
        rest, whys = file.vehicles, {}
    whys |= {one.id: one.why for one in file.ungated.vehicles}
    return replace(file, vehicles=rest, left_out=(*file.left_out, *in_ordinary_traffic(file.file, whys)))


def _look(roads: RoadNetwork, file: RoutesFile, wanted: Wanted) -> _Seen:
    file = _without_ordinary(roads, file, wanted.step_s)
    names, loops, starts_m = file.robots()
    types = file.robot_types()
    if wanted.vehicle_length_m is not None:
        types = [replace(kind, length_m=wanted.vehicle_length_m) for kind in types]
    loops, found = _on_shared_lanes(roads, file, names, loops, types)
    placed, problem = None, None
    if found.refused:
        problem = _refusal(file, found)
    else:
        users = list(zip(names, loops, types, strict=True))
        first = [user for user, later in zip(users, _later(file, len(users)), strict=True) if not later]
        later = [(loop, kind) for user in users if user not in first for _, loop, kind in (user,)]
        if first:
            placed, problem = _place(roads, first, later, wanted.seed, starts_m)
        problem = problem or _unfit_stop(file, users, found) or undrivable(roads, file, wanted.step_s)
    return _Seen(
        file,
        len(names),
        found,
        survey(found.itineraries),
        measure_coverage(roads, found.loops),
        placed,
        problem,
    )


def _on_shared_lanes(
    roads: RoadNetwork,
    file: RoutesFile,
    names: Sequence[str],
    loops: Sequence[Loop],
    types: Sequence[VehicleType],
) -> tuple[list[Loop], QueueSurvey]:
    """Return the loops on the lanes that they get in a run, and what is found of them as queues.

    A loop that cannot be cut there keeps the lanes on which it is read. All do if that is not enough.
    """
    stops, keeping = {vehicle.id: vehicle.stops for vehicle in file.vehicles}, set[str]()
    on_loops = [
        VehicleDemand(name, loop, kind, stops=stops.get(name, file.stops.get(loop.id, ())))
        for name, loop, kind in zip(names, loops, types, strict=True)
        if loop.closed
    ]
    while True:
        shared = {v.loop.id: v.loop for v in share_lanes(roads, on_loops, keeping)}
        driven = [shared.get(loop.id, loop) for loop in loops]
        found = survey_queues(roads, list(zip(driven, types, strict=True)))
        refused = {refusal.loop.id for refusal in found.refused if refusal.loop.closed}
        if not refused:
            return driven, found
        if refused <= keeping:
            return list(loops), survey_queues(roads, list(zip(loops, types, strict=True)))
        keeping |= refused


def _later(file: RoutesFile, count: int) -> list[bool]:
    """Return for each vehicle whether it departs after the begin of the run."""
    if not file.vehicles:
        return [False] * count
    return [(v.flow.begin_s if v.flow else v.depart_s) > 0 for v in file.vehicles]


def _place(
    roads: RoadNetwork,
    users: Sequence[_User],
    later: Sequence[tuple[Loop, VehicleType]],
    seed: int,
    starts_m: dict[str, float],
) -> tuple[Abstraction | None, ScenarioError | None]:
    names, loops, types = zip(*users, strict=True)
    try:
        made = make_queues(roads, loops, types, seed=seed, names=names, starts_m=starts_m, later=later)
    except ScenarioError as error:
        return None, error
    return made, None


def _unfit_stop(file: RoutesFile, users: Sequence[_User], found: QueueSurvey) -> ScenarioError | None:
    """Return the fault of a stop at which a vehicle would block others, or None."""
    ways = {way.loop.id: way for way in found.itineraries}
    stops = {vehicle.id: vehicle.stops for vehicle in file.vehicles}
    try:
        for name, loop, kind in users:
            mine = stops.get(name, file.stops.get(loop.id, ()))
            fit_stops(ways[loop.id], kind, mine, what=f"{file.file}: vehicle {name}")
    except ScenarioError as error:
        return error
    return None


def _refusal(file: RoutesFile, found: QueueSurvey) -> ScenarioError:
    every = len(found.loops) + len(found.refused)
    names = [refusal.loop.id for refusal in found.refused]
    if len(names) == 1:
        return ScenarioError(
            f"{file.file}: loop {names[0]} cannot work as queues: it {found.refused[0].reason}"
        )
    return ScenarioError(
        f"{file.file}: {len(names)} of {every} loops cannot work as queues, as said above: {listed(names)}; "
        "leave them out or change their streets"
    )


def _data(seen: _Seen) -> dict[str, Any]:
    found = seen.found
    return {
        "abstraction": "queues",
        "loops": loops_data(seen.shares, found.itineraries, state="place", crossings=True),
        "refused": [
            {"loop": refusal.loop.id, "edge": refusal.edge, "reason": refusal.reason}
            for refusal in found.refused
        ],
        "places": [_rounded(place) for place in found.places],
        "crossings": [
            {
                "id": crossing.id,
                "from_lane": crossing.from_lane,
                "to_lane": crossing.to_lane,
                "junction": crossing.junction or None,
                "length_m": round(crossing.length_m, 2),
                "loops": crossing.loops,
                "conflicts": [
                    {
                        "with": conflict.foe,
                        "begin_m": _metres(conflict.begin_m),
                        "end_m": _metres(conflict.end_m),
                        "shared_m": _metres(conflict.shared_m),
                        "listed": conflict.listed,
                    }
                    for conflict in crossing.conflicts
                ],
            }
            for crossing in found.crossings
        ],
        "unlisted_conflicts": found.unlisted,
        "joined_lanes": [_rounded(lane) for lane in found.joined],
        "vehicles": seen.vehicles,
        "holds": found.holds,
        "most_vehicles": found.at_start,
        "most_vehicles_in_turn": found.even,
        "stops": sum(len(vehicle.stops) for vehicle in seen.file.vehicles),
        "departures": {
            "later": sum(v.flow is None and v.depart_s > 0 for v in seen.file.vehicles),
            "flows": sum(v.flow is not None for v in seen.file.vehicles),
        },
        **common_data(seen.shares, seen.coverage, seen.placed, seen.warnings),
    }


def _rounded(record: DataclassInstance) -> dict[str, Any]:
    """Return the fields of a record, lengths to the centimetre."""
    return {name: round(v, 2) if isinstance(v, float) else v for name, v in asdict(record).items()}


def _metres(metres: float | None) -> float | None:
    return None if metres is None else round(metres, 2)


def _print(seen: _Seen) -> None:
    """Print the loops that work, their slots and their reach, and the loops that cannot work."""
    out, found = console(), seen.found
    if found.loops:
        _print_room(out, seen)
    if found.refused:
        print_table(
            out,
            f"{counted(len(found.refused), 'loop')} that cannot work",
            ("loop", "edge", "why: it ..."),
            ((r.loop.id, r.edge or "", r.reason) for r in found.refused),
            left=("loop", "edge", "why: it ..."),
        )
    if found.loops:
        out.print("--json lists every loop, place and crossing", style="dim")


def _print_fleet(out: Console, file: RoutesFile) -> None:
    """Print the stops and departures that a run keeps."""
    stops = [stop for v in file.vehicles for stop in v.stops] or [
        s for some in file.stops.values() for s in some
    ]
    if stops:
        names = list(dict.fromkeys(stop.name for stop in stops))
        out.print(f"stops: {len(stops)} in every round, at {listed(names)}", markup=False)
    later = [v for v in file.vehicles if v.flow is None and v.depart_s > 0]
    flows = [v for v in file.vehicles if v.flow is not None]
    if later or flows:
        first = len(file.vehicles) - len(later) - len(flows)
        out.print(f"departures: {first} at the beginning, {len(later)} later, {counted(len(flows), 'flow')}")


def _print_room(out: Console, seen: _Seen) -> None:
    found = seen.found
    works = "works" if len(found.loops) == 1 else "work"
    out.print(
        f"{counted(len(found.loops), 'loop')} that {works}: {counted(len(found.places), 'place')} for "
        f"{counted(found.holds, 'vehicle')}, {counted(len(found.crossings), 'crossing')} with "
        f"{counted(found.conflicts, 'conflict')}"
        + (f", {len(found.unlisted)} of them unlisted: only geometry shows them" if found.unlisted else "")
        + (f"; {counted(len(found.joined), 'lane')} too short to queue on" if found.joined else ""),
        style="bold",
    )
    out.print(
        f"capacity: {counted(found.at_start, 'vehicle')} can start on these loops so that each can move, "
        f"{found.even} if they are dealt to the loops in turn (--vehicles {found.even})"
    )
    km = sum(loop.length_m for loop in found.loops) / 1000.0
    out.print(f"shared: {seen.shares.shared:.0%} of {km:.1f} km lie on lanes that several loops use")
    print_reach(out, seen.coverage, begin="coverage: ")
    _print_fleet(out, seen.file)
    print_warnings(out, seen.warnings)
