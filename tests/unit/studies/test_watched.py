"""The study of how often streets are seen: its tables, from rows made up by hand."""

from __future__ import annotations

import re

import pandas as pd
import watched

from loopgate.results import columns as c
from loopgate.results.row_schema import ROW_SCHEMA


def rows(**figures: object) -> pd.DataFrame:
    """Return one row of a run, with these figures and no others."""
    known = dict.fromkeys(ROW_SCHEMA.names) | {c.STATUS: c.STATUS_OK, c.AUDIT: "clean", c.KEPT: True}
    zero = dict.fromkeys((c.DEADLOCKS, c.COLLISIONS, c.NEVER_SEEN, c.HEADWAY_CV, c.BUNCHED, c.KM_PER_H), 0)
    return pd.DataFrame([known | zero | {c.LONGEST_WAIT: 3.0} | figures])


def test_every_table_has_a_name_of_its_own() -> None:
    """It is that of its folder, so no table takes another's runs."""
    names = [cell.name for cell in watched.cells(["my.net.xml"])]
    assert len(names) == len(set(names))
    assert {"DRT-covering-40", "DRT-covering-300-traffic", "my-covering-80"} <= set(names)


def test_what_was_measured_stands_beside_what_evenness_would_reach() -> None:
    """60 s where 50 s could be, at worst 300 s where 200 s could be; nothing is said of rules not run."""
    cell = watched.Cell("sumo:DRT", "covering", 40)
    figures = {c.IDLENESS: 60.0, c.IF_EVEN: 50.0, c.WORST_IDLENESS: 300.0, c.WORST_IF_EVEN: 200.0}
    runs = rows(**figures, **{watched.RULE: "loopgate, hold"})
    (row,) = watched.table(cell, runs).to_dict("records")
    assert (row["over even"], row["worst over even"]) == ("+20%", "+50%")
    assert (row["idleness [s]"], row["clean"]) == ("60.0", "1 of 1")


def test_rules_of_a_table_differ() -> None:
    """SUMO's own on the grid are four networks; among other traffic lights are obeyed."""
    grid = dict(watched.Cell(watched.GRID, "covering", 40).rules())
    assert len({rule["network"] for name, rule in grid.items() if name.startswith("SUMO")}) == 4
    among = dict(watched.Cell("sumo:DRT", "covering", 40, traffic=True).rules())
    assert among["loopgate, hold"] == {"spacing": "hold", "lights": "obey"}


def test_only_tables_that_were_made_are_renewed() -> None:
    """The first is, for more seeds; the second stays; a third comes after them."""
    tables = "**a**, 1 seeds\n\nold\n\n**b**, 2 seeds\n\nkept"
    page = f"Text.\n<!-- watched: begin -->\n{tables}\n<!-- watched: end -->\n"
    assert watched.renewed(page, ["**c**, 1 seeds\n\nnew", "**a**, 5 seeds\n\nbetter"]) == (
        "**a**, 5 seeds\n\nbetter\n\n**b**, 2 seeds\n\nkept\n\n**c**, 1 seeds\n\nnew"
    )


def test_the_page_shows_a_row_of_each_table_that_the_file_of_tables_holds() -> None:
    """The best of SUMO's own rules stands for them."""
    tables, page = (file.read_text(encoding="utf-8") for file in (watched.TABLES, watched.PAGE))
    marks = "<!-- watched: begin -->\n", "\n<!-- watched: end -->"
    every = tables.partition(marks[0])[2].partition(marks[1])[0]
    assert watched.overview(every).join(marks) in page
    known = re.findall(r"^\*\*(.*)\*\*, (?:[3-9]|\d\d+) seeds", every, re.MULTILINE)
    there = [what for what in known if re.search(watched.ON_PAGE, what)]
    assert watched.overview(every).count("\n") - 1 == len(there) >= 8
    grid = next(line for line in page.splitlines() if line.startswith("| grid5-priority, 40"))
    assert " 25.3 ± 3.2 " in grid  # right before left; by priority it is 27.0
