"""The study of dense traffic: which runs in which order, and a table of those that are done."""

from __future__ import annotations

import json
from pathlib import Path

import in_traffic
import pytest


def figures(distance_km: float, wait_s: float) -> dict[str, object]:
    """Return what is kept of a run."""
    return {
        "vehicles": 600,
        "distance_km": distance_km,
        "longest_wait_s": wait_s,
        "longest_waits_s": {"occupied": wait_s},
        "lapless": 3,
        "clean": True,
        "deadlocks": 0,
    }


def test_runs_go_seed_by_seed_in_pairs() -> None:
    """So that a study that is ended early has whole rows of the first seeds."""
    names = [name for name, _ in in_traffic.tasks(2)]
    assert len(names) == 32
    assert names[:2] == ["grid-400-off-before-1", "grid-400-off-after-1"]
    assert [name.rsplit("-", 1)[1] for name in names] == ["1"] * 16 + ["2"] * 16


def test_the_table_shows_what_there_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A row for each pair that is done; no run is made for it."""
    monkeypatch.setattr("sys.argv", ["in_traffic.py", "--table", "--out", str(tmp_path)])
    in_traffic.main()
    assert capsys.readouterr().out.startswith("no run is done yet")
    for when, kept in (("before", figures(1000.0, 500.0)), ("after", figures(990.0, 130.0))):
        (tmp_path / f"berlin-600-obey-{when}-1.json").write_text(json.dumps(kept), encoding="utf-8")
    (tmp_path / "grid-400-off-before-1.json").write_text(json.dumps(figures(1.0, 1.0)), encoding="utf-8")
    in_traffic.main()
    rows = capsys.readouterr().out.splitlines()
    assert len(rows) == 3
    assert rows[2].startswith("| berlin | 600 | obey | 1 | 1000 / 990 | 0.990 | 3 / 3 | 500 / 130 |")
