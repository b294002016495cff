"""Tables for readers, as CSV and as LaTeX."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from loopgate.report.headline import DASH, PLUS_MINUS, number, with_interval
from loopgate.results.columns import (
    AT_BORDER,
    BETTER,
    CAPACITY,
    DIFFERENCE,
    GREEN_USED,
    HIGH,
    KIND,
    LOW,
    MEAN,
    OF,
    ON_TIME_60,
    ON_TIME_120,
    RATE,
    REFUSED_SHARE,
    STD,
    STOOD_SHARE,
)
from loopgate.results.headings import heading
from loopgate.results.table_reading import csv_of

Cells = tuple[list[str], list[list[str]]]
"""Headings and rows, as text."""

_INTERVAL = STD, LOW, HIGH
_ESTIMATES = MEAN, DIFFERENCE, RATE, CAPACITY
_SHARES = {RATE, BETTER, GREEN_USED, REFUSED_SHARE, STOOD_SHARE, ON_TIME_60, ON_TIME_120}


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
    headings = [heading(str(name)) for name in table.columns]
    return headings, [list(row) for row in zip(*columns, strict=True)]


def _estimated(values: pd.Series, estimate: str, text: str) -> str:
    """Return the estimate of a row with its interval, or `text` without one."""
    low, high = values[LOW], values[HIGH]
    if pd.isna(low) or pd.isna(high):
        return text
    if estimate == RATE:
        return f"{text} ({100 * low:.0f} to {100 * high:.0f} %)"
    return with_interval(float(values[estimate]), float(low), float(high))


def write_csv(table: pd.DataFrame, file: Path) -> None:
    """Write the table as CSV with all digits."""
    file.write_text(csv_of(table), encoding="utf-8")


def write_latex(table: pd.DataFrame, file: Path, *, caption: str) -> None:
    """Write the table for a paper that loads the package booktabs."""
    estimate = next((name for name in _ESTIMATES if name in table), "")
    shown = table.drop(columns=[name for name in (*_INTERVAL, KIND) if estimate and name in table])
    headings, rows = cells(shown)
    if estimate and {LOW, HIGH} <= set(table):
        at = list(shown.columns).index(estimate)
        for row, (_, values) in zip(rows, table.iterrows(), strict=True):
            row[at] = _estimated(values, estimate, row[at])
        headings[at] = heading(table.attrs.get(OF, estimate))
        if estimate == DIFFERENCE and OF in table.attrs:
            headings[at] = f"difference, {headings[at]}"
    elif estimate == MEAN:
        headings[list(shown.columns).index(estimate)] = heading(table.attrs.get(OF, estimate))
    frame = pd.DataFrame([[text or DASH for text in row] for row in rows], columns=headings)
    numeric = [pd.api.types.is_numeric_dtype(shown[name]) for name in shown.columns]
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
    known = {
        DASH: "--",
        "\N{NO-BREAK SPACE}": "~",
        PLUS_MINUS: r"$\pm$",
        "\N{MICRO SIGN}": r"\textmu{}",
        "\N{RIGHTWARDS ARROW}": r"$\to$",
    }
    for character, command in known.items():
        text = str(text).replace(character, command)
    return str(text)


def _texts(column: pd.Series, *, share: bool) -> list[str]:
    if pd.api.types.is_bool_dtype(column):
        return ["yes" if value else "no" for value in column]
    if share:
        return [DASH if pd.isna(value) else f"{100 * value:.1f} %" for value in column]
    if pd.api.types.is_integer_dtype(column):
        return [DASH if pd.isna(value) else str(value) for value in column]
    if pd.api.types.is_numeric_dtype(column):
        return [number(float(value)) for value in column]
    return [DASH if pd.api.types.is_scalar(value) and pd.isna(value) else str(value) for value in column]
