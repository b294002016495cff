"""Lines over vehicles or density from the tables of a sweep: one colour, marker and dash per series."""

import math
from collections.abc import Sequence
from typing import Any

import altair as alt
import numpy as np
import pandas as pd

from loopgate.analysis.frames import check_columns
from loopgate.plots.charts import (
    NUMBER,
    Chart,
    data,
    finish,
    series_channels,
    series_names,
    tooltip,
    with_dashes,
    with_series,
)
from loopgate.results import columns as c
from loopgate.results.headings import heading

_SPREAD = 0.008
"""Distance between neighbouring series, as a share of the axis: intervals must not hide each other."""
_OVER: dict[str, Any] = {"x": c.VEHICLES, "low": c.LOW, "high": c.HIGH}


def plot_against(  # noqa: PLR0913 - what a figure of lines may have; all but the table by name
    table: pd.DataFrame,
    *,
    x: str,
    y: str,
    low: str = "",
    high: str = "",
    labels: tuple[str, str] = ("", ""),
    series: str = "",
    single: pd.DataFrame | None = None,
    single_y: str = "",
    zero: bool = True,
    percent: bool = False,
    among: Sequence[str] = (),
) -> Chart:
    """Draw a line with markers for each series, with intervals and single runs if given.

    Parameters
    ----------
    table
        One row per series and `x`.
    x, y, low, high
        Columns of `table` to draw; without `low` and `high` there are no intervals.
    series
        The column with the name of the series; default: ``series``, or ``gate`` without such a column.
    single, single_y
        A table with one row per run, and its column to draw as small points.
    zero, percent
        Whether the axis begins at 0; whether it shows shares in percent.
    among
        The names of all series, if the table has only some, so that a series has the same colour everywhere.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.plots import plot_against
    >>> table = pd.DataFrame({"gate": "open", "vehicles": [20, 40], "mean_speed_mps": [7.0, 5.0]})
    >>> plot_against(table, x="vehicles", y="mean_speed_mps").save("figure.svg")
    """
    table, series = with_series(table, series)
    if single is not None:
        check_columns(single, [series, x, single_y], "single")
    known = series_names(table, series)
    style = series_channels(known, series, among)
    low = low if low and table[low].notna().any() else ""  # one run has no interval
    lone = table[x].nunique() < 2 and x == c.VEHICLES  # noqa: PLR2004 - a line needs two points
    if lone:  # nothing to be drawn against vehicles: series stand side by side
        across: Any = alt.X(
            f"{series}:N", title=None, sort=known, axis=alt.Axis(labelAngle=0, labelLimit=160)
        )
    else:
        across = alt.X("at:Q", title=labels[0] or heading(x), scale=alt.Scale(zero=True, nice=True))
    span = float(table[x].max() - table[x].min()) if len(table) and not lone else 0.0
    beside = _SPREAD * span * min(1.0, 4 / max(len(known), 1)) if low else 0.0
    shifted = f"datum['{x}'] + (indexof({known!r}, datum['{series}']) - {(len(known) - 1) / 2}) * {beside}"
    chosen = alt.FieldOneOfPredicate(field=series, oneOf=known)
    base = alt.Chart().transform_filter(chosen).transform_calculate(at=shifted)
    up = alt.Y(
        f"{y}:Q",
        title=labels[1] or heading(y),
        scale=alt.Scale(zero=zero),
        axis=alt.Axis(format="%") if percent else alt.Axis(labelExpr=NUMBER),
    )
    hover = tooltip(series, f"{x}:Q", f"{y}:Q", *(f"{f}:Q" for f in (low, high) if f))
    layers: list[Any] = []
    if single is not None and len(single):
        layers.append(
            alt.Chart(data(_only(single, series, x, single_y, c.SEED)))
            .transform_filter(chosen)
            .transform_calculate(at=shifted)
            .mark_point(size=14, opacity=0.45, filled=True)
            .encode(
                x=across,
                y=alt.Y(f"{single_y}:Q", title=labels[1] or heading(y)),
                color=style["color"],
                tooltip=tooltip(series, f"{x}:Q", f"{single_y}:Q", *([c.SEED] if c.SEED in single else [])),
            )
        )
    if low:
        layers.append(
            base.mark_rule(strokeWidth=1.5).encode(
                x=across,
                y=alt.Y(f"{low}:Q", title=labels[1] or heading(y)),
                y2=f"{high}:Q",
                color=style["color"],
            )
        )
    # Rows of one run each, or several at one place, are points: a line through them would go to and fro.
    if not lone and c.SEED not in table and not table.duplicated([series, x]).any():
        layers.append(
            with_dashes(base, series)
            .mark_line(strokeWidth=2)
            .encode(x=across, y=up, color=style["color"], strokeDash=style["strokeDash"], order=f"{x}:Q")
        )
    layers.append(
        base.mark_point(filled=True, size=55, opacity=1).encode(
            x=across, y=up, color=style["color"], shape=style["shape"], tooltip=hover
        )
    )
    return finish(alt.layer(*layers, data=data(_only(table, series, x, y, low, high))))  # type: ignore[no-any-return]


def _only(table: pd.DataFrame, *names: str) -> pd.DataFrame:
    """Return the columns that are drawn; a row of a run has a hundred more."""
    return table[[name for name in dict.fromkeys(names) if name in table]]


def plot_mean(
    means: pd.DataFrame,
    label: str = "",
    *,
    series: str = "",
    single: pd.DataFrame | None = None,
    value: str = c.KM_PER_H,
    among: Sequence[str] = (),
) -> Chart:
    """Draw means from `compute_mean` against the number of vehicles, a line for each series.

    Single runs are small points; `value` is their column to draw.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_mean
    >>> from loopgate.plots import plot_mean
    >>> runs = pd.DataFrame({"gate": "open", "vehicles": [20, 40], "km_per_h": [90.0, 150.0]})
    >>> plot_mean(compute_mean(runs=runs), "vehicle-km/h", single=runs).save("figure.svg")
    """
    of: dict[str, Any] = {"series": series, "single": single, "single_y": value, "among": among}
    label = label or heading(means.attrs.get(c.OF, c.MEAN))
    return plot_against(means, y=c.MEAN, labels=("", label), **of, **_OVER)


def plot_deadlock_rate(rates: pd.DataFrame, *, series: str = "", among: Sequence[str] = ()) -> Chart:
    """Draw the share of runs that lock up, from `compute_deadlock_rate`, with Wilson's intervals.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_deadlock_rate
    >>> from loopgate.plots import plot_deadlock_rate
    >>> runs = pd.DataFrame({"gate": "open", "vehicles": [20, 40], "deadlocks": [0, 1]})
    >>> plot_deadlock_rate(compute_deadlock_rate(runs=runs)).save("figure.svg")
    """
    labels = "", "runs that lock up"
    return plot_against(rates, y=c.RATE, labels=labels, series=series, percent=True, among=among, **_OVER)


def plot_paired(
    paired: pd.DataFrame, label: str = "", *, series: str = "", among: Sequence[str] = ()
) -> Chart:
    """Draw the differences to a baseline from `compute_paired`, with intervals; above 0 is better.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_paired
    >>> from loopgate.plots import plot_paired
    >>> runs = pd.DataFrame({"gate": ["open", "open", "certified", "certified"], "seed": [1, 2, 1, 2]})
    >>> runs = runs.assign(vehicles=40, km_per_h=[90.0, 110.0, 100.0, 125.0])
    >>> plot_paired(compute_paired(runs=runs, baseline="open")).save("figure.svg")
    """
    baseline = f" to {paired[c.BASELINE].iloc[0]}" if len(paired) else ""
    labels = "", label or f"difference{baseline}: {heading(paired.attrs.get(c.OF, 'mean'))}"
    lines = plot_against(paired, y=c.DIFFERENCE, labels=labels, series=series, among=among, **_OVER)
    lines.layer.insert(
        0, alt.Chart(alt.InlineData(values=[{}])).mark_rule(strokeWidth=1).encode(y=alt.datum(0))
    )
    return lines


def plot_decision_time(decisions: pd.DataFrame, *, series: str = "", among: Sequence[str] = ()) -> Chart:
    """Draw median and 99th percentile of the decision time, from `compute_decision_time`.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_decision_time
    >>> from loopgate.plots import plot_decision_time
    >>> runs = pd.DataFrame({"gate": ["banker"], "vehicles": [40], "decisions": [1000], "refusals": [250]})
    >>> runs = runs.assign(messages=None, decision_median_us=5.0, decision_p99_us=30.0, decision_max_us=90.0)
    >>> plot_decision_time(compute_decision_time(runs=runs)).save("figure.svg")
    """
    over = {**_OVER, "low": c.DECISION_MEDIAN, "high": c.DECISION_P99}
    labels = "", "decision time [µs]"
    lines = plot_against(decisions, y=c.DECISION_MEDIAN, labels=labels, series=series, among=among, **over)
    values = decisions[[c.DECISION_MEDIAN, c.DECISION_P99]].to_numpy(dtype=float)
    known = values[np.isfinite(values) & (values > 0)]
    for layer in lines.layer:
        layer.encoding.y.scale = alt.Scale(type="log")
        if known.size:
            ticks = _log_ticks(float(known.min()), float(known.max()))
            layer.encoding.y.axis = alt.Axis(labelExpr=NUMBER, values=ticks)
    return lines


def _log_ticks(low: float, high: float) -> list[float]:
    """Return 1, 2 and 5 times the powers of ten from just below `low` to just above `high`."""
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    return [digit * 10.0**power for power in powers for digit in (1, 2, 5)]


def plot_fundamental(
    means: pd.DataFrame,
    *,
    y: str = c.FLOW,
    series: str = "",
    single: pd.DataFrame | None = None,
    among: Sequence[str] = (),
) -> Chart:
    """Draw flow or speed over density: the fundamental diagram.

    Parameters
    ----------
    means
        Table of `compute_fundamental`; without its `by` each run is a point.
    y
        The column to draw: ``flow_veh_per_h`` or ``speed_km_per_h``.
    series, among
        The column with the name of the series; default: ``series``, or ``gate`` without such a column. All
        its names if `means` has only some of these.
    single
        Table of single runs, with the same columns; each is drawn as a small point.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_fundamental
    >>> from loopgate.plots import plot_fundamental
    >>> runs = pd.DataFrame({"gate": "open", "vehicles": [20, 40], "edge_km": 8.0, "km_per_h": [500, 800]})
    >>> runs = runs.assign(mean_speed_mps=[7.0, 5.0])
    >>> plot_fundamental(compute_fundamental(runs=runs, by=["gate", "vehicles"])).save("figure.svg")
    """
    labels = f"{heading(c.DENSITY)}, of road on loops", heading(y)
    of: dict[str, Any] = {"series": series, "single": single, "single_y": y, "among": among}
    return plot_against(means, x=c.DENSITY, y=y, labels=labels, **of)
