"""The road network, each edge as broad and strong as its figure is great."""

from collections.abc import Collection

import altair as alt
import numpy as np
import pandas as pd

from loopgate.plots.charts import NUMBER, Chart, Rows, finish, with_series
from loopgate.plots.style import series_order
from loopgate.results import columns as c
from loopgate.results.headings import heading

_SHIFT = 0.006  # of the extent: both directions of a road stay apart
_MARGIN = 0.03  # of the extent
_MAPS = 4
_WIDTH = 230
_MANY = 150
"""So many edges are drawn half as broad."""
_BARE = "#0072B2"
_BLOCKED = "#1A1A1A"


def plot_edges(
    edges: pd.DataFrame,
    value: str = "",
    *,
    label: str = "",
    series: str = "",
    blocked: Collection[str] = (),
) -> Chart:
    """Draw a map of the road network for each series; edges with greater figures are drawn wider.

    An edge without a value is thin, dashed and blue. An edge that was closed or blocked for a time is black
    and dashed.

    Parameters
    ----------
    edges
        From `compute_edge_means`: column `value`, and `SHAPE` ("x,y x,y ..." [m]).
    value, label
        The column to draw, and the label of the scale; default: ``stood_s``, or else ``idleness_s``.
    series
        The column with the name of the series; default: ``series``, or ``gate`` without such a column. At
        most four series are drawn, on one scale.
    blocked
        The edges that were closed or blocked for a time.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.plots import plot_edges
    >>> edges = pd.DataFrame({"gate": "open", "shape": ["0,0 80,0", "80,0 80,60"], "idleness_s": [20, 90]})
    >>> plot_edges(edges, "idleness_s", label="idleness [s]").save("map.svg")
    """
    value = value or (c.STOOD if c.STOOD in edges else c.IDLENESS)
    edges, series = with_series(edges, series)
    above = edges[edges[value] > 0]
    names = series_order((above if len(above) else edges)[series])[:_MAPS]
    drawn = edges[edges[series].isin(names)].sort_values(value, kind="stable", na_position="first")
    shapes = {str(text): points(str(text)) for text in drawn[c.SHAPE].unique()}
    every = np.concatenate(list(shapes.values())) if shapes else np.zeros((1, 2))
    extent = np.maximum(np.ptp(every, axis=0), 1.0)
    lines = {text: beside(line, _SHIFT * float(extent.max())).round(1) for text, line in shapes.items()}
    wide, high = (extent + 2 * _MARGIN * extent.max()).tolist()
    west, north = (
        every.min(axis=0)[0] - _MARGIN * extent.max(),
        every.max(axis=0)[1] + _MARGIN * extent.max(),
    )
    scale = _WIDTH / wide
    rows = [
        {
            "type": "Feature",
            "geometry": {"type": "LineString", "coordinates": lines[str(row[c.SHAPE])].tolist()},
            "series": str(row[series]),
            "street": str(row.get(c.STREET) or ""),
            "edge": str(row.get(c.EDGE, number)),
            "value": None if pd.isna(row[value]) else round(float(row[value]), 2),
            "blocked": row.get(c.EDGE) in blocked,
        }
        for number, row in enumerate(drawn.to_dict("records"))
    ]
    # The name first, where the network has names; the id is what the other tables have.
    named = ["street:N", "edge:N"] if any(row["street"] for row in rows) else ["edge:N"]
    domain = [0.0, float(np.nan_to_num(drawn[value].max())) or 1.0]
    legend = alt.Legend(
        title=label or heading(value),
        orient="bottom",
        symbolType="stroke",
        labelExpr=NUMBER,
        tickCount=4,
        titleLimit=0,
    )
    broadest = 6.0 if len(shapes) <= _MANY else 3.5
    flat = {
        "type": "identity",
        "reflectY": True,
        "scale": scale,
        "translate": [-west * scale, north * scale],
    }
    chart = (
        alt.Chart()
        .mark_geoshape(filled=False, clip=False, strokeCap="round", strokeJoin="round")
        .project(**flat)
        .encode(
            strokeWidth=alt.StrokeWidth(
                "value:Q", scale=alt.Scale(domain=domain, range=[0.8, broadest]), legend=legend
            ),
            strokeOpacity=alt.StrokeOpacity(
                "value:Q", scale=alt.Scale(domain=domain, range=[0.3, 1]), legend=legend
            ),
            tooltip=[*named, alt.Tooltip("value:Q", format=",.4~r", title=label or heading(value))],
        )
    )
    if drawn[value].isna().any():
        bare = alt.Chart().mark_geoshape(filled=False, stroke=_BARE, strokeWidth=1.2, strokeDash=[3, 2])
        chart = alt.layer(
            chart.transform_filter("isValid(datum.value)"),
            bare.transform_filter("!isValid(datum.value)").project(**flat).encode(tooltip=named),
        )
    if any(row["blocked"] for row in rows):
        shut = alt.Chart().mark_geoshape(filled=False, stroke=_BLOCKED, strokeWidth=2.0, strokeDash=[4, 3])
        chart = alt.layer(chart, shut.transform_filter("datum.blocked").project(**flat).encode(tooltip=named))
    panel = chart.properties(width=_WIDTH, height=int(_WIDTH * max(high / wide, 0.2)))
    return finish(  # type: ignore[no-any-return]
        panel.facet(
            facet=alt.Facet("series:N", title=None, sort=names),
            columns=min(len(names), 2) or 1,
            data=Rows(values=rows),
        ),
        usermeta={"map": wide},
    )


def points(text: str) -> np.ndarray:
    """Return the points of a shape as tables keep it, ``x,y x,y ...`` [m]."""
    return np.array([[float(v) for v in pair.split(",")[:2]] for pair in text.split()], dtype=float)


def beside(line: np.ndarray, distance: float) -> np.ndarray:
    """Return a line shifted to its right, the side on which its traffic drives."""
    along = np.gradient(line, axis=0) if len(line) > 1 else np.zeros_like(line)
    length = np.maximum(np.hypot(along[:, 0], along[:, 1]), 1e-9)[:, None]
    moved: np.ndarray = line + distance * np.column_stack((along[:, 1], -along[:, 0])) / length
    return moved
