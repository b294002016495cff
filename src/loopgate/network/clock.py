"""Numbers and times in the notation of SUMO's files."""

import math
import re
from contextlib import suppress
from xml.etree import ElementTree as ET

from loopgate.errors import RouteError
from loopgate.reading import shown

_SCALES = (1.0, 60.0, 3600.0, 86400.0)
_UNITS_S = 3600.0, 60.0, 1.0
_IN_PARTS = re.compile(r"(?:([\d.]+)h)?\s*(?:([\d.]+)min)?\s*(?:([\d.]+)s)?")
"""``2h30min``: hours, minutes, seconds."""


def as_number(text: str, *, default: float = math.nan) -> float:
    """Return a number, or `default` if the value is no number."""
    try:
        return float(text)
    except ValueError:
        return default


def seconds(text: str) -> float:
    """Return a time in seconds: a number, or ``h:m:s``, or ``d:h:m:s``, as in SUMO.

    Raises `ValueError` if the text is no time; ``10:00`` could be minutes or hours.
    """
    parts = [float(part) for part in text.split(":")]
    total = sum(part * scale for part, scale in zip(reversed(parts), _SCALES, strict=False))
    if len(parts) not in {1, 3, 4} or not math.isfinite(total):
        msg = f"{text!r} is no time; expected seconds or h:m:s"
        raise ValueError(msg)
    return total


def with_units(text: str) -> float:
    """Return a time in seconds as `seconds` does, or one with units, such as ``10min``.

    Raises `ValueError` if the text is neither.

    >>> with_units("2h30min"), with_units("90"), with_units("0:10:00")
    (9000.0, 90.0, 600.0)
    """
    found = _IN_PARTS.fullmatch(text.strip()) if text.strip() else None
    if found is None:
        return seconds(text)
    return sum(float(much) * unit_s for much, unit_s in zip(found.groups("0"), _UNITS_S, strict=True))


def time_of_day(text: str) -> float:
    """Return a time in seconds as `with_units` does, or a time of day ``h:m``, such as ``9:30``.

    Raises `ValueError` if the text is neither.
    """
    try:
        return with_units(f"{text}:00" if text.count(":") == 1 else text)
    except ValueError:
        msg = f"{text!r} is no time of day; expected h:m, h:m:s or seconds"
        raise ValueError(msg) from None


def time_of(
    element: ET.Element, attribute: str, what: str, *, why: str = "", from_0: bool = False
) -> float | None:
    """Return the time of an attribute, at least 0 [s]; None if the attribute is missing.

    Raises `RouteError` if it is no time; the text begins with `what` and ends with `why` it has to be one.

    `from_0`: whether a time below 0 is refused too, as SUMO does with departures; else it counts as 0.
    """
    text = element.get(attribute)
    if text is None:
        return None
    with suppress(ValueError):
        time_s = seconds(text)
        if time_s >= 0.0 or not from_0:
            return max(0.0, time_s)
    least = ", from 0 on" if from_0 else ""
    msg = f"{what}: {attribute} is {shown(text)}; expected seconds or h:m:s{least}{why}"
    raise RouteError(msg)


def time_if_any(element: ET.Element, attribute: str, what: str) -> float | None:
    """Return the time of an attribute [s]; None if it is missing, or below 0, which is none for SUMO.

    Raises `RouteError` if it is no time; the text begins with `what`.
    """
    time_s = time_of(element, attribute, what)
    return None if time_s is None or seconds(element.attrib[attribute]) < 0.0 else time_s
