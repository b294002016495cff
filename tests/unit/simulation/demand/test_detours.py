"""Loops that lead round what stands."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest

from loopgate.network import Loop, RoadNetwork, VehicleDemand, make_loop, read_loops
from loopgate.network.incidents import Breakdown, Closure, Incidents
from loopgate.network.stops import Stop
from loopgate.network.vehicle_type import DEFAULT_TYPE
from loopgate.simulation.demand.detours import (
    Detours,
    FoundDetours,
    find_detours,
    name_closed_stops,
    name_incidents_outside,
    name_long_stops,
)

ROOT = Path(__file__).resolve().parents[4]
GRID = RoadNetwork.open(ROOT / "networks/grid5-priority.net.xml")
LOOPS = read_loops(GRID, ROOT / "routes/grid5.rou.xml").loops
FINDER = Detours(GRID, "passenger")


@pytest.mark.parametrize("mine", LOOPS[:20], ids=[loop.id for loop in LOOPS[:20]])
def test_a_loop_round_an_edge_keeps_to_the_rest(mine: Loop) -> None:
    """It avoids the edge, is connected, leaves the loop right before the edge, and keeps its other edges."""
    for number, edge in enumerate(mine.edges):
        found = FINDER.around(mine, {edge})
        assert found is not None
        assert edge not in found.edges
        closed = [*found.edges, found.edges[0]]
        assert all(GRID.between(one, other, "passenger") for one, other in pairwise(closed))
        before = mine.edges[number - 1]
        turns_off = any(c.to_edge != edge for c in GRID.outgoing(before))
        assert (before in found.edges) is turns_off
        assert len(set(mine.edges) - set(found.edges)) <= len(mine.edges) / 2
        assert found.id == f"{mine.id}~{edge}"


def test_two_equal_laps_that_are_left_of_a_loop_become_one() -> None:
    """Else the loop would pass every edge twice, and a route could be renewed on none of them."""
    lap = ["E0D0", "D0D1", "D1E1", "E1E0"]
    more = ["D1D2", "D2C2", "C2C1", "C1D1"]
    loop = make_loop(GRID, "both", (*lap, *lap[:2], *more, *lap[2:]))
    found = FINDER.around(loop, set(more))
    assert found is not None
    assert sorted(found.edges) == sorted(lap)


def test_where_nothing_leads_round_there_is_no_loop() -> None:
    """The ring has one way only; and a loop that does not use an edge needs none round it."""
    ring = RoadNetwork.open(ROOT / "networks/ring3.net.xml")
    loop = read_loops(ring, ROOT / "routes/ring3.rou.xml").loops[0]
    finder = Detours(ring, "passenger")
    assert finder.around(loop, set(loop.edges)) is None
    assert finder.around(loop, {"nowhere"}) is None


def test_loops_are_found_round_all_that_may_stand() -> None:
    """Round each closure, round those at the same time together, and round each edge of who breaks down."""
    first, second = LOOPS[0], LOOPS[5]
    vehicles = [VehicleDemand(f"v{n}", loop, DEFAULT_TYPE) for n, loop in enumerate((first, second))]
    one, other = first.edges[3], first.edges[7]
    planned = Incidents((Closure(one, "", 0.0, 9.0), Closure(other, "", 5.0, 12.0)))
    found = find_detours(GRID, vehicles, planned)
    names = {f"{first.id}~{one}", f"{first.id}~{other}", f"{first.id}~{one}~{other}"}
    assert names <= {v.loop.id for v in found.vehicles}
    assert {found.own[name] for name in names} == {first.id}
    broken = Incidents((), (Breakdown("v1", 3.0, 4.0),))
    assert {f"{second.id}~{edge}" for edge in second.edges} <= find_detours(GRID, vehicles, broken).own.keys()
    assert find_detours(GRID, vehicles, Incidents()) == FoundDetours()


def test_a_loop_with_a_name_like_that_of_a_detour_is_not_taken_for_one() -> None:
    """Whose detour a loop is does not hang on its name."""
    edge = LOOPS[0].edges[3]
    namesake = replace(LOOPS[1], id=f"{LOOPS[0].id}~{edge}")
    vehicles = [VehicleDemand(f"v{n}", loop, DEFAULT_TYPE) for n, loop in enumerate((LOOPS[0], namesake))]
    found = find_detours(GRID, vehicles, Incidents((Closure(edge, "", 0.0, 9.0),)))
    assert namesake.id not in found.own
    assert LOOPS[0].id in found.own.values()


def test_a_stop_on_a_closed_road_is_named_with_who_has_to_wait() -> None:
    """No stop is left out, as in SUMO; the other lanes of a road stay open."""
    loop = LOOPS[0]
    edge = loop.edges[1]
    stop = Stop("market", "busStop", f"{edge}_0", 10.0, 60.0, 20.0)
    buses = [VehicleDemand(f"bus{n}", loop, DEFAULT_TYPE, stops=(stop,)) for n in range(5)]
    cars = [VehicleDemand("car", loop, DEFAULT_TYPE)]
    closures = (Closure(edge, "", 60.0, 900.0), Closure(edge, f"{edge}_0", 5.0, math.inf))
    others = (Closure(edge, f"{edge}_1", 0.0, 9.0), Closure(loop.edges[2], "", 0.0, 9.0))
    who = "bus0, bus1, bus2 and 2 more may have to wait before it, since no stop is left out"
    assert name_closed_stops([*buses, *cars], Incidents((*closures, *others))) == (
        f"stop market is on {edge}, closed from 60 s to 900 s: {who}",
        f"stop market is on {edge}_0, closed from 5 s on: {who}",
    )


def test_a_stop_that_is_longer_than_others_can_wait_is_named() -> None:
    """With where it is, and the loops through there that no way leads round; a short one is not named."""
    first = replace(LOOPS[0], id="mine")
    stop = Stop("bay", "lane", f"{first.edges[1]}_0", 10.0, 60.0, 900.0)
    others = [VehicleDemand(f"o{n}", loop, DEFAULT_TYPE) for n, loop in enumerate(LOOPS[:5])]
    through = [v.loop.id for v in others if stop.edge in v.loop.edges]
    assert through
    stands = VehicleDemand("v", first, DEFAULT_TYPE, stops=(stop,))
    (line,) = name_long_stops([stands, *others], FoundDetours())
    assert line.startswith(f"v is to stand for 900 s on edge {stop.edge}:")
    assert line.endswith(f"no way leads round it for {', '.join(through)}")
    found = find_detours(GRID, [stands, *others], Incidents())
    (line,) = name_long_stops([stands, *others], found)
    assert "no way" not in line
    short = replace(stands, stops=(replace(stop, duration_s=60.0),))
    assert name_long_stops([short, *others], found) == ()


def test_incidents_outside_of_the_run_are_named() -> None:
    """Before its begin, or from its end on; not those that last into it."""
    closures = (Closure("a", "", 0.0, 100.0), Closure("b", "b_0", 50.0, 101.0))
    breakdowns = (Breakdown("v", 600.0, math.inf), Breakdown("w", 599.0, 700.0))
    assert name_incidents_outside(Incidents(closures, breakdowns), 100.0, 600.0) == (
        "a is closed from 0 s to 100 s, outside of the run, which is from 100 s to 600 s",
        "v is broken down from 600 s on, outside of the run, which is from 100 s to 600 s",
    )
