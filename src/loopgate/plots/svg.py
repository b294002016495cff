"""Figures as text of a page."""

from __future__ import annotations

import io
import re

import matplotlib as mpl
from matplotlib.figure import Figure

from loopgate.plots.style import RC

__all__ = ["figure_svg"]

_NO_METADATA = {"Date": None, "Creator": None, "Format": None, "Type": None}


def figure_svg(figure: Figure, name: str) -> str:
    """Return the figure as SVG, the same bytes for the same figure, with ids of its own on the page.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> from loopgate.plots import figure_svg
    >>> figure = Figure()
    >>> axes = figure.subplots()
    >>> figure_svg(figure, "empty").rstrip().endswith("</svg>")
    True
    """
    with mpl.rc_context({**RC, "svg.hashsalt": name}):
        buffer = io.StringIO()
        figure.savefig(buffer, format="svg", metadata=_NO_METADATA)
    svg = buffer.getvalue()
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    svg = re.sub(r"<!DOCTYPE.*?>", "", svg, flags=re.DOTALL)
    svg = re.sub(r'\bid="(?=[\w.]+_\d+")', f'id="{name}-', svg)
    width = re.search(r'viewBox="0 0 ([\d.]+)', svg)
    wide = f'style="max-width:{float(width[1]) * 4 / 3:.0f}px" ' if width else ""
    # The page scales figures with the column; a title is what a screen reader says.
    return re.sub(
        r'<svg ([^>]*?)width="[\d.]+pt" height="[\d.]+pt"', rf"<svg {wide}\1", svg, count=1
    ).replace("<svg ", '<svg role="img" ', 1)
