"""Refuses flows with too many vehicles before the network is read."""

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from loopgate.errors import LoopgateError
from loopgate.network.sumo_config import is_sumo_config, read_sumo_config
from loopgate.network.traffic_file import check_flows, flows_in
from loopgate.network.vehicle_demand import Flow
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.sumo_options import begins_s

_LARGEST_BYTES = 4_000_000
"""Larger files are not read twice: a file that asks for many vehicles with few words is small [bytes]."""


def refuse_too_many(scenario: Scenario) -> None:
    """Refuse flows that exceed the largest number of vehicles; the run itself judges unclear cases.

    Raises
    ------
    RouteError
        The text names the flow with most vehicles.
    """
    begin_s = 0.0
    with suppress(LoopgateError):
        begin_s = begins_s(scenario)
    end_s = begin_s + scenario.warmup_s + scenario.duration_s
    for source in filter(None, _sources(scenario)):
        flows: list[tuple[str, Flow]] = []
        with suppress(LoopgateError, OSError):  # the run reports the error when it reads the file
            flows = flows_in(_small(source))
        check_flows(flows, begin_s, end_s, source)


def _sources(scenario: Scenario) -> Iterator[str]:
    """Yield the files whose flows are vehicles of the run."""
    if not scenario.counts_vehicles and not scenario.loops:
        yield scenario.routes or (scenario.network if is_sumo_config(scenario.network) else "")
    yield scenario.traffic


def _small(source: str) -> Iterator[Path]:
    files: tuple[Path, ...] = (Path(source),)
    if is_sumo_config(source):
        config = read_sumo_config(source)
        files = (*config.route_files, *config.additional_files)
    yield from (file for file in files if file.is_file() and file.stat().st_size <= _LARGEST_BYTES)
