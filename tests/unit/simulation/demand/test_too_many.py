"""Vehicles without end are refused before they are made one by one."""

from __future__ import annotations

import math
import tracemalloc
from pathlib import Path
from random import Random
from time import process_time

import pytest

from loopgate import Scenario
from loopgate.errors import LoopgateError, RouteError, ScenarioError
from loopgate.network.traffic_file import MOST_OF_SUMO, check_flows, flows_in, read_traffic
from loopgate.network.vehicle_demand import Flow
from loopgate.simulation.assembly import assemble
from loopgate.simulation.demand.allotment import MOST_VEHICLES

GRID = "networks/grid5-priority.net.xml"
ROUND = '<route edges="A0A1 A1B1 B1B0 B0A0"/>'
OPEN = '<route edges="A0A1 A1A2"/>'


def flow(folder: Path, attributes: str, route: str) -> str:
    """Write a route file with one flow."""
    file = folder / "f.rou.xml"
    file.write_text(f'<routes><flow id="f" {attributes}>{route}</flow></routes>')
    return str(file)


@pytest.mark.parametrize("route", [ROUND, OPEN])
@pytest.mark.parametrize(
    "attributes",
    [
        'begin="0" number="1000000000"',
        'begin="0" end="100" number="300000"',
        'begin="0" period="exp(1e9)"',
        'begin="0" period="exp(1e9)" number="1000000000"',
        'begin="0" period="1e-6"',
        'begin="0" vehsPerHour="1e9"',
        'begin="0" period="5e-324"',
    ],
)
def test_flows_of_too_many(tmp_path: Path, attributes: str, route: str) -> None:
    """The flow is named, and how many there may be; in under a second, in a few megabytes."""
    routes = flow(tmp_path, attributes, route)
    assemble(Scenario(network=GRID, loops=1))  # the network is read
    tracemalloc.start()
    began = process_time()
    with pytest.raises(ScenarioError, match=rf"of f; expected at most {MOST_VEHICLES}"):
        assemble(Scenario(network=GRID, routes=routes, duration_s=3600))
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert process_time() - began < 1.0
    assert most < 50e6


def test_flows_that_go_on_after_the_run_are_as_many_as_depart_in_it(tmp_path: Path) -> None:
    """A billion vehicles in thirty years are a few in a minute."""
    routes = flow(tmp_path, 'begin="0" end="1e9" number="1000000000"', OPEN)
    made = assemble(Scenario(network=GRID, routes=routes, duration_s=5))
    assert [start.vehicle for start in made.everybody] == ["f.0", "f.1", "f.2", "f.3", "f.4"]


@pytest.mark.parametrize(
    "one",
    [
        Flow(10.0, 100.0, 30),
        Flow(10.0, None, 30),
        Flow(10.0, 100.0, None, 0.7),
        Flow(0.0, None, 1000, 0.1),
        Flow(10.0, 5.0, 30),
        Flow(10.0, 10.0, 30),
        Flow(40.0, 40.0, 30),
    ],
)
@pytest.mark.parametrize("since_s", [-math.inf, 0.0, 30.0, 31.4, 99.0])
def test_as_many_are_expected_as_depart(one: Flow, since_s: float) -> None:
    """Counted without making them; who departed before has a number too."""
    whole = list(one.departures_s(-math.inf, 60.0, Random(1)))
    some = list(one.departures_s(since_s, 60.0, Random(1)))
    assert some == [(number, at_s) for number, at_s in whole if at_s >= since_s]
    assert [number for number, _ in whole] == list(range(len(whole)))
    assert one.expected(since_s, 60.0) == pytest.approx(len(some), abs=1)


def test_a_flow_that_ends_as_it_begins_departs_at_once() -> None:
    """As SUMO has it, where it says how many there are."""
    departs = list(Flow(0.0, 0.0, 3).departures_s(0.0, 60.0, Random(1)))
    assert departs == [(0, 0.0), (1, 0.0), (2, 0.0)]


def test_a_rare_flow_without_end_is_drawn_for_the_run_only() -> None:
    """For each second of the run it is drawn whether somebody departs: not for thirty years."""
    began = process_time()
    assert len(list(Flow(0.0, 1e9, probability=1e-9).departures_s(0.0, 100.0, Random(1)))) < 2
    assert process_time() - began < 1.0


def test_numbers_of_a_scenario_have_the_same_bound() -> None:
    """The command line can ask for a million vehicles."""
    with pytest.raises(
        ScenarioError, match=f"vehicles: 1000000 are asked for; expected at most {MOST_VEHICLES}"
    ):
        assemble(Scenario(network=GRID, loops=3, vehicles=1_000_000))


def test_flows_that_sumo_makes_have_a_bound_too(tmp_path: Path) -> None:
    """Ordinary traffic, persons among it, and configurations that run as they are."""
    file = Path(flow(tmp_path, 'begin="0" end="100" number="1000000000"', OPEN))
    text = file.read_text().replace("<routes>", '<routes><personFlow id="p" begin="0" period="exp(1e9)"/>')
    file.write_text(text)
    for flows in (read_traffic(file).flows, flows_in([file])):
        with pytest.raises(RouteError, match=f"of p; expected at most {MOST_OF_SUMO}"):
            check_flows(flows, 0.0, 100.0, file)
        check_flows(flows, 1e9, 1e9 + 1e-6, file)
    assert flows_in([tmp_path / "nowhere.rou.xml", Path(GRID)]) == []


def test_nobody_in_the_time_of_the_run_is_said(tmp_path: Path) -> None:
    """It is no matter of the gate."""
    routes = flow(tmp_path, 'begin="0" probability="1e-9"', OPEN)
    with pytest.raises(LoopgateError, match="no vehicle departs"):
        assemble(Scenario(network=GRID, routes=routes, duration_s=60, gate="certified"))
