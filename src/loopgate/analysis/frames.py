"""Checks on the tables that analysis functions are given, and on the period they look at."""

import functools
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, ParamSpec, TypeVar

import pandas as pd

from loopgate.errors import AnalysisError, LoopgateError
from loopgate.plugins import reason_of
from loopgate.reading import at_least
from loopgate.results.columns import STATUS, STATUS_OK

P = ParamSpec("P")
T = TypeVar("T")

_NAMES = ("by", "match", "among", "streets", "edges", "blocked")
"""Parameters that take names; a text is one of them, as in pandas, and no sequence of letters."""

_COUNTS = ("first", "resamples")
"""Parameters that take a number of things."""


def of_tables(function: Callable[P, T], offered_by: str) -> Callable[P, T]:
    """Decorate a function of tables so that invalid values raise `AnalysisError` in one line.

    A single name stands for a list of one, and a number of rows is at least 1: pandas would take the letters
    of a name, and leave out the last rows for a negative number.

    Tables may be damaged, made by another version, or a user's own. Whatever the function stumbles on then
    becomes an `AnalysisError` that names the function. A call that Python itself refuses stays a `TypeError`.

    Parameters
    ----------
    offered_by
        The package that offers the function, by which other processes find it.
    """

    @functools.wraps(function)
    def explained(*args: P.args, **kwargs: P.kwargs) -> T:
        for name in _NAMES:
            if isinstance(only := kwargs.get(name), str):
                kwargs[name] = [only]
        for name in _COUNTS:
            at_least(
                1, kwargs.get(name, 1), f"{function.__name__}: {name}", AnalysisError, "a number from 1 on"
            )
        try:
            return function(*args, **kwargs)
        except LoopgateError:
            raise
        except Exception as problem:
            if problem.__traceback__ is None or problem.__traceback__.tb_next is None:
                raise
            msg = f"{function.__name__}: its tables hold what no run has ({reason_of(problem)})"
            raise AnalysisError(msg) from problem

    explained.__module__ = offered_by
    return explained


def check_columns(frame: pd.DataFrame, needed: Iterable[str], what: str) -> None:
    """Refuse a table that lacks a column.

    Raises `AnalysisError`, naming the table, the missing columns and those it has.
    """
    missing = [name for name in needed if name not in frame.columns]
    if missing:
        has = ", ".join(map(str, frame.columns)) or "no columns"
        msg = f"{what}: the column {', '.join(missing)} is missing; the table has {has}"
        raise AnalysisError(msg)


def check_period(begin_s: float, end_s: float) -> None:
    """Refuse a period of observation that is empty, runs backwards or begins before 0.

    Raises `AnalysisError`, naming both ends.
    """
    if not (math.isfinite(begin_s) and math.isfinite(end_s) and 0 <= begin_s < end_s):
        msg = f"the period from {begin_s:g} s to {end_s:g} s is none; expected 0 <= begin < end, both finite"
        raise AnalysisError(msg)


def groups(
    frame: pd.DataFrame, by: Sequence[str], what: str
) -> Iterator[tuple[dict[str, Any], pd.DataFrame]]:
    """Yield the groups of a table in sorted order, each with its values of `by`; rows without a value count.

    Raises `AnalysisError` if a column of `by` is missing.
    """
    check_columns(frame, by, what)
    if not by:
        yield {}, frame
        return
    for values, group in frame.groupby(list(by), sort=True, dropna=False):
        yield dict(zip(by, values, strict=True)), group


def succeeded(runs: pd.DataFrame) -> pd.DataFrame:
    """Return the runs that ended without an error; all of them if the table has no status."""
    return runs[runs[STATUS] == STATUS_OK] if STATUS in runs.columns else runs


def table(rows: Iterable[Mapping[str, object]], columns: Sequence[str]) -> pd.DataFrame:
    """Return rows as a table that has its columns even without rows."""
    return pd.DataFrame(list(rows), columns=list(columns))
