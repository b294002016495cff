"""Sweeps on a Dask cluster: processes of their own, over TCP, one of them killed in the middle."""

import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pandas as pd
import pytest
from distributed import Client

from loopgate.errors import SweepError
from loopgate.results.row_columns import VOLATILE_COLUMNS
from loopgate.runs.results import read_results
from loopgate.sweep import Progress, Sweep, run_sweep
from loopgate.sweep.cluster import dask_executor

pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::DeprecationWarning")


class Cluster:
    """A scheduler and two workers, each a process of its own with a folder of its own."""

    def __init__(self, folder: Path) -> None:
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
        self._folder = folder
        port = self.address.rsplit(":", 1)[1]
        self.processes = [self._start("scheduler", "--host", "127.0.0.1", "--port", port, "--no-dashboard")]
        for number in range(2):
            (folder / f"w{number}").mkdir()
            options = ["--nthreads", "1", "--no-nanny", "--no-dashboard", "--host", "127.0.0.1"]
            self.processes.append(
                self._start("worker", self.address, *options, "--local-directory", str(folder / f"w{number}"))
            )

    def _start(self, *words: str) -> subprocess.Popen[bytes]:
        log = (self._folder / "log").open("ab")
        with log:
            return subprocess.Popen(
                [sys.executable, "-m", "dask", *words], stdout=log, stderr=log, cwd=self._folder
            )

    def end(self) -> None:
        """Kill what is still there."""
        for process in reversed(self.processes):
            process.kill()
            process.wait()


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    made = Cluster(tmp_path_factory.mktemp("cluster"))
    try:
        with Client(made.address, timeout=60, set_as_default=False) as client:
            client.wait_for_workers(2, timeout=60)
        yield made
    finally:
        made.end()


def test_files_travel_with_the_runs(cluster: Cluster, tmp_path: Path) -> None:
    """A worker that cannot see the network's place gets its content: here the place is emptied meanwhile."""
    network, script = tmp_path / "n.net.xml", tmp_path / "reader.py"
    network.write_text("<net>here</net>", encoding="utf-8")
    script.write_text(
        "from pathlib import Path\n"
        "def run(scenario, out):\n"
        "    raise RuntimeError(Path(scenario['network']).read_text())\n",
        encoding="utf-8",
    )
    sweep = Sweep("s", {"network": str(network)}, {"seed": [0, 1]})

    def empty(_: Progress) -> None:
        network.write_text("", encoding="utf-8")

    with dask_executor(cluster.address) as (pool, _):
        run_sweep(sweep, tmp_path / "r", executor=pool, window=1, runner=f"{script}:run", report=empty)
    assert read_results(tmp_path / "r").runs["error"].tolist() == ["RuntimeError: <net>here</net>"] * 2


def test_no_scheduler_is_one_clear_line() -> None:
    """Nobody listens on the port."""
    with (
        pytest.raises(SweepError, match=r"scheduler tcp://127.0.0.1:9: no connection"),
        dask_executor("tcp://127.0.0.1:9"),
    ):
        pass


def test_two_workers_one_killed_in_the_middle(fake_runner: str, cluster: Cluster, tmp_path: Path) -> None:
    """The table is that of an undisturbed sweep on this machine, and both workers have made rows.

    The last one that the cluster is of use for.
    """
    network = tmp_path / "n.net.xml"
    network.write_text("<net/>", encoding="utf-8")
    base = {"network": str(network), "sleep_s": 0.2, "duration_s": 300}
    sweep = Sweep("s", base, {"vehicles": [5, 60], "seed": list(range(12))})
    run_sweep(sweep, tmp_path / "calm", executor=ThreadPoolExecutor(1), runner=fake_runner)

    def kill_one(progress: Progress) -> None:
        if progress.done == 8:
            cluster.processes[-1].send_signal(signal.SIGKILL)

    with dask_executor(cluster.address) as (pool, size):
        outcome = run_sweep(
            sweep, tmp_path / "far", executor=pool, workers=size, runner=fake_runner, report=kill_one
        )
    assert (outcome.done, outcome.failed) == (24, 0)
    calm, far = (read_results(tmp_path / name).runs for name in ("calm", "far"))
    assert far["worker"].nunique() == 2
    assert str(os.getpid()) not in {name.split(":")[1] for name in far["worker"]}
    pd.testing.assert_frame_equal(
        calm.drop(columns=list(VOLATILE_COLUMNS)), far.drop(columns=list(VOLATILE_COLUMNS))
    )
