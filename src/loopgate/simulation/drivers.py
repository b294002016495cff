"""Vehicle types with other drivers: automated driving, and driving by speed advice."""

from collections.abc import Sequence
from dataclasses import replace

from loopgate.control.spacing import FASTEST
from loopgate.network import VehicleDemand, VehicleType

_MACHINE = "@machine"
"""Ends the names of types that are driven automatically."""

_HEADWAY_S = 0.5
"""Headway of an automated vehicle, if a step is not longer [s]."""


def as_machine(kind: VehicleType, step_s: float) -> VehicleType:
    """Return a vehicle type as a controlled vehicle drives.

    It never dawdles (``sigma`` 0), its desired speed is not drawn (``speedDev`` 0, the mean of a distribution
    in ``speedFactor``), and its headway ``tau`` is half a second, or a step if that is longer. A shorter
    headway of the type stays. Its name is the type's with ``@machine``.

    Parameters
    ----------
    kind
        The type as the file has it.
    step_s
        Length of a simulation step [s].

    Examples
    --------
    >>> from loopgate.network import VehicleType
    >>> as_machine(VehicleType("car", attributes={"sigma": "0.8"}), 1.0).attributes
    {'sigma': '0', 'speedDev': '0', 'tau': '1'}
    """
    attributes = dict(kind.attributes)
    factor = attributes.get("speedFactor", "")
    if "(" in factor:  # normc(mean,deviation,least,most)
        attributes["speedFactor"] = factor.partition("(")[2].partition(",")[0]
    tau_s = min(float(attributes.get("tau", "1")), max(_HEADWAY_S, step_s))
    steady = {"sigma": "0", "speedDev": "0", "tau": f"{tau_s:g}"}
    return replace(kind, id=f"{kind.id}{_MACHINE}", attributes={**attributes, **steady})


def type_name(kind: VehicleType) -> str:
    """Return the name of a vehicle type in the route file that it was read from."""
    return kind.id.removesuffix(_MACHINE)


def driven_by_machines(vehicles: Sequence[VehicleDemand], step_s: float) -> list[VehicleDemand]:
    """Return the vehicles with automated drivers; vehicles of one type keep one type."""
    once: dict[int, VehicleType] = {}
    for vehicle in vehicles:
        if id(vehicle.type) not in once:
            once[id(vehicle.type)] = as_machine(vehicle.type, step_s)
    return [replace(vehicle, type=once[id(vehicle.type)]) for vehicle in vehicles]


def advised_type(kind: VehicleType) -> VehicleType:
    """Return a type for vehicles that follow speed advice, up to the fastest advice."""
    return replace(kind, attributes={**kind.attributes, "speedFactor": f"{FASTEST}", "speedDev": "0"})
