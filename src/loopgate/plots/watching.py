"""Figures of a watched district: the map of its streets, and how soon they were seen again."""

from collections.abc import Mapping

import altair as alt
import pandas as pd

from loopgate.plots.charts import Chart, data, finish, series_channels, series_names, tooltip
from loopgate.plots.road_map import plot_edges
from loopgate.results import columns as c

_SERIES = "series"


def plot_unwatched(
    streets: pd.DataFrame, value: str = c.WORST_IDLENESS, *, label: str = "longest time unseen [s]"
) -> Chart:
    """Draw a map of streets by idleness: darker if idle longer, dashed if never visited.

    Parameters
    ----------
    streets
        ``streets.parquet``: `SHAPE` ("x,y x,y ..." [m]), `VISITS` and column `value`.
    value, label
        The column to draw, and the label of the colour scale.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.plots import plot_unwatched
    >>> shapes = ["0,0 80,0", "80,0 80,60", "80,60 0,0"]
    >>> streets = pd.DataFrame({"shape": shapes, "visits": [9, 2, 0], "worst_idleness_s": [60, 300, 3600]})
    >>> plot_unwatched(streets).save("unwatched.svg")
    """
    seen = streets[c.VISITS] > 0
    title = f"seen: {seen.sum()} of {len(seen)}" + (", dashed: never" if not seen.all() else "")
    told = streets.assign(**{_SERIES: title})
    told[value] = streets[value].where(seen)
    return plot_edges(told, value, label=label, series=_SERIES)


def plot_seen_within(
    seen: pd.DataFrame | Mapping[str, pd.DataFrame], *, bound_s: float | None = None
) -> Chart:
    """Draw the share of streets visited within a time: at a random moment, and always.

    Parameters
    ----------
    seen
        Table from `compute_seen_within`, or several by the names of their series.
    bound_s
        Longest allowed time between visits [s], drawn as a line.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_seen_within
    >>> from loopgate.plots import plot_seen_within
    >>> rows = [(25, "v1", "edge", "e1"), (50, "v2", "edge", "e1"), (75, "v1", "edge", "e1")]
    >>> events = pd.DataFrame(rows, columns=["time_s", "vehicle", "event", "place"])
    >>> table = compute_seen_within(events=events, streets=["e1", "e2"], end_s=100)
    >>> plot_seen_within(table, bound_s=60).save("seen.svg")
    """
    parts = [
        pd.DataFrame({"x": table[c.SEEN_WITHIN], "y": table[column], _SERIES: f"{name} {how}".strip()})
        for name, table in ({"": seen} if isinstance(seen, pd.DataFrame) else seen).items()
        for column, how in ((c.NOW, "on average over time"), (c.ALWAYS, "always"))
    ]
    rows = pd.concat(parts, ignore_index=True) if parts else pd.DataFrame(columns=["x", "y", _SERIES])
    channels = series_channels(series_names(rows, _SERIES), _SERIES, lines=True)
    lines = (
        alt.Chart(data(rows))
        .mark_line()
        .encode(
            x=alt.X("x:Q", title="seen within [s]"),
            y=alt.Y(
                "y:Q", title="share of streets", scale=alt.Scale(domain=[0, 1]), axis=alt.Axis(format="%")
            ),
            tooltip=tooltip(_SERIES, "x:Q", "y:Q"),
            **channels,
        )
    )
    if bound_s is None:
        return finish(alt.layer(lines))  # type: ignore[no-any-return]
    mark = alt.Chart(alt.InlineData(values=[{"x": bound_s}])).mark_rule().encode(x="x:Q")
    return finish(alt.layer(mark, lines))  # type: ignore[no-any-return]
