"""SUMO's options from a configuration and from a scenario; flows too large for the memory are refused."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING

from loopgate.errors import LoopgateError, ScenarioError
from loopgate.network.additional import FLEET, read_additional
from loopgate.network.clock import as_number, seconds
from loopgate.network.sumo_config import SumoConfig, is_sumo_config, read_sumo_config
from loopgate.network.traffic_file import check_flows, flows_in
from loopgate.network.vehicle_demand import Flow, RoutesFile
from loopgate.reading import shown
from loopgate.simulation.settings import DEFAULTS, UNDER_NO_GATE, check_options, is_on
from loopgate.simulation.sumo_words import NEVER, OWN_OUTPUT, REPLACED, own_words

if TYPE_CHECKING:
    from loopgate.simulation.scenario import Scenario


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


_NO_END_S = -1.0
"""SUMO's word for a run without end."""

_KEYS = {"seed": "seed", "step-length": "step_s"}
"""Options that are keys of a scenario."""

_OUTPUTS = "fcd-output", "tripinfo-output", "edgedata-output", "output.", "device.fcd."

QUIET = frozenset(
    {
        "no-step-log",
        "verbose",
        "duration-log.disable",
        "start",
        "quit-on-end",
        "gui-settings-file",
        "end",
        "log",
    }
)
"""Options that are dropped without a warning, since they do not change the simulation."""


@dataclass(frozen=True, slots=True)
class SumoOptions:
    """Additional options for SUMO.

    Attributes
    ----------
    arguments
        Arguments for SUMO's command line, before those of the run.
    additional_files
        The additional files of the configuration.
    notes
        One warning for each option that is dropped.
    begin_s
        When the simulation begins [s].
    configured
        Whether there is a configuration.
    """

    arguments: tuple[str, ...] = ()
    additional_files: tuple[Path, ...] = ()
    notes: tuple[str, ...] = ()
    begin_s: float = 0.0
    configured: bool = False
    source: str = ""
    outputs: Mapping[str, str] = field(default_factory=dict, hash=False)
    """The file of the configuration, and its options of outputs by name."""

    def taken_over_by(self, options: Sequence[str]) -> list[str]:
        """Return warnings for outputs of the configuration that options of the run replace."""
        return [
            f"{self.source}: {name} {value} is not taken over: the run folder has this output in its own form"
            for name, value in self.outputs.items()
            if f"--{name}" in options and name not in REPLACED
        ]


def sumo_options(scenario: Scenario) -> SumoOptions:
    """Return the options for SUMO from a configuration and from a scenario.

    A configuration's options, outputs and additional files are passed on.

    Raises
    ------
    ScenarioError
        If a gate cannot work with an option, or the option must be set in another way; the text says which.
    """
    network, traffic, words = scenario.network, scenario.traffic, scenario.sumo
    if scenario.gated:
        _refuse(dict(own_words(words)), "sumo")
    config = read_sumo_config(network) if is_sumo_config(network) else None
    beside = _of_traffic(network, traffic)
    if config is None:
        return SumoOptions(tuple(shlex.split(words)), notes=beside)
    if scenario.gated:
        _refuse({name: value for name, value in config.options.items() if name not in SWITCHED_OFF}, network)
        if scenario.routes not in {"", network} and traffic != network:
            _without_vehicles(config)
    port = ("--remote-port", "0") if is_on(config.options.get("remote-port", "")) else ()
    off = [part for name, value in _switched_off(config, scenario) for part in (f"--{name}", value)]
    return SumoOptions(
        ("--configuration-file", str(config.file), *port, *off, *shlex.split(words)),
        config.additional_files,
        (*_notes(config, scenario), *beside),
        begin_s=begins_s(scenario),
        configured=True,
        source=str(config.file),
        outputs={name: value for name, value in config.options.items() if name.startswith(_OUTPUTS)},
    )


def all_options(scenario: Scenario) -> dict[str, str]:
    """Return the options of SUMO in the scenario's configuration and in the scenario itself, by name."""
    config = read_sumo_config(scenario.network).options if is_sumo_config(scenario.network) else {}
    return {**config, **dict(own_words(scenario.sumo))}


def option_of(scenario: Scenario, name: str, default: float) -> float:
    """Return a number that the scenario's configuration, or the scenario itself, gives to SUMO as an option.

    Raises
    ------
    ScenarioError
        If it is no number of at least 0.
    """
    text = all_options(scenario).get(name)
    value = default if text is None else as_number(text)
    if not 0.0 <= value < inf and value != default:
        msg = f"{scenario.network}: {name} is {shown(text)}; expected a number of at least 0"
        raise ScenarioError(msg)
    return value


def from_configuration(network: str, begins_s: object = -1.0) -> dict[str, object]:
    """Return the keys of a scenario that a configuration sets: seed, step and duration.

    `begins_s`: when the simulation begins, if the scenario says so [s].
    """
    if not is_sumo_config(network):
        return {}
    config = read_sumo_config(network)
    found: dict[str, object] = {}
    try:
        if "seed" in config.options:
            found["seed"] = int(config.options["seed"])
        if "step-length" in config.options:
            found["step_s"] = _seconds(config, "step-length")
        end_s, begin_s = _seconds(config, "end", "-1"), _seconds(config, "begin")
        if isinstance(begins_s, int | float) and begins_s >= 0.0:
            begin_s = float(begins_s)
    except ValueError as error:
        msg = f"{config.file}: seed is {config.options['seed']!r}; expected a whole number"
        raise ScenarioError(msg) from error
    if end_s < begin_s and end_s != _NO_END_S:
        msg = f"{config.file}: end is {end_s:g} s, before the run begins, at {begin_s:g} s; correct one"
        raise ScenarioError(msg)
    if end_s > begin_s:
        found["duration_s"] = end_s - begin_s
    return found


def _refuse(options: Mapping[str, str], source: str) -> None:
    check_options(lambda name: options.get(name, ""), source=source, way_out="or --gate open")
    for name in ("random",):
        if is_on(options.get(name, "")):
            msg = f"{source}: {name} {options[name]} does not go with a gate: {NEVER[name]}; or --gate open"
            raise ScenarioError(msg)


def _without_vehicles(config: SumoConfig) -> None:
    for file in config.additional_files:
        for one in read_additional(file):
            if one.tag in FLEET:
                msg = (
                    f"{file}: {one.tag} {one.get('id', '')}: beside the vehicles of --routes it is ordinary "
                    f"traffic that nothing is known of; give the configuration by --traffic too"
                )
                raise ScenarioError(msg)


_SAME = {"collision.action": "warn", "collision.check-junctions": "true", "no-warnings": "true"}
"""What the run sets itself: a configuration that says the same is not told otherwise."""

HONOURED = {
    **dict.fromkeys(("net-file", "route-files", "additional-files"), "loopgate reads them"),
    **dict.fromkeys(("begin", "seed", "step-length"), "the run has them"),
    "end": "the duration of a run, unless `--duration` says another",
    "scale": "multiplies gated vehicles too",
    "max-num-vehicles": "gated vehicles count, and wait to depart",
    **dict.fromkeys(DEFAULTS, "of vehicle types that say nothing themselves, as a gate must know"),
    "device.rerouting.probability": "loopgate reroutes gated trips itself",
    "device.rerouting.period": "loopgate reroutes gated trips itself",
    "device.rerouting.threshold.factor": "loopgate reroutes gated trips itself",
    "device.rerouting.threshold.constant": "loopgate reroutes gated trips itself",
}
"""Options of SUMO that loopgate reads, and what it does with them."""

_AT_DEPARTURE = "gated vehicles depart where and when the gate lets them; it holds for ordinary vehicles"

UNDER_GATE = {
    **dict.fromkeys(("default.departspeed", "default.departlane"), _AT_DEPARTURE),
    **dict.fromkeys(("max-depart-delay", "random-depart-offset", "extrapolate-departpos"), _AT_DEPARTURE),
    **dict.fromkeys(("insertion-checks", "eager-insert", "sloppy-insert", "emergency-insert"), _AT_DEPARTURE),
}
"""Options that have no effect on gated vehicles, and why."""


SWITCHED_OFF = {"lateral-resolution": "-1"}
"""Options of `UNDER_NO_GATE` without which a configuration can be driven, and the values that mean that."""


def _switched_off(config: SumoConfig, scenario: Scenario) -> list[tuple[str, str]]:
    """Return the options that the run switches off, with their values."""
    said = config.options
    return [one for one in SWITCHED_OFF.items() if scenario.gated and is_on(said.get(one[0], ""))]


def _notes(config: SumoConfig, scenario: Scenario) -> Iterator[str]:
    if is_on(port := config.options.get("remote-port", "")):
        yield f"{config.file}: remote-port {port} is not taken over: {NEVER['remote-port']}"
    for name in (name for name in UNDER_GATE if scenario.gated and is_on(config.options.get(name, ""))):
        yield f"{config.file}: {name} {config.options[name]}: {UNDER_GATE[name]}"
    for name, _ in _switched_off(config, scenario):
        why, _, _ = UNDER_NO_GATE[name].partition(";")
        yield f"{config.file}: {name} {config.options[name]} is not taken over: {why}; --gate open has it"
    for name, why in REPLACED.items():
        said = config.options.get(name, OWN_OUTPUT.get(name))
        if said == _SAME.get(name, ""):
            continue
        if name.startswith("time-to-teleport") and not is_on(said or ""):
            continue
        if said != OWN_OUTPUT.get(name) and name not in QUIET:
            yield f"{config.file}: {name} {config.options[name]} is not taken over: {why}"
    for name, key in _KEYS.items():
        said = config.options.get(name)
        if said is not None and _seconds(config, name) != getattr(scenario, key):
            yield f"{config.file}: {name} {said} is not taken over: the run has {getattr(scenario, key)}"


def _of_traffic(network: str, traffic: str) -> tuple[str, ...]:
    if not is_sumo_config(traffic) or traffic == network:
        return ()
    said = [name for name in read_sumo_config(traffic).options if name not in QUIET]
    if not said:
        return ()
    return (f"{traffic}: only its vehicles and additional files are taken, not {', '.join(said)}",)


def begins_s(scenario: Scenario, file: RoutesFile | None = None) -> float:
    """Return when the simulation begins [s]: as the scenario or its configuration says, otherwise at 0.

    Without a configuration, and with vehicles that drive once, it begins when the first of them departs.
    """
    if scenario.begin_s >= 0.0:
        return scenario.begin_s
    if not is_sumo_config(scenario.network):
        once = file is not None and any(vehicle.once for vehicle in file.vehicles)
        return float(int(file.first_s)) if file is not None and once else 0.0
    config = read_sumo_config(scenario.network)
    return _seconds(config, "begin")


def _seconds(config: SumoConfig, option: str, default: str = "0") -> float:
    """Return the time that a configuration gives to an option [s]."""
    text = config.options.get(option, default)
    try:
        return seconds(text)
    except ValueError as error:
        msg = f"{config.file}: {option} is {shown(text)}; expected seconds or h:m:s"
        raise ScenarioError(msg) from error
