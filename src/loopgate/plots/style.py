"""The look of figures: colours that all can tell apart, markers and dashes that survive a grey printer."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Final

__all__ = ["HEAT_MAP", "MAX_SERIES", "RC", "Look", "looks", "looks_of", "series_order"]

# Okabe and Ito (2008), for all kinds of colour vision; ordered so that neighbours differ in lightness too.
_COLOURS = ("#000000", "#E69F00", "#0072B2", "#56B4E9", "#D55E00", "#009E73", "#CC79A7", "#808080")
_MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")
_DASHES: tuple[Any, ...] = (
    "solid",
    (0, (5, 1.5)),
    (0, (1, 1)),
    (0, (5, 1, 1, 1)),
    (0, (8, 2)),
    (0, (3, 1, 1, 1, 1, 1)),
    (0, (2, 2)),
    (0, (1, 3)),
)
MAX_SERIES: Final = len(_COLOURS)
"""Most series that one figure can show and a reader tell apart."""

HEAT_MAP: Final = "cividis_r"
"""Even in lightness, the same for all kinds of colour vision; dark is much."""

RC: Final[Any] = {
    "font.family": "sans-serif",
    "font.size": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.grid.axis": "y",
    "grid.color": "#dddddd",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "axes.labelsize": 10,
    "legend.frameon": False,
    "legend.fontsize": 9,
    "lines.linewidth": 1.6,
    "lines.markersize": 5,
    "figure.constrained_layout.use": True,
    "svg.fonttype": "none",  # text stays text: searchable, small, and read out by screen readers
    "savefig.dpi": 200,
}


@dataclass(frozen=True, slots=True)
class Look:
    """Colour, marker and dash of one series."""

    colour: str
    marker: str
    dash: Any

    def line(self) -> dict[str, Any]:
        """Return the keyword arguments of a line with markers."""
        return {"color": self.colour, "marker": self.marker, "linestyle": self.dash}


def looks(series: Sequence[str]) -> dict[str, Look]:
    """Return a look for each of the first `MAX_SERIES` series, always the same for the same order."""
    triples = zip(_COLOURS, _MARKERS, _DASHES, strict=True)
    return {name: Look(*triple) for name, triple in zip(series, triples, strict=False)}


def looks_of(column: Iterable[object]) -> dict[str, Look]:
    """Return looks for the series that a column names, in their order."""
    return looks(series_order(column))


def series_order(column: Iterable[object]) -> list[str]:
    """Return the series that a column names, sorted; open gates first: others are compared with them."""
    return sorted({str(name) for name in column}, key=lambda name: (not name.startswith("open"), name))
