"""Tables as CSV that no spreadsheet takes for formulas."""

import numpy as np
import pandas as pd

_FORMULA = ("=", "+", "-", "@")
"""Begins what a spreadsheet computes, or hides from its reader."""
_FIGURES = frozenset("0123456789.,+-eE ")
"""A text of nothing else calls no function: shapes of streets, and edges named by numbers below zero."""


def plain(table: pd.DataFrame) -> pd.DataFrame:
    """Return the table with texts for lists, as every format can hold it."""
    lists = {
        name: table[name].map(lambda values: " ".join(map(str, values)), na_action="ignore")
        for name in table.columns
        if table[name].dtype == object and any(isinstance(value, np.ndarray) for value in table[name])
    }
    return table.assign(**lists)


def csv_of(table: pd.DataFrame) -> str:
    """Return the table as CSV that no spreadsheet takes for formulas.

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
