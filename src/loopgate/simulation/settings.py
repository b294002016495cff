"""Settings of SUMO and vehicle types that a gate accepts, because drivers then keep clear of each other.

`analysis/tables/roads.md` has the measurements of what is accepted, and of what can be foreseen.
"""

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from math import inf

from loopgate.errors import ScenarioError
from loopgate.network import Loop, RoadNetwork
from loopgate.network.clock import as_number, seconds
from loopgate.network.vehicle_type import VehicleType
from loopgate.reading import shown
from loopgate.simulation.braking_trial import why_overruns

_MODEL, _LANES, _TAU, _ACTION, _GAP, _MINOR, _DESIRED = (
    "carFollowModel",
    "laneChangeModel",
    "tau",
    "actionStepLength",
    "minGap",
    "jmSigmaMinor",
    "desiredMaxSpeed",
)

_LETS = {
    "jmIgnoreJunctionFoeProb": (0.0, "it drive into vehicles inside a junction"),
    "timeToTeleport": (0.0, "it jump over others, of which no gate is told"),
    "timeToTeleportBidi": (0.0, "it jump over others, of which no gate is told"),
}
"""The highest harmless value of an attribute, and what a vehicle may do above it."""

_LETS_AT_LIGHTS = {"jmDriveAfterRedTime": (0.0, "it drive at red where lights are obeyed")}
"""The same where lights are obeyed; where they are not, nobody counts on a driver who stops at red."""

_STOPS_EARLY, _AT_LINE_M = "jmStoplineGap", 1.0
"""How far before a light a driver stops, and its usual value [m]. For a greater value drivers brake sooner,
also on a crossing with a light farther on."""

_IGNORES = tuple(
    f"{model}.ignore{whom}" for model in ("carFollowModel", "junctionModel") for whom in ("IDs", "Types")
)
"""Parameters of a vehicle with which SUMO lets it drive as if other vehicles were not there."""

_AWARE = "device.driverstate.initialAwareness"
"""A parameter, and an option, for how well drivers see: below 1 they misjudge gaps, speeds and lines."""

_FORESEEN = ("Krauss", "KraussOrig1", "KraussPS", "KraussX", "Daniel1")
"""Car-following models for which the time to clear a crossing can be predicted; SUMO's default is first."""

_UNFORESEEN = ("IDM", "IDMM", "EIDM", "ACC", "Wiedemann", "BKerner")
"""Models that keep clear of vehicles ahead, but may be slower over a crossing than predicted."""

_SUMO = {_TAU: 1.0, "accel": 2.6, "sigma": 0.5, "speedFactor": 1.0, "speedDev": 0.1}
"""SUMO's defaults for a passenger car."""

_DECEL_MPS2 = 4.5
"""SUMO's default deceleration of a passenger car [m/s2]."""

_LEAST_GAP_M = 0.5
_MOST_DAWDLING_MPS2 = 1.75
"""Largest acceleration times sigma: the speed that a driver may lose in a second without a reason."""

_LEAST_TOP = 0.8
"""A vehicle whose desired top speed is below this share of the limit is on a crossing for longer than
predicted: SUMO tells of each vehicle how fast it can drive, not how fast it would like to."""

_SLOWER_THAN_THEY_CAN = frozenset({"bicycle"})
"""Vehicle classes to which SUMO gives a low desired top speed by default."""

_ROUNDING = 1e-9

UNDER_NO_GATE = {
    "step-method.ballistic": "vehicles overshoot the lines at which they are held; leave it out",
    "mesosim": "no vehicle is on a lane in a mesoscopic run; leave it out",
    "lanechange.duration": "a vehicle is between lanes for a while, which no place describes; leave it out",
    "lateral-resolution": "vehicles pass each other within a lane, which no place describes; leave it out",
    "load-state": "the gate knows nothing of the vehicles in it; leave it out",
    "device.bluelight.probability": "others change lanes to make room for such a vehicle; leave it out",
    "device.bluelight.explicit": "others change lanes to make room for such a vehicle; leave it out",
    "device.bluelight.reactiondist": "no vehicle makes way for blue lights there; leave it out",
    _AWARE: "drivers misjudge how far others and lines are away; leave it out",
}
"""Options of SUMO that no gate can work with: the reason, and the way out."""

_SUMO_HAS = {"device.bluelight.reactiondist": 25.0, _AWARE: 1.0}
"""Values that these options have where nobody sets them: a running simulation tells them too."""

_UNKNOWN = "give it as {} of a vType, so that the gate knows of it"

DEFAULTS = {
    "default.carfollowmodel": _MODEL,
    "default.action-step-length": _ACTION,
    "default.speeddev": "speedDev",
}
"""Options of SUMO that a vehicle type has where it says nothing itself: its attribute."""

_OFF = frozenset({"", "false", "0", "0.0", "0.00", "off", "no", "x", "-", "-1", "-1.00", "krauss"})
"""Values that switch an option off."""


def check_options(read: Callable[[str], str], *, source: str, way_out: str = "", known: bool = True) -> None:
    """Refuse options of SUMO with which a gate cannot keep vehicles apart.

    Parameters
    ----------
    read
        Returns the value of an option, empty if it is not set.
    source
        Where the options are set, for the message.
    way_out
        Advice on what else can be done, for the message.
    known
        Whether the gate knows of the options that hold for vehicle types.

    Raises
    ------
    ScenarioError
        If such an option is set; the text names it and the reason.
    """
    unknown = {} if known else {name: _UNKNOWN.format(kind) for name, kind in DEFAULTS.items()}
    for name, reason in {**UNDER_NO_GATE, **unknown}.items():
        value = read(name)
        is_set = value.strip() if name == _AWARE else is_on(value)  # 0 is no switch there
        if is_set and as_number(value) != _SUMO_HAS.get(name):
            msg = f"{source}: {name} {value} does not go with a gate: {reason}"
            raise ScenarioError(f"{msg}, {way_out}" if way_out else msg)


def is_on(value: str) -> bool:
    """Return whether an option of SUMO is switched on."""
    return value.strip().lower() not in _OFF


def _as_attribute(name: str, value: str) -> str:
    """Return the value of an option as a type takes it: an option may be a clock time, an attribute not."""
    try:
        return value if DEFAULTS[name] == _MODEL else f"{seconds(value):g}"
    except ValueError as error:
        msg = f"{name} is {shown(value)}; expected a number"
        raise ScenarioError(msg) from error


def with_defaults(kind: VehicleType, options: Mapping[str, str]) -> VehicleType:
    """Return a vehicle type with what SUMO's options say of types that say nothing themselves."""
    said = kind.attributes
    more = {
        attribute: _as_attribute(name, options[name])
        for name, attribute in DEFAULTS.items()
        if is_on(options.get(name, "")) and attribute not in said
    }
    if "(" in said.get("speedFactor", ""):  # it has a deviation of its own
        more.pop("speedDev", None)
    return replace(kind, attributes={**said, **more}) if more else kind


def check_types(kinds: Mapping[VehicleType, float], *, step_s: float, obeys: bool, source: str) -> None:
    """Refuse vehicle types whose drivers keep smaller gaps than a gate needs, or do not stop where told.

    Parameters
    ----------
    kinds
        Types of the vehicles under the gate, each with the highest speed limit on their ways [m/s].
    step_s
        Length of a simulation step [s].
    obeys
        Whether traffic lights are obeyed.
    source
        The file of the types, for the message.

    Raises
    ------
    ScenarioError
        If measurements have not shown a type to be safe; the text names type, attribute and way out.
    """
    for kind, limit_mps in {kind.id: (kind, limit_mps) for kind, limit_mps in kinds.items()}.values():
        reason = why_unsafe(kind, step_s, limit_mps, obeys=obeys)
        if reason:
            msg = f"{source}: vType {kind.id}: {reason}, or --gate open"
            raise ScenarioError(msg)


def brakes_late(kind: VehicleType) -> bool:
    """Return whether a type's model may brake later than SUMO's default, for lines and vehicles ahead."""
    return kind.attributes.get(_MODEL, _FORESEEN[0]) in _UNFORESEEN


def highest_limits(
    network: RoadNetwork, users: Iterable[tuple[Loop, VehicleType]]
) -> dict[VehicleType, float]:
    """Return each vehicle type with the highest speed limit on the loops or trips of its vehicles [m/s]."""
    found: dict[VehicleType, float] = {}
    for loop, kind in {(id(loop), id(kind)): (loop, kind) for loop, kind in users}.values():
        limit_mps = max((network.lanes[span.lane_id].speed_mps for span in loop.spans), default=0.0)
        found[kind] = max(limit_mps, found.get(kind, 0.0))
    return found


def why_unsafe(kind: VehicleType, step_s: float, limit_mps: float, *, obeys: bool) -> str:
    """Return why no gate can drive a vehicle type where the highest limit is `limit_mps`; "" if one can.

    `obeys`: whether traffic lights are obeyed.
    """
    model = kind.attributes.get(_MODEL, _FORESEEN[0])
    if model not in _FORESEEN + _UNFORESEEN:
        known = ", ".join(_FORESEEN + _UNFORESEEN)
        return f"{_MODEL} {model} does not keep clear enough for a gate; use one of {known}"
    tau_s = _number(kind, _TAU)
    if tau_s < step_s - _ROUNDING:
        return (
            f"{_TAU} {tau_s:g} is below the step of {step_s:g} s: SUMO lets such vehicles drive into each "
            f"other; give {_TAU} {step_s:g} or more, or --step-length {tau_s:g}"
        )
    action_s = _number(kind, _ACTION, step_s)
    if action_s > step_s + _ROUNDING:
        return (
            f"{_ACTION} {action_s:g} is above the step of {step_s:g} s: in between SUMO takes no orders from "
            f"a gate; leave it out"
        )
    if kind.min_gap_m < _LEAST_GAP_M:
        return f"{_GAP} {kind.min_gap_m:g} is too small, bodies touch; give {_GAP} {_LEAST_GAP_M:g} m or more"
    all_lets = _LETS | (_LETS_AT_LIGHTS if obeys else {})
    means = {name: text for name, (usual, text) in all_lets.items() if _number(kind, name, usual) > usual}
    if kind.attributes.get(_LANES) == "SL2015":
        means[f"{_LANES} SL2015"] = "it change no lanes when told, and stand before merges for good"
    lets = next((f"{name} lets {text}; leave it out" for name, text in means.items()), "")
    lets = lets or why_ignoring({_AWARE: kind.parameters.get(_AWARE, "1")})
    if lets or model in _FORESEEN or limit_mps <= 0.0:
        return lets
    pace, deviation = _speed_factor(kind)
    top_mps = min(limit_mps * (pace + 2.0 * deviation), _number(kind, "maxSpeed", inf))
    overruns = why_overruns(kind, _number(kind, "decel", _DECEL_MPS2), top_mps, step_s)
    return f"{_MODEL} {model} with {overruns}" if overruns else ""


def why_ignoring(parameters: Mapping[str, str]) -> str:
    """Return why no gate can drive a vehicle with these parameters; "" if one can."""
    name = next((one for one in _IGNORES if parameters.get(one)), "")
    if name:
        return f"param {name} lets it drive into the vehicles that it names; leave it out"
    aware = parameters.get(_AWARE, "1")
    return "" if as_number(aware) == 1.0 else f"param {_AWARE} {aware} lets it brake too late; leave it out"


def unforeseen(
    network: RoadNetwork, users: Iterable[tuple[Loop, VehicleType]], *, obeys: bool
) -> dict[str, str]:
    """Return the types whose time to clear a crossing cannot be predicted, with the reason.

    While a vehicle of such a type is on a crossing, other vehicles set out only when it has left the shared
    stretch. That is safe with any driver, and costs throughput.

    Parameters
    ----------
    users
        For each vehicle its loop and its type.
    obeys
        Whether traffic lights are obeyed.

    Returns
    -------
    dict
        A warning for each such type, by its name. Of the other types each vehicle's own length, acceleration,
        top speed and speed factor decide, see `loopgate.control.places.Make`.
    """
    fastest: dict[str, tuple[VehicleType, float]] = {}
    for loop, kind in {(loop.id, kind.id): (loop, kind) for loop, kind in users}.values():
        limits = [network.lanes[span.lane_id].speed_mps for span in loop.spans if span.internal]
        _, before = fastest.get(kind.id, (kind, 0.0))
        fastest[kind.id] = kind, max([before, *limits])
    found = [(name, _peculiarity(kind, limit, obeys=obeys)) for name, (kind, limit) in fastest.items()]
    return {
        name: f"vType {name}: {what}: nothing is foreseen of them on crossings, which costs some throughput"
        for name, what in found
        if what
    }


def _peculiarity(kind: VehicleType, limit_mps: float, *, obeys: bool) -> str:
    """Return the attributes by which a type differs from SUMO's cars; empty if there are none."""
    model, accel, sigma = kind.attributes.get(_MODEL), _number(kind, "accel"), _number(kind, "sigma")
    minor = _number(kind, _MINOR, 0.0)
    top, gap_m = _number(kind, _DESIRED, limit_mps), _number(kind, _STOPS_EARLY, _AT_LINE_M)
    checks = {
        f"{_MODEL} {model}": model in _UNFORESEEN,
        f"vClass {kind.vclass}": kind.vclass in _SLOWER_THAN_THEY_CAN and _DESIRED not in kind.attributes,
        f"sigma {sigma:g}": sigma >= 1.0,
        f"accel {accel:g} with {_MINOR} {minor:g}": accel * minor > _MOST_DAWDLING_MPS2,
        f"{_STOPS_EARLY} {gap_m:g} where lights are obeyed": obeys and gap_m > _AT_LINE_M,
        f"{_DESIRED} {top:g} where the limit is {limit_mps:g} m/s": top < _LEAST_TOP * limit_mps,
    }
    return next((text for text, holds in checks.items() if holds), "")


def _speed_factor(kind: VehicleType) -> tuple[float, float]:
    """Return mean and deviation of the speed factor: from two numbers, or from ``normc(1,0.1,0.2,2)``."""
    text = kind.attributes.get("speedFactor", "")
    drawn = re.match(r"normc?\(([^,)]+),([^,)]+)", text)
    if not drawn:
        return _number(kind, "speedFactor"), _number(kind, "speedDev")
    try:
        return float(drawn[1]), float(drawn[2])
    except ValueError:
        return _SUMO["speedFactor"], _SUMO["speedDev"]


def _number(kind: VehicleType, attribute: str, default: float | None = None) -> float:
    fallback = _SUMO[attribute] if default is None else default
    try:
        return float(kind.attributes.get(attribute, fallback))
    except ValueError:
        return fallback  # SUMO itself refuses a value that is no number
