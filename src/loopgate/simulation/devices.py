"""Devices by which SUMO would lead a gated vehicle off its way: it goes without them, and that is said."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from itertools import chain

from loopgate.errors import ScenarioError
from loopgate.network.sumo_config import is_sumo_config, read_sumo_config
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.settings import is_on
from loopgate.simulation.sumo_input import Start
from loopgate.simulation.sumo_words import own_words
from loopgate.simulation.vehicles import Member

__all__ = ["LEADING", "has_device", "leading_devices", "without_devices"]

LEADING = {
    "rerouting": "lead them another way than the gate knows (SUMO's duaIterate.py leads them beforehand)",
    "taxi": "lead them wherever they are called",
    "toc": "slow or stop them anywhere while nobody drives",
}
"""What each such device would do."""


def has_device(name: str) -> str:
    """Return the parameter of vehicles and types that says whether they have a device.

    >>> has_device("rerouting")
    'has.rerouting.device'
    """
    return f"has.{name}.device"


def leading_devices(
    scenario: Scenario, vehicles: Sequence[Member]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return which of these devices gated vehicles would have, and what to say of it.

    Raises
    ------
    ScenarioError
        If SUMO's options give one to them by their names: it cannot be taken from these.
    """
    configured = is_sumo_config(scenario.network)
    source = scenario.network if configured else scenario.routes or scenario.network
    options = dict(_options(scenario, configured=configured))
    names = {vehicle.id for vehicle in vehicles}
    found = {}
    for device, would in LEADING.items():
        by_name = f"device.{device}.explicit"
        if named := sorted(names & set(options.get(by_name, "").split(","))):
            msg = f"{source}: {by_name} {named[0]} does not go with a gate: it would {would}; leave it out"
            raise ScenarioError(msg)
        said = chain.from_iterable((v.parameters, v.type.parameters) for v in vehicles)
        share = options.get(f"device.{device}.probability", "")
        if is_on(share) or any(is_on(params.get(has_device(device), "")) for params in said):
            found[device] = f"{source}: gated vehicles go without {device} devices, which would {would}"
    return tuple(found), tuple(found.values())


def without_devices(start: Start, devices: Collection[str]) -> Start:
    """Return a vehicle, and its type, without devices; SUMO takes none from a vehicle that is there."""
    off = {has_device(device): "false" for device in devices}
    kind = replace(start.type, parameters={**start.type.parameters, **off})
    own = {name: value for name, value in start.parameters.items() if name not in off}
    return replace(start, type=kind, parameters=own)


def _options(scenario: Scenario, *, configured: bool) -> Iterator[tuple[str, str]]:
    if configured:
        yield from read_sumo_config(scenario.network).options.items()
    yield from own_words(scenario.sumo)
