"""Vehicles whose controllers are processes: ten are killed and start again, the network is cut in two.

    python analysis/vehicles_processes.py                  # 50 vehicles, one hour: some minutes
    python analysis/vehicles_processes.py --vehicles 20 --duration 900

On the five-by-five grid, with positions. A third of the run in, ten processes are killed, and started again
30 s later; two thirds in, the network is cut in two for a minute. A row for the same run without all that is
printed first, decided in one process. Exit code 1 if vehicles collide, if positions or the audit show a
fault, or if somebody has not moved on for ten minutes at the end.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario

GRID = Path(__file__).parents[1] / "networks" / "grid5-priority.net.xml"
OUT = Path("out/vehicles")
LONGEST_STILL_S = 600.0
SHOWN = (
    "moves",
    "per_move",
    "bytes_per_move",
    "cut_off",
    "processes",
    "killed",
    "started_again",
    "datagrams",
)


def main() -> None:
    """Run both, print what became of them."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--vehicles", type=int, default=50)
    parser.add_argument("--killed", type=int, default=10)
    parser.add_argument("--duration", type=float, default=3600.0, help="[s]")
    parser.add_argument("--loss", type=float, default=0.0, help="share of messages lost")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    harm = (
        f"kill={options.killed},kill_at={options.duration / 3:g},again=30,"
        f"cut=60,cut_at={2 * options.duration / 3:g}"
    )
    wrong = 0
    for decide in (f"vehicles:loss={options.loss}", f"processes:loss={options.loss},{harm}"):
        scenario = Scenario(
            network=str(GRID),
            loops=180,
            vehicles=options.vehicles,
            duration_s=options.duration,
            seed=options.seed,
            decide=decide,
            positions=True,
        )
        summary = simulate(scenario, OUT / "processes", overwrite=True)
        found = summary["by_messages"]
        print(decide)
        said = (
            f"{summary['distance_km']:.1f} km, {summary['collisions']} collisions",
            f"audit {summary['audit']}, {summary['outcome']}, unsafe {found['unsafe']}",
            f"longest wait {summary['longest_wait_s']} s, nobody still for over {found['longest_still_s']} s",
            f"{summary['wall_s']['total']} s of wall time",
        )
        print("  " + ", ".join(said))
        print("  " + ", ".join(f"{name} {found[name]}" for name in SHOWN if name in found), flush=True)
        wrong += not summary["clean"] or summary["outcome"] != "done" or found["unsafe"] > 0
        wrong += found["longest_still_s"] > LONGEST_STILL_S
    sys.exit(int(wrong > 0))


if __name__ == "__main__":
    main()
