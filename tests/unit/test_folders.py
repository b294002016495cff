"""Locks and temporary folders, and what becomes of them when their process is killed."""

import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from loopgate.errors import ResultsError
from loopgate.folders import FolderLock, remove_abandoned, temporary_folder

HOLDS_LOCK = """
from loopgate.folders import FolderLock
lock = FolderLock(Path(sys.argv[1]))
assert lock.acquire()
"""
HOLDS_FOLDER = """
from loopgate.folders import temporary_folder
holder = temporary_folder()
(holder.__enter__() / "deep").mkdir()
"""


@contextmanager
def holding(script: str, *words: str) -> Iterator[None]:
    """Run the script, wait until it has what it wants, and kill it at the end as nothing can prevent."""
    whole = (
        f"import sys, time\nfrom pathlib import Path\n{script}\nprint('has it', flush=True)\ntime.sleep(60)"
    )
    process = subprocess.Popen([sys.executable, "-c", whole, *words], stdout=subprocess.PIPE, text=True)
    with process:
        assert process.stdout is not None
        assert process.stdout.readline() == "has it\n"
        try:
            yield
        finally:
            process.kill()


@pytest.fixture
def disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Let temporary files of this process and of those it starts be made in a folder of the test."""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", None)
    return tmp_path


def test_a_lock_keeps_others_out_until_its_process_is_killed(tmp_path: Path) -> None:
    """Nothing has to be removed by hand, and nothing is left in the folder."""
    lock = FolderLock(tmp_path)
    with holding(HOLDS_LOCK, str(tmp_path)):
        assert not lock.acquire()
    assert lock.acquire()
    assert not FolderLock(tmp_path).acquire()
    lock.release()
    assert not list(tmp_path.iterdir())


def test_a_temporary_folder_goes_at_the_end_whatever_happens(disk: Path) -> None:
    """Here: an interruption."""
    with suppress(KeyboardInterrupt), temporary_folder() as folder:
        (folder / "run").mkdir()
        (folder / "run" / "events").touch()
        assert [*disk.iterdir()] == [folder]
        raise KeyboardInterrupt
    assert not list(disk.iterdir())


def test_the_folder_of_a_process_that_was_killed_goes_at_the_next_start(disk: Path) -> None:
    """While that process lives, its folder is let alone."""
    with holding(HOLDS_FOLDER):
        (theirs,) = disk.iterdir()
        remove_abandoned()
        assert (theirs / "deep").is_dir()
    assert theirs.is_dir()
    with temporary_folder() as ours:
        assert [*disk.iterdir()] == [ours]
    assert not list(disk.iterdir())


def test_what_only_looks_like_a_temporary_folder_stays(disk: Path) -> None:
    """Results that a user called so, and a link to a temporary folder elsewhere."""
    (disk / "loopgate-study").mkdir()
    (disk / "loopgate-study" / ".lock").touch()
    (disk / "elsewhere").mkdir()
    (disk / "elsewhere" / ".loopgate-temporary").touch()
    (disk / "loopgate-link").symlink_to(disk / "elsewhere")
    remove_abandoned()
    assert {path.name for path in disk.iterdir()} == {"loopgate-study", "elsewhere", "loopgate-link"}
    assert list((disk / "elsewhere").iterdir())


def test_no_place_for_temporary_files_is_one_line(disk: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It names what to set."""
    monkeypatch.setattr(tempfile, "tempdir", str(disk / "gone"))
    with pytest.raises(ResultsError, match=r"TMPDIR.*cannot be written"), temporary_folder():
        pass
