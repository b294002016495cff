"""Tables of several runs, for people."""

from __future__ import annotations

import math
from collections.abc import Mapping

import pandas as pd
from rich import box
from rich.markup import escape
from rich.table import Table


def frame_table(frame: pd.DataFrame, columns: Mapping[str, str], *, title: str) -> Table:
    """Return a table for the terminal with the rows of `frame`.

    `columns`: which of its columns, in this order, and what each is called.
    """
    table = Table(title=title, box=box.SIMPLE_HEAD)
    for name, heading in columns.items():
        numeric = pd.api.types.is_numeric_dtype(frame[name])
        table.add_column(escape(heading), justify="right" if numeric else "left", no_wrap=True)
    for row in frame[list(columns)].itertuples(index=False):
        table.add_row(*(escape(_text(value)) for value in row))
    return table


def _text(value: object) -> str:
    if value is pd.NA or (isinstance(value, float) and math.isnan(value)):
        return "-"
    return f"{value:.1f}" if isinstance(value, float) else str(value)
