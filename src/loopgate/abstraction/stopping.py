"""Checks that vehicles can make the stops of their route file without blocking other vehicles."""

from collections.abc import Sequence
from dataclasses import replace

from loopgate.abstraction.itinerary import Itinerary
from loopgate.errors import ScenarioError
from loopgate.network.stops import Stop
from loopgate.network.vehicle_type import VehicleType

_BEFORE_LINE_M = 0.3
"""A stop ends so far before the line at which its vehicle can be held [m]: SUMO keeps one per position."""

_ROUNDING_M = 1e-6

_LEAST_M = 0.1
"""The shortest stop on a lane [m]."""

_SAME_M = 0.05
"""A stop that is moved by less than this stays where it is; it gets another lane [m]."""

_BESIDE_M = 40.0
"""A stop moves so far along its lane rather than to another lane [m]."""

_SHORT_M = 0.5
"""So far before the end of a stop a vehicle may come to rest [m]."""


def fit_stops(way: Itinerary, kind: VehicleType, stops: Sequence[Stop], *, what: str) -> tuple[Stop, ...]:
    """Return the stops fitted to states: the whole vehicle within one state, before its stop line.

    A stop on a lane that goes beyond the line is shortened, as far as it says itself where it begins.

    Raises `ScenarioError` if the vehicle would stand in a crossing or beside its lane; the text names stop
    and state, by how much it is off, and what would do.

    Parameters
    ----------
    stops
        In the order of the loop.
    what
        File and vehicle, for messages.
    """
    return tuple(_fit(way, kind, stop, f"{what}: the stop at {stop.name}") for stop in stops)


def move_stops(
    way: Itinerary, kind: VehicleType, stops: Sequence[Stop]
) -> tuple[tuple[Stop, ...], dict[str, float]]:
    """Return the stops fitted to states, each that does not fit moved to the nearest position that does.

    A stop that moves is one on a lane. The second value has the metres by the names of the stops that move; a
    stop without such a position stays where it is.
    """
    found: list[Stop] = []
    by_m: dict[str, float] = {}
    for stop in stops:
        try:
            found.append(_fit(way, kind, stop, ""))
        except ScenarioError:
            moved = _nearest(way, kind, stop, after_m=found[-1].arc_m + _LEAST_M if found else 0.0)
            found.append(moved or stop)
            by_m |= {stop.name: moved.arc_m - stop.arc_m} if moved else {}
    return tuple(found), by_m


def _nearest(way: Itinerary, kind: VehicleType, stop: Stop, *, after_m: float = 0.0) -> Stop | None:
    """Return the stop at the nearest position, on any lane of the path, where the vehicle is in nobody's way.

    `after_m`: as arc length, the first position [m].
    """
    best: tuple[float, float, str] | None = None
    for leg in way.legs if way.loop.closed else way.legs[:-1]:
        low_m = max(leg.begin_m + kind.length_m + _SHORT_M, after_m)
        high_m = leg.end_m - _BEFORE_LINE_M
        at_m, lane = max(low_m, min(stop.arc_m, high_m)), f"{leg.line.edge}_{leg.line.lane}"
        off_m = abs(at_m - stop.arc_m) + (0.0 if lane == stop.lane or stop.any_lane else _BESIDE_M)
        if low_m <= high_m and (best is None or off_m < best[0]):
            best = off_m, at_m, lane
    if best is None:
        return None
    _, at_m, lane = best
    end_m = way.loop.locate(at_m).position_m
    start_m = max(0.0, end_m - _LEAST_M)
    return replace(
        stop,
        kind="lane",
        lane=lane,
        start_m=start_m,
        end_m=end_m,
        arc_m=at_m,
        lot_m=0.0,
        spaces=(),
        any_lane=False,
    )


def _fit(way: Itinerary, kind: VehicleType, stop: Stop, what: str) -> Stop:
    try:
        return _fitted(way, kind, stop, what)
    except ScenarioError as error:
        if (moved := _nearest(way, kind, stop)) is None:
            raise
        by_m = abs(moved.arc_m - stop.arc_m)
        by = "" if by_m < _SAME_M else f"by {by_m:.1f} m, "
        msg = f"{error}; --move-stops moves it {by}to {moved.end_m:.1f} m of lane {moved.lane}"
        raise ScenarioError(msg) from error


def _fitted(way: Itinerary, kind: VehicleType, stop: Stop, what: str) -> Stop:
    loop, lap_m = way.loop, way.loop.lap_m
    places = way.legs if loop.closed else way.legs[:-1]  # behind the last place it is away
    legs = [(leg, (stop.arc_m - leg.begin_m) % lap_m) for leg in places if leg.line.edge == stop.edge]
    if not legs:
        msg = f"{what} is on {stop.lane}, which is too short to wait on; move the stop"
        raise ScenarioError(msg)
    first = min((leg for leg, _ in legs), key=lambda leg: leg.begin_m)
    if not loop.closed and stop.arc_m < first.begin_m:
        msg = (
            f"{what} ends at {stop.end_m:g} m of lane {stop.lane}, before place {first.state}, in which the "
            f"trip begins"
        )
        raise ScenarioError(msg)
    leg, in_m = min(legs, key=lambda found: found[1])
    if (lane := f"{leg.line.edge}_{leg.line.lane}") != stop.lane:
        if stop.any_lane:
            return _fitted(way, kind, replace(stop, name=lane, lane=lane), what)
        msg = (
            f"{what} is on lane {stop.lane}, but loop {loop.id} leads over {lane} there; move "
            f"the stop, or lead the route so that its lane is on the way"
        )
        raise ScenarioError(msg)
    offset_m = stop.end_m - in_m  # where the state begins on the lane
    last_m = leg.end_m - leg.begin_m - _BEFORE_LINE_M
    if in_m > last_m + _ROUNDING_M:
        if stop.kind != "lane" or in_m - (stop.end_m - stop.start_m) > last_m:
            msg = (
                f"{what} ends at {stop.end_m:g} m of lane {stop.lane}, beyond the line of place {leg.state}: "
                f"the vehicle would stand in others' way; let it end at {offset_m + last_m:.1f} m, or before"
            )
            raise ScenarioError(msg)
        end_m = offset_m + last_m
        start_m = min(stop.start_m, end_m - _LEAST_M)
        shorter = replace(stop, start_m=start_m, end_m=end_m, arc_m=stop.arc_m - in_m + last_m)
        return _fitted(way, kind, shorter, what)
    if in_m - stop.lot_m - _SHORT_M < kind.length_m:
        first_m = stop.end_m - stop.lot_m  # of its first lot
        msg = (
            f"{what} ends at {first_m:g} m of lane {stop.lane}: a vehicle of {kind.length_m:g} m would "
            f"reach back out of place {leg.state}, into others' way; let it end at "
            f"{offset_m + kind.length_m + _SHORT_M:.1f} m, or later"
        )
        if kind.length_m + _SHORT_M > last_m:
            msg = f"{what}: place {leg.state} is too short for a vehicle of {kind.length_m:g} m; move it"
        raise ScenarioError(msg)
    return stop
