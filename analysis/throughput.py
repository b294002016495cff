"""Vehicle-km in the hour on the five-by-five grid: SUMO's own rules beside the gates, on the same loops.

For each seed 40 random loops are made once; every column drives the same vehicles on them from the same
places (on other networks of the same streets). Runs that are done are kept in a table and not repeated.

    python analysis/throughput.py --seeds 5 --vehicles 60 100 140 180 240 300 400

It prints a table of means with 95 % confidence intervals over the seeds, and writes all runs as CSV.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy import stats

from loopgate.abstraction.queue_layout import why_not
from loopgate.network import RoadNetwork, generate_loops, write_loops
from loopgate.simulation.run import run
from loopgate.simulation.scenario import Scenario

NETWORKS = Path(__file__).resolve().parents[1] / "networks"
COLUMNS = {
    "priority": ("grid5-priority", "open", "oldest"),
    "right-before-left": ("grid5-right-before-left", "open", "oldest"),
    "all-way-stop": ("grid5-all-way-stop", "open", "oldest"),
    "actuated": ("grid5-actuated", "open", "oldest"),
    "certified, oldest": ("grid5-priority", "certified", "oldest"),
    "certified, pressure": ("grid5-priority", "certified", "pressure"),
}
KEPT = ("km_per_h", "laps", "deadlocks", "longest_wait_s", "collisions", "teleports", "outcome", "audit")
LOOPS = 40


def one_run(column: str, vehicles: int, seed: int, duration_s: float, folder: Path) -> dict[str, Any]:
    """Drive one hour and return what is kept of its summary."""
    network, gate, negotiation = COLUMNS[column]
    routes = folder / f"loops{seed}.rou.xml"
    if not routes.exists():
        roads = RoadNetwork.open(NETWORKS / "grid5-priority.net.xml")
        write_loops(
            generate_loops(roads, LOOPS, seed=seed, admits=lambda loop: not why_not(roads, loop)), routes
        )
    summary = run(
        Scenario(
            network=str(NETWORKS / f"{network}.net.xml"),
            routes=str(routes),
            vehicles=vehicles,
            gate=gate,
            abstraction="queues",
            negotiation=negotiation,
            duration_s=duration_s,
            warmup_s=300.0,
            seed=seed,
            on_deadlock="continue",
        )
    )
    found = {key: summary[key] for key in KEPT}
    found["deadlocks"] = len(summary["deadlocks"])
    found["audit"] = str(summary["audit"])
    return {"column": column, "vehicles": vehicles, "seed": seed, "duration_s": duration_s, **found}


def table(runs: pd.DataFrame) -> pd.DataFrame:
    """Return mean vehicle-km in the hour, with half its 95 % interval, by column and vehicles."""

    def figure(values: pd.Series[float]) -> str:
        half = (
            stats.t.ppf(0.975, len(values) - 1) * float(np.std(values, ddof=1)) / len(values) ** 0.5
            if len(values) > 1
            else float("nan")
        )
        return f"{values.mean():.0f} ± {half:.0f}"

    wide = runs.pivot_table(index="column", columns="vehicles", values="km_per_h", aggfunc=figure)
    return wide.reindex(list(COLUMNS))


def main() -> None:
    """Make the runs that are missing, print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--vehicles", type=int, nargs="+", default=[60, 180, 300])
    parser.add_argument("--duration", type=float, default=3600.0)
    parser.add_argument("--out", type=Path, default=Path("out/throughput.csv"))
    given = parser.parse_args()
    given.out.parent.mkdir(parents=True, exist_ok=True)
    known = pd.read_csv(given.out).to_dict("records") if given.out.exists() else []
    runs: list[dict[str, Any]] = [{str(name): value for name, value in row.items()} for row in known]
    key = ("column", "vehicles", "seed", "duration_s")
    done = {tuple(row[k] for k in key) for row in runs}
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(1, given.seeds + 1):
            for vehicles in given.vehicles:
                for column in COLUMNS:
                    if (column, vehicles, seed, given.duration) in done:
                        continue
                    runs.append(one_run(column, vehicles, seed, given.duration, Path(folder)))
                    pd.DataFrame(runs).to_csv(given.out, index=False)
                    print(f"seed {seed}: {column}, {vehicles} vehicles", file=sys.stderr)
    print(table(pd.DataFrame(runs)).to_string())


if __name__ == "__main__":
    main()
