"""Diagnosis of a network file that could not be read: made only then, for the message."""

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import IO
from xml.etree import ElementTree as ET

from loopgate.reading import shown

_NEEDED: dict[str, tuple[str, ...]] = {
    "edge": ("id",),
    "lane": ("id", "index", "speed", "length", "shape"),
    "junction": ("id", "type", "x", "y"),
    "request": ("index", "response", "foes"),
    "phase": ("duration", "state"),
    "connection": ("from", "to", "fromLane", "toLane", "dir"),
}
_WHOLE = {"index", "fromLane", "toLane"}
_NUMBERS = {"x", "y", "length", "speed", "width"}
_DIMENSIONS = {2, 3}


def first_fault(stream: IO[bytes], file: Path) -> str:
    """Return the first invalid element or reference of the network; empty if there is none.

    Parameters
    ----------
    stream
        The file's content, which is read to its end.
    file
        Its name, for the message.
    """
    try:
        text = next(_faults(stream), "")
    except (ET.ParseError, ValueError, LookupError, OSError):
        return ""  # no XML: the reader has said so
    return f"{file}: {text}; repair it in netedit or build it anew with netconvert" if text else ""


def _faults(stream: IO[bytes]) -> Iterator[str]:
    lanes: Counter[str] = Counter()
    junctions: set[str] = set()
    ends: list[tuple[str, str]] = []
    links: list[tuple[str, str, str]] = []
    named: set[str] = set()
    over: list[tuple[str, str]] = []
    edge = ""
    for _, element in ET.iterparse(stream, events=("start",)):  # noqa: S314  read before, by the same parser
        get = element.get
        name = f"{element.tag} {shown(get('id') or get('from') or get('index') or '')[1:-1]}".strip()
        yield from (f"{name}: {text}" for text in _values(element))
        if element.tag == "edge":
            edge = get("id", "")
            ends += [(name, get(end, "")) for end in ("from", "to") if get("function", "normal") == "normal"]
        elif element.tag == "lane":
            lanes[edge] += 1
            named.add(get("id", ""))
        elif element.tag == "junction":
            junctions.add(get("id", ""))
        elif element.tag == "connection":
            links += [(name, get(end, ""), get(f"{end}Lane", "")) for end in ("from", "to")]
            over.append((name, get("via", "")))
        element.clear()
    yield from (f"{name}: there is no junction {shown(end)}" for name, end in ends if end not in junctions)
    for name, end, lane in links:
        if not 0 <= int(lane) < lanes[end]:
            yield f"{name}: there is no lane {shown(lane)} on an edge {shown(end)}"
    yield from (f"{name}: there is no lane {shown(via)}" for name, via in over if via and via not in named)


def _values(element: ET.Element) -> Iterator[str]:
    for attribute in _NEEDED.get(element.tag, ()):
        if attribute not in element.attrib:
            yield f"it has no {attribute}"
    if element.tag not in _NEEDED:
        return
    for attribute, text in element.attrib.items():
        if attribute in _WHOLE and not _is(int, text):
            yield f"{attribute} is {shown(text)}; expected a whole number"
        if attribute in _NUMBERS and not _is(float, text):
            yield f"{attribute} is {shown(text)}; expected a number"
        if attribute == "shape":
            for point in text.split():
                parts = point.split(",")
                if len(parts) not in _DIMENSIONS or not all(_is(float, part) for part in parts):
                    yield f"its shape has the point {shown(point)}; expected x,y or x,y,z"


def _is(kind: type[int | float], text: str) -> bool:
    try:
        kind(text)
    except ValueError:
        return False
    return True
