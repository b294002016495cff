"""What was seen of a district, against cases worked out by hand."""

import math

import pandas as pd
import pytest

from loopgate.analysis.watching import (
    compute_districts,
    compute_promises,
    compute_seen_within,
    compute_watch,
)
from loopgate.results.columns import EVENT_COLUMNS
from loopgate.simulation.monitoring import watch_figures


def visits(**times: list[float]) -> pd.DataFrame:
    rows = [(at, "v", "edge", street, "") for street, found in times.items() for at in found]
    return pd.DataFrame(rows, columns=list(EVENT_COLUMNS[:5]))


def test_a_street_on_no_loop_is_never_seen() -> None:
    """It is idle for as long as the run lasts: 10 s at the end, 5 s on average; and it comes first."""
    table = compute_watch(events=visits(a=[2, 6]), streets=["a", "b"], end_s=10, bound_s=math.inf)
    assert table["edge"].tolist() == ["b", "a"]
    first = table.iloc[0]
    assert (first["visits"], first["idleness_s"], first["worst_idleness_s"]) == (0, 5.0, 10.0)
    figures = watch_figures(table.assign(street=""), bound_s=math.inf)
    assert (figures["streets"], figures["never_seen"]) == (2, 1)
    assert figures["worst_idleness_of_seen_s"] == 4.0
    assert [row["edge"] for row in figures["rarest"]] == ["a"]
    assert "within" not in figures


def test_share_of_time_under_a_bound() -> None:
    """Visits at 2 and 6 of 10 s, bound 3 s: over from 5 to 6 and from 9 on; never seen: from 3 on."""
    table = compute_watch(events=visits(a=[2, 6]), streets=["a", "b"], end_s=10, bound_s=3).set_index("edge")
    assert table["within"].to_dict() == pytest.approx({"a": 0.8, "b": 0.3})
    figures = watch_figures(table.reset_index().assign(street=""), bound_s=3)
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


def test_streets_may_have_bounds_of_their_own() -> None:
    """Visits at 2 and 6 of 10 s: within 3 s for 8 s of ten, within 1 s for 3 s (from 0, 2 and 6 on)."""
    events = visits(a=[2, 6], b=[2, 6])
    table = compute_watch(events=events, streets=["a", "b"], end_s=10, bound_s={"a": 3.0, "b": 1.0})
    found = table.set_index("edge")
    assert found["bound_s"].to_dict() == {"a": 3.0, "b": 1.0}
    assert found["within"].to_dict() == pytest.approx({"a": 0.8, "b": 0.3})
    broken = watch_figures(table.assign(street="x"), bound_s=3.0)["broken"]
    assert [(row["edge"], row["bound_s"]) for row in broken] == [("b", 1.0), ("a", 3.0)]


def test_share_of_streets_seen_within() -> None:
    """Visits at 2 and 6 of 10 s, on b none: of 20 s within 3 s for 8 + 3, within 4 s for 10 + 4; a always."""
    events = visits(a=[2, 6])
    seen = compute_seen_within(events=events, streets=["a", "b"], end_s=10, times_s=[3, 4])
    assert seen["now"].tolist() == pytest.approx([11 / 20, 14 / 20])
    assert seen["always"].tolist() == [0.0, 0.5]


def test_the_share_seen_agrees_with_the_shares_of_each_street() -> None:
    """At any bound it is the mean of `within`; what lay before the period counts alike."""
    events = visits(a=[2, 6, 7, 20], b=[1, 30], c=[4])
    streets = ["a", "b", "c", "d"]
    seen = compute_seen_within(events=events, streets=streets, begin_s=5.0, end_s=33.0)
    assert seen["within_s"].iloc[[0, -1]].tolist() == [0.0, 29.0]  # from 1 to 30 s on b; d counts for nothing
    for time, now in seen[["within_s", "now"]].itertuples(index=False):
        table = compute_watch(events=events, streets=streets, begin_s=5.0, end_s=33.0, bound_s=time)
        assert now == pytest.approx(table["within"].mean())


def test_districts_take_their_streets_together() -> None:
    """A street may lie in two; a district without streets is left out."""
    table = compute_watch(events=visits(a=[2, 6]), streets=["a", "b"], end_s=10, bound_s=3)
    found = compute_districts(watch=table, districts={"all": ["a", "b"], "one": ["a"], "none": ["z"]})
    rows = found.set_index("district")
    assert list(rows.index) == ["all", "one"]
    assert rows[["streets", "never_seen", "visits"]].iloc[0].tolist() == [2, 1, 2]
    assert rows["idleness_s"].iloc[0] == pytest.approx((5.0 + 1.8) / 2)
    assert rows["within"].iloc[0] == pytest.approx(0.55)
    assert rows["worst_idleness_s"].iloc[1] == 4.0


def test_promises_by_name_of_street() -> None:
    """An edge exactly at its bound keeps it; one that nobody entered neither keeps nor breaks it."""
    rows = [
        ("e1", "Long", 3, 200.0),
        ("e2", "Long", 1, 201.0),
        ("e3", "Even", 2, 200.0),
        ("e4", "Half", 4, 50.0),
        ("e5", "Half", 0, 600.0),
        ("e6", "", 0, 600.0),
    ]
    streets = pd.DataFrame(rows, columns=["edge", "street", "visits", "worst_idleness_s"])
    table = compute_promises(streets=streets.assign(bound_s=200.0, within=0.5))
    assert table[["street", "edges", "seen", "late", "worst_idleness_s", "promise"]].to_numpy().tolist() == [
        ["Long", 2, 2, 1, 201.0, "broken"],
        ["Even", 1, 1, 0, 200.0, "kept"],
        ["Half", 2, 1, 0, 50.0, "partly seen"],
        ["e6", 1, 0, 0, 600.0, "never seen"],
    ]
