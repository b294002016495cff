"""What was seen of a district, against cases worked out by hand."""

import math

import pandas as pd
import pytest

from loopgate.analysis.watching import compute_watch, watch_figures
from loopgate.results.columns import EVENT_COLUMNS


def visits(**times: list[float]) -> pd.DataFrame:
    rows = [(at, "v", "edge", street, "") for street, found in times.items() for at in found]
    return pd.DataFrame(rows, columns=list(EVENT_COLUMNS[:5]))


def test_a_street_on_no_loop_is_never_seen() -> None:
    """It is idle for as long as the run lasts: 10 s at the end, 5 s on average; and it comes first."""
    table = compute_watch(events=visits(a=[2, 6]), streets=["a", "b"], end_s=10, bound_s=math.inf)
    assert table["edge"].tolist() == ["b", "a"]
    first = table.iloc[0]
    assert (first["visits"], first["idleness_s"], first["worst_idleness_s"]) == (0, 5.0, 10.0)
    figures = watch_figures(table, bound_s=math.inf)
    assert (figures["streets"], figures["never_seen"]) == (2, 1)
    assert figures["worst_idleness_of_seen_s"] == 4.0
    assert [row["edge"] for row in figures["rarest"]] == ["a"]
    assert "within" not in figures


def test_share_of_time_under_a_bound() -> None:
    """Visits at 2 and 6 of 10 s, bound 3 s: over from 5 to 6 and from 9 on; never seen: from 3 on."""
    table = compute_watch(events=visits(a=[2, 6]), streets=["a", "b"], end_s=10, bound_s=3).set_index("edge")
    assert table["within"].to_dict() == pytest.approx({"a": 0.8, "b": 0.3})
    figures = watch_figures(table.reset_index(), bound_s=3)
    assert (figures["within"], figures["within_of_seen"], figures["streets_over"]) == (0.55, 0.8, 1)


def test_what_lay_over_the_bound_before_the_period_does_not_count() -> None:
    """Visits at 1 and 8 s, bound 3 s, from 6 s on: over it from 6 to 8 of 4 s."""
    table = compute_watch(events=visits(a=[1, 8]), streets=["a"], begin_s=6, end_s=10, bound_s=3)
    assert table["within"].tolist() == pytest.approx([0.5])


def test_even_and_bunched_visits() -> None:
    """Every 5 s: no variation. In pairs, 9, 1, 9, 1, 9 s: mean 5.8 s, variance 76.8 / 4; two of five."""
    events = visits(even=[5, 10, 15, 20, 25, 30], pairs=[4, 13, 14, 23, 24, 33])
    table = compute_watch(events=events, streets=["even", "pairs"], end_s=33, bound_s=math.inf)
    found = table.set_index("edge")
    assert found["headway_cv"].to_dict() == pytest.approx({"even": 0.0, "pairs": (76.8 / 4) ** 0.5 / 5.8})
    assert found["bunched"].to_dict() == pytest.approx({"even": 0.0, "pairs": 0.4})
