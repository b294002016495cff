"""Events on disk."""

from pathlib import Path

import pandas as pd

from loopgate.results.columns import EVENT_COLUMNS, STAGE, Event
from loopgate.results.recorder import Recorder, read_event_pieces, read_events


def test_events_are_read_back_in_order(tmp_path: Path) -> None:
    """More than one batch, with reasons."""
    recorder = Recorder(tmp_path / "e.parquet")
    for k in range(120_000):
        recorder.note(float(k), f"v{k % 7}", Event.GRANT, f"s{k % 11}", "free", "replay")
    recorder.close()
    recorder.close()
    events = read_events(tmp_path / "e.parquet")
    assert tuple(events.columns) == EVENT_COLUMNS
    assert len(events) == 120_000
    assert events["time_s"].is_monotonic_increasing
    assert events.iloc[100_000].to_list() == [100_000.0, "v5", "grant", "s10", "free", "replay"]


def test_no_events_make_an_empty_table(tmp_path: Path) -> None:
    """The file is there and has its columns."""
    Recorder(tmp_path / "e.parquet").close()
    assert tuple(read_events(tmp_path / "e.parquet").columns) == EVENT_COLUMNS


def test_a_file_without_stages_gets_empty_ones(tmp_path: Path) -> None:
    """Run folders of earlier versions stay readable."""
    recorder = Recorder(tmp_path / "e.parquet")
    recorder.note(1.0, "v", Event.GRANT, "s", "free", "replay")
    recorder.close()
    pd.read_parquet(tmp_path / "e.parquet").drop(columns=STAGE).to_parquet(tmp_path / "old.parquet")
    events = read_events(tmp_path / "old.parquet")
    assert tuple(events.columns) == EVENT_COLUMNS
    assert events[STAGE].to_list() == [""]


def test_a_long_file_is_read_in_pieces(tmp_path: Path) -> None:
    """Pieces in order, together the whole; of the kinds asked for only."""
    recorder = Recorder(tmp_path / "e.parquet")
    for k in range(120_000):
        recorder.note(float(k), f"v{k % 7}", Event.EDGE if k % 2 else Event.GRANT, f"p{k % 5}")
    recorder.close()
    whole = read_events(tmp_path / "e.parquet")
    pieces = list(read_event_pieces(tmp_path / "e.parquet"))
    assert len(pieces) > 2
    assert pd.concat(pieces, ignore_index=True).equals(whole)
    assert whole["time_s"].tolist() == [float(k) for k in range(120_000)]
    edges = read_events(tmp_path / "e.parquet", (Event.EDGE,))
    assert edges.equals(whole[whole["event"] == "edge"].reset_index(drop=True))
