"""Joins the paths that rerouted vehicles really drove into one path each, for audit and replay."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from loopgate.audit.layout import Layout, LoopLeg, LoopSpan, LoopWay, SizedStretches
from loopgate.control.start import VehicleStart
from loopgate.network.loop import AWAY_M
from loopgate.simulation.ways_round import TurnOff

_ROUNDING_M = 1e-6


def continued(way: LoopWay, leg: int, other: LoopWay, position: int) -> LoopWay:
    """Return one path up to the end of a leg, joined with another path from the end of leg `position`.

    Both legs are the same place. Arc lengths continue those of the first path.
    """
    end_m = way.legs[leg].end_m
    by_m = end_m - other.legs[position].end_m
    before = [span for span in way.spans if span.begin_m < end_m]
    behind = [_moved(span, by_m) for span in other.spans if span.end_m + by_m >= end_m - _ROUNDING_M]
    behind[0] = _entered_as(before.pop(), behind[0])
    here = replace(_leg_moved(other.legs[position], by_m), begin_m=way.legs[leg].begin_m)
    legs = (*way.legs[:leg], here, *(_leg_moved(one, by_m) for one in other.legs[position + 1 :]))
    return LoopWay(other.length_m + by_m, (*before, *behind), legs)


def unrolled(way: LoopWay, leg: int, *, closed: bool) -> LoopWay:
    """Return a closed path repeated for enough laps to contain a leg; an open path as it is."""
    if not closed:
        return way
    laps = range(leg // len(way.legs) + 2)
    by_m = [lap * way.length_m for lap in laps]
    return LoopWay(
        len(laps) * way.length_m + AWAY_M,  # the path does not close
        tuple(_moved(span, metres) for metres in by_m for span in way.spans),
        tuple(_leg_moved(one, metres) for metres in by_m for one in way.legs),
    )


def departed_on(layout: Layout, starts: Mapping[str, VehicleStart]) -> Layout:
    """Return a layout in which some vehicles start on other paths of it, by name."""
    bodies = layout.vehicles
    vehicles = {
        name: replace(bodies[name], loop=one.loop.id, start_m=one.track.start_m, leg=one.track.position)
        for name, one in starts.items()
    }
    return replace(layout, vehicles={**bodies, **vehicles})


def as_driven(layout: Layout, turns: Mapping[str, Sequence[TurnOff]], granted: Mapping[str, int]) -> Layout:
    """Return a layout in which each vehicle that changed paths has one path of its own, as it drove.

    Parameters
    ----------
    layout
        The layout from before the run, with all paths.
    turns
        The changes to other paths, by name of the vehicle.
    granted
        For vehicles on loops, the last leg granted on the present path. Their path is then everything
        that they drove, round after round.
    """
    loops, vehicles = dict(layout.loops), dict(layout.vehicles)
    for vehicle, some in turns.items():
        name = vehicles[vehicle].loop
        way, ahead = layout.loops[name], 0
        closed, last = vehicle in granted, [*(turn.leg for turn in some[1:]), granted.get(vehicle, 0)]
        way = unrolled(way, some[0].leg, closed=closed)
        for turn, until in zip(some, last, strict=True):
            leg = turn.leg + ahead
            other = unrolled(layout.loops[turn.way], until, closed=closed)
            way = continued(way, leg, other, turn.position)
            ahead = leg - turn.position
            name = f"{name} > {turn.way}@{leg}"
        loops[name] = way
        vehicles[vehicle] = replace(vehicles[vehicle], loop=name)
    names = {body.loop for body in vehicles.values()}
    driven = {name: way for name, way in loops.items() if name in names}
    lanes = {lane for way in driven.values() for span in way.spans for lane in span.driven}
    unregulated = tuple(lane for lane in layout.unregulated if lane in lanes)
    return replace(layout, loops=driven, vehicles=vehicles, unregulated=unregulated)


def _moved(span: LoopSpan, by_m: float) -> LoopSpan:
    return replace(span, begin_m=span.begin_m + by_m, end_m=span.end_m + by_m)


def _entered_as(one: LoopSpan, other: LoopSpan) -> LoopSpan:
    """Return the road where a vehicle changes paths: it enters as on one path and leaves as on the other.

    Between the two it may have to change lanes.
    """
    came, lanes = one.driven[0], tuple(dict.fromkeys((*other.lanes, *one.lanes)))
    return LoopSpan(one.begin_m, other.end_m, lanes, came if came != lanes[0] else "")


def _leg_moved(leg: LoopLeg, by_m: float) -> LoopLeg:
    crossings = tuple(
        (name, {foe: (at[0] + by_m, at[1] + by_m) if at else None for foe, at in foes.items()})
        for name, foes in leg.crossings
    )
    sized = {
        name: {foe: _sized_moved(table, by_m) for foe, table in foes.items()}
        for name, foes in leg.sized.items()
    }
    return LoopLeg(leg.state, leg.begin_m + by_m, leg.end_m + by_m, crossings, sized)


def _sized_moved(table: SizedStretches, by_m: float) -> SizedStretches:
    among = tuple(tuple(at and (at[0] + by_m, at[1] + by_m) for at in row) for row in table.among)
    return SizedStretches(table.sizes, among)
