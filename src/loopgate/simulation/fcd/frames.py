"""Reads SUMO's FCD output (floating car data) frame by frame: all vehicles at one time."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree as ET

from loopgate.errors import ResultsError
from loopgate.network.clock import seconds
from loopgate.network.xml_file import check_root, open_xml
from loopgate.reading import refusing

_WHAT = "FCD output"
_MISSING = "{file}: an element has no {name}; SUMO writes it unless --fcd-output.attributes leaves it out"
_LARGEST = 1e10
_TABLES = (".csv", ".csv.gz", ".parquet")


class SeenVehicle(NamedTuple):
    """A vehicle in a frame: name, type, lane, position of the front on the lane [m], speed [m/s].

    Then x and y of the front [m], and the direction clockwise from north [degrees].
    """

    vehicle: str
    type: str
    lane: str
    pos_m: float
    speed_mps: float
    x_m: float
    y_m: float
    angle_deg: float


Frame = tuple[float, list[SeenVehicle]]
"""The time of a frame [s], and its vehicles."""


def read_frames(file: Path) -> Iterator[Frame]:
    """Read the time of each frame [s] and its vehicles; persons and containers are left out.

    Raises `ResultsError` if the file cannot be read, is no FCD output, lacks an attribute, or its frames are
    not in the order of time.

    Parameters
    ----------
    file
        XML, compressed if its name ends in ``.gz``.
    """
    if file.name.endswith(_TABLES):
        msg = f"{file}: only FCD output as XML is read; let SUMO write it as --fcd-output fcd.xml.gz"
        raise ResultsError(msg)
    check_root(file, root="fcd-export", what=_WHAT, error=ResultsError)
    with refusing(file, _WHAT, ResultsError, wrong="cut short or damaged"), open_xml(file) as stream:
        elements = ET.iterparse(stream, events=("start", "end"))  # noqa: S314  expat bounds entities
        _, root = next(elements)
        last_s = -_LARGEST
        vehicles: list[SeenVehicle] = []
        for event, element in elements:
            if event == "start":
                continue
            if element.tag == "vehicle":
                vehicles.append(_seen(element.attrib, file))
            elif element.tag == "timestep":
                time_s = _number(element.attrib, "time", file, as_number=seconds)
                if time_s <= last_s:
                    msg = f"{file}: a frame at {time_s:g} s comes after one at {last_s:g} s"
                    raise ResultsError(msg)
                last_s = time_s
                yield time_s, vehicles
                vehicles = []
                root.clear()


def _seen(attributes: dict[str, str], file: Path) -> SeenVehicle:
    for name in ("id", "lane"):
        if name not in attributes:
            msg = _MISSING.format(file=file, name=name)
            raise ResultsError(msg)
    numbers = (_number(attributes, name, file) for name in ("pos", "speed", "x", "y", "angle"))
    return SeenVehicle(attributes["id"], attributes.get("type", ""), attributes["lane"], *numbers)


def _number(
    attributes: dict[str, str], name: str, file: Path, *, as_number: Callable[[str], float] = float
) -> float:
    text = attributes.get(name)
    if text is None:
        msg = _MISSING.format(file=file, name=name)
        raise ResultsError(msg)
    value = as_number(text)
    if not abs(value) <= _LARGEST:
        msg = f"{file}: {name} is {text}; expected a number up to {_LARGEST:g}"
        raise ResultsError(msg)
    return value
