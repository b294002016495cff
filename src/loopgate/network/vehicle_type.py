"""Vehicle types, as far as they matter to loops: length, gap and class."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from xml.etree import ElementTree as ET

from loopgate.errors import RouteError

__all__ = ["DEFAULT_TYPE", "VehicleType", "vehicle_type"]

_LENGTH_M = {
    "bicycle": 1.6,
    "bus": 12.0,
    "coach": 14.0,
    "delivery": 6.5,
    "emergency": 6.5,
    "evehicle": 5.0,
    "moped": 2.1,
    "motorcycle": 2.2,
    "trailer": 16.5,
    "truck": 7.1,
}
"""SUMO's default lengths by vehicle class where they are not a passenger car's."""


_WIDTH_M = {"bicycle": 0.65, "bus": 2.5, "coach": 2.6, "delivery": 2.16, "trailer": 2.55, "truck": 2.4}
"""SUMO's default widths by vehicle class where they are not a passenger car's."""

_CAR_WIDTH_M = 1.8


@dataclass(frozen=True, slots=True)
class VehicleType:
    """What a vehicle type says that matters here; the defaults are SUMO's.

    Attributes
    ----------
    id
        Name.
    length_m, min_gap_m
        Length of the vehicle, and the gap it leaves to the one before it when standing.
    vclass
        SUMO's vehicle class.
    attributes
        All that the file says about the type, as SUMO writes it.
    """

    id: str = "DEFAULT_VEHTYPE"
    length_m: float = 5.0
    min_gap_m: float = 2.5
    vclass: str = "passenger"
    attributes: Mapping[str, str] = field(default_factory=dict, hash=False)

    @property
    def width_m(self) -> float:
        """Width [m]: what the file says, or SUMO's for the class."""
        try:
            return float(self.attributes["width"])
        except (KeyError, ValueError):
            return _WIDTH_M.get(self.vclass, _CAR_WIDTH_M)


DEFAULT_TYPE = VehicleType()


def vehicle_type(element: ET.Element, source: str) -> VehicleType:
    """Read a ``<vType>``; raise `RouteError` if a length is no number."""
    name = element.get("id", "")

    def metres(attribute: str, default: float) -> float:
        text = element.get(attribute)
        try:
            return default if text is None else float(text)
        except ValueError:
            msg = f"{source}: vType {name}: {attribute} is {text!r}; expected metres"
            raise RouteError(msg) from None

    vclass = element.get("vClass", DEFAULT_TYPE.vclass)
    return VehicleType(
        id=name,
        length_m=metres("length", _LENGTH_M.get(vclass, DEFAULT_TYPE.length_m)),
        min_gap_m=metres("minGap", DEFAULT_TYPE.min_gap_m),
        vclass=vclass,
        attributes=dict(element.attrib),
    )
