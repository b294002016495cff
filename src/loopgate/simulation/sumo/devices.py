"""What in SUMO would lead gated vehicles elsewhere: devices go, rerouters act on others only."""

from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path
from random import Random
from xml.etree import ElementTree as ET

from loopgate.errors import RouteError, ScenarioError
from loopgate.network import Loop, VehicleDemand
from loopgate.network.additional import read_additional
from loopgate.network.circling import words
from loopgate.network.clock import seconds, time_of
from loopgate.network.incidents import Closure
from loopgate.network.sumo_config import is_sumo_config, read_sumo_config
from loopgate.network.traffic_file import elements_in
from loopgate.network.trips import MIDDLE
from loopgate.reading import listed, shown
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.settings import is_on
from loopgate.simulation.sumo_words import own_words

_CLOSES = ("closingReroute", "closingLaneReroute")

_ON_STEP = 1e-6
"""How far from a whole number of steps a time on a step is at most: SUMO counts milliseconds."""


def closures_of(
    files: Iterable[Path], vehicles: Iterable[VehicleDemand], step_s: float = 1.0
) -> tuple[Closure, ...]:
    """Return when rerouters close edges and lanes on the loops of gated vehicles, for each of their classes.

    An edge that some of these classes may use all the same is left out: `refuse_what_leads_off` tells it.
    SUMO opens a lane within the step of `step_s` that begins then, and takes no route over it before: so a
    lane is closed for one step more.

    Raises
    ------
    RouteError
        If an attribute of an interval is no time, or lies between two steps where a lane is closed: SUMO then
        does not close it, or does not open it.
    """
    classes: dict[str, set[str]] = defaultdict(set)
    for vehicle in vehicles:
        for edge in vehicle.loop.edges:
            classes[edge].add(vehicle.type.vclass)
    found: dict[Closure, None] = {}
    for file in files:
        for interval in read_additional(file).iterfind(".//rerouter/interval"):
            for closed in _inside(interval, _CLOSES):
                name, edge = closed.get("id", ""), _closed(closed)
                if edge not in classes or any(_may_pass(closed, vclass) for vclass in classes[edge]):
                    continue
                what = f"{file}: interval that closes {name}"
                from_s, to_s = time_of(interval, "begin", what), time_of(interval, "end", what)
                lane = name if name != edge else ""
                if lane:
                    _check_on_step({"begin": from_s, "end": to_s}, step_s, what)
                    to_s = None if to_s is None else to_s + step_s
                found[Closure(edge, lane, from_s or 0.0, inf if to_s is None else to_s)] = None
    return tuple(found)


def _check_on_step(times_s: Mapping[str, float | None], step_s: float, what: str) -> None:
    for name, at_s in times_s.items():
        steps = (at_s or 0.0) / step_s
        if abs(steps - round(steps)) > _ON_STEP:
            msg = f"{what}: {name} {at_s:g} is between two steps, where SUMO does nothing; "
            msg += f"give a multiple of {step_s:g}"
            raise RouteError(msg)


def _may_pass(closed: ET.Element, vclass: str) -> bool:
    """Return whether vehicles of a class may pass a road that a rerouter closes."""
    said = {name: words(closed, name) for name in ("allow", "disallow")}
    if said["allow"]:
        return vclass in said["allow"] or "all" in said["allow"]
    if said["disallow"]:
        return not {vclass, "all"} & set(said["disallow"])
    return vclass == "authority"


def refuse_what_leads_off(
    files: Iterable[Path], loops: Iterable[Loop], closures: Iterable[Closure] = ()
) -> None:
    """Refuse closed roads and calibrators on loops that affect all vehicles, but for planned closures.

    Raises
    ------
    ScenarioError
        If there is such an element; the text names it, the loop and the way out.
    """
    by_edge, planned = (
        {edge: loop.id for loop in loops for edge in loop.edges},
        {one.edge for one in closures},
    )
    for file in files:
        for element in read_additional(file).iter():
            for edge, does in _does(element):
                if edge in by_edge and (edge not in planned or element.tag != "rerouter"):
                    what = f"{file}: {element.tag} {element.get('id', '')}"
                    msg = f"{what} {does.format(edge=edge, loop=by_edge[edge])}, or --gate open"
                    raise ScenarioError(msg)


def has_leads(file: Path) -> bool:
    """Return whether an additional file has rerouters that lead vehicles another way."""
    return any(_leads(one) for one in read_additional(file).iter("rerouter"))


def _leads(rerouter: ET.Element) -> bool:
    return any(one.tag.endswith("Reroute") and one.tag not in _CLOSES for one in rerouter.iter())


def for_others(element: ET.Element, types: Collection[str]) -> bool:
    """Restrict a rerouter to the types of ordinary vehicles; return whether it is for any of them.

    Gated vehicles drive the way on which rerouters lead them, or their loop: no rerouter may act on them.
    """
    if not _leads(element):
        return True
    own = words(element, "vTypes")
    left = [kind for kind in own or sorted(types) if kind in types]
    element.set("vTypes", " ".join(left))
    return bool(left)


def led_off(files: Iterable[Path], vehicles: Iterable[VehicleDemand]) -> dict[str, str]:
    """Return the trips that a rerouter may lead off their paths, with the reason, by name.

    A rerouter acts where a vehicle enters one of its edges. It may lead the vehicle in a way that cannot be
    known before the run, or round a closed edge farther on.
    """
    trips = [v for v in vehicles if not v.loop.closed]
    rerouters = [one for file in files for one in read_additional(file).iter("rerouter")] if trips else []
    found = {v.id: f"{v.led.unknown}; or give vTypes of others" for v in trips if v.led.unknown}
    for rerouter in rerouters:
        at, types = words(rerouter, "edges"), words(rerouter, "vTypes")
        closes = {_closed(one) for one in _inside(rerouter, _CLOSES)}
        for vehicle in (v for v in trips if closes and (not types or v.type.id in types)):
            way = vehicle.loop.edges[vehicle.edge :]
            first = next((k for k, edge in enumerate(way) if edge in at), None)
            shut = "" if first is None else next((edge for edge in way[first:] if edge in closes), "")
            if shut:
                name = rerouter.get("id", "")
                found.setdefault(vehicle.id, f"rerouter {name} closes {shut} on its way")
    return found


def _inside(element: ET.Element, tags: Iterable[str]) -> Iterator[ET.Element]:
    return (one for tag in tags for one in element.iter(tag))


def _closed(one: ET.Element) -> str:
    """Return the edge that is closed, wholly or by lane."""
    name = one.get("id", "")
    return name if one.tag == "closingReroute" else name.rpartition("_")[0]


def _does(element: ET.Element) -> Iterator[tuple[str, str]]:
    """Yield edges, and the effect there on vehicles that no gate can work with."""
    edge = element.get("edge") or element.get("lane", "").rpartition("_")[0]
    if element.tag == "calibrator" and not element.get("vTypes"):
        yield edge, "takes vehicles out on {edge}, which is on loop {loop}; give it vTypes of others"
    if element.tag != "rerouter":
        return
    does = "closes {edge}, which is on loop {loop}, to some of its vehicles, or where no vehicle is led round"
    for closed in _inside(element, _CLOSES):
        yield _closed(closed), f"{does}; let loops avoid it (loopgate loops --avoid)"


LEADING = {
    "stationfinder": "lead them to charging stations",
    "rerouting": "lead them another way than the gate knows (SUMO's duaIterate.py leads them beforehand)",
    "taxi": "lead them wherever they are called",
    "toc": "slow or stop them anywhere while nobody drives",
    "bluelight": "make others leave the lanes of their loops",
}
"""What each such device would do to gated vehicles."""

_REROUTING = "rerouting"

_BLUE, _HEARD_M = "has.bluelight.device", "device.bluelight.reactiondist"


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
    for v in filter(_may_be_led_anew, vehicles):
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


def _may_be_led_anew(vehicle: VehicleDemand) -> bool:
    """Return whether a vehicle may take another path: it drives once, and has only its end to get to."""
    on_its_way = vehicle.stops or any(name in vehicle.attributes for name in MIDDLE)
    return not (vehicle.loop.closed or on_its_way)


def _number(scenario: Scenario, said: Mapping[str, str], name: str, default: float) -> float:
    """Return the value of an option of rerouting: a share, or a time [s]; at least 0."""
    word = f"device.{_REROUTING}.{name}"
    try:
        return max(0.0, seconds(said[word])) if word in said else default
    except ValueError as error:
        msg = f"{scenario.routes or scenario.network}: {word} is {shown(said[word])}; expected a number"
        raise ScenarioError(msg) from error


def leading_devices(
    scenario: Scenario, vehicles: Sequence[VehicleDemand]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the devices that gated vehicles would have and must not, and warnings.

    Vehicles that loopgate reroutes (`led_anew`) lose SUMO's rerouting device without a warning.

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
            v
            for v in vehicles
            if is_on(share) or is_on(v.parameters.get(has, "")) or is_on(v.type.parameters.get(has, ""))
        ]
        if having:
            found[device] = f"{source}: gated vehicles go without {device} devices, which would {would}"
        if device == _REROUTING and all(map(_may_be_led_anew, having)):
            told.discard(device)
    return tuple(found), tuple(found[device] for device in found if device in told)


def unheard(files: Iterable[Path]) -> tuple[str, ...]:
    """Return a warning if ordinary vehicles of some files have blue lights: nobody makes way for them.

    Under a gate SUMO's distance from which others make way is 0 m, for they would leave the lanes on which
    they have grants.

    Raises
    ------
    ScenarioError
        If a vehicle or type sets that distance itself.
    """
    found = []
    for file, one in elements_in(files):
        said = one.get("key") if one.tag == "param" and is_on(one.get("value", "")) else ""
        if said == _HEARD_M:
            msg = f"{file}: {_HEARD_M} does not go with a gate: others would change lanes; leave it out"
            raise ScenarioError(msg)
        if said == _BLUE:
            found.append(str(file))
    where = listed(dict.fromkeys(found))
    return (f"{where}: no vehicle makes way for blue lights under a gate",) if found else ()


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
