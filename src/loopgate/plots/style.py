"""The look of figures: colours that all can tell apart, markers and dashes for a grey printer."""

from collections.abc import Iterable
from typing import Any, Final

from loopgate.results.columns import SUMO_RULES

_NAMES = ("ink", "soft", "line", "heat", *(f"s{number}" for number in range(8)))

# At least 3:1 against the ground, and apart for every kind of colour vision: a test measures both.
_LIGHT = "#1a1a1a #595959 #dddddd #b5340d #1a1a1a #0072b2 #d55e00 #1a9e71 #8608eb #783514 #012991 #594062"
_DARK = "#f2f2f2 #b4b8bf #3a3f47 #ff8a5c #f2f2f2 #4aa3ff #ff7a3c #17d890 #90547a #cd1538 #c637bd #aeadc9"
LIGHT: Final = dict(zip(_NAMES, _LIGHT.split(), strict=True))
DARK: Final = dict(zip(_NAMES, _DARK.split(), strict=True))
"""Colours by name, on white and on a dark page."""

SYMBOLS: Final = (
    "circle",
    "square",
    "triangle-up",
    "diamond",
    "triangle-down",
    "cross",
    "triangle-left",
    "stroke",
)
DASHES: Final = ((1, 0), (6, 2), (2, 2), (6, 2, 2, 2), (9, 3), (4, 2, 1, 2, 1, 2), (3, 3), (1, 3))
MAX_SERIES: Final = len(SYMBOLS)
"""Most series that one figure can show and a reader tell apart."""


def colours(name: str) -> str:
    """Return the colour as a variable of the page's style, which knows light and dark."""
    return f"var(--{name})"


def config(of: Any = LIGHT.__getitem__) -> dict[str, Any]:  # noqa: ANN401 - any function from names to colours
    """Return Vega-Lite's configuration; `of` tells the colour that a name stands for."""
    return {
        "background": "transparent" if of is colours else "white",
        "font": "system-ui, 'DejaVu Sans', sans-serif",
        "view": {"stroke": None},
        "mark": {"aria": False},  # a figure has one label, and its numbers are in a table
        "axis": {
            "labelColor": of("ink"),
            "titleColor": of("ink"),
            "titleFontWeight": "normal",
            "labelFontSize": 11,
            "titleFontSize": 12,
            "gridColor": of("line"),
            "domainColor": of("soft"),
            "tickColor": of("soft"),
            "labelOverlap": True,
            "labelSeparation": 5,
        },
        "axisX": {"grid": False, "labelFlush": False},
        "legend": {
            "labelColor": of("ink"),
            "titleColor": of("ink"),
            "labelFontSize": 11,
            "labelLimit": 320,
            "symbolStrokeWidth": 2,
            "symbolOpacity": 1,
        },
        "header": {"labelColor": of("ink"), "titleColor": of("ink"), "labelFontSize": 11},
        "title": {"color": of("ink"), "fontWeight": "normal", "fontSize": 12},
        "range": {"category": [of(f"s{number}") for number in range(MAX_SERIES)]},
        "rule": {"color": of("soft")},
        "line": {"color": of("heat")},
        "geoshape": {"stroke": of("heat")},
        "bar": {"color": of("s1")},
    }


def series_order(column: Iterable[object]) -> list[str]:
    """Return the names of all series of a column, sorted, with SUMO's rules first."""
    return sorted({str(name) for name in column}, key=open_first)


def open_first(name: str) -> tuple[bool, str]:
    """Return a sort key for series and gates: series without a gate come first."""
    return not name.startswith((SUMO_RULES, "open")), name
