"""Events on a disk that is full before they are all written."""

import errno
import os
from pathlib import Path

import pytest
from limits import no_file_beyond

from loopgate.errors import ResultsError
from loopgate.results.columns import Event
from loopgate.results.recorder import Recorder, read_events


def record(file: Path, rows: int = 120_000) -> None:
    recorder = Recorder(file)
    try:
        for k in range(rows):
            recorder.note(float(k), f"v{k * 7919 % 91}", Event.GRANT, f"s{k * 104_729 % 503}")
    finally:
        recorder.close()


@pytest.mark.parametrize("size_bytes", [12_000, 100_000, 300_000])
def test_events_up_to_a_full_disk_can_be_read(tmp_path: Path, size_bytes: int) -> None:
    """One line that names the file; in the file the first events, in order and whole."""
    file = tmp_path / "e.parquet"
    with no_file_beyond(size_bytes), pytest.raises(ResultsError, match=r"e\.parquet: .*free some space"):
        record(file)
    times = read_events(file)["time_s"].to_list()
    assert times == [float(k) for k in range(len(times))]
    assert len(times) < 120_000
    assert len(times) > {12_000: -1, 100_000: 1_000, 300_000: 20_000}[size_bytes]


def test_a_file_for_which_there_is_no_room_at_all(tmp_path: Path) -> None:
    """Said when it is opened, and nothing is left of it."""
    with no_file_beyond(100), pytest.raises(ResultsError, match=r"e\.parquet: cannot be written"):
        Recorder(tmp_path / "e.parquet")
    assert not list(tmp_path.iterdir())


def test_a_disk_that_promises_no_room_is_written_to_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As some network disks; the file is the same."""
    record(tmp_path / "a.parquet")

    def refuse(*_: int) -> None:
        raise OSError(errno.EOPNOTSUPP, os.strerror(errno.EOPNOTSUPP))

    monkeypatch.setattr(os, "posix_fallocate", refuse)
    record(tmp_path / "b.parquet")
    assert (tmp_path / "a.parquet").read_bytes() == (tmp_path / "b.parquet").read_bytes()
    with no_file_beyond(200_000), pytest.raises(ResultsError, match=r"c\.parquet: cannot be written"):
        record(tmp_path / "c.parquet")
