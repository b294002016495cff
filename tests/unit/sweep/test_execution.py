"""Sweeps on this machine: failures are rows, interruptions lose nothing."""

import json
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from random import Random
from typing import Any

import pandas as pd
import pytest

from loopgate.errors import ResultsError
from loopgate.results.columns import VOLATILE_COLUMNS
from loopgate.runs.results import read_results
from loopgate.sweep import Progress, Sweep, run_sweep
from loopgate.sweep.execution import Store
from loopgate.sweep.local import LocalExecutor

GRID: dict[str, list[Any]] = {"vehicles": [5, 60], "gate": ["open", "certified"], "seed": [0, 1]}


def table(folder: Path) -> pd.DataFrame:
    """Return what two executions of one sweep must agree in."""
    return read_results(folder).runs.drop(columns=list(VOLATILE_COLUMNS))


def test_every_point_becomes_a_row(fake_runner: str, tmp_path: Path) -> None:
    """Eight runs in two processes; a second call finds nothing to do and changes nothing."""
    steps: list[Progress] = []
    sweep = Sweep("s", {"duration_s": 300}, GRID)
    outcome = run_sweep(sweep, tmp_path / "r", workers=2, runner=fake_runner, report=steps.append)
    assert (outcome.total, outcome.present, outcome.done, outcome.failed) == (8, 0, 8, 0)
    assert [step.done for step in steps] == list(range(1, 9))
    first = table(tmp_path / "r")
    assert sorted(zip(first["vehicles"], first["gate"], first["seed"], strict=True)) == sorted(
        (n, g, s) for n in GRID["vehicles"] for g in GRID["gate"] for s in GRID["seed"]
    )
    again = run_sweep(sweep, tmp_path / "r", workers=2, runner=fake_runner)
    assert (again.present, again.done) == (8, 0)
    pd.testing.assert_frame_equal(table(tmp_path / "r"), first)


def test_rows_say_what_determines_them(fake_runner: str, tmp_path: Path) -> None:
    """Versions, hashes, the whole scenario, command and warnings with the user's path, deadlock and laps."""
    (tmp_path / "n.net.xml").write_text("<net/>", encoding="utf-8")
    sweep = Sweep("s", {"network": "n.net.xml", "extra": 1.5}, {"vehicles": [60]}, folder=tmp_path)
    run_sweep(sweep, tmp_path / "r", executor=ThreadPoolExecutor(1), runner=fake_runner)
    row = read_results(tmp_path / "r").runs.iloc[0]
    assert row["network"] == "n.net.xml"
    assert len(row["network_hash"]) == 64
    assert row["scenario"] == '{"extra": 1.5, "network": "n.net.xml", "vehicles": 60}'
    assert row["command"] == f"loopgate run {tmp_path / 'n.net.xml'} --vehicles 60 --seed 0"
    assert json.loads(row["warnings"]) == [f"{tmp_path / 'n.net.xml'}: found 4 of 12 loops"]
    assert (row["sumo_version"], row["refusals"], row["edge_km"]) == ("1.28.0", row["laps"] + 2, 0.624)
    assert row["first_deadlock_s"] == row["observed_s"] == pytest.approx(100 + 5000 / 60)
    assert (row["duration_s"], row["measured_s"]) == (600, row["observed_s"])
    assert row["laps_per_h"] == pytest.approx(row["laps"] * 6)
    assert len(row["lap_quantiles_s"]) == 21
    assert row["lap_quantiles_s"][0] >= 100


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["/bin/loopgate", "sweep", "a b.toml"], "loopgate sweep 'a b.toml'"),
        (["study.py", "3"], ""),
        ([], ""),
    ],
)
def test_only_a_command_is_told_as_one(
    fake_runner: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: list[str], told: str
) -> None:
    """A sweep that a script or a notebook makes is not made again by ``loopgate`` with the script's words."""
    monkeypatch.setattr(sys, "argv", words)
    with ThreadPoolExecutor(1) as pool:
        run_sweep(Sweep("s", {"vehicles": 5}, {"seed": [1]}), tmp_path, executor=pool, runner=fake_runner)
    assert read_results(tmp_path).manifest["command"] == told


def test_failures_are_rows_and_the_sweep_goes_on(fake_runner: str, tmp_path: Path) -> None:
    """An error of the package, a bug, a crash and a hang each fail their own run only."""
    trouble = ["none", "raise", "bug", "die", "hang"]
    sweep = Sweep("s", {"vehicles": 5}, {"trouble": trouble})
    outcome = run_sweep(sweep, tmp_path, workers=2, timeout_s=10, runner=fake_runner)
    assert (outcome.done, outcome.failed) == (5, 4)
    runs = read_results(tmp_path).runs.sort_values("scenario")
    errors = dict(zip([s.split('"')[3] for s in runs["scenario"]], runs["error"], strict=True))
    assert errors == {
        "none": "",
        "raise": "edge e7: no lane for passenger",
        "bug": "ZeroDivisionError: integer division or modulo by zero",
        "die": "the worker process died (signal SIGKILL; out of memory?)",
        "hang": "ended after 10 s without a result (time limit)",
    }


def test_failed_rows_are_made_again_on_request(fake_runner: str, tmp_path: Path) -> None:
    """The new row takes the place of the old one, also when that is in a merged file."""
    script = tmp_path / "flaky.py"
    script.write_text("def run(scenario, out):\n    raise RuntimeError('not today')\n", encoding="utf-8")
    sweep = Sweep("s", {"vehicles": 5}, {"seed": [0, 1, 2]})
    results, pool = tmp_path / "r", ThreadPoolExecutor(1)
    assert run_sweep(sweep, results, executor=pool, runner=f"{script}:run").failed == 3
    assert run_sweep(sweep, results, executor=pool, runner=fake_runner).done == 0
    again = run_sweep(sweep, results, executor=pool, runner=fake_runner, retry_failed=True)
    assert (again.done, again.failed) == (3, 0)
    runs = read_results(results).runs
    assert runs["status"].tolist() == ["ok"] * 3
    assert runs["attempt"].tolist() == [2] * 3


def test_a_full_disk_of_a_worker_stops_the_sweep_and_makes_no_row(fake_runner: str, tmp_path: Path) -> None:
    """It says nothing of the scenario, also when the runner wraps the error: no failed row."""
    sweep = Sweep("s", {"vehicles": 5}, {"trouble": ["none", "disk"]})
    with pytest.raises(ResultsError, match=r"a worker's disk is full .* goes on where it stopped"):
        run_sweep(sweep, tmp_path, executor=ThreadPoolExecutor(1), window=1, runner=fake_runner)
    assert read_results(tmp_path).runs["status"].tolist() == ["ok"]


def test_workers_that_cannot_begin_end_the_sweep_and_make_no_row(fake_runner: str, tmp_path: Path) -> None:
    """A script without a main guard, or read from stdin, cannot be imported by workers: no run's fault."""
    script = (
        "from loopgate import Sweep, run_sweep\n"
        f"run_sweep(Sweep('s', {{'vehicles': 5}}, {{'seed': [0, 1]}}), 'r', runner={fake_runner!r})\n"
    )
    result = subprocess.run(
        [sys.executable, "-"], input=script, cwd=tmp_path, check=False, capture_output=True, text=True
    )
    assert "SweepError: a worker process ended before it began" in result.stderr
    assert "if __name__ == '__main__'" in result.stderr
    assert read_results(tmp_path / "r").runs.empty


def test_two_sweeps_do_not_write_to_one_folder(fake_runner: str, tmp_path: Path) -> None:
    """The second is told so at once."""
    with Store(tmp_path), pytest.raises(ResultsError, match="another sweep is writing"):
        run_sweep(Sweep("s", {"vehicles": 5}, {"seed": [0]}), tmp_path, runner=fake_runner)


TWENTY_FOUR: dict[str, list[object]] = {
    "vehicles": [5, 60],
    "gate": ["open", "certified"],
    "seed": [0, 1, 2, 3, 4, 5],
}
COMMAND = f"""
import sys
from loopgate.sweep import Sweep, run_sweep
sweep = Sweep("s", {{"duration_s": 300, "sleep_s": 0.1}}, {TWENTY_FOUR})
run_sweep(sweep, sys.argv[1], workers=2, runner=sys.argv[2])
"""


@pytest.mark.slow
def test_killed_five_times_and_resumed_gives_the_undisturbed_table(fake_runner: str, tmp_path: Path) -> None:
    """Kill -9 some random time after two more rows are there, five times; the workers end with the sweep."""
    random = Random(1)
    program = [sys.executable, "-c", COMMAND]
    calm = Sweep("s", {"duration_s": 300, "sleep_s": 0.1}, TWENTY_FOUR)
    run_sweep(calm, tmp_path / "calm", executor=ThreadPoolExecutor(2), runner=fake_runner)
    rows = tmp_path / "killed" / "rows"
    for _ in range(5):
        before = len(list(rows.glob("*.parquet")))
        process = subprocess.Popen([*program, str(tmp_path / "killed"), fake_runner], start_new_session=True)
        while len(list(rows.glob("*.parquet"))) < before + 2:
            assert process.poll() is None
            time.sleep(0.01)
        time.sleep(random.uniform(0.0, 0.3))
        process.kill()
        process.wait()
        _wait_until_gone(process.pid)
    assert before + 2 < 24
    subprocess.run([*program, str(tmp_path / "killed"), fake_runner], check=True)
    pd.testing.assert_frame_equal(table(tmp_path / "killed"), table(tmp_path / "calm"))


HANGING = """
import sys
from loopgate.sweep import Sweep, run_sweep
base = {"vehicles": 5, "trouble": "hang", "touch": sys.argv[1] + "/begun"}
sweep = Sweep("s", base, {"seed": [0, 1]})
run_sweep(sweep, sys.argv[1], workers=2, runner=sys.argv[2])
"""


def test_workers_in_the_middle_of_a_run_end_with_a_sweep_that_is_killed(
    fake_runner: str, tmp_path: Path
) -> None:
    """A run that would take another minute does not keep its process alive when the sweep is gone."""
    process = subprocess.Popen(
        [sys.executable, "-c", HANGING, str(tmp_path), fake_runner], start_new_session=True
    )
    while not (tmp_path / "begun").exists():
        time.sleep(0.1)
    process.kill()
    process.wait()
    _wait_until_gone(process.pid)


def _wait_until_gone(group: int) -> None:
    """Wait until no process of the session is left; workers that outlive their sweep fail the test."""
    for _ in range(100):
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return
        time.sleep(0.1)
    os.killpg(group, signal.SIGKILL)
    pytest.fail("workers outlived the sweep")


def test_a_worker_that_is_just_starting_ends_with_the_executor() -> None:
    """There is nobody to kill yet when it is shut down; it does not begin a call of a minute."""
    executor = LocalExecutor(1)
    executor.submit(time.sleep, 60)
    begun_s = time.monotonic()
    executor.shutdown(cancel_futures=True)
    assert time.monotonic() - begun_s < 30
    assert not [one for one in multiprocessing.active_children() if "pebble" in one.name]


def test_a_sweep_that_is_interrupted_keeps_its_rows_and_ends_its_workers(
    fake_runner: str, tmp_path: Path
) -> None:
    """Ctrl-C after the first row: it ends within seconds, and what is there can be read."""
    program = [sys.executable, "-c", COMMAND, str(tmp_path), fake_runner]
    process = subprocess.Popen(program, start_new_session=True, stderr=subprocess.PIPE)
    while not list((tmp_path / "rows").glob("row-*.parquet")):
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGINT)
    _, stderr = process.communicate(timeout=20)
    assert process.returncode != 0
    assert b"KeyboardInterrupt" in stderr
    _wait_until_gone(process.pid)
    assert 1 <= len(read_results(tmp_path).runs) < 24
