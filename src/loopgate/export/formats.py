"""GeoJSON, GPX and KML as texts; points are longitude and latitude in degrees."""

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape, quoteattr

import numpy as np

from loopgate.arrays import Floats
from loopgate.disk import writing

_DIGITS = 7
"""Of a degree: a centimetre."""

Features = list[dict[str, Any]]


def feature(line: Floats, **properties: object) -> dict[str, Any]:
    """Return a line or a point as a GeoJSON feature with plain values."""
    points = np.round(line, _DIGITS).tolist()
    shape = {"type": "Point", "coordinates": points[0]}
    if len(points) > 1:
        shape = {"type": "LineString", "coordinates": points}
    known = {name: _plain(value) for name, value in properties.items()}
    return {"type": "Feature", "geometry": shape, "properties": known}


def _plain(value: object) -> object:
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float):
        return round(value, 4) if np.isfinite(value) else None
    return value


def geojson(features: Features) -> str:
    """Return a collection of features, by RFC 7946: WGS 84, longitude first."""
    return json.dumps(
        {"type": "FeatureCollection", "features": features}, ensure_ascii=False, separators=(",", ":")
    )


def gpx(name: str, line: Floats, turns: Sequence[tuple[Floats, str, str]]) -> str:
    """Return a track of a loop, and its turn list as a route, as GPX 1.1.

    Parameters
    ----------
    turns
        Where, what a driver does, and more about it.
    """
    rows = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<gpx version="1.1" creator="loopgate" xmlns="http://www.topografix.com/GPX/1/1">',
        f"  <rte><name>{text(name)}</name>",
    ]
    rows += [
        f"    <rtept {_at(at)}><name>{text(what)}</name><desc>{text(more)}</desc></rtept>"
        for at, what, more in turns
    ]
    rows += ["  </rte>", f"  <trk><name>{text(name)}</name><trkseg>"]
    rows += [f"    <trkpt {_at(point)}/>" for point in line]
    return "\n".join([*rows, "  </trkseg></trk>", "</gpx>", ""])


def kml(name: str, line: Floats, turns: Sequence[tuple[Floats, str, str]]) -> str:
    """Return a loop as a line, and its turns as points in their order, as KML 2.2."""
    listed = "\n".join(f"{number}. {what} ({more})" for number, (_, what, more) in enumerate(turns, 1))
    rows = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<kml xmlns="http://www.opengis.net/kml/2.2"><Document>',
        f"  <name>{text(name)}</name>",
        f"  <Placemark><name>{text(name)}</name><description>{text(listed)}</description>",
        f"    <LineString><tessellate>1</tessellate><coordinates>{_coordinates(line)}</coordinates>",
        "    </LineString></Placemark>",
        "  <Folder><name>Turns</name>",
    ]
    rows += [
        f"    <Placemark><name>{text(f'{number}. {what}')}</name><description>{text(more)}</description>"
        f"<Point><coordinates>{_coordinates(np.atleast_2d(at))}</coordinates></Point></Placemark>"
        for number, (at, what, more) in enumerate(turns, 1)
    ]
    return "\n".join([*rows, "  </Folder>", "</Document></kml>", ""])


def text(value: str) -> str:
    """Return text for XML, without characters that XML cannot hold."""
    return escape(re.sub(r"[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]", "\ufffd", value))


def _at(point: Floats) -> str:
    lon, lat = (f"{value:.{_DIGITS}f}" for value in point)
    return f"lat={quoteattr(lat)} lon={quoteattr(lon)}"


def _coordinates(line: Floats) -> str:
    return " ".join(f"{lon:.{_DIGITS}f},{lat:.{_DIGITS}f}" for lon, lat in line)


def file_names(names: Iterable[str]) -> Mapping[str, str]:
    """Return a different file name for each name, valid on any file system."""
    found: dict[str, str] = {}
    taken: set[str] = set()
    for name in names:
        plain = re.sub(r"[^\w.-]+", "-", name).strip(".-")[:80] or "loop"
        number, chosen = 2, plain
        while chosen.lower() in taken:
            number, chosen = number + 1, f"{plain}-{number}"
        taken.add(chosen.lower())
        found[name] = chosen
    return found


def write(file: Path, content: str) -> Path:
    """Write a text and return where; raises `ResultsError` if it cannot be written."""
    with writing(file):
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(content, encoding="utf-8")
    return file
