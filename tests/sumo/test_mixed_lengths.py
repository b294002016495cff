"""Vehicles of 5, 7 and 12 m in one route file, on queues: starts, capacities, and how many are too many."""

from __future__ import annotations

from functools import partial
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
    file = routes(tmp_path / "r.rou.xml", 24)
    wanted = partial(Scenario, network=GRID, routes=file, types="car=1,van=1,bus=1", duration_s=300.0)
    with pytest.raises(TooManyVehiclesError, match=r"the first \d+ can start") as refused:
        simulate(wanted(vehicles=1000))
    most = refused.value.fitting
    assert most > 100
    summary = simulate(wanted(vehicles=most), tmp_path / "run")
    assert (summary["vehicles"], summary["outcome"], summary["audit"]) == (most, "done", "clean")
    assert summary["collisions"] == summary["overruns"] == 0
    driven = pd.read_parquet(tmp_path / "run" / "vehicles.parquet")["distance_m"]
    assert (driven > 10.0).mean() > 0.9
    with pytest.raises(TooManyVehiclesError, match=f"the first {most} can start"):
        simulate(wanted(vehicles=most + 1))


def test_vehicles_of_a_file_that_find_no_room_wait_to_depart(tmp_path: Path) -> None:
    """As under SUMO: those start that can, the others wait, and nobody locks up."""
    crowd = Scenario(network=GRID, routes=routes(tmp_path / "crowd.rou.xml", 1000), duration_s=120.0)
    summary = simulate(crowd, tmp_path / "run")
    rows = pd.read_parquet(tmp_path / "run" / "vehicles.parquet")
    assert (len(rows), summary["outcome"], summary["audit"]) == (1000, "done", "clean")
    assert (rows["depart_delay_s"] == 0.0).sum() > 100
    assert (rows["depart_delay_s"] > 100.0).sum() > 500


def test_trailers_and_buses_among_cars_never_touch(tmp_path: Path) -> None:
    """Twenty-four vehicles of 5, 12 and 16.5 m: the audit of positions is clean."""
    routes = write_mixed_fleet(loops_for_all(GRID, 8, seed=3), 24, 3, tmp_path / "r.rou.xml")
    summary = simulate(Scenario(network=GRID, routes=str(routes), duration_s=200.0, positions=True))
    assert (summary["collisions"], summary["trespasses"], summary["overruns"]) == (0, 0, 0)
    assert summary["audit"] == "clean"
