"""SUMO's options that record positions, and the layout of the abstraction for audit and replay."""

from collections import Counter
from collections.abc import Mapping, Sequence
from math import inf
from pathlib import Path
from statistics import fmean
from types import MappingProxyType

from loopgate.abstraction.itinerary import Abstraction, Crossing, Itinerary, PlaceRoom
from loopgate.audit.layout import Layout, LoopLeg, LoopSpan, LoopWay, SizedStretches, VehicleBody
from loopgate.audit.position_table import ATTRIBUTES
from loopgate.control.start import VehicleStart
from loopgate.model import StateId
from loopgate.network import LaneSpan, Loop
from loopgate.network.bridges import find_bridges
from loopgate.simulation.assembly import Assembly


def record_positions(file: Path) -> list[str]:
    """Return the options with which SUMO writes the position of every vehicle in every step.

    The output is a compressed text table: besides XML it is the only format that every build of SUMO writes,
    with constant memory.
    """
    return [
        *("--fcd-output", str(file)),
        *("--fcd-output.attributes", ",".join(ATTRIBUTES)),
        "--fcd-output.skip-empty",
        # The first row sets the columns of the table, and persons have other columns.
        *("--person-device.fcd.probability", "0"),
        # A configuration of the user may have these otherwise, for outputs of its own.
        *("--fcd-output.geo", "false"),
        *("--fcd-output.utm", "false"),
        *("--device.fcd.probability", "1"),
        *("--device.fcd.begin", "-1"),
        *("--device.fcd.period", "0"),
        *("--output.column-header", "auto"),
        *("--output.column-separator", ";"),
    ]


def make_layout(
    assembly: Assembly, step_s: float, rooms: Mapping[str, PlaceRoom] = MappingProxyType({})
) -> Layout:
    """Return states, crossings and vehicles of a run, for the audit and the replay.

    Parameters
    ----------
    assembly
        The parts of the run; it has an abstraction.
    step_s
        Length of a simulation step [s].
    rooms
        The places whose slots depend on the vehicles that come, by name.
    """
    abstraction = assembly.abstraction
    if abstraction is None:
        msg = "the run has no abstraction"
        raise ValueError(msg)
    system = abstraction.system
    loops: dict[str, LoopWay] = {}
    vehicles: dict[str, VehicleBody] = {}
    ways = [*abstraction.itineraries[: len(assembly.starts)], *abstraction.later[: len(assembly.departures)]]
    positions = [robot.start for robot in system.robots[: len(assembly.starts)]]
    positions += [one.track.position for one in assembly.departures]
    for start, itinerary, position in zip(assembly.everybody, ways, positions, strict=True):
        kind = start.type
        vehicles[start.vehicle] = VehicleBody(
            start.loop.id,
            kind.length_m,
            kind.width_m,
            start.track.start_m,
            position,
            kind.jointed,
            kind.min_gap_m,
        )
        if start.loop.id not in loops:
            loops[start.loop.id] = _way(start.loop, itinerary)
    for one, itinerary in zip(
        assembly.other_ways, abstraction.later[len(assembly.departures) :], strict=True
    ):
        loops[one.loop.id] = _way(one.loop, itinerary)
    lanes = assembly.network.lanes
    driven = sorted({lane for loop in loops.values() for span in loop.spans for lane in span.driven})
    named = {c for loop in loops.values() for leg in loop.legs for c, _ in leg.crossings}
    return Layout(
        step_s=step_s,
        room=_room(abstraction, assembly.other_ways),
        metres={name: room.length_m + room.overhang_m for name, room in rooms.items()},
        loops=loops,
        vehicles=vehicles,
        movements={c.id: c.via for c in assembly.network.connections if c.id in named},
        shapes={lane: lanes[lane].shape for lane in driven},
        heights={lane: fmean(lanes[lane].heights) for lane in driven if lanes[lane].heights},
        unregulated=tuple(lane for lane in driven if not assembly.network.is_regulated(lane)),
        bridges=find_bridges(assembly.network, driven),
    )


def _way(loop: Loop, itinerary: Itinerary) -> LoopWay:
    # A vehicle that drives once is never before the first place of its route.
    first_m = -inf if loop.closed else itinerary.legs[0].begin_m
    spans = tuple(_span(s) for s in loop.spans if s.end_m > first_m)
    return LoopWay(loop.lap_m, spans, _legs(itinerary))


def _room(abstraction: Abstraction, others: Sequence[VehicleStart]) -> dict[str, int]:
    """Return the slots of the states that several vehicles visit, or may visit later."""
    system = abstraction.system
    if not abstraction.later:
        states = zip(system.states, system.room, system.private, strict=True)
        return {name: room for name, room, private in states if not private}
    paths = [{leg.state for leg in way.legs} for way in (*abstraction.itineraries, *abstraction.later)]
    visitors = Counter(state for path in paths for state in path)
    visitors.update(leg.state for one in others for leg in one.track.legs)
    return {name: room for name, room in abstraction.room.items() if visitors[StateId(name)] > 1}


def _span(span: LaneSpan) -> LoopSpan:
    changed = not span.internal and span.lane_in != span.lane
    return LoopSpan(span.begin_m, span.end_m, span.lane_ids, f"{span.edge}_{span.lane_in}" if changed else "")


def _legs(itinerary: Itinerary) -> tuple[LoopLeg, ...]:
    return tuple(
        LoopLeg(
            leg.state,
            leg.begin_m,
            leg.end_m,
            tuple((c.id, _foes(c, leg.end_m)) for c in leg.crossings),
            {c.id: _sized(c, leg.end_m) for c in leg.crossings if c.sized},
        )
        for leg in itinerary.legs
    )


def _sized(crossing: Crossing, at_m: float) -> dict[str, SizedStretches]:
    shifted = {foe: table.shifted(at_m) for foe, table in crossing.sized.items()}
    return {foe: SizedStretches(table.sizes, table.among) for foe, table in shifted.items()}


def _foes(crossing: Crossing, at_m: float) -> dict[str, tuple[float, float] | None]:
    shared = {foe: crossing.overlaps.get(foe) for foe in sorted(crossing.foes)}
    return {foe: (at_m + s[0], at_m + s[1]) if s else None for foe, s in shared.items()}
