"""Sweeps on a Dask cluster: processes of their own, over TCP, one of them killed in the middle."""

import os
import shlex
import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Self

import pandas as pd
import pytest
from distributed import Client

import loopgate
from loopgate.errors import SweepError
from loopgate.results.columns import VOLATILE_COLUMNS
from loopgate.runs.results import read_results
from loopgate.sweep import Progress, Sweep, run_sweep
from loopgate.sweep.cluster import dask_executor

pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::DeprecationWarning")


class Cluster:
    """A scheduler and two workers, each a process of its own with a folder of its own."""

    def __init__(self, folder: Path, *, workers: int = 2, **how: Any) -> None:  # noqa: ANN401  see `join`
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
        self._folder = folder
        self.processes: list[subprocess.Popen[bytes]] = []
        self.begin()
        for _ in range(workers):
            self.join(**how)

    def begin(self) -> None:
        """Start a scheduler at the address, the first time or again."""
        port = self.address.rsplit(":", 1)[1]
        self._start("scheduler", "--host", "127.0.0.1", "--port", port, "--no-dashboard")

    def join(self, *, source: Path | None = None, blind: Path | None = None) -> None:
        """Start a worker.

        Parameters
        ----------
        source
            Where it finds loopgate, if not where this process does.
        blind
            A folder in whose place it sees an empty one.
        """
        own = self._folder / f"w{len(self.processes)}"
        own.mkdir()
        options = ["--nthreads", "1", "--no-nanny", "--no-dashboard", "--host", "127.0.0.1"]
        path = {} if source is None else {"PYTHONPATH": str(source)}
        words = ("worker", self.address, *options, "--local-directory", str(own))
        self._start(*words, before=_without(blind) if blind else (), path=path)

    def _start(self, *words: str, before: Sequence[str] = (), path: Mapping[str, str] | None = None) -> None:
        with (self._folder / "log").open("ab") as log:
            command = [*before, sys.executable, "-m", "dask", *words]
            environment = os.environ | (path or {})
            self.processes.append(
                subprocess.Popen(command, stdout=log, stderr=log, cwd=self._folder, env=environment)
            )

    def wait(self, workers: int) -> Self:
        """Wait until so many workers are there."""
        with Client(self.address, timeout=60, set_as_default=False) as client:
            client.wait_for_workers(workers, timeout=60)
        return self

    def end(self) -> None:
        """Kill what is still there."""
        for process in reversed(self.processes):
            process.kill()
            process.wait()


def _without(folder: Path) -> list[str]:
    """Return what starts a command that sees an empty folder in the place of this one, as another machine."""
    hide = f'mount -t tmpfs none {shlex.quote(str(folder))} && exec "$@"'
    return ["unshare", "--mount", "sh", "-c", hide, "sh"]


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    made = Cluster(tmp_path_factory.mktemp("cluster"))
    try:
        yield made.wait(2)
    finally:
        made.end()


@contextmanager
def another(folder: Path, workers: int = 2, **how: Any) -> Iterator[Cluster]:  # noqa: ANN401  see `join`
    made = Cluster(folder, workers=workers, **how)
    try:
        yield made.wait(workers)
    finally:
        made.end()


def small(tmp_path: Path) -> Sweep:
    """Return a sweep of twelve short runs."""
    network = tmp_path / "n.net.xml"
    network.write_text("<net/>", encoding="utf-8")
    base = {"network": str(network), "sleep_s": 0.2, "duration_s": 300}
    return Sweep("s", base, {"vehicles": [5, 60], "seed": list(range(6))})


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


@pytest.mark.parametrize("address", ["here", "tcp://here", "here:port", "http://here:8786"])
def test_what_is_no_address_is_told_at_once(address: str) -> None:
    """Dask would print a traceback when the command ends."""
    with pytest.raises(SweepError, match=r"no address; expected tcp://host:port"), dask_executor(address):
        pass


def test_a_scheduler_that_is_restarted(fake_runner: str, tmp_path: Path) -> None:
    """One line, and all rows so far are kept; with a new scheduler the same sweep makes the others, once."""
    sweep, rows = small(tmp_path), tmp_path / "r"
    run_sweep(sweep, tmp_path / "calm", executor=ThreadPoolExecutor(1), runner=fake_runner)
    (tmp_path / "c").mkdir()
    with another(tmp_path / "c") as made:

        def kill(progress: Progress) -> None:
            if progress.done == 4:
                made.processes[0].send_signal(signal.SIGKILL)

        with (
            pytest.raises(SweepError, match="all rows so far are kept, the same command goes on"),
            dask_executor(made.address) as (pool, size),
        ):
            run_sweep(sweep, rows, executor=pool, workers=size, runner=fake_runner, report=kill)
        kept = read_results(rows).runs.set_index("key")["finished_at"]
        assert 4 <= len(kept) < 12
        made.end()
        made.begin()
        made.join()
        made.wait(1)
        with dask_executor(made.address) as (pool, size):
            outcome = run_sweep(sweep, rows, executor=pool, workers=size, runner=fake_runner)
    assert (outcome.present, outcome.done, outcome.failed) == (len(kept), 12 - len(kept), 0)
    calm, far = (read_results(tmp_path / name).runs for name in ("calm", "r"))
    pd.testing.assert_series_equal(far.set_index("key")["finished_at"].loc[kept.index], kept)
    pd.testing.assert_frame_equal(
        calm.drop(columns=list(VOLATILE_COLUMNS)), far.drop(columns=list(VOLATILE_COLUMNS))
    )


def test_workers_of_another_version(fake_runner: str, cluster: Cluster, tmp_path: Path) -> None:
    """Refused at the start; a worker that comes later ends the sweep with its first run, and rows stay."""
    package = Path(loopgate.__file__).parent
    shutil.copytree(package, tmp_path / "other" / "loopgate", ignore=shutil.ignore_patterns("__pycache__"))
    with (tmp_path / "other" / "loopgate" / "errors.py").open("a", encoding="utf-8") as file:
        file.write("# another version\n")
    (tmp_path / "c").mkdir()
    with another(tmp_path / "c", workers=1, source=tmp_path / "other") as made:
        with (
            pytest.raises(SweepError, match=r"worker tcp://\S+ runs other code \(.*; install loopgate"),
            dask_executor(made.address),
        ):
            pass
        with Client(made.address, timeout=60, set_as_default=False) as client:
            pool = client.get_executor(pure=False)
            with pytest.raises(SweepError, match=r"with other code .* all rows so far are kept"):
                run_sweep(small(tmp_path), tmp_path / "r", executor=pool, workers=1, runner=fake_runner)
    assert read_results(tmp_path / "r").runs.empty
    with dask_executor(cluster.address) as (pool, size):
        done = run_sweep(small(tmp_path), tmp_path / "r", executor=pool, workers=size, runner=fake_runner)
    assert (done.done, done.failed) == (12, 0)


@pytest.mark.skipif(
    subprocess.run([*_without(Path("/mnt")), "true"], check=False, capture_output=True).returncode != 0,
    reason="only root can hide a folder from a process",
)
def test_workers_without_a_shared_folder(fake_runner: str, tmp_path: Path) -> None:
    """Their rows come back as ever; to keep run folders, which would stay with them, is refused."""
    for name in ("c", "r"):
        (tmp_path / name).mkdir()
    with (
        another(tmp_path / "c", workers=1, blind=tmp_path / "r") as made,
        dask_executor(made.address) as (pool, size),
    ):
        sweep = small(tmp_path)
        with pytest.raises(SweepError, match=r"worker \S+ does not see the results in .*: runs are kept"):
            run_sweep(sweep, tmp_path / "r", executor=pool, workers=size, runner=fake_runner, keep_runs=True)
        assert read_results(tmp_path / "r").runs.empty
        done = run_sweep(sweep, tmp_path / "r", executor=pool, workers=size, runner=fake_runner)
    assert (done.done, done.failed) == (12, 0)
    assert len(read_results(tmp_path / "r").runs) == 12


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
