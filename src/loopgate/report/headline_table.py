"""The table that comes first: throughput by vehicles and rule, with intervals."""

from pathlib import Path

import pandas as pd

from loopgate.analysis import columns as a
from loopgate.analysis.columns import SERIES
from loopgate.plots.style import series_order
from loopgate.report.headline import DASH, number
from loopgate.report.tables import Cells, latex_text
from loopgate.results import row_columns as c

_OF_ONE = "Throughput [vehicle-km/h]"
_OF_MEANS = f"{_OF_ONE}: mean over runs"
_WITH_INTERVALS = f"{_OF_MEANS}, in brackets its 95 % interval (Student's t)"


def caption(means: pd.DataFrame) -> str:
    """Return the caption of a table of means; it explains brackets only if there are any."""
    if means[a.LOW].notna().any():
        return _WITH_INTERVALS
    return _OF_MEANS if (means[a.RUNS] > 1).any() else _OF_ONE


def headline_table(means: pd.DataFrame) -> Cells:
    """Return vehicles against rules from `compute_mean` by series and vehicles: headings and rows as text."""
    names = series_order(means[SERIES])
    by = means.set_index([c.VEHICLES, SERIES])
    counts = sorted(means[c.VEHICLES].unique())
    rows = [
        [
            f"{count:g}",
            *(_cell(by.loc[(count, name)]) if (count, name) in by.index else DASH for name in names),
        ]
        for count in counts
    ]
    return ["vehicles", *names], rows


def _cell(row: pd.Series) -> str:
    mean = number(float(row[a.MEAN]))
    if pd.isna(row[a.LOW]):
        return mean
    return f"{mean} ({number(float(row[a.LOW]))} to {number(float(row[a.HIGH]))})"


def write_headline(headings: list[str], rows: list[list[str]], said: str, file: Path) -> None:
    """Write the table for a paper that loads the package booktabs, with `said` as its caption."""
    text = latex_text(pd.DataFrame(rows, columns=headings), [True] * len(headings), said, file.stem)
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8")
