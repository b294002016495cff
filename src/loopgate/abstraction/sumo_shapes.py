"""Writes places, crossings and loops as shapes in a SUMO additional file, for sumo-gui and netedit."""

import colorsys
import re
from bisect import bisect_right
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from itertools import groupby
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import shapely

from loopgate.abstraction.itinerary import DrawnLeg, Itinerary
from loopgate.arrays import Floats
from loopgate.disk import writing
from loopgate.network.loop import Loop, cut_curve, gap

_STEPS = (1, 2, 3, 4, 6, 10, 20)
_ROOM = ("199,221,204", "173,214,181", "127,205,187", "65,182,196", "29,145,192", "34,94,168", "12,44,132")
"""Colours of places with at least this many slots, from pale to dark."""

_FREE, _CONFLICT, _REFUSED = "108,117,125", "213,94,0", "170,51,119"
_LOOP_LAYER, _PLACE_LAYER, _CROSSING_LAYER, _POI_LAYER = "10", "11", "12", "13"
"""Layers above the roads, which are on layer 0."""

_HALF_PLACE_M = 1.2
_TURN = 0.618034
"""Step on the circle of colours from loop to loop, so that neighbours in the list look different."""


def write_shapes(
    file: Path,
    itineraries: Sequence[Itinerary],
    room: Mapping[str, int],
    refused: Sequence[tuple[Loop, str, str | None]] = (),
) -> int:
    """Write an additional file; ``sumo-gui -n NET -a FILE`` and ``netedit -s NET -a FILE`` show it.

    Loops are lines. Places are areas, darker with more slots. Crossings are lines, orange if they have
    conflicts. Points of interest show where loops begin, and where a loop cannot go on. Each shape has its
    figures as parameters.

    Raises `ResultsError` if the file cannot be written.

    Parameters
    ----------
    itineraries
        The loops, cut into states.
    room
        Slots of each state; a missing state has one.
    refused
        Loops that cannot be cut: why, and the edge where it fails, if there is one.

    Returns
    -------
    int
        Number of shapes.
    """
    top = ET.Element("additional")
    names = _Names()
    for number, way in enumerate(itineraries):
        loop = way.loop
        _add_loop(top, names, loop, _hue(number), length_m=f"{loop.length_m:.1f}", places=str(len(way.legs)))
    users: dict[str, list[str]] = {}
    for way in itineraries:
        for leg in way.legs:
            users.setdefault(leg.state, []).append(way.loop.id)
    for loop, leg, _ in _once(itineraries, lambda leg, _: leg.state):
        _add_place(top, names, loop, leg, room.get(leg.state, 1), users[leg.state])
    for loop, leg, after in _once(itineraries, _between):
        _add_crossing(top, names, loop, leg, after)
    for loop, reason, edge in refused:
        _add_loop(top, names, loop, _REFUSED, reason=reason)
        spans = (span for span in loop.roads if span.edge == edge)
        at = next((span.shapes[0][-1] for span in spans), tuple(loop.curve()[0][0]))
        _poi(
            top, names.new("refused", loop.id), at, _REFUSED, "loopgate.refused", loop=loop.id, reason=reason
        )
    ET.indent(top)
    with writing(file):
        file.parent.mkdir(parents=True, exist_ok=True)
        ET.ElementTree(top).write(file, encoding="utf-8", xml_declaration=True)
    return len(top)


class _Names:
    """Makes names that netedit accepts: without colons, brackets and the like."""

    def __init__(self) -> None:
        self._used: set[str] = set()

    def new(self, kind: str, name: str) -> str:
        plain = base = f"{kind}_{re.sub(r'[^A-Za-z0-9_.#+-]+', '_', name)}"
        number = 1
        while plain in self._used:
            number += 1
            plain = f"{base}_{number}"
        self._used.add(plain)
        return plain


def _between(leg: DrawnLeg, after: DrawnLeg) -> Hashable:
    return leg.state, after.state, tuple(crossing.id for crossing in leg.crossings)


def _once(
    itineraries: Sequence[Itinerary], key: Callable[[DrawnLeg, DrawnLeg], Hashable]
) -> Iterator[tuple[Loop, DrawnLeg, DrawnLeg]]:
    """Yield each leg with its loop and the next leg; of pairs with the same key, the first only."""
    seen: set[Hashable] = set()
    for way in itineraries:
        for number, leg in enumerate(way.legs):
            after = way.legs[(number + 1) % len(way.legs)]
            if (known := key(leg, after)) not in seen:
                seen.add(known)
                yield way.loop, leg, after


def _add_loop(top: ET.Element, names: _Names, loop: Loop, colour: str, **figures: str) -> None:
    points = loop.curve()[0]
    _poly(
        top,
        names.new("loop", loop.id),
        np.vstack((points, points[:1])),
        {"type": "loopgate.loop", "color": f"{colour},150", "layer": _LOOP_LAYER, "lineWidth": "1.2"},
        loop=loop.id,
        **figures,
    )
    _poi(top, names.new("start", loop.id), tuple(points[0]), colour, "loopgate.loop", loop=loop.id)


def _add_place(
    top: ET.Element, names: _Names, loop: Loop, leg: DrawnLeg, room: int, users: Sequence[str]
) -> None:
    line = shapely.LineString(_part(loop, leg.begin_m, leg.end_m))
    area: shapely.Geometry = line.buffer(_HALF_PLACE_M, cap_style="flat", join_style="mitre")
    if not isinstance(area, shapely.Polygon) or area.is_empty:
        return  # a stretch without length, or one that its drawing folds
    colour = _ROOM[max(0, bisect_right(_STEPS, room) - 1)]
    _poly(
        top,
        names.new("place", leg.state),
        np.asarray(area.exterior.coords),
        {"type": "loopgate.place", "color": f"{colour},230", "layer": _PLACE_LAYER, "fill": "1"},
        place=leg.state,
        capacity=str(room),
        length_m=f"{leg.end_m - leg.begin_m:.1f}",
        loops=" ".join(dict.fromkeys(users)),
    )


def _add_crossing(top: ET.Element, names: _Names, loop: Loop, leg: DrawnLeg, after: DrawnLeg) -> None:
    far = gap(loop.length_m, leg.end_m, after.begin_m)
    if not leg.crossings or far <= 0.0:
        return
    foes = sorted({foe for crossing in leg.crossings for foe in crossing.foes})
    _poly(
        top,
        names.new("crossing", f"{leg.state}_to_{after.state}"),
        _part(loop, leg.end_m, leg.end_m + far),
        {
            "type": "loopgate.crossing",
            "color": f"{_CONFLICT if foes else _FREE},255",
            "layer": _CROSSING_LAYER,
            "lineWidth": "0.4",
        },
        movements=" ".join(crossing.id for crossing in leg.crossings),
        conflicts=" ".join(foes),
    )


def _part(loop: Loop, begin_m: float, end_m: float) -> Floats:
    return cut_curve(*loop.curve(), loop.length_m, begin_m, end_m)


def _poly(top: ET.Element, name: str, line: Floats, looks: Mapping[str, str], **figures: str) -> None:
    points = (f"{x:.2f},{y:.2f}" for x, y in line)
    shape = " ".join(point for point, _ in groupby(points))  # lanes repeat the point at which they meet
    _figures(ET.SubElement(top, "poly", {"id": name, "fill": "0", **looks, "shape": shape}), figures)


def _poi(top: ET.Element, name: str, at: Sequence[float], colour: str, kind: str, **figures: str) -> None:
    place = {"x": f"{at[0]:.2f}", "y": f"{at[1]:.2f}", "layer": _POI_LAYER}
    _figures(ET.SubElement(top, "poi", {"id": name, "type": kind, "color": colour, **place}), figures)


def _figures(shape: ET.Element, figures: Mapping[str, str]) -> None:
    for key, value in figures.items():
        ET.SubElement(shape, "param", {"key": key, "value": value})


def _hue(number: int) -> str:
    red, green, blue = colorsys.hsv_to_rgb(number * _TURN % 1.0, 0.7, 0.75)
    return f"{red * 255:.0f},{green * 255:.0f},{blue * 255:.0f}"
