"""Vehicles of 5, 7 and 12 m in one route file, on queues: starts, capacities, and how many are too many."""

from __future__ import annotations

import re
from pathlib import Path

import pandas as pd
import pytest
from long_vehicles import loops_for_all, write_mixed_fleet

from loopgate.errors import TooManyVehiclesError
from loopgate.network import RoadNetwork, generate_loops
from loopgate.results.columns import EVENT, PLACE, VEHICLE, Event
from loopgate.results.recorder import read_events
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario

pytestmark = pytest.mark.sumo

GRID = str(Path(__file__).parents[2] / "networks" / "grid5-priority.net.xml")
TYPES = {"car": (5.0, 2.5), "van": (7.0, 1.5), "bus": (12.0, 3.5)}


def routes(file: Path, vehicles: int) -> str:
    """Write eight loops with vehicles on them in turn, of the three types in turn on each loop."""
    loops = generate_loops(RoadNetwork.open(GRID), 8, length_m=(500.0, 1500.0))
    lines = [f'<vType id="{k}" length="{m}" minGap="{gap}"/>' for k, (m, gap) in TYPES.items()]
    lines += [f'<route id="{loop.id}" edges="{" ".join(loop.edges)}"/>' for loop in loops]
    for k in range(vehicles):
        kind = list(TYPES)[k // len(loops) % len(TYPES)]
        lines.append(f'<vehicle id="x{k}" type="{kind}" route="{loops[k % len(loops)].id}" depart="0"/>')
    file.write_text(f"<routes>{''.join(lines)}</routes>", encoding="utf-8")
    return str(file)


def test_nothing_collides_and_no_place_holds_more_than_fit(tmp_path: Path) -> None:
    """Ninety vehicles for ten minutes: no collision, audit clean, lengths on a lane never exceed it."""
    scenario = Scenario(network=GRID, routes=routes(tmp_path / "r.rou.xml", 90), duration_s=600.0)
    summary = simulate(scenario, tmp_path / "run")
    assert summary["vehicles"] == 90
    assert (summary["outcome"], summary["audit"]) == ("done", "clean")
    assert summary["collisions"] == summary["teleports"] == summary["vehicles_without_a_lap"] == 0
    events = read_events(tmp_path / "run" / "events.parquet")
    network = RoadNetwork.open(GRID)
    on: dict[str, dict[str, float]] = {}
    fullest = 0.0
    for row in events[events[EVENT].isin([Event.START, Event.GRANT, Event.LEAVE])].itertuples():
        vehicle, place = str(getattr(row, VEHICLE)), str(getattr(row, PLACE))
        here = on.setdefault(place, {})
        if getattr(row, EVENT) == Event.LEAVE:
            here.pop(vehicle, None)
            continue
        here[vehicle] = sum(list(TYPES.values())[int(vehicle[1:]) // 8 % 3])
        share = sum(here.values()) / network.lanes[place].length_m
        assert share <= 1.0, f"{place} at {row.time_s} s: {here}"
        fullest = max(fullest, share)
    assert fullest > 0.6, "so few vehicles say nothing about capacities"


def test_the_number_that_can_start_starts_and_moves_and_one_more_is_refused(tmp_path: Path) -> None:
    """Of a thousand vehicles the run names how many can start; these get going, and one more is too many."""
    crowd = Scenario(network=GRID, routes=routes(tmp_path / "crowd.rou.xml", 1000), duration_s=300.0)
    with pytest.raises(TooManyVehiclesError, match=r"the first \d+ can start") as refused:
        simulate(crowd)
    found = re.search(r"take at most (\d+)", str(refused.value))
    assert found is not None
    most = int(found[1])
    assert most == refused.value.fitting > 100
    fitting = Scenario(network=GRID, routes=routes(tmp_path / "most.rou.xml", most), duration_s=300.0)
    summary = simulate(fitting, tmp_path / "run")
    assert (summary["vehicles"], summary["outcome"], summary["audit"]) == (most, "done", "clean")
    assert summary["collisions"] == summary["overruns"] == 0
    driven = pd.read_parquet(tmp_path / "run" / "vehicles.parquet")["distance_m"]
    assert (driven > 10.0).mean() > 0.9
    one_more = Scenario(network=GRID, routes=routes(tmp_path / "more.rou.xml", most + 1), duration_s=300.0)
    with pytest.raises(TooManyVehiclesError, match=f"the first {most} can start"):
        simulate(one_more)


def test_trailers_and_buses_among_cars_never_touch(tmp_path: Path) -> None:
    """Twenty-four vehicles of 5, 12 and 16.5 m: the audit of positions is clean."""
    routes = write_mixed_fleet(loops_for_all(GRID, 8, seed=3), 24, 3, tmp_path / "r.rou.xml")
    summary = simulate(Scenario(network=GRID, routes=str(routes), duration_s=200.0, positions=True))
    assert (summary["collisions"], summary["trespasses"], summary["overruns"]) == (0, 0, 0)
    assert summary["audit"] == "clean"
