"""Colours of vehicles and types, as SUMO reads them."""

import math
import re
from xml.etree import ElementTree as ET

from loopgate.errors import RouteError
from loopgate.network.clock import as_number
from loopgate.reading import shown

_COLOURS = frozenset(
    {"red", "green", "blue", "yellow", "cyan", "magenta", "orange", "white", "black", "grey", "gray"}
    | {"invisible", "random"}
)
_HEX = re.compile(r"#[0-9a-fA-F]{6}")
_PARTS = (3, 4)
"""Numbers of a colour: red, green, blue, and perhaps how opaque it is."""


def check_colour(element: ET.Element, what: str) -> None:
    """Raise `RouteError` if a colour is none of SUMO's; the text begins with `what`."""
    text = element.get("color")
    if text is None or text.casefold() in _COLOURS or _HEX.fullmatch(text):
        return
    parts = text.split(",")  # with blanks before the numbers only
    numbers = [as_number(part.lstrip()) if part == part.rstrip() else math.nan for part in parts]
    if len(numbers) in _PARTS and all(map(math.isfinite, numbers)):
        return
    msg = (
        f"{what}: color is {shown(text)}; expected #rrggbb, red,green,blue as numbers, or one of "
        f"{', '.join(sorted(_COLOURS))}"
    )
    raise RouteError(msg)
