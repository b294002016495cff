"""Series: the runs that make one line of a figure."""

import json
from collections.abc import Hashable, Mapping
from typing import Any

import pandas as pd

from loopgate.analysis.frames import check_columns, succeeded
from loopgate.results import columns as c
from loopgate.results.columns import SERIES, SUMO_RULES
from loopgate.results.row_schema import ROW_SCHEMA

_NAMED = {c.ABSTRACTION, c.NEGOTIATION}
_RULES = {"open": SUMO_RULES, "certified": "loopgate"}
_LIGHTS = {"keep": "lights kept", "off": "lights off", "obey": "lights obeyed"}

_ONLY_COUNTS = {SERIES, "vehicles_per_km"}
"""Columns that make no series: what comes of the latter are vehicles, and these are on the axis."""


def add_series(runs: pd.DataFrame) -> pd.DataFrame:
    """Return the successful runs with a new column `SERIES`, the name of their line in figures.

    The name begins with the rule: *SUMO's rules* if no gate decides, *loopgate* under the gate ``certified``,
    *gate NAME* under another gate. Then come all settings in which the runs differ, such as the treatment of
    lights. Network, seed and number of vehicles are not part of the name.

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
    ["SUMO's rules, its lights", 'loopgate, lights off', 'loopgate, lights kept']
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
    if c.LIGHTS in good and len(good[c.LIGHTS].dropna().unique()) > 1:
        differs[c.LIGHTS] = True  # whoever compares rules wants to know
    names = [
        ", ".join(
            [_label(c.GATE, row[c.GATE]), *(_part(n, row) for n in known if differs.loc[row[c.GATE], n])]
        )
        for row in labels.to_dict("records")
    ]
    return good.assign(**{SERIES: pd.Series(names, index=good.index, dtype=object)})


def _part(name: str, row: Mapping[Hashable, Any]) -> str:
    if name == c.LIGHTS and row[name] in _LIGHTS:
        own = row[c.GATE] == "open" and row[name] == "keep"
        return "its lights" if own else _LIGHTS[str(row[name])]
    return _label(name, row[name])


def _label(name: str, value: object) -> str:
    if value is None or value != value:  # noqa: PLR0124 - NaN is what differs from itself
        return "no gate" if name == c.GATE else f"no {name}"
    if name == c.GATE:
        return _RULES.get(str(value), f"gate {value}")
    if isinstance(value, float):
        value = f"{value:g}"
    return str(value) if name in _NAMED else f"{name} {value}"
