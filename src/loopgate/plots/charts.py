"""The common parts of all figures: their data, their series, and how they become files."""

import base64
import json
from collections.abc import Sequence
from typing import Any

import altair as alt
import numpy as np
import pandas as pd
import vl_convert

from loopgate.plots.style import DASHES, MAX_SERIES, SYMBOLS, config, series_order

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


def data(table: pd.DataFrame) -> alt.InlineData:
    """Return a table as the data of a figure; the report gives tables names, and keeps each once."""
    return alt.InlineData(values=records(table), name=table.attrs.get("name", alt.Undefined))


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
    """Return a Matplotlib figure as SVG text.

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
