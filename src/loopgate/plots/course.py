"""Figures of how runs went: over time, by the cause of waiting, by junction, and along a loop."""

from collections.abc import Mapping, Sequence
from math import ceil, floor
from typing import Any

import altair as alt
import pandas as pd

from loopgate.errors import AnalysisError
from loopgate.plots.charts import NUMBER, Chart, data, finish, series_channels, series_names, tooltip
from loopgate.results import columns as c
from loopgate.results.headings import heading

OVER_TIME: Sequence[str] = c.KM_PER_H, c.LAPS_PER_H, c.STILL, c.SPEED
CUMULATIVE: Sequence[str] = c.DISTANCE_KM, c.LAPS, c.STOOD_H
"""Columns of `compute_flow`: rates, and totals so far."""

_SAID: Mapping[str, str] = {
    c.LAPS_PER_H: "laps/h",
    c.STILL: "vehicles standing",
    c.DISTANCE_KM: "vehicle-km so far",
    c.LAPS: "laps so far",
    c.STOOD_H: "vehicle-hours stood so far",
}
_TIME_AXIS = {False: "simulated time [s]", True: "time of day"}
_TICKS_MIN = 1, 2, 5, 10, 15, 30, 60, 120, 180, 360, 720, 1440
_MOST_TICKS = 8
_RANKED = c.MOVEMENT, c.JUNCTION, c.REASON, c.CAUSE, c.STREET, c.EDGE
_RANKED_BY = c.LOST, c.STOOD, c.WAIT, c.MOST, c.WORST_IDLENESS
"""What bars may stand for, and their lengths, the first of each that a table has."""


def _time_axis(times_s: pd.Series, *, clock: bool) -> alt.Axis:
    """Return the axis of times; on times of day the ticks are at full minutes, quarters or hours."""
    if not clock or times_s.empty:
        return alt.Axis()
    if times_s.max() - times_s.min() < 2 * 60.0 * _TICKS_MIN[0]:
        return alt.Axis(labelExpr="utcFormat(datum.value * 1000, '%-H:%M:%S')")
    first_min, last_min = float(times_s.min()) / 60.0, float(times_s.max()) / 60.0
    enough = (one for one in _TICKS_MIN if (last_min - first_min) / one < _MOST_TICKS)
    step_min = next(enough, _TICKS_MIN[-1])
    ticks = range(ceil(first_min / step_min), floor(last_min / step_min) + 1)
    return alt.Axis(
        labelExpr="utcFormat(datum.value * 1000, '%-H:%M')", values=[60 * step_min * tick for tick in ticks]
    )


def plot_flow(
    flow: pd.DataFrame,
    *,
    series: str = "",
    what: Sequence[str] = OVER_TIME,
    deadlocks: Sequence[float] = (),
    clock: bool = False,
    among: Sequence[str] = (),
) -> Chart:
    """Draw measurements of all vehicles over time from `compute_flow`, a panel for each.

    Parameters
    ----------
    series
        The column with the name of the series; default: ``series``, or ``gate`` without such a column, or
        all rows are one.
    what
        Columns to draw.
    deadlocks
        Times of deadlocks [s], drawn as vertical lines.
    clock
        Whether times are times of day: 36000 is 10:00.
    among
        The names of all series, if the table has only some, so that a series has the same colour everywhere.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_flow
    >>> from loopgate.plots import plot_flow
    >>> flow = pd.DataFrame({"time_s": [60.0, 120.0], "vehicles": 4, "standing": [0, 2], "laps": [0, 1]})
    >>> plot_flow(compute_flow(flow=flow.assign(distance_m=400.0), every_s=60)).save("figure.svg")
    """
    series = series or next((name for name in (c.SERIES, c.GATE) if name in flow), "")
    known = series_names(flow, series) if series else []
    color = series_channels(known, series, among, lines=True) if series else {}
    locked = alt.Chart(alt.InlineData(values=[{c.TIME: at} for at in deadlocks]))
    # Where nobody drives rounds, as in most FCD, laps need no panel.
    what = [one for one in what if one not in (c.LAPS, c.LAPS_PER_H) or flow[one].gt(0).any()] or what
    panels = []
    for column in what:
        # The panels share the time: its name stands below the last.
        title: Any = _TIME_AXIS[clock] if column == what[-1] else None
        scale = alt.Scale(nice=False, zero=False)
        x = alt.X(f"{c.TIME}:Q", title=title, scale=scale, axis=_time_axis(flow[c.TIME], clock=clock))
        # A figure that is 0 all the time is a line at the foot of its panel.
        flat = not flow[column].gt(0).any()
        scale = alt.Scale(domain=[0, 1]) if flat else alt.Scale(zero=True)
        ticks: dict[str, Any] = {"values": [0, 1]} if flat else {"tickCount": 4}
        y = alt.Y(f"{column}:Q", title=None, scale=scale, axis=alt.Axis(labelExpr=NUMBER, **ticks))
        base = alt.Chart().encode(x=x, y=y, **color)
        if known:
            base = base.transform_filter(alt.FieldOneOfPredicate(field=series, oneOf=known))
        hover = tooltip(*([series] if series else []), f"{c.TIME}:Q", f"{column}:Q")
        layers: list[Any] = [
            base.mark_line(strokeWidth=1.7),
            base.mark_point(size=60, opacity=0, filled=True).encode(tooltip=hover),
        ]
        if deadlocks:
            layers.append(locked.mark_rule(strokeDash=[3, 3]).encode(x=x, tooltip=tooltip(f"{c.TIME}:Q")))
        head = alt.Title(_SAID.get(column) or heading(column), anchor="start", fontSize=12, offset=4)
        panels.append(alt.layer(*layers).properties(width=430, height=80, title=head))
    return finish(alt.vconcat(*panels, data=data(flow), spacing=8))  # type: ignore[no-any-return]


_NAMES = alt.Axis(labelLimit=alt.ExprRef("containerSize()[0] < 500 ? 240 : 330"), labelOverlap=False)
"""The names of bars, whole; on a narrow page the bars need room too."""


def plot_ranked(
    table: pd.DataFrame,
    *,
    of: str = "",
    value: str = "",
    label: str = "",
    series: str = "",
    among: Sequence[str] = (),
) -> Chart:
    """Draw bars, the longest on top: junctions, edges, movements, or causes of waiting.

    From `compute_ranked`, `compute_worst_movements`, `compute_causes`, `compute_longest_waits` or
    `compute_rarest`. Of several rows of one name and series the greatest value is drawn.

    Parameters
    ----------
    of, value, label
        The column with the names of the bars, the column with their lengths, and the label of the axis.
        Default: those by which the table is ranked.
    series
        The column with the name of the series, drawn side by side; default: as of `plot_flow`.
    among
        The names of all series, if the table has only some, so that a series has the same colour everywhere.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.plots import plot_ranked
    >>> causes = pd.DataFrame({"reason": ["crossing", "occupied"], "wait_s": [13.0, 2.0]})
    >>> plot_ranked(causes).save("figure.svg")
    """
    series = series or next((name for name in (c.SERIES, c.GATE) if name in table), "")
    of, value = of or _first(table, _RANKED), value or _first(table, _RANKED_BY)
    names = [*([series] if series else []), of]
    if table.duplicated(names).any():
        table = table.sort_values(value, ascending=False, kind="stable").drop_duplicates(names)
        table.attrs.pop("name", None)  # these rows are no longer the table of that name
    # By what is drawn: the figure may show some rows of the table only.
    order = alt.EncodingSortField(field=value, op="max", order="descending")
    fields = [*([series] if series else []), of, f"{value}:Q"]
    bars = (
        alt.Chart(data(table))
        .mark_bar()
        .encode(
            x=alt.X(f"{value}:Q", title=label or heading(value), axis=alt.Axis(labelExpr=NUMBER)),
            y=alt.Y(f"{of}:N", title=None, sort=order, axis=_NAMES),
            tooltip=tooltip(*fields),
        )
    )
    rows = table[of].nunique()
    if series:
        known = series_names(table, series)
        bars = bars.encode(
            yOffset=alt.YOffset(f"{series}:N", sort=known),
            color=series_channels(known, series, among)["color"],
        ).transform_filter(alt.FieldOneOfPredicate(field=series, oneOf=known))
        rows *= max(1, len(known))  # a bar of each series, and room for it
    return finish(bars, height=max(22, 15 * rows))  # type: ignore[no-any-return]


def _first(table: pd.DataFrame, names: Sequence[str]) -> str:
    """Return the first of the names that the table has."""
    found = [name for name in names if name in table]
    if not found:
        msg = f"plot_ranked: the table has none of {', '.join(names)}; say which column is meant (of, value)"
        raise AnalysisError(msg)
    return found[0]


def plot_time_space(points: pd.DataFrame, *, clock: bool = False) -> Chart:
    """Draw the edges of a loop over time from `compute_time_space`, one line for each vehicle.

    Only the times at which the vehicle entered edges are known; the line between them is straight. With
    `clock`, times are times of day.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.plots import plot_time_space
    >>> points = pd.DataFrame({"vehicle": "v1", "lap": 0, "time_s": [0, 9], "position_m": [0.0, 70.0]})
    >>> plot_time_space(points.assign(edge=["a", "b"])).save("figure.svg")
    """
    lines = (
        alt.Chart()
        .transform_calculate(line=f"datum['{c.VEHICLE}'] + ' ' + datum['{c.LAP_NUMBER}']")
        .encode(
            x=alt.X(
                f"{c.TIME}:Q",
                title=_TIME_AXIS[clock],
                scale=alt.Scale(nice=False, zero=False),
                axis=_time_axis(points[c.TIME], clock=clock),
            ),
            y=alt.Y(f"{c.POSITION}:Q", title="place on the loop [m]"),
            color=alt.Color(f"{c.VEHICLE}:N", legend=None),
            detail="line:N",
        )
    )
    hover = tooltip(c.VEHICLE, f"{c.LAP_NUMBER}:Q", c.EDGE, f"{c.TIME}:Q", f"{c.POSITION}:Q")
    return finish(  # type: ignore[no-any-return]
        alt.layer(
            lines.mark_line(strokeWidth=1.3),
            lines.mark_point(size=30, opacity=0, filled=True).encode(tooltip=hover),
            data=data(points),
        ),
        height=300,
    )
