"""A trial in SUMO alone of whether a vehicle type stops at the lines at which a gate holds it.

A gate counts on the braking distance at the `decel` of the type. Some car-following models brake later, and
some of them cannot make up for it.
"""

import subprocess
from collections.abc import Iterator
from functools import cache
from math import ceil
from pathlib import Path
from xml.etree import ElementTree as ET

import sumo

from loopgate.control.places import MARGIN_M, braking_m
from loopgate.errors import TrafficError
from loopgate.folders import temporary_folder
from loopgate.network.vehicle_type import VehicleType

_SPEEDS = 8
"""Number of speed limits up to the highest."""

_BEGIN_M, _FREE_S, _STANDS_S = 100.0, 10.0, 10.0
"""The vehicles depart here [m], drive freely for this time, and stand at the line for this time [s]."""

_STARTS: tuple[tuple[str, float], ...] = (
    *[("max", _FREE_S)] * 8,
    *[("max", 0.0)] * 4,
    *(("0", share) for share in (2.0, 1.5, 1.0, 0.7, 0.5, 0.3)),
)
"""How the vehicles of each limit depart, and where their lines are.

For those that drive: so many seconds at the limit beyond the braking distance (0: where a gate tells them to
stop). For those that stand: so many times the braking distance.

Some models err at random, so several do the same; those that stand must brake while they accelerate."""

_LEAST_M = 5.0
"""Added to the distance of a line from a vehicle that stands [m]."""

_LATE_M = 0.2
"""A vehicle may come so much nearer to a line than its braking distance [m]; in a run more is an overrun."""

_SOFTEST_MPS2 = (1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 6.0, 9.0)
"""The decelerations of which the least sufficient one is named [m/s2]."""

_LIMIT_S = 120.0


def why_overruns(kind: VehicleType, decel: float, top_mps: float, step_s: float) -> str:
    """Return at which speed a type drives beyond a line at which it is held, with advice; "" if it stops.

    Parameters
    ----------
    kind
        The vehicle type.
    decel
        Its deceleration [m/s2].
    top_mps
        The highest speed of a vehicle of that type [m/s].
    step_s
        Length of a simulation step [s].
    """
    attributes = tuple(sorted((name, text) for name, text in kind.attributes.items() if name != "id"))
    slowest = _slowest_overrun(attributes, decel, top_mps, step_s)
    if slowest is None:
        return ""
    enough = (one for one in _SOFTEST_MPS2 if one > decel)
    found = next((b for b in enough if _slowest_overrun(attributes, b, top_mps, step_s) is None), None)
    advice = "" if found is None else f"decel {found:g} or more, or "
    return (
        f"decel {decel:g} is too soft to stop at a line from {slowest:.0f} m/s; give {advice}the model Krauss"
    )


@cache
def _slowest_overrun(
    attributes: tuple[tuple[str, str], ...], decel: float, top_mps: float, step_s: float
) -> float | None:
    """Return the lowest speed limit at which a vehicle does not stop at a line [m/s]; None if all stop."""
    limits, departs, lines = list[float](), list[str](), list[float]()
    for number in range(1, _SPEEDS + 1):
        limit = top_mps * number / _SPEEDS
        brakes_m = braking_m(limit, decel, step_s)
        for speed, far in _STARTS:
            limits.append(limit)
            departs.append(speed)
            drives_m = brakes_m + max(step_s, far) * limit + MARGIN_M
            lines.append(_BEGIN_M + (drives_m if speed == "max" else _LEAST_M + far * brakes_m))
    length_m = max(lines) + _BEGIN_M
    with temporary_folder() as folder:
        _write_roads(folder / "roads.net.xml", limits, length_m)
        own = {**dict(attributes), "decel": f"{decel:g}", "speedFactor": "1", "speedDev": "0"}
        top = ET.Element("routes")
        ET.SubElement(top, "vType", {**own, "id": "type"})
        for number, (line, speed) in enumerate(zip(lines, departs, strict=True)):
            start = {"depart": "0", "departPos": f"{_BEGIN_M:g}", "departSpeed": speed}
            one = ET.SubElement(top, "vehicle", {"id": f"{number}", "type": "type", **start})
            ET.SubElement(one, "route", edges=f"e{number}")
            ET.SubElement(one, "stop", lane=f"e{number}_0", endPos=f"{line:.3f}", duration="1000000")
        ET.ElementTree(top).write(folder / "cars.rou.xml")
        until_s = ceil(_FREE_S + 2.0 * top_mps / decel + _STANDS_S)
        _run(folder, step_s, until_s)
        slow = [
            limits[number]
            for number, position_m, speed in _positions(folder / "fcd.xml")
            if lines[number] - position_m < braking_m(speed, decel, step_s) - _LATE_M
        ]
    return min(slow, default=None)


def _write_roads(file: Path, limits: list[float], length_m: float) -> None:
    """Write a network of one straight road for each speed limit [m/s]."""
    top = ET.Element("net", version="1.20")
    for number, limit in enumerate(limits):
        y, ends = 10.0 * number, (f"a{number}", f"b{number}")
        edge = ET.SubElement(top, "edge", {"id": f"e{number}", "from": ends[0], "to": ends[1]})
        lane = {"id": f"e{number}_0", "index": "0", "speed": f"{limit:g}", "length": f"{length_m:g}"}
        ET.SubElement(edge, "lane", {**lane, "shape": f"0,{y} {length_m:g},{y}"})
        for end, x in zip(ends, (0.0, length_m), strict=True):
            lanes = lane["id"] if x else ""
            there = {"id": end, "type": "dead_end", "x": f"{x:g}", "y": f"{y}", "intLanes": ""}
            ET.SubElement(top, "junction", {**there, "incLanes": lanes, "shape": f"{x:g},{y} {x:g},{y + 3}"})
    ET.ElementTree(top).write(file)


def _run(folder: Path, step_s: float, until_s: int) -> None:
    options = {
        "net-file": "roads.net.xml",
        "route-files": "cars.rou.xml",
        "fcd-output": "fcd.xml",
        "fcd-output.attributes": "pos,speed",
        "step-length": f"{step_s:g}",
        "end": f"{until_s}",
        "xml-validation": "never",
        "time-to-teleport": "-1",
        "precision": "6",
        "no-step-log": "true",
        "no-warnings": "true",
    }
    command = [str(Path(sumo.SUMO_HOME) / "bin" / "sumo")]
    command += [word for name, value in options.items() for word in (f"--{name}", value)]
    try:
        done = subprocess.run(  # noqa: S603  SUMO's own program
            command, cwd=folder, capture_output=True, text=True, timeout=_LIMIT_S, check=False
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        msg = f"{command[0]}: a trial of a vehicle type's brakes cannot be made: {error}"
        raise TrafficError(msg) from error
    if done.returncode:
        words = [line for line in done.stderr.splitlines() if line.startswith("Error")]
        msg = f"a trial of a vehicle type's brakes: SUMO says: {(words or ['it failed'])[0]}"
        raise TrafficError(msg)


def _positions(file: Path) -> Iterator[tuple[int, float, float]]:
    """Yield the number of each vehicle in each step, with its position [m] and speed [m/s]."""
    for _, element in ET.iterparse(file):  # noqa: S314  SUMO has written it
        if element.tag == "vehicle":
            yield int(element.attrib["id"]), float(element.attrib["pos"]), float(element.attrib["speed"])
        elif element.tag == "timestep":
            element.clear()
