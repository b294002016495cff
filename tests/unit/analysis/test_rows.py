"""What a row keeps of a run."""

from __future__ import annotations

from typing import Any

import pandas as pd
import pyarrow as pa

from loopgate.analysis.rows import run_row
from loopgate.results.columns import EDGE_COLUMNS
from loopgate.results.row_schema import ROW_SCHEMA

SUMMARY = {"vehicles": 3, "loops": 1, "duration_s": 3600.0, "laps": 3, "distance_km": 1.0}


def row(laps: list[tuple[float, str]], **summary: object) -> dict[str, Any]:
    """Return the row for three vehicles, an hour and 300 s of warm-up."""
    events = pd.DataFrame(
        [(time, vehicle, "lap", "loop1") for time, vehicle in laps],
        columns=["time_s", "vehicle", "event", "place"],
    )
    made = run_row(
        scenario={"duration_s": 3600.0, "warmup_s": 300.0},
        summary=SUMMARY | summary,
        events=events,
        edges=pd.DataFrame(columns=list(EDGE_COLUMNS)),
    )
    return made.row


def lapless(laps: list[tuple[float, str]], *, loops: int = 1) -> object:
    """Return how many of these had no lap."""
    return row(laps, loops=loops)["lapless_vehicles"]


def test_who_has_no_lap_in_the_last_half_hour() -> None:
    """From 2100 s to 3900 s: a lap before that does not count, two of one vehicle count once."""
    assert lapless([(2000.0, "v1"), (2200.0, "v2"), (3000.0, "v2")]) == 2
    assert lapless([(2200.0, "v1"), (2200.0, "v2"), (3900.0, "v3")]) == 0
    assert lapless([]) == 3


def test_without_loops_there_are_no_laps_to_miss() -> None:
    """Trips of a configuration run as it is."""
    assert lapless([], loops=0) is None


def test_figures_of_trips_and_red_lights_are_columns() -> None:
    """Under the names of the summary; missing where there are none."""
    names = [f"mean_{name}_s" for name in ("time_loss", "depart_delay", "delay", "waiting", "trip")]
    said: dict[str, object] = {name: number + 0.5 for number, name in enumerate(names)}
    made = row([], **said, at_lights={"grants": 9, "on_red": 2})
    table = pa.Table.from_pylist([made, row([])], schema=ROW_SCHEMA)
    assert table.select([*names, "on_red"]).to_pylist() == [
        {**said, "on_red": 2},
        dict.fromkeys([*names, "on_red"]),
    ]
