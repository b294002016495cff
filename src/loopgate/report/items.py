"""The parts of a report: figures and tables with their words, by network."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd
from matplotlib.figure import Figure

__all__ = ["SERIES", "FigureItem", "Section", "TableItem"]

SERIES = "series"
"""The column that names a series: gate, and whatever else varies besides network, vehicles and seed."""


@dataclass(frozen=True, slots=True)
class FigureItem:
    """A figure with its words."""

    name: str
    title: str
    caption: str
    figure: Figure
    code: str
    """Python that makes the table behind it."""


@dataclass(frozen=True, slots=True)
class TableItem:
    """A table with its words."""

    name: str
    title: str
    table: pd.DataFrame
    code: str


@dataclass(frozen=True, slots=True)
class Section:
    """All about one network."""

    network: str
    runs: pd.DataFrame
    count: int
    """The vehicle count at which series are compared where one must be chosen."""
    figures: Sequence[FigureItem]
    tables: Sequence[TableItem]
    hidden: Sequence[str]
    """Series that the figures leave out, since nobody could tell them apart."""
