"""SUMO's devices that would move gated vehicles on their own: they are switched off, with a warning."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace
from math import inf
from random import Random

from loopgate.errors import ScenarioError
from loopgate.network import VehicleDemand
from loopgate.network.clock import seconds
from loopgate.network.sumo_config import is_sumo_config, read_sumo_config
from loopgate.network.trips import MIDDLE
from loopgate.reading import shown
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.settings import is_on
from loopgate.simulation.sumo_words import own_words

LEADING = {
    "stationfinder": "lead them to charging stations",
    "rerouting": "lead them another way than the gate knows (SUMO's duaIterate.py leads them beforehand)",
    "taxi": "lead them wherever they are called",
    "toc": "slow or stop them anywhere while nobody drives",
}
"""What each such device would do to gated vehicles."""

_REROUTING = "rerouting"


def has_device(name: str) -> str:
    """Return the parameter by which a vehicle or type gets a device.

    >>> has_device("rerouting")
    'has.rerouting.device'
    """
    return f"has.{name}.device"


@dataclass(frozen=True, slots=True)
class ReroutingPolicy:
    """When a vehicle is rerouted: every `every_s` seconds; if this is infinite, at departure only.

    A new path must take less time than the vehicle's own path: less by the constant `least_s` [s] and by the
    factor `factor`.
    """

    every_s: float
    factor: float
    least_s: float


def led_anew(scenario: Scenario, vehicles: Sequence[VehicleDemand]) -> dict[str, ReroutingPolicy]:
    """Return the vehicles that are rerouted where another path is quicker, each with its policy, as in SUMO.

    These are vehicles that drive once, without stops and without edges that they must pass.

    Raises
    ------
    ScenarioError
        If a share, period or threshold is no number.
    """
    options = dict(_options(scenario, configured=is_sumo_config(scenario.network)))
    share = _number(scenario, options, "probability", 0.0)
    found = {}
    for v in vehicles:
        if v.loop.closed or v.stops or any(name in v.attributes for name in MIDDLE):
            continue
        said = {**options, **v.type.parameters, **v.parameters}
        has = said.get(has_device(_REROUTING))
        chosen = (
            Random(f"{scenario.seed} {_REROUTING} {v.id}").random() < share if has is None else is_on(has)
        )
        if chosen:
            found[v.id] = ReroutingPolicy(
                _number(scenario, said, "period", 0.0) or inf,
                _number(scenario, said, "threshold.factor", 1.0),
                _number(scenario, said, "threshold.constant", 0.0),
            )
    return found


def _number(scenario: Scenario, said: Mapping[str, str], name: str, default: float) -> float:
    """Return the value of an option of rerouting: a share, or a time [s]; at least 0."""
    word = f"device.{_REROUTING}.{name}"
    try:
        return max(0.0, seconds(said[word])) if word in said else default
    except ValueError as error:
        msg = f"{scenario.routes or scenario.network}: {word} is {shown(said[word])}; expected a number"
        raise ScenarioError(msg) from error


def leading_devices(
    scenario: Scenario, vehicles: Sequence[VehicleDemand], rerouted: AbstractSet[str] = frozenset()
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the devices that gated vehicles would have and must not, and warnings.

    `rerouted`: vehicles that loopgate reroutes; they lose SUMO's rerouting device without a warning.

    Raises
    ------
    ScenarioError
        If SUMO's options give a device to a gated vehicle by name: loopgate cannot switch that off.
    """
    configured = is_sumo_config(scenario.network)
    source = scenario.network if configured else scenario.routes or scenario.network
    options = dict(_options(scenario, configured=configured))
    names = {vehicle.id for vehicle in vehicles}
    found, told = {}, set(LEADING)
    for device, would in LEADING.items():
        by_name = f"device.{device}.explicit"
        if named := sorted(names & set(options.get(by_name, "").split(","))):
            msg = f"{source}: {by_name} {named[0]} does not go with a gate: it would {would}; leave it out"
            raise ScenarioError(msg)
        share, has = options.get(f"device.{device}.probability", ""), has_device(device)
        having = [
            v.id
            for v in vehicles
            if is_on(share) or is_on(v.parameters.get(has, "")) or is_on(v.type.parameters.get(has, ""))
        ]
        if having:
            found[device] = f"{source}: gated vehicles go without {device} devices, which would {would}"
        if device == _REROUTING and rerouted >= set(having):
            told.discard(device)
    return tuple(found), tuple(found[device] for device in found if device in told)


def without_devices(vehicle: VehicleDemand, devices: Collection[str]) -> VehicleDemand:
    """Return a vehicle and its type without devices."""
    off = {has_device(device): "false" for device in devices}
    kind = replace(vehicle.type, parameters={**vehicle.type.parameters, **off})
    own = {name: value for name, value in vehicle.parameters.items() if name not in off}
    return replace(vehicle, type=kind, parameters=own)


def _options(scenario: Scenario, *, configured: bool) -> Iterator[tuple[str, str]]:
    if configured:
        yield from read_sumo_config(scenario.network).options.items()
    yield from own_words(scenario.sumo)
