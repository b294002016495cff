"""Tables for readers, as CSV and as LaTeX."""

from pathlib import Path

import numpy as np
import pandas as pd

from loopgate.analysis.columns import AT_BORDER, BETTER, CAPACITY, HIGH, LOW, RATE, REFUSED_SHARE
from loopgate.report.headline import DASH, number

Cells = tuple[list[str], list[list[str]]]
"""Headings and rows, as text."""

_FORMULA = ("=", "+", "-", "@")
"""Begins what a spreadsheet computes, or hides from its reader."""
_FIGURES = frozenset("0123456789.,+-eE ")
"""A text of nothing else calls no function: shapes of streets, and edges named by numbers below zero."""

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


def plain(table: pd.DataFrame) -> pd.DataFrame:
    """Return the table with lists as texts."""
    lists = {
        name: table[name].map(lambda values: " ".join(map(str, values)), na_action="ignore")
        for name in table.columns
        if table[name].dtype == object and any(isinstance(value, np.ndarray) for value in table[name])
    }
    return table.assign(**lists)


def csv_of(table: pd.DataFrame) -> str:
    """Return the table as CSV in which no text looks like a formula.

    A text that begins as a formula does (``=``, ``+``, ``-``, ``@``, behind blanks too, or a tab) gets an
    apostrophe before it, unless it holds figures alone, as the shapes of streets do. Names of streets and
    files often begin so; the Parquet files hold these names as they are.
    """
    simple = plain(table)
    texts = {
        name: simple[name].map(_no_formula)
        for name in simple.columns
        if not pd.api.types.is_numeric_dtype(simple[name])
    }
    return str(simple.assign(**texts).rename(columns=_no_formula).to_csv(index=False))


def _no_formula(value: object) -> object:
    if not isinstance(value, str):
        return value
    text = value.replace("\r", " ")  # a reader may take the rest for a row of its own
    if _FIGURES.issuperset(text):
        return text
    return f"'{text}" if text.lstrip().startswith(_FORMULA) or text.startswith("\t") else text


def write_csv(table: pd.DataFrame, file: Path) -> None:
    """Write the table as CSV with all digits."""
    file.write_text(csv_of(table), encoding="utf-8")


def write_latex(table: pd.DataFrame, file: Path, *, caption: str) -> None:
    """Write the table for a paper that loads the package booktabs."""
    headings, rows = cells(table)
    frame = pd.DataFrame(rows, columns=headings)
    numeric = [pd.api.types.is_numeric_dtype(table[name]) for name in table.columns]
    text = frame.to_latex(
        index=False,
        escape=True,
        caption=caption.replace("%", r"\%"),
        label=f"tab:{file.stem}",
        column_format="".join("r" if is_number else "l" for is_number in numeric),
    )
    # Typographic characters of the page that LaTeX's default encodings do not all know.
    file.write_text(text.replace(DASH, "--").replace("\N{NO-BREAK SPACE}", "~"), encoding="utf-8")


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
