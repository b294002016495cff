"""The run folder: one run at a time, and whole files or none."""

from pathlib import Path

import pytest
from limits import no_file_beyond

from loopgate.errors import ResultsError, ScenarioError
from loopgate.simulation.run_folder import Folder, Tally
from loopgate.simulation.sumo.start import DiskGuard

TALLY = Tally("v", "l", 100.0, 1, 100.0, 0.0, 0.0, 0.0)


def test_a_second_run_is_refused_before_it_touches_anything(tmp_path: Path) -> None:
    """Also with --overwrite; afterwards the folder is free, and holds no lock."""
    with Folder(tmp_path / "out", overwrite=False) as folder:
        (folder / "events.parquet").touch()
        for overwrite in (False, True):
            with pytest.raises(ScenarioError, match=r"out: another run is writing to it"):
                Folder(tmp_path / "out", overwrite=overwrite)
        assert (folder / "events.parquet").exists()
    with Folder(tmp_path / "out", overwrite=False):
        pass
    assert not list((tmp_path / "out").iterdir())


def test_a_folder_that_is_refused_is_not_left_locked(tmp_path: Path) -> None:
    """Results are there: refused, then replaced on request."""
    (tmp_path / "summary.json").touch()
    with pytest.raises(ScenarioError, match="holds the results"):
        Folder(tmp_path, overwrite=False)
    assert [file.name for file in tmp_path.iterdir()] == ["summary.json"]
    with Folder(tmp_path, overwrite=True):
        pass


def test_names_that_sumo_reads_otherwise_are_refused(tmp_path: Path) -> None:
    """In one line, before anything is written."""
    for name in ("a:b", "a,b"):
        with pytest.raises(ScenarioError, match=f"{name}: SUMO takes what follows a co.* choose a folder"):
            Folder(tmp_path / name, overwrite=False)
    assert not list(tmp_path.iterdir())


def test_a_full_disk_leaves_no_half_files(tmp_path: Path) -> None:
    """The line names the file; a folder with a summary is complete."""
    with Folder(tmp_path, overwrite=False) as folder, no_file_beyond(300):
        with pytest.raises(ResultsError, match=r"vehicles\.parquet: cannot be written \(file too large"):
            folder.write_vehicles([TALLY])
        with pytest.raises(ResultsError, match=r"summary\.json"):
            folder.write_summary({"text": "x" * 1000})
    assert not list(tmp_path.iterdir())


def test_a_run_ends_before_sumo_finds_the_disk_full(tmp_path: Path) -> None:
    """Four mebibytes are kept for what SUMO holds back."""
    DiskGuard(tmp_path / "positions.csv.gz").check()
    with no_file_beyond(5 << 20):
        room = DiskGuard(tmp_path / "positions.csv.gz")
        room.check()
        (tmp_path / "positions.csv.gz").write_bytes(bytes(2 << 20))
        with pytest.raises(ResultsError, match=r"positions\.csv\.gz: .*3\.0 MiB are left.*free some space"):
            room.check()
