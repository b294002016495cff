"""Figures over runs as charts: their data and series, and how they become files."""

from __future__ import annotations

import base64
import functools
import json
from collections.abc import Callable, Sequence
from typing import Any, ParamSpec, TypeVar

import altair as alt
import numpy as np
import pandas as pd
import vl_convert
from altair.utils.schemapi import debug_mode

from loopgate.plots.style import DASHES, MAX_SERIES, SYMBOLS, config, series_order
from loopgate.results import columns as c

P = ParamSpec("P")
T = TypeVar("T")

_VEHICLES = "vehicles"


def plot_capacity(capacity: pd.DataFrame, *, series: str = "", among: Sequence[str] = ()) -> Chart:
    """Draw the number of vehicles with the greatest throughput, from `compute_capacity`.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_capacity
    >>> from loopgate.plots import plot_capacity
    >>> runs = pd.DataFrame({"gate": "open", "vehicles": [20, 40, 60], "km_per_h": [90.0, 150.0, 80.0]})
    >>> plot_capacity(compute_capacity(runs=runs)).save("figure.svg")
    """
    capacity, series = with_series(capacity, series)
    known = series_names(capacity, series)
    color = alt.Color(f"{series}:N", scale=alt.Scale(domain=list(among or known)), legend=None)
    base = alt.Chart().encode(y=alt.Y(f"{series}:N", sort=known, title=None, axis=alt.Axis(labelLimit=160)))
    base = base.encode(color=color).transform_filter(alt.FieldOneOfPredicate(field=series, oneOf=known))
    across = alt.X(f"{c.LOW}:Q", title=_VEHICLES, scale=alt.Scale(zero=True))
    at = alt.X(f"{c.CAPACITY}:Q", title=_VEHICLES)
    hover = tooltip(series, f"{c.CAPACITY}:Q", f"{c.LOW}:Q", f"{c.HIGH}:Q", f"{c.PEAK}:Q", c.AT_BORDER)
    far = base.transform_filter(f"datum.{c.AT_BORDER}")
    beyond = alt.condition(f"datum.{c.AT_BORDER}", alt.value("triangle-right"), alt.value("circle"))
    known_high = base.transform_filter(f"isValid(datum.{c.HIGH})")
    intervals = [known_high.mark_rule(strokeWidth=2).encode(x=across, x2=f"{c.HIGH}:Q")]
    return finish(  # type: ignore[no-any-return]
        alt.layer(
            *(intervals if capacity[c.HIGH].notna().any() else ()),  # a scale of no numbers is a warning
            base.mark_point(filled=True, size=70, opacity=1).encode(x=at, tooltip=hover, shape=beyond),
            far.transform_calculate(said=f"'> ' + datum.{c.CAPACITY} + ', not reached'")
            .mark_text(align="right", dx=-10)
            .encode(x=at, text="said:N"),
            data=data(capacity),
        ),
        height=30 + 26 * len(known),
    )


def plot_survival(survival: pd.DataFrame, *, series: str = "", among: Sequence[str] = ()) -> Chart:
    """Draw Kaplan-Meier curves from `compute_survival`, one panel for each number of vehicles.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_survival
    >>> from loopgate.plots import plot_survival
    >>> runs = pd.DataFrame({"gate": "open", "first_deadlock_s": [900, None], "observed_s": [900, 3600]})
    >>> plot_survival(compute_survival(runs=runs)).save("figure.svg")
    """
    survival, series = with_series(survival, series)
    known = series_names(survival, series)
    style = series_channels(known, series, among)
    chosen = alt.FieldOneOfPredicate(field=series, oneOf=known)
    base = alt.Chart().transform_filter(chosen).encode(x=alt.X(f"{c.AT}:Q", title="simulated time [s]"))
    share = alt.Y(
        f"{c.SURVIVAL}:Q",
        title="runs not yet locked up",
        scale=alt.Scale(domain=[0, 1]),
        axis=alt.Axis(format="%"),
    )
    band = base.mark_area(interpolate="step-after", opacity=0.15).encode(
        y=alt.Y(f"{c.LOW}:Q", title="runs not yet locked up"), y2=f"{c.HIGH}:Q", color=style["color"]
    )
    line = (
        with_dashes(base, series)
        .mark_line(interpolate="step-after", strokeWidth=2)
        .encode(y=share, color=style["color"], strokeDash=style["strokeDash"])
    )
    hover = tooltip(
        series, f"{c.AT}:Q", f"{c.AT_RISK}:Q", f"{c.DEADLOCKED}:Q", f"{c.CENSORED}:Q", f"{c.SURVIVAL}:Q"
    )
    points = base.mark_point(filled=True, size=30, opacity=1).encode(
        y=share, color=style["color"], shape=style["shape"], tooltip=hover
    )
    layers = alt.layer(band, line, points)
    if c.VEHICLES not in survival:
        return finish(layers.properties(data=data(survival)))  # type: ignore[no-any-return]
    order = [f"{count:g} {_VEHICLES}" for count in sorted(survival[c.VEHICLES].unique())]
    panels = (
        layers.properties(width=190, height=120)
        .facet(
            facet=alt.Facet("panel:N", title=None, sort=order),
            columns=2,
            data=data(survival),
        )
        .transform_calculate(panel=f"datum['{c.VEHICLES}'] + ' {_VEHICLES}'")
    )
    return finish(panels)  # type: ignore[no-any-return]


def plot_laps(laps: pd.DataFrame, *, series: str = "", among: Sequence[str] = ()) -> Chart:
    """Draw lap times as boxes (25 to 75 %) with whiskers (5 to 95 %), from `compute_lap_distribution`.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_lap_distribution
    >>> from loopgate.plots import plot_laps
    >>> quantiles = [60.0 + number for number in range(21)]
    >>> runs = pd.DataFrame({"gate": "open", "vehicles": 40, "laps": 120, "lap_quantiles_s": [quantiles]})
    >>> plot_laps(compute_lap_distribution(runs=runs)).save("figure.svg")
    """
    laps, series = with_series(laps, series)
    known = series_names(laps, series)
    style = series_channels(known, series, among)
    keys: list[Any] = [series, c.VEHICLES, c.LAPS]
    wide = (
        alt.Chart()
        .transform_filter(alt.FieldOneOfPredicate(field=series, oneOf=known))
        .transform_calculate(q=f"'q' + format(100 * datum['{c.QUANTILE}'], 'd')")
        .transform_pivot("q", value=c.LAP_TIME, groupby=keys)
        .encode(
            x=alt.X(f"{c.VEHICLES}:O", title=_VEHICLES, axis=alt.Axis(labelAngle=0)),
            xOffset=alt.XOffset(f"{series}:N", sort=known, scale=alt.Scale(paddingInner=0.25)),
            color=style["color"],
            tooltip=tooltip(*keys, *(f"q{n}:Q" for n in (5, 25, 50, 75, 95))),
        )
    )
    title = "lap time [s]"
    return finish(  # type: ignore[no-any-return]
        alt.layer(
            wide.mark_rule().encode(y=alt.Y("q5:Q", title=title), y2="q95:Q"),
            wide.mark_bar(size=9, opacity=0.45).encode(y=alt.Y("q25:Q", title=title), y2="q75:Q"),
            wide.mark_point(filled=True, size=45, opacity=1).encode(
                y=alt.Y("q50:Q", title=title), shape=style["shape"]
            ),
            data=data(laps),
        )
    )


Chart = alt.LayerChart | alt.FacetChart | alt.VConcatChart | alt.Chart

WIDTH, HEIGHT = 430, 250
DASHED = "dashed"
"""The column by which lines with markers are dashed."""
_LONG_NAME = 24

NUMBER = "format(datum.value, abs(datum.value) < 1 ? '~g' : '~s')"
"""The labels of an axis or a legend, as Vega writes it: 0.5, 20, 1.5k; by one format for all 0.5 was 500m."""


def records(table: pd.DataFrame) -> list[dict[str, Any]]:
    """Return the rows of a table as plain values for JSON; None for missing values."""
    columns = {name: _plain(table[name]) for name in map(str, table.columns)}
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def _plain(column: pd.Series) -> list[Any]:
    if pd.api.types.is_float_dtype(column):
        return [value if np.isfinite(value) else None for value in column.astype(float).tolist()]
    return [None if value is None or value is pd.NA else value for value in column.astype(object).tolist()]


class Rows(alt.InlineData):
    """The rows that a figure shows; nobody changes them, so that all copies of a chart share them."""

    def __deepcopy__(self, _: object) -> Rows:
        return self


def data(table: pd.DataFrame) -> Rows:
    """Return a table as the data of a figure; the report gives tables names, and keeps each once."""
    return Rows(values=records(table), name=table.attrs.get("name", alt.Undefined))


def unchecked(plot: Callable[P, T]) -> Callable[P, T]:
    """Decorate a function that makes a figure: no part of it is checked against Vega-Lite's schema.

    Altair would check each part when it is made, which takes longer than drawing; tests check whole figures.
    """

    @functools.wraps(plot)
    def drawn(*args: P.args, **kwargs: P.kwargs) -> T:
        with debug_mode(arg=False):
            return plot(*args, **kwargs)

    return drawn


def with_series(table: pd.DataFrame, series: str = "") -> tuple[pd.DataFrame, str]:
    """Return the table and its column with the names of series; `series`, where the caller named one.

    A table that tells no series apart has one.
    """
    series = series or next((name for name in (c.SERIES, c.GATE) if name in table), "")
    return (table, series) if series else (table.assign(**{c.SERIES: ""}), c.SERIES)


def series_names(table: pd.DataFrame, series: str) -> list[str]:
    """Return the series of a table that a figure shows: as many as a reader can distinguish."""
    return series_order(table[series])[:MAX_SERIES]


def series_channels(
    names: Sequence[str], series: str, among: Sequence[str] = (), *, lines: bool = False
) -> dict[str, Any]:
    """Return the encodings by colour, marker and dash.

    A series looks the same in all figures that know `among` which it is. The legend shows markers, or the
    dashes of `lines` that have no markers: a marker with a dashed edge looks torn.
    """
    columns = 1 if max(map(len, names), default=0) > _LONG_NAME else 3
    look: dict[str, Any] = {"symbolType": "stroke", "symbolSize": 400} if lines else {}
    legend = alt.Legend(title=None, orient="bottom", columns=columns, values=list(names), **look)
    alone: Any = None if len(names) == 1 else legend
    domain = list(among or names)[:MAX_SERIES]
    shapes, dashes = list(SYMBOLS[: len(domain)]), [list(dash) for dash in DASHES[: len(domain)]]
    field = f"{series}:N"
    rest: dict[str, Any] = {"legend": alone, "sort": None}
    color = alt.Color(field, scale=alt.Scale(domain=domain), **rest)
    if lines:
        dashed = alt.StrokeDash(field, scale=alt.Scale(domain=domain, range=dashes), **rest)
        return {"color": color, "strokeDash": dashed}
    own = alt.Scale(domain=[f"{name} " for name in domain], range=dashes)
    return {
        "color": color,
        "shape": alt.Shape(field, scale=alt.Scale(domain=domain, range=shapes), **rest),
        "strokeDash": alt.StrokeDash(f"{DASHED}:N", scale=own, legend=None, sort=None),
    }


def with_dashes(chart: alt.Chart, series: str) -> alt.Chart:
    """Return the chart with a second column of series names for dashes, so that legends stay apart."""
    return chart.transform_calculate(as_=DASHED, calculate=f"datum['{series}'] + ' '")


def tooltip(*fields: str) -> list[alt.Tooltip]:
    """Return the tooltip of a point."""
    return [
        alt.Tooltip(field=field, type="quantitative", format=",.4~r")
        if kind == "Q"
        else alt.Tooltip(field=field)
        for field, _, kind in (field.partition(":") for field in fields)
    ]


def finish(chart: Any, **sizes: Any) -> Any:  # noqa: ANN401 - Altair's own chart types
    """Return the chart with its size and the look of all figures."""
    if isinstance(chart, alt.LayerChart | alt.Chart):
        sizes = {"width": WIDTH, "height": HEIGHT, **sizes}
    return chart.properties(**sizes).configure(**config())


def figure_svg(figure: Chart) -> str:
    """Return a figure as SVG text.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_mean
    >>> from loopgate.plots import figure_svg, plot_mean
    >>> runs = pd.DataFrame({"gate": "open", "vehicles": [20, 40], "km_per_h": [90.0, 150.0]})
    >>> figure_svg(plot_mean(compute_mean(runs=runs))).endswith("</svg>")
    True
    """
    return spec_svg(figure_spec(figure))


def figure_spec(figure: Chart) -> dict[str, Any]:
    """Return a figure as Vega-Lite.

    Altair would check each against the schema, which takes longer than drawing it; tests do.
    """
    return dict(figure.to_dict(validate=False))


def spec_svg(spec: dict[str, Any]) -> str:
    """Return a figure that is Vega-Lite already as SVG."""
    svg: str = vl_convert.vegalite_to_svg(json.dumps(spec))
    return svg


def figure_image(figure: Chart, label: str) -> str:
    """Return a figure as an element of a page that holds it whole."""
    coded = base64.b64encode(figure_svg(figure).encode()).decode()
    return f'<img alt="{label}" src="data:image/svg+xml;base64,{coded}">'
