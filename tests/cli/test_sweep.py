"""The command `loopgate sweep`: exit codes, what is printed, and what is run."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from command import loopgate

RUNNER = str(Path(__file__).parents[1] / "unit" / "sweep" / "fake_runner.py") + ":run"
FAKE = ("--runner", RUNNER, "--workers", "1")
"""Runs without SUMO, in one process: to start two takes longer."""

SWEEP = "[base]\nduration_s = 100\n[grid]\nvehicles = [5, 60]\nseed = { from = 0, to = 1 }\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "grid.toml").write_text(SWEEP, encoding="utf-8")
    return tmp_path


def test_run_then_nothing_left_to_do(folder: Path) -> None:
    """Rows go to out/NAME; the second call makes none; --json prints nothing but JSON."""
    first = loopgate("sweep", "grid.toml", *FAKE, cwd=folder)
    assert (first.returncode, first.stderr) == (0, "")
    assert "out/grid: 4 of 4 rows, 4 made now" in first.stdout
    again = loopgate("sweep", "grid.toml", *FAKE, "--json", cwd=folder)
    assert again.returncode == 0
    outcome = json.loads(again.stdout)
    assert (outcome["total"], outcome["present"], outcome["done"]) == (4, 4, 0)


def test_a_dry_run_lists_and_estimates_and_runs_nothing(folder: Path) -> None:
    """Each run with its key and what varies; no results folder."""
    result = loopgate("sweep", "grid.toml", *FAKE, "--dry-run", cwd=folder)
    assert result.returncode == 0
    assert "vehicles=60  seed=1" in result.stdout
    assert "4 runs (vehicles: 2, seed: 2); 4 to do, 0 there already" in result.stdout
    assert "rule of thumb" in result.stdout
    assert not (folder / "out").exists()
    loopgate("sweep", "grid.toml", *FAKE, cwd=folder)
    plan = json.loads(loopgate("sweep", "grid.toml", *FAKE, "--dry-run", "--json", cwd=folder).stdout)
    assert (plan["missing"], plan["present"], len(plan["runs"])) == (0, 4, 4)
    assert plan["basis"] == "from 4 finished runs"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["nothing.toml"], "loopgate: nothing.toml: cannot read the file"),
        (["grid.toml"], "loopgate: grid.toml: the key 'network' is missing"),
        (["grid.toml", "--executor", "dask"], "--executor dask needs --scheduler"),
        (["grid.toml", "--scheduler", "tcp://x:1"], "--scheduler is for --executor dask"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(folder: Path, words: list[str], message: str) -> None:
    """No traceback, and nothing is run."""
    more = () if words == ["grid.toml"] else FAKE
    result = loopgate("sweep", *words, *more, cwd=folder)
    assert result.returncode == 2
    assert message in result.stderr
    assert len(result.stderr.splitlines()) == 1


def test_ctrl_c_is_exit_code_130_and_no_traceback(folder: Path) -> None:
    """The rows that were made stay."""
    (folder / "grid.toml").write_text(SWEEP.replace("[base]", "[base]\nsleep_s = 0.5"), encoding="utf-8")
    program = [sys.executable, "-c", "from loopgate.cli.main import main; main()"]
    process = subprocess.Popen(
        [*program, "sweep", "grid.toml", *FAKE],
        cwd=folder,
        stderr=subprocess.PIPE,
        start_new_session=True,
        text=True,
    )
    while not list((folder / "out" / "grid" / "rows").glob("row-*.parquet")):
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGINT)
    _, stderr = process.communicate(timeout=20)
    assert process.returncode == 130
    assert stderr.split("\n") == [
        "",
        "out/grid: all rows so far are kept; the same command continues the sweep",
        "",
        "loopgate: interrupted",
        "",
    ]
    assert list((folder / "out" / "grid" / "rows").glob("*.parquet"))
