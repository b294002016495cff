"""Vehicle types of SUMO: length, gap, class, and checks of their values."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from random import Random
from typing import TypeVar
from xml.etree import ElementTree as ET

import sumo

from loopgate.errors import RouteError
from loopgate.network.clock import as_number
from loopgate.network.colour import check_colour
from loopgate.network.road import VEHICLE_CLASSES
from loopgate.network.xml_file import open_xml
from loopgate.reading import shown

_XSD = "{http://www.w3.org/2001/XMLSchema}"

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

_JOINTED_SHAPES = ("bus/flexible", "rail", "truck/semitrailer", "truck/trailer")
_JOINTED_CLASSES = (
    "cable_car",
    "rail",
    "rail_electric",
    "rail_fast",
    "rail_urban",
    "subway",
    "trailer",
    "tram",
)
"""Shapes and classes that SUMO draws in parts, each in a direction of its own."""


_ABOVE_0 = math.ulp(0.0)
_FIGURES: dict[str, tuple[float, float, str]] = {
    "length": (_ABOVE_0, 1e3, "metres"),
    "width": (_ABOVE_0, 1e2, "metres"),
    "height": (_ABOVE_0, 1e2, "metres"),
    "minGap": (0.0, 1e3, "metres"),
    "minGapLat": (0.0, 1e2, "metres"),
    "accel": (_ABOVE_0, 1e3, "m/s2"),
    "decel": (_ABOVE_0, 1e3, "m/s2"),
    "apparentDecel": (_ABOVE_0, 1e3, "m/s2"),
    "emergencyDecel": (_ABOVE_0, 1e3, "m/s2"),
    "maxSpeed": (_ABOVE_0, 1e4, "m/s"),
    "desiredMaxSpeed": (_ABOVE_0, 1e4, "m/s"),
    "maxSpeedLat": (_ABOVE_0, 1e4, "m/s"),
    "tau": (_ABOVE_0, 1e3, "seconds"),
    "sigma": (0.0, 1.0, "a share"),
    "speedDev": (0.0, 1e2, "a share of the speed limit"),
    "speedFactor": (_ABOVE_0, 1e2, "a share of the speed limit"),
    "mass": (_ABOVE_0, 1e9, "kilograms"),
}
"""Least and greatest value of an attribute, and its meaning. SUMO accepts some other values, such as a length
that is no number, without an error."""

_TOPS = frozenset({"maxSpeed", "desiredMaxSpeed", "maxSpeedLat", "emergencyDecel"})
"""Attributes that only bound something, so that SUMO takes an infinite value for no bound."""

_SETTINGS = ("lc", "jm", "cc", "actionStep", "boarding", "impatience", "loading", "startup")
"""Beginnings of the names of further settings: any number, also an infinite one; some may be clock times."""


@dataclass(frozen=True, slots=True)
class VehicleType:
    """The attributes of a SUMO vehicle type that loopgate uses; the defaults are SUMO's."""

    id: str = "DEFAULT_VEHTYPE"
    length_m: float = 5.0
    min_gap_m: float = 2.5
    """`length_m` and `min_gap_m`: length of the vehicle, and gap to the vehicle ahead when standing."""
    vclass: str = "passenger"
    attributes: Mapping[str, str] = field(default_factory=dict, hash=False)
    parameters: Mapping[str, str] = field(default_factory=dict, hash=False)
    """`attributes` and `parameters`: all attributes of the type in the file, and its ``<param>`` elements by
    key."""

    @property
    def needed_m(self) -> float:
        """The length that the vehicle takes in a queue [m]: its own length and its minimum gap."""
        return self.length_m + self.min_gap_m

    @property
    def width_m(self) -> float:
        """The width of the vehicle [m]: from the file, or SUMO's default for its class."""
        try:
            return float(self.attributes["width"])
        except (KeyError, ValueError):
            return _WIDTH_M.get(self.vclass, _CAR_WIDTH_M)

    @property
    def jointed(self) -> bool:
        """Whether the vehicle has joints, as a truck with a trailer; SUMO gives its first part's angle."""
        if "locomotiveLength" in self.attributes:
            return True
        shape = self.attributes.get("guiShape")
        return self.vclass in _JOINTED_CLASSES if shape is None else shape.startswith(_JOINTED_SHAPES)


DEFAULT_TYPE = VehicleType()


def vehicle_type(element: ET.Element, source: str) -> VehicleType:
    """Read a vehicle type from a ``<vType>`` element.

    Raises `RouteError` if a value is not a number or makes no sense (a length of 0, an infinite speed); the
    message names file, type and attribute.
    """
    name = element.get("id", "")
    figures: dict[str, float] = {}
    attributes = dict(element.attrib)
    for part in element:  # the older way to write a model of car following
        model = part.tag.removeprefix("carFollowing-")
        if model != part.tag:
            attributes |= {"carFollowModel": model, **part.attrib}
    for attribute, text in attributes.items():
        if attribute in _TOPS and as_number(text) == math.inf:
            continue
        if attribute in _FIGURES:
            figures[attribute] = _figure(f"{source}: vType {name}: {attribute}", text, *_FIGURES[attribute])
        elif attribute.startswith(_SETTINGS) and math.isnan(as_number(text, default=0.0)):
            msg = f"{source}: vType {name}: {attribute} is {shown(text)}; expected a number"
            raise RouteError(msg)
    check_colour(element, f"{source}: vType {name}")
    vclass = element.get("vClass", DEFAULT_TYPE.vclass)
    return VehicleType(
        id=name,
        length_m=figures.get("length", _LENGTH_M.get(vclass, DEFAULT_TYPE.length_m)),
        min_gap_m=figures.get("minGap", DEFAULT_TYPE.min_gap_m),
        vclass=vclass,
        attributes=attributes,
        parameters={one.get("key", ""): one.get("value", "") for one in element.findall("param")},
    )


@cache
def sumo_attributes(element: str) -> frozenset[str]:
    """Return the attributes of an element of route files by SUMO's schema, and of what it refers to.

    >>> {"accel", "lcStrategic", "probability"} <= sumo_attributes("vType")
    True
    """
    top = ET.parse(Path(sumo.SUMO_HOME) / "data" / "xsd" / "types" / "route.xsd").getroot()  # noqa: S314 - SUMO's own
    kinds = {kind.get("name", ""): kind for kind in top.iter(f"{_XSD}complexType")}
    found: set[str] = set()
    ahead = [f"{element}Type", f"{element}RefType"]
    while ahead:
        kind = kinds.get(ahead.pop())
        if kind is not None:
            found |= {one.get("name", "") for one in kind.iter(f"{_XSD}attribute")}
            ahead += [one.get("base", "") for one in kind.iter(f"{_XSD}extension")]
    return frozenset(found)


def vehicle_types_of(network: Path) -> list[ET.Element]:
    """Return the vehicle types that a network's file defines, which SUMO takes for those of vehicles."""
    with open_xml(network) as stream:
        read = ET.iterparse(stream)  # noqa: S314  read before, by the same parser
        return [element for _, element in read if element.tag == "vType"]


def type_of_class(vclass: str, source: str) -> VehicleType:
    """Return SUMO's default type of a vehicle class, named after the class.

    Raises `RouteError` if SUMO has no such class.
    """
    if vclass not in VEHICLE_CLASSES:
        msg = f"{source}: vehicle class {shown(vclass)}: SUMO has {', '.join(sorted(VEHICLE_CLASSES))}"
        raise RouteError(msg)
    return vehicle_type(ET.Element("vType", id=vclass, vClass=vclass), source)


def _figure(what: str, text: str, least: float, most: float, unit: str) -> float:
    """Return a figure, or the first of a distribution like ``normc(1,0.1,0.2,2)``; all must be fit."""
    head, bracket, inside = text.strip().partition("(")
    drawn = bracket and head in {"norm", "normc"} and inside.endswith(")")
    numbers = [as_number(part) for part in (inside[:-1].split(",") if drawn else [text])]
    low = 0.0 if drawn else least  # a spread may be 0, and so may the least speed drawn
    if not least <= numbers[0] <= most or not all(low <= figure <= most for figure in numbers):
        above = "above 0" if least == _ABOVE_0 else f"from {least:g}"
        msg = f"{what} is {shown(text)}; expected {unit}, {above} and up to {most:g}"
        raise RouteError(msg)
    return numbers[0]


T = TypeVar("T")

_MOST = 1e9


@dataclass(frozen=True, slots=True)
class Choice:
    """A member of a distribution: a name, or an element of its own.

    `share` is None where the distribution does not say it.
    """

    name: str
    element: ET.Element | None
    share: float | None


def parts(spread: ET.Element, what: str, *, named: str, tag: str) -> list[Choice]:
    """Return the choices of a distribution.

    Raises `RouteError` if a share is none, or their number is not that of the names.

    Parameters
    ----------
    spread
        A ``<vTypeDistribution>`` or ``<routeDistribution>``.
    what
        File and element, for messages.
    named, tag
        The attribute that lists names, and the tag of elements inside.
    """
    names, shares = spread.get(named, "").split(), spread.get("probabilities", "").split()
    if shares and len(shares) != len(names):
        msg = f"{what}: it has {len(shares)} probabilities for {len(names)} {named}; give one for each"
        raise RouteError(msg)
    found = [Choice(name, None, _share(shares[k], what) if shares else None) for k, name in enumerate(names)]
    for one in spread.findall(tag):
        said = one.get("probability")
        share = None if said is None else _share(said, what)
        other = one.get("refId", "")
        found.append(Choice(other or one.get("id", ""), None if other else one, share))
    return found


def routes_named(elements: Iterable[ET.Element]) -> set[str]:
    """Return the routes that distributions name, but do not hold themselves."""
    found: set[str] = set()
    for spread in elements:
        found.update(spread.get("routes", "").split(), (one.get("refId", "") for one in spread))
    return found


def share_of(element: ET.Element, what: str) -> float:
    """Return the share of a type or route in distributions that do not say it; SUMO's default is 1."""
    said = element.get("probability")
    return 1.0 if said is None else _share(said, what)


def refuse_nothing(shares: Iterable[float], what: str) -> None:
    """Raise `RouteError` if all shares are 0."""
    if not any(shares):
        msg = f"{what}: nothing can be drawn from it; name something with a probability above 0"
        raise RouteError(msg)


def draw(choices: Sequence[tuple[T, float]], rng: Random) -> T:
    """Draw a member by the shares."""
    return rng.choices([one for one, _ in choices], [share for _, share in choices])[0]


def _share(text: str, what: str) -> float:
    share = as_number(text)
    if not 0.0 <= share <= _MOST:
        msg = f"{what}: a probability is {shown(text)}; expected a share, from 0 and up to {_MOST:g}"
        raise RouteError(msg)
    return share
