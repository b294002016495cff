"""The results folder: whole files or none, each row once, clear words when the disk is full."""

import errno
import shutil
import subprocess
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pandas as pd
import pytest

from loopgate.errors import ResultsError
from loopgate.results import columns as c
from loopgate.runs.results import read_results
from loopgate.sweep import Sweep, run_sweep
from loopgate.sweep.execution import Store
from loopgate.sweep.task import Result


def row(key: str, attempt: int = 1, status: str = "ok", laps: int = 1) -> Result:
    return Result({c.KEY: key, c.ATTEMPT: attempt, c.STATUS: status, c.LAPS: laps})


def test_single_rows_are_merged_into_chunks(tmp_path: Path) -> None:
    """Seven rows in chunks of three: two chunks and one single row; all can be read."""
    with Store(tmp_path, merge_at=3) as store:
        for number in range(7):
            store.add(row(f"k{number}"))
    assert len(list((tmp_path / "rows").glob("chunk-*.parquet"))) == 2
    assert len(list((tmp_path / "rows").glob("row-*.parquet"))) == 1
    assert sorted(read_results(tmp_path).runs["key"]) == [f"k{n}" for n in range(7)]


def test_a_crash_between_merging_and_removing_leaves_each_row_once(tmp_path: Path) -> None:
    """The parts are put back beside the chunk, as if they had not been removed yet."""
    with Store(tmp_path) as store:
        for number in range(3):
            store.add(row(f"k{number}"))
        shutil.copytree(tmp_path / "rows", tmp_path / "before")
        store.merge()
    for part in (tmp_path / "before").iterdir():
        shutil.copy(part, tmp_path / "rows")
    assert sorted(read_results(tmp_path).runs["key"]) == ["k0", "k1", "k2"]
    with Store(tmp_path) as store:
        assert len(store) == 3


def test_the_latest_attempt_counts(tmp_path: Path) -> None:
    """A failed first attempt in a chunk, a good second one in a single row."""
    with Store(tmp_path) as store:
        store.add(row("k", status="failed"))
        store.add(row("other"))
        store.merge()
        store.add(row("k", attempt=2, laps=9))
    with Store(tmp_path) as store:
        assert (store.finished("k"), store.attempts("k")) == ("ok", 2)
    runs = read_results(tmp_path).runs.set_index("key")
    assert runs.loc["k", "laps"] == 9


def test_what_a_crash_left_half_written_is_removed(tmp_path: Path) -> None:
    """A temporary file is nobody's row."""
    with Store(tmp_path) as store:
        store.add(row("k"))
    left = tmp_path / "rows" / "row-x.parquet.tmp"
    left.write_bytes(b"PAR1 half")
    with Store(tmp_path) as store:
        assert len(store) == 1
    assert not left.exists()


def test_a_file_that_the_disk_damaged_is_named(tmp_path: Path) -> None:
    """The error says what to remove, on writing as on reading."""
    (tmp_path / "rows").mkdir()
    (tmp_path / "rows" / "row-x.parquet").write_bytes(b"PAR1 half")
    with pytest.raises(ResultsError, match=r"row-x.parquet: not a readable Parquet file"):
        Store(tmp_path)
    with pytest.raises(ResultsError, match=r"row-x.parquet"):
        read_results(tmp_path)


def test_a_disk_that_is_full_while_writing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No half file stays, rows that were there stay, and the error says how to go on."""
    with Store(tmp_path) as store:
        store.add(row("k"))
        monkeypatch.setattr("loopgate.sweep.execution.os.fsync", _no_space)
        with pytest.raises(ResultsError, match=r"no space left on device; .* goes on where it stopped"):
            store.add(row("l"))
        monkeypatch.undo()
    assert [file.name for file in (tmp_path / "rows").iterdir()] == ["row-k.parquet"]
    assert read_results(tmp_path).runs["key"].tolist() == ["k"]


def _no_space(_: int) -> None:
    raise OSError(errno.ENOSPC, "No space left on device")


@pytest.fixture
def tiny_disk(tmp_path: Path) -> Iterator[Path]:
    """Mount a disk of 192 KiB, which needs the right to do so."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = shutil.which("mount")
    if (
        mount is None
        or subprocess.run(
            [mount, "-t", "tmpfs", "-o", "size=192k", "tmpfs", disk], check=False, capture_output=True
        ).returncode
    ):
        pytest.skip("mounting a small disk needs root")
    try:
        yield disk
    finally:
        subprocess.run([str(shutil.which("umount")), disk], check=True)


def test_a_small_disk_fills_up_and_the_sweep_goes_on_when_there_is_room(
    fake_runner: str, tiny_disk: Path, tmp_path: Path
) -> None:
    """A real full disk: one clear line; the rows that fitted are readable; after moving, all are there."""
    sweep = Sweep("s", {"vehicles": 5}, {"seed": list(range(12))})
    pool = ThreadPoolExecutor(1)
    with pytest.raises(ResultsError, match="no space left on device"):
        run_sweep(sweep, tiny_disk, executor=pool, runner=fake_runner)
    fitted = read_results(tiny_disk).runs
    assert 1 <= len(fitted) < 12
    shutil.copytree(tiny_disk, tmp_path / "roomy")
    outcome = run_sweep(sweep, tmp_path / "roomy", executor=pool, runner=fake_runner)
    assert (outcome.present, outcome.done) == (len(fitted), 12 - len(fitted))
    run_sweep(sweep, tmp_path / "calm", executor=pool, runner=fake_runner)
    roomy, calm = (
        read_results(tmp_path / name).runs.drop(columns=list(c.VOLATILE_COLUMNS))
        for name in ("roomy", "calm")
    )
    pd.testing.assert_frame_equal(roomy, calm)
