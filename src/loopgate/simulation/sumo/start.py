"""Starts SUMO with options that hide no deadlock and no collision."""

import shutil
import sys
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from loopgate.disk import disk_error
from loopgate.errors import ResultsError, ScenarioError, SecondSimulationError, TrafficError
from loopgate.machines import largest_file_bytes
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.sumo_words import OUTPUTS, OWN_OUTPUT
from loopgate.traffic.sumo import SumoTraffic

_SPARE_BYTES = 4 << 20
"""Least free space: SUMO keeps 1 MiB of text and of compressed text in memory until it closes its file
[bytes]."""


class DiskGuard:
    """Ends a run before the disk is full: SUMO would end the process if it could not write.

    Parameters
    ----------
    file
        The file that SUMO writes. A check takes one or two microseconds, so it can be made in every step.
    """

    def __init__(self, file: Path) -> None:
        self._file = file
        self._folder = file.parent
        self._limit = largest_file_bytes()

    def check(self) -> None:
        """Check the space left on the disk.

        Raises
        ------
        ResultsError
            If it may not suffice for the rest of SUMO's output.
        """
        try:
            left = shutil.disk_usage(self._folder).free
            if self._limit is not None:
                written = self._file.stat().st_size if self._file.exists() else 0
                left = min(left, self._limit - written)
        except OSError as error:
            msg = f"{self._file}: cannot be written ({disk_error(error)})"
            raise ResultsError(msg) from error
        if left < _SPARE_BYTES:
            msg = (
                f"{self._file}: cannot go on, {max(left, 0) / 2**20:.1f} MiB are left on the disk and SUMO "
                f"needs {_SPARE_BYTES >> 20}; free some space and run the same command again"
            )
            raise ResultsError(msg)


def check_backend(backend: str) -> None:
    """Refuse a backend that cannot work here, before any other work.

    Raises
    ------
    TrafficError
        If there is no display for ``gui``, or a simulation is under way in this process for ``libsumo``.
    """
    if backend == "libsumo" and "libsumo" in sys.modules:  # otherwise no simulation can run in this process
        from loopgate.traffic.libsumo_backend import refuse_second  # noqa: PLC0415  loads SUMO

        refuse_second()
    if backend == "gui":
        from loopgate.traffic.traci_backend import check_display  # noqa: PLC0415  loads traci

        check_display()


def plain_options(scenario: Scenario, log: Path) -> list[str]:
    """Return the SUMO options of every run.

    Teleports are off, and SUMO looks for collisions on junctions too: by default teleports would hide
    deadlocks, and SUMO would miss these collisions.
    """
    options = [
        "--no-step-log",
        "--no-warnings",
        "--duration-log.disable",
        *("--time-to-teleport", "-1"),
        *("--collision.action", "warn"),
        *("--collision.check-junctions", "true"),
        *("--seed", str(scenario.seed)),
        *("--step-length", f"{scenario.step_s:g}"),
        *("--log", str(log)),
    ]
    if scenario.rule_for_lights == "off":
        options.append(_ALL_OFF)
    if scenario.gated:  # see `devices.unheard`
        options += ["--device.bluelight.reactiondist", "0"]
    return options


_ALL_OFF = "--tls.all-off"

TRIPS = "tripinfo.xml"

_OUTPUTS = {name: f"{name}.xml" for name in OUTPUTS} | {"fcd": "fcd.xml.gz", "tripinfo": TRIPS}


def output_options(scenario: Scenario, folder: Path, *, trips: bool = False) -> list[str]:
    """Return the options with which SUMO writes the outputs of a scenario into the run folder.

    With `trips`, SUMO writes ``tripinfo.xml`` in any case. Names and formats of these files, and the vehicles
    in them, do not follow a configuration of the user (`OWN_OUTPUT`).
    """
    asked = [name for name in OUTPUTS if name in scenario.wanted_outputs or (trips and name == "tripinfo")]
    options = [part for name in asked for part in (f"--{name}-output", str(folder / _OUTPUTS[name]))]
    if "tripinfo" in asked:
        options.append("--tripinfo-output.write-unfinished")
    options += ["--tripinfo-output.write-undeparted"] if trips else []
    return [*options, *(part for name, value in OWN_OUTPUT.items() for part in (f"--{name}", value))]


def check_outputs(scenario: Scenario) -> None:
    """Refuse SUMO outputs in a run without a folder; raise `ScenarioError`."""
    if scenario.outputs:
        msg = f"outputs {scenario.outputs}: they are written into the run folder; give one (-o)"
        raise ScenarioError(msg)


def start_traffic(
    options: Sequence[str],
    *,
    backend: str,
    log: Path,
    yields: bool = False,
    words: str = "",
    trains: bool = False,
) -> SumoTraffic:
    """Start SUMO.

    Parameters
    ----------
    options
        SUMO's command line, without the program's name.
    backend
        ``libsumo``, ``traci``, or ``gui`` for sumo-gui through traci. If libsumo has refused input in
        this process and left parts of it behind, ``traci`` replaces it: slower, with the same results.
    log
        SUMO's log, quoted in the error.
    yields
        Whether vehicles under the gate obey SUMO's right of way as well.
    words
        The options of the scenario's own, for the error.
    trains
        Whether there may be trains of SUMO's own: level crossings then close before them, also where lights
        are off.

    Raises
    ------
    TrafficError
        If SUMO does not accept its input, or libsumo has a simulation under way.
    """
    start, close, kind, reads = _backend(backend)
    try:
        running = start(options)
    except SecondSimulationError:
        raise
    except Exception as error:  # the backends raise any class of error at the start
        why = _last_error(log) or str(error)
        if words and ("commandline" in why or "processing option" in why):
            why = f"it does not take the options {words}; 'sumo --help' lists all"
        msg = f"SUMO does not start: {why}"
        raise TrafficError(msg) from error
    traffic = SumoTraffic(running, kind, yields=yields, shared=False, reads=reads, close=close)
    if trains and _ALL_OFF in options:
        traffic.close_rail_crossings()
    return traffic


def _backend(
    name: str,
) -> tuple[
    Callable[[Sequence[str]], Any],
    Callable[[], None] | None,
    tuple[type[Exception], ...],
    Mapping[str, Callable[..., Any]],
]:
    """Return how to start SUMO, how to end it (or None), its exceptions, and its faster read calls."""
    if name == "libsumo":
        from loopgate.traffic import libsumo_backend  # noqa: PLC0415  loads SUMO into the process

        if not libsumo_backend.half_built:
            return libsumo_backend.start, libsumo_backend.close, libsumo_backend.ERROR, libsumo_backend.READS
    from loopgate.traffic import traci_backend  # noqa: PLC0415  as above

    return partial(traci_backend.start, gui=name == "gui"), None, traci_backend.ERROR, {}


def _last_error(log: Path) -> str:
    try:
        lines = log.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return ""
    return next((line.removeprefix("Error: ") for line in lines if line.startswith("Error")), "")
