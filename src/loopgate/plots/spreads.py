"""Capacity, survival and lap times of a sweep: figures that are no lines over vehicles."""

from collections.abc import Sequence
from typing import Any

import altair as alt
import pandas as pd

from loopgate.analysis import columns as a
from loopgate.plots.charts import Chart, data, finish, series_channels, series_names, tooltip, with_dashes
from loopgate.results import row_columns as c

_VEHICLES = "vehicles"


def plot_capacity(capacity: pd.DataFrame, *, series: str = c.GATE, among: Sequence[str] = ()) -> Chart:
    """Draw the number of vehicles with the greatest throughput, from `compute_capacity`.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_capacity
    >>> from loopgate.plots import plot_capacity
    >>> runs = pd.DataFrame({"gate": "open", "vehicles": [20, 40, 60], "km_per_h": [90.0, 150.0, 80.0]})
    >>> plot_capacity(compute_capacity(runs=runs)).save("figure.svg")
    """
    known = series_names(capacity, series)
    color = alt.Color(f"{series}:N", scale=alt.Scale(domain=list(among or known)), legend=None)
    base = alt.Chart().encode(y=alt.Y(f"{series}:N", sort=known, title=None, axis=alt.Axis(labelLimit=160)))
    base = base.encode(color=color).transform_filter(alt.FieldOneOfPredicate(field=series, oneOf=known))
    across = alt.X(f"{a.LOW}:Q", title=_VEHICLES, scale=alt.Scale(zero=True))
    at = alt.X(f"{a.CAPACITY}:Q", title=_VEHICLES)
    hover = tooltip(series, f"{a.CAPACITY}:Q", f"{a.LOW}:Q", f"{a.HIGH}:Q", f"{a.PEAK}:Q", a.AT_BORDER)
    far = base.transform_filter(f"datum.{a.AT_BORDER}")
    beyond = alt.condition(f"datum.{a.AT_BORDER}", alt.value("triangle-right"), alt.value("circle"))
    known_high = base.transform_filter(f"isValid(datum.{a.HIGH})")
    intervals = [known_high.mark_rule(strokeWidth=2).encode(x=across, x2=f"{a.HIGH}:Q")]
    return finish(  # type: ignore[no-any-return]
        alt.layer(
            *(intervals if capacity[a.HIGH].notna().any() else ()),  # a scale of no numbers is a warning
            base.mark_point(filled=True, size=70, opacity=1).encode(x=at, tooltip=hover, shape=beyond),
            far.transform_calculate(said=f"'> ' + datum.{a.CAPACITY} + ', not reached'")
            .mark_text(align="right", dx=-10)
            .encode(x=at, text="said:N"),
            data=data(capacity),
        ),
        height=30 + 26 * len(known),
    )


def plot_survival(survival: pd.DataFrame, *, series: str = c.GATE, among: Sequence[str] = ()) -> Chart:
    """Draw Kaplan-Meier curves from `compute_survival`, one panel for each number of vehicles.

    Examples
    --------
    >>> import pandas as pd
    >>> from loopgate.analysis import compute_survival
    >>> from loopgate.plots import plot_survival
    >>> runs = pd.DataFrame({"gate": "open", "first_deadlock_s": [900, None], "observed_s": [900, 3600]})
    >>> plot_survival(compute_survival(runs=runs)).save("figure.svg")
    """
    known = series_names(survival, series)
    style = series_channels(known, series, among)
    chosen = alt.FieldOneOfPredicate(field=series, oneOf=known)
    base = alt.Chart().transform_filter(chosen).encode(x=alt.X(f"{a.AT}:Q", title="simulated time [s]"))
    share = alt.Y(
        f"{a.SURVIVAL}:Q",
        title="runs not yet locked up",
        scale=alt.Scale(domain=[0, 1]),
        axis=alt.Axis(format="%"),
    )
    band = base.mark_area(interpolate="step-after", opacity=0.15).encode(
        y=alt.Y(f"{a.LOW}:Q", title="runs not yet locked up"), y2=f"{a.HIGH}:Q", color=style["color"]
    )
    line = (
        with_dashes(base, series)
        .mark_line(interpolate="step-after", strokeWidth=2)
        .encode(y=share, color=style["color"], strokeDash=style["strokeDash"])
    )
    hover = tooltip(
        series, f"{a.AT}:Q", f"{a.AT_RISK}:Q", f"{a.DEADLOCKED}:Q", f"{a.CENSORED}:Q", f"{a.SURVIVAL}:Q"
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


def plot_laps(laps: pd.DataFrame, *, series: str = c.GATE, among: Sequence[str] = ()) -> Chart:
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
    known = series_names(laps, series)
    style = series_channels(known, series, among)
    keys: list[Any] = [series, c.VEHICLES, c.LAPS]
    wide = (
        alt.Chart()
        .transform_filter(alt.FieldOneOfPredicate(field=series, oneOf=known))
        .transform_calculate(q=f"'q' + format(100 * datum['{a.QUANTILE}'], 'd')")
        .transform_pivot("q", value=a.LAP_TIME, groupby=keys)
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
