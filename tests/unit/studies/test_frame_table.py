"""Tables of several runs."""

from __future__ import annotations

import io

import pandas as pd
from frame_table import frame_table
from rich.console import Console


def test_a_table_shows_the_columns_asked_for_and_no_others() -> None:
    """Numbers are rounded to one decimal, whole ones stay whole, and what is missing is a dash."""
    frame = pd.DataFrame(
        {
            "gate": ["open", "collision"],
            "at_s": [None, 121.04],
            "runs": [20, 19],
            "clean": pd.array([None, 20], dtype="Int64"),
            "left out": ["x", "y"],
        }
    )
    out = io.StringIO()
    headings = {"gate": "gate", "at_s": "at [s]", "runs": "runs", "clean": "clean"}
    Console(file=out, width=80).print(frame_table(frame, headings, title="Runs"))
    lines = [line.split() for line in out.getvalue().splitlines() if line.strip()]
    assert lines[1] == ["gate", "at", "[s]", "runs", "clean"]
    assert lines[3:] == [["open", "-", "20", "-"], ["collision", "121.0", "19", "20"]]
