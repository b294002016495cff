"""Tables for readers, as CSV and as LaTeX."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from loopgate.report.headline import DASH, number
from loopgate.results.columns import AT_BORDER, BETTER, CAPACITY, HIGH, LOW, RATE, REFUSED_SHARE
from loopgate.results.table_reading import csv_of

Cells = tuple[list[str], list[list[str]]]
"""Headings and rows, as text."""

_SHARES = {RATE, BETTER, REFUSED_SHARE}


def cells(table: pd.DataFrame) -> Cells:
    """Return the table with three significant digits, and shares with their intervals in percent."""
    shares = _SHARES | ({LOW, HIGH} if RATE in table.columns else set())
    columns = [_texts(table[name], share=name in shares) for name in table.columns]
    if AT_BORDER in table and CAPACITY in table:
        at = list(table.columns).index(CAPACITY)
        columns[at] = [
            f"> {text}, not reached" if border else text
            for text, border in zip(columns[at], table[AT_BORDER], strict=True)
        ]
    headings = [str(name).replace("_", " ") for name in table.columns]
    return headings, [list(row) for row in zip(*columns, strict=True)]


def write_csv(table: pd.DataFrame, file: Path) -> None:
    """Write the table as CSV with all digits."""
    file.write_text(csv_of(table), encoding="utf-8")


def write_latex(table: pd.DataFrame, file: Path, *, caption: str) -> None:
    """Write the table for a paper that loads the package booktabs."""
    headings, rows = cells(table)
    frame = pd.DataFrame(rows, columns=headings)
    numeric = [pd.api.types.is_numeric_dtype(table[name]) for name in table.columns]
    file.write_text(latex_text(frame, numeric, caption, file.stem), encoding="utf-8")


def latex_text(frame: pd.DataFrame, numeric: Sequence[bool], caption: str, name: str) -> str:
    """Return a table of texts for a paper that loads the package booktabs."""
    text = frame.to_latex(
        index=False,
        escape=True,
        caption=caption.replace("%", r"\%"),
        label=f"tab:{name}",
        column_format="".join("r" if is_number else "l" for is_number in numeric),
    )
    # Typographic characters of the page that LaTeX's default encodings do not all know.
    return str(text).replace(DASH, "--").replace("\N{NO-BREAK SPACE}", "~")


def _texts(column: pd.Series, *, share: bool) -> list[str]:
    if pd.api.types.is_bool_dtype(column):
        return ["yes" if value else "no" for value in column]
    if share:
        return [DASH if pd.isna(value) else f"{100 * value:.1f} %" for value in column]
    if pd.api.types.is_integer_dtype(column):
        return [str(value) for value in column]
    if pd.api.types.is_numeric_dtype(column):
        return [number(float(value)) for value in column]
    return [DASH if value is None else str(value) for value in column]
