"""Faults from outside: a second run, a signal, a full disk, a killed process, no display."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import pytest
from command import loopgate

from loopgate.results.recorder import read_events

pytestmark = pytest.mark.sumo

ROOT = Path(__file__).parents[2]
RING = ("run", ROOT / "networks" / "ring3.net.xml", "--routes", ROOT / "routes" / "ring3.rou.xml")
ENDLESS = ("--duration", "1e7", "--json")
MAIN = "from loopgate.cli.main import main; main()"
DRIVING = """
import os
from pathlib import Path
from loopgate.simulation.watching.deadlock_detector import DeadlockDetector

check = DeadlockDetector.check

def check_and_tell(self):
    Path(os.environ["DRIVING"]).touch()
    return check(self)

DeadlockDetector.check = check_and_tell
"""
"""Makes a file once ten seconds have been driven."""


@contextmanager
def begun(*words: str | Path, disk: Path, wait_for: Path | None = None) -> Iterator[subprocess.Popen[str]]:
    """Start the command in a session of its own, its temporary files in `disk`, and wait until it is driving.

    Or until there is a file `wait_for`. Nothing of it outlives the ``with`` block.
    """
    driving = disk.with_name(f"{disk.name}-driving") if wait_for is None else wait_for
    process = subprocess.Popen(
        [sys.executable, "-c", (DRIVING if wait_for is None else "") + MAIN, *map(str, words)],
        env=os.environ | {"TMPDIR": str(disk), "DRIVING": str(driving)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        start_new_session=True,
        text=True,
    )
    with process:
        try:
            while not driving.exists():
                assert process.poll() is None
                time.sleep(0.05)
            yield process
        finally:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)


def wait_until_gone(group: int) -> None:
    """Wait until no process of the session is left, nor the one that multiprocessing keeps."""
    for _ in range(100):
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return
        time.sleep(0.05)
    pytest.fail("workers outlived the sweep")


@dataclass(frozen=True, slots=True)
class Ended:
    """What two runs into one folder left, the first of which was then told to end."""

    out: Path
    first: subprocess.CompletedProcess[str]
    second: subprocess.CompletedProcess[str]


@pytest.fixture(scope="module")
def ended(tmp_path_factory: pytest.TempPathFactory) -> Ended:
    """Start a run, start another into its folder, and end the first by SIGTERM."""
    folder = tmp_path_factory.mktemp("two")
    out = folder / "out"
    with begun(*RING, *ENDLESS, "-o", out, disk=folder) as first:
        second = loopgate(*RING, "--duration", "60", "-o", out, "--overwrite")
        os.killpg(first.pid, signal.SIGTERM)
        stdout, stderr = first.communicate(timeout=30)
    return Ended(out, subprocess.CompletedProcess([], first.returncode, stdout, stderr), second)


def test_a_second_run_into_a_folder_is_refused_in_one_line(ended: Ended) -> None:
    """Exit code 2 and the folder's name, whatever it wants to overwrite."""
    assert ended.second.returncode == 2
    assert ended.second.stderr == (
        f"loopgate: {ended.out}: another run is writing to it; wait for it, or choose another folder\n"
    )


def test_sigterm_leaves_the_results_up_to_then(ended: Ended) -> None:
    """Of the first run, unharmed by the second: exit code 130, outcome, readable events, no lock."""
    assert ended.first.returncode == 130
    assert all("simulated seconds: " in line for line in ended.first.stderr.splitlines())  # on slow machines
    summary = json.loads((ended.out / "summary.json").read_text(encoding="utf-8"))
    assert summary == json.loads(ended.first.stdout)
    assert summary["outcome"] == "interrupted"
    assert summary["audit"] == "clean"
    assert read_events(ended.out / "events.parquet")["time_s"].max() > summary["duration_s"] - 60.0
    assert not list(ended.out.glob(".*"))


def test_a_run_that_keeps_nothing_leaves_nothing_when_it_is_told_to_end(tmp_path: Path) -> None:
    """The summary is printed all the same; what a killed run had left went when this one began."""
    (tmp_path / "loopgate-killed").mkdir()
    (tmp_path / "loopgate-killed" / ".loopgate-temporary").touch()
    with begun(*RING, *ENDLESS, disk=tmp_path) as process:
        (folder,) = tmp_path.iterdir()
        assert (folder / "events.parquet").exists()
        process.send_signal(signal.SIGTERM)
        stdout, _ = process.communicate(timeout=30)
    assert process.returncode == 130
    assert json.loads(stdout)["outcome"] == "interrupted"
    assert not list(tmp_path.iterdir())


def test_sigterm_ends_a_sweep_its_workers_and_their_folders(tmp_path: Path) -> None:
    """Sent to the sweep alone: exit code 130, the rows stay, no process and no temporary folder does."""
    runner = str(ROOT / "tests" / "unit" / "sweep" / "fake_runner.py") + ":run"
    (tmp_path / "disk").mkdir()
    (tmp_path / "s.toml").write_text(
        "[[include]]\nvehicles = 5\n"
        f'[[include]]\nvehicles = 5\ntrouble = "hang"\ntouch = "{tmp_path / "hangs"}"\n'
    )
    words = ("sweep", tmp_path / "s.toml", "--runner", runner, "-j", "1", "-o", tmp_path / "out")
    with begun(*words, disk=tmp_path / "disk", wait_for=tmp_path / "hangs") as process:
        assert list((tmp_path / "disk").iterdir())
        while not list((tmp_path / "out" / "rows").glob("*.parquet")):
            time.sleep(0.05)
        process.send_signal(signal.SIGTERM)
        _, stderr = process.communicate(timeout=20)
        wait_until_gone(process.pid)
    assert process.returncode == 130
    assert "all rows so far are kept" in stderr
    assert "Traceback" not in stderr
    assert len(list((tmp_path / "out" / "rows").glob("*.parquet"))) == 1
    assert not list((tmp_path / "disk").iterdir())


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a device of Linux that is always full")
@pytest.mark.parametrize(
    "words",
    [
        ("study", "verify", "--random", "2", "--certificates", "/dev/full"),
        ("study", "verify", "--random", "2"),
    ],
)
def test_what_is_printed_to_a_full_disk(words: tuple[str, ...]) -> None:
    """Certificates, and stdout: one line, exit code 2."""
    with Path("/dev/full").open("w", encoding="utf-8") as full:
        done = subprocess.run(
            [sys.executable, "-c", MAIN, *words], stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert done.returncode == 2
    assert "no space left on device" in done.stderr
    said = [line for line in done.stderr.splitlines() if not line.startswith("systems: ")]
    assert len(said) == 1, done.stderr  # besides progress, which a slow machine shows


def test_no_display_is_said_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Before the network is read: here there is none."""
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    done = loopgate("run", tmp_path / "no.net.xml", "--loops", "1", "--gui")
    assert done.returncode == 2
    assert "DISPLAY" in done.stderr
    assert len(done.stderr.splitlines()) == 1
