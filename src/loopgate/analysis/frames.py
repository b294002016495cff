"""Checks on the tables that analysis functions are given, and on the period they look at."""

from __future__ import annotations

import math
from collections.abc import Iterable

import pandas as pd

from loopgate.errors import AnalysisError

__all__ = ["check_columns", "check_period"]


def check_columns(frame: pd.DataFrame, needed: Iterable[str], what: str) -> None:
    """Refuse a table that lacks a column.

    Raises
    ------
    AnalysisError
        Naming the table, the missing columns and those it has.
    """
    missing = [name for name in needed if name not in frame.columns]
    if missing:
        has = ", ".join(map(str, frame.columns)) or "no columns"
        msg = f"{what}: the column {', '.join(missing)} is missing; the table has {has}"
        raise AnalysisError(msg)


def check_period(begin_s: float, end_s: float) -> None:
    """Refuse a period of observation that is empty, runs backwards or begins before 0.

    Raises
    ------
    AnalysisError
        Naming both ends.
    """
    if not (math.isfinite(begin_s) and math.isfinite(end_s) and 0 <= begin_s < end_s):
        msg = f"the period from {begin_s:g} s to {end_s:g} s is none; expected 0 <= begin < end, both finite"
        raise AnalysisError(msg)
