"""Series: the runs that make one line of a figure."""

import json

import pandas as pd

from loopgate.analysis.columns import SERIES
from loopgate.analysis.frames import check_columns, succeeded
from loopgate.results import row_columns as c
from loopgate.results.row_schema import ROW_SCHEMA

_NAMED = {c.GATE, c.ABSTRACTION, c.NEGOTIATION}

_ONLY_COUNTS = {SERIES, "vehicles_per_km"}
"""Columns that make no series: what comes of the latter are vehicles, and these are on the axis."""


def add_series(runs: pd.DataFrame) -> pd.DataFrame:
    """Return the successful runs with a column `SERIES`: the gate, and all other settings that differ.

    Network, vehicles (in all or per kilometre) and seed make no series. Neither does the number of loops
    where nobody asked for one: a file has so many, and fewer are used where there are fewer vehicles, or
    where a loop cannot work.

    Raises `AnalysisError` on a missing column.

    Parameters
    ----------
    runs
        One row per run: `Results.runs`.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import add_series
    >>> runs = pd.DataFrame({"gate": ["open", "certified", "certified"], "lights": ["keep", "off", "keep"]})
    >>> add_series(runs)["series"].tolist()
    ['open', 'certified, lights off', 'certified, lights keep']
    """
    check_columns(runs, [c.GATE], "runs")
    good = succeeded(runs)
    if c.VEHICLES in good:
        good = good[good[c.VEHICLES].notna()]
    known = [n for n in (c.ABSTRACTION, c.NEGOTIATION, c.LIGHTS, c.DURATION, c.WARMUP) if n in good]
    known += [n for n in good.columns if n not in ROW_SCHEMA.names and n not in _ONLY_COUNTS]
    labels = good[[c.GATE, *known]].copy()
    if c.SCENARIO in good:
        labels[c.LOOPS] = [json.loads(text).get(c.LOOPS) if text else None for text in good[c.SCENARIO]]
        known.append(c.LOOPS)
    # What differs only from one gate to the next follows from the gate, and needs no name.
    differs = labels.groupby(c.GATE, dropna=False)[known].nunique(dropna=False).gt(1)
    names = [
        ", ".join(
            [_label(c.GATE, row[c.GATE]), *(_label(n, row[n]) for n in known if differs.loc[row[c.GATE], n])]
        )
        for row in labels.to_dict("records")
    ]
    return good.assign(**{SERIES: pd.Series(names, index=good.index, dtype=object)})


def _label(name: str, value: object) -> str:
    if value is None or value != value:  # noqa: PLR0124 - NaN is what differs from itself
        return "no gate" if name == c.GATE else f"no {name}"
    if isinstance(value, float):
        value = f"{value:g}"
    return str(value) if name in _NAMED else f"{name} {value}"
