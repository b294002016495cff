"""The paper's abstraction: collision segments become shared states, the rest private states."""

import math
import random
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from loopgate.abstraction.collision_segments import collision_segments
from loopgate.abstraction.itinerary import CLEARANCE_M, Abstraction, DrawnLeg, Itinerary
from loopgate.abstraction.starts import choose_starts
from loopgate.abstraction.zone_warnings import zone_warnings
from loopgate.abstraction.zones import Zones, make_zones
from loopgate.cache import Cache
from loopgate.errors import ScenarioError
from loopgate.model import Robot, RobotId, StateId, System
from loopgate.network.loop import Loop

DEFAULT_RHO_M = 1.25
"""Safe radius [m]: oncoming lanes, 3.2 m apart, do not conflict; crossing, merging and shared lanes do."""


@dataclass(frozen=True, slots=True)
class SegmentLayout:
    """Loops cut into states, before vehicles are placed."""

    itineraries: tuple[Itinerary, ...]
    """One per robot."""
    warnings: tuple[str, ...]
    """Warnings for the user about loops that do not suit this abstraction."""


def lay_out_segments(
    loops: Sequence[Loop],
    *,
    rho_m: float = DEFAULT_RHO_M,
    vehicle_length_m: float = 5.0,
    min_gap_m: float = 2.5,
    piece_m: float = 100.0,
) -> SegmentLayout:
    """Cut loops into states (Zhou et al. 2020, Section 3.2): shared zones, and private pieces.

    Collision segments (Definition 1) are found on the loops' curves, merged into zones and fitted to the
    vehicles, see `loopgate.abstraction.zones`. The rest is private and cut into pieces. A zone that a path
    passes several times in one round has a leg for each visit.

    Raises `ScenarioError` if two robots have the same loop, or a length is not positive; `RouteError` if a
    loop is too short for the vehicle.

    Parameters
    ----------
    loops
        One per robot; ids are unique.
    rho_m
        Safe radius [m]: points of two paths conflict within 2 rho.
    vehicle_length_m, min_gap_m
        Of the longest vehicle, which fits into each state.
    piece_m
        Longest private state [m], as far as vehicles can be held where it would be cut.
    """
    for what, value in (("rho", rho_m), ("piece", piece_m), ("vehicle length", vehicle_length_m)):
        if not value > 0.0:
            msg = f"segments: {what} {value:g} m; expected more than 0"
            raise ScenarioError(msg)
    for name, count in Counter(loop.id for loop in loops).items():
        if count > 1:
            msg = (
                f"segments: {count} vehicles on loop {name}, which holds one (one path, one robot); "
                f"use fewer vehicles, more loops, or --abstraction queues"
            )
            raise ScenarioError(msg)
    key = (tuple(loops), rho_m, vehicle_length_m, min_gap_m, piece_m)
    return _KEPT.get(
        key, lambda: _lay_out(loops, rho_m, needed_length_m(vehicle_length_m, min_gap_m), piece_m)
    )


_KEPT: Cache[SegmentLayout] = Cache(8)


def _lay_out(loops: Sequence[Loop], rho_m: float, need_m: float, piece_m: float) -> SegmentLayout:
    zones = make_zones(loops, collision_segments(loops, rho_m), need_m)
    return SegmentLayout(
        itineraries=tuple(_itinerary(loop, k, zones, need_m, piece_m) for k, loop in enumerate(loops)),
        warnings=tuple(zone_warnings(loops, zones, zone_state)),
    )


def make_segments(
    loops: Sequence[Loop],
    *,
    rho_m: float = DEFAULT_RHO_M,
    vehicle_length_m: float = 5.0,
    min_gap_m: float = 2.5,
    piece_m: float = 100.0,
    seed: int = 1,
    names: Sequence[str] | None = None,
    starts_m: Mapping[str, float] | None = None,
) -> Abstraction:
    """Cut loops into states (zones and private states), and place one vehicle on each loop.

    Raises `ScenarioError` if two vehicles start in one zone, or a vehicle does not fit where it starts;
    `RouteError` if a loop is too short for the vehicle.

    Parameters
    ----------
    loops, rho_m, vehicle_length_m, min_gap_m, piece_m
        As for `lay_out_segments`.
    seed, names, starts_m
        As for `place_vehicles`.
    """
    layout = lay_out_segments(
        loops, rho_m=rho_m, vehicle_length_m=vehicle_length_m, min_gap_m=min_gap_m, piece_m=piece_m
    )
    return place_vehicles(
        layout, vehicle_length_m=vehicle_length_m, seed=seed, names=names, starts_m=starts_m
    )


def place_vehicles(
    layout: SegmentLayout,
    *,
    vehicle_length_m: float = 5.0,
    seed: int = 1,
    names: Sequence[str] | None = None,
    starts_m: Mapping[str, float] | None = None,
) -> Abstraction:
    """Choose a start state for the vehicle of each loop: a private state if possible.

    Raises `ScenarioError` if two vehicles start in one zone, or a vehicle does not fit where it starts.

    Parameters
    ----------
    seed
        Decides where vehicles start.
    names
        Names of the robots; the loops' ids by default.
    starts_m
        Arc length of the front of vehicles that start at a place of their own, by robot name.
    """
    names = [way.loop.id for way in layout.itineraries] if names is None else names
    starts = choose_starts(
        layout.itineraries,
        names=names,
        vehicle_length_m=vehicle_length_m,
        rng=random.Random(seed),
        given_m=starts_m or {},
    )
    robots = (
        Robot(RobotId(name), tuple(leg.state for leg in itinerary.legs), closed=True, start=start.position)
        for name, itinerary, start in zip(names, layout.itineraries, starts, strict=True)
    )
    return Abstraction(
        name="segments",
        system=System(robots),
        itineraries=layout.itineraries,
        starts_m=tuple(start.front_m for start in starts),
        warnings=layout.warnings,
    )


def needed_length_m(vehicle_length_m: float, min_gap_m: float) -> float:
    """Return the length that a state needs for a vehicle to stand in it [m]."""
    return vehicle_length_m + min_gap_m + CLEARANCE_M


def zone_state(zone: int) -> StateId:
    """Return the name of a zone's state."""
    return StateId(f"zone{zone + 1}")


def _itinerary(loop: Loop, number: int, zones: Zones, need_m: float, piece_m: float) -> Itinerary:
    lap = loop.length_m
    visits = zones.visits[number]
    legs = [DrawnLeg(zone_state(v.zone), v.begin_m, v.end_m) for v in visits]
    if visits:
        ends = [v.end_m for v in visits]
        gaps = list(zip(ends, [v.begin_m for v in visits[1:]] + [visits[0].begin_m + lap], strict=True))
    else:
        end = loop.hold_before(lap)
        gaps = [(end - lap, end)]
    private = [piece for gap in gaps for piece in _pieces(loop, *gap, need_m, piece_m)]
    legs += [DrawnLeg(StateId(""), begin, end) for begin, end in private]
    # Every leg ends within the lap; the one across the loop's beginning begins below 0 and comes first.
    placed = sorted(
        (
            DrawnLeg(leg.state, leg.begin_m - shift, leg.end_m - shift)
            for leg in legs
            if (shift := _shift(leg, lap)) >= 0
        ),
        key=lambda leg: leg.begin_m,
    )
    named = []
    count = 0
    for leg in placed:
        count += not leg.state
        state = leg.state or StateId(f"{loop.id}/{count}")
        named.append(DrawnLeg(state, leg.begin_m, leg.end_m, line=loop.locate(leg.end_m)))
    return Itinerary(loop, tuple(named))


def _shift(leg: DrawnLeg, lap_m: float) -> float:
    return lap_m if leg.end_m > lap_m else 0.0


def _pieces(
    loop: Loop, begin_m: float, end_m: float, need_m: float, piece_m: float
) -> list[tuple[float, float]]:
    """Cut private road into pieces of at most `piece_m`, where lanes and the vehicle's length allow."""
    length = end_m - begin_m
    if length < need_m / 2.0:  # visits that touch, up to rounding
        return []
    count = math.ceil(length / piece_m)
    cuts = [begin_m]
    for k in range(1, count):
        cut = loop.hold_before(begin_m + k * length / count)
        if cut - cuts[-1] >= need_m and end_m - cut >= need_m:
            cuts.append(cut)
    return list(zip(cuts, [*cuts[1:], end_m], strict=True))
