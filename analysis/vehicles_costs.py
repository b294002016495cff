"""What range, loss and delay cost vehicles that decide by messages: a table of runs, and a figure of each.

    python analysis/vehicles_costs.py                                # draw the figures from the table
    python analysis/vehicles_costs.py --rows out/vehicles/costs-1-*.csv    # write the table first

The rows come from ``python analysis/vehicles_roads.py --part costs``. The table is
``analysis/tables/vehicles-costs.md``, the figures are ``docs/images/vehicles-loss.svg``, ``-delay.svg`` and
``-range.svg``.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import altair as alt
import pandas as pd

from loopgate.plots.charts import data, figure_svg, finish
from loopgate.plots.style import LIGHT

ROOT = Path(__file__).resolve().parent.parent
TABLE = ROOT / "analysis" / "tables" / "vehicles-costs.md"
IMAGES = ROOT / "docs" / "images"
USUAL = {"loss": 0.0, "delay": 0.1, "range": 150.0}
"""What the other two are while one of them grows."""
AXES = {
    "loss": "transmissions lost",
    "delay": "mean delay of a transmission [s]",
    "range": "range of a transmission [m]",
}
COLUMNS = ("loss", "delay", "range", "seeds", "of central", "least", "most", "messages a move", "given back")
WIDTH, HEIGHT = 290, 190
BLUE, ORANGE = LIGHT["s1"], LIGHT["s2"]


def collected(files: list[Path]) -> str:
    """Return the table of these rows, in Markdown: means of the seeds for each setting."""
    runs = pd.concat([pd.read_csv(file) for file in files])
    runs = runs[runs["part"].eq("costs")].drop_duplicates(["seed", "decide"])
    runs = runs[runs["decide"].ne("central")]
    wrong = runs[["collisions", "deadlocks", "unsafe"]].to_numpy().sum() + (~runs["clean"]).sum()
    for name, usual in USUAL.items():
        found = runs["decide"].str.extract(rf"{name}=([0-9.]+)", expand=False)
        runs[name] = found.astype(float).fillna(usual)
    first = runs.iloc[0]
    how = f"{first['vehicles']} vehicles on the five-by-five grid, {first['duration_s']:g} s"
    lines = [
        "# What range, loss and delay cost",
        "",
        f"`python analysis/vehicles_roads.py --part costs`: {how}, means of the first seeds, and",
        f"least and most of them. Collisions, deadlocks, unsafe grants and runs with faults in all: {wrong}.",
        "",
        "| " + " | ".join(COLUMNS) + " |",
        "|" + "---|" * len(COLUMNS),
    ]
    for (loss, delay, far), some in runs.groupby(["loss", "delay", "range"]):
        share = some["of_central"]
        cells: list[object] = [f"{loss:g}", f"{delay:g}", f"{far:g}", len(some)]
        cells += [f"{value:.3f}" for value in (share.mean(), share.min(), share.max())]
        cells += [f"{some['per_move'].mean():.2f}", f"{some['given_back'].mean():.0f}"]
        lines.append("| " + " | ".join(map(str, cells)) + " |")
    return "\n".join(lines) + "\n"


def read() -> pd.DataFrame:
    """Return the table as it is kept."""
    lines = [line for line in TABLE.read_text(encoding="utf-8").splitlines() if line.startswith("|")]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    return pd.DataFrame(rows[2:], columns=rows[0]).astype(float)


def drawn(name: str) -> str:
    """Return the figure of what grows by this name, as SVG."""
    table = read()
    top = float(table["messages a move"].max()) * 1.05
    for other, usual in USUAL.items():
        table = table[table[other].eq(usual)] if other != name else table
    table = table.sort_values(name).rename(columns={"of central": "share", "messages a move": "messages"})
    values = list(map(float, table[name]))
    axis = alt.Axis(values=values, format="%" if name == "loss" else "~g", labelOverlap=False)
    scale = alt.Scale(type="log", domain=[20, 160], nice=False) if name == "range" else alt.Scale(zero=True)
    x = alt.X(f"{name}:Q", title=AXES[name], axis=axis, scale=scale)
    base = alt.Chart(data(table[[name, "share", "least", "most", "messages"]]))
    percent = alt.Axis(format="%", values=[0, 0.2, 0.4, 0.6, 0.8, 1], labelOverlap=False)
    share, least = (
        alt.Y(f"{of}:Q", title="distance, of central", scale=alt.Scale(domain=[0, 1.1]), axis=percent)
        for of in ("share", "least")
    )
    left = alt.layer(
        base.mark_area(opacity=0.18, color=BLUE).encode(x=x, y=least, y2="most:Q"),
        base.mark_line(color=BLUE, point=_marks("circle", BLUE)).encode(x=x, y=share),
    ).properties(width=WIDTH, height=HEIGHT)
    y = alt.Y("messages:Q", title="messages a move", scale=alt.Scale(domain=[0, top]))
    right = base.mark_line(color=ORANGE, point=_marks("square", ORANGE)).encode(x=x, y=y)
    both = alt.hconcat(left, right.properties(width=WIDTH, height=HEIGHT), spacing=40)
    return figure_svg(finish(both))


def _marks(shape: str, color: str) -> alt.OverlayMarkDef:
    return alt.OverlayMarkDef(size=45, filled=True, shape=shape, color=color)


def main() -> None:
    """Write the table, if rows are given, and draw the figures."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rows", nargs="+", type=Path, default=[], help="CSV files of vehicles_roads.py")
    options = parser.parse_args()
    if options.rows:
        TABLE.write_text(collected(options.rows), encoding="utf-8")
    for name in AXES:
        (IMAGES / f"vehicles-{name}.svg").write_text(drawn(name), encoding="utf-8")


if __name__ == "__main__":
    main()
