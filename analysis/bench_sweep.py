"""How fast sweeps go: ``python analysis/bench_sweep.py [SWEEP.toml] [RUNS]``.

Runs the same runs (default: 30 of ``sweep_grid.toml``, spread over the grid) in one process and in one per
processor, and prints runs per minute, processors in use and peak memory per worker for both. The figures mean
something on a machine that does nothing else.
"""

from __future__ import annotations

import os
import resource
import sys
import tempfile
import time
from pathlib import Path

from loopgate import Sweep, read_results, read_sweep, run_sweep
from loopgate.results import columns as c

HERE = Path(__file__).resolve().parent
RUNS = 30


def main() -> None:
    """Measure and print."""
    file = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "sweep_grid.toml"
    runs = int(sys.argv[2]) if len(sys.argv) > 2 else RUNS  # noqa: PLR2004 - the second argument
    sweep = some(read_sweep(file), runs)
    processors = len(os.sched_getaffinity(0))
    paces = {}
    for workers in (1, processors):
        with tempfile.TemporaryDirectory() as folder:
            begin, before = time.perf_counter(), children_s()
            outcome = run_sweep(sweep, folder, workers=workers)
            seconds, used = time.perf_counter() - begin, children_s() - before
            rows = read_results(folder).runs
        paces[workers] = outcome.done / seconds
        print(
            f"{workers} process{'es' if workers > 1 else ''}: {outcome.done} runs in {seconds:.1f} s, "
            f"{60 * paces[workers]:.1f} runs/min, {used / seconds:.2f} processors in use, "
            f"{rows[c.PEAK_MEMORY].max():.0f} MiB peak per worker, {outcome.failed} failed"
        )
    print(f"{processors} processes make {paces[processors] / paces[1]:.2f} times as many runs as one")


def some(sweep: Sweep, runs: int) -> Sweep:
    """Return a sweep of `runs` points that lie evenly over the given one, long and short runs mixed."""
    points = sweep.points()
    chosen = [points[number * len(points) // runs] for number in range(min(runs, len(points)))]
    include = [{axis: [point.scenario[axis]] for axis in sweep.grid} for point in chosen]
    return Sweep(sweep.name, sweep.base, {}, include=include, folder=sweep.folder)


def children_s() -> float:
    """Return the processor time of all processes that have ended [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    main()
