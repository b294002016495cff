"""The table that comes first: throughput by vehicles and rule, with intervals."""

from pathlib import Path

import pandas as pd

from loopgate.analysis import columns as a
from loopgate.analysis.columns import SERIES
from loopgate.plots.style import series_order
from loopgate.report.headline import DASH, number
from loopgate.report.tables import Cells, latex_text
from loopgate.results import row_columns as c

CAPTION = "Throughput [vehicle-km/h]: mean over runs, in brackets its 95 % interval (Student's t)"


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


def write_headline(headings: list[str], rows: list[list[str]], file: Path) -> None:
    """Write the table for a paper that loads the package booktabs."""
    text = latex_text(pd.DataFrame(rows, columns=headings), [True] * len(headings), CAPTION, file.stem)
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8")
