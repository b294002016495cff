# %% [markdown]
"""A study from nothing to figures, cell by cell: ``python analysis/worked_study.py [FOLDER]``.

Open it in an editor that knows ``# %%`` cells, or run it as it is: a sweep of 24 short runs on a five-by-five
grid, tables in pandas, one run looked at closely, and the report. It takes about a minute; run again, the
sweep is there already.
"""

# %% What to run: two gates on the same loops, starts and seeds
import sys
from pathlib import Path

from loopgate import (
    Scenario,
    Sweep,
    read_results,
    run,
    run_sweep,
    write_report,
)
from loopgate.analysis import compute_deadlock_rate, compute_holds, compute_laps, compute_mean, compute_paired

HERE = Path(__file__).resolve().parent
OUT = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE.parent / "out" / "worked-study"
BASE = {
    "network": str(HERE.parent / "networks" / "grid5-priority.net.xml"),
    "abstraction": "queues",
    "loops": 12,
    "duration_s": 300,
    "on_deadlock": "continue",
}


def main() -> None:
    """Run the cells; a spawned worker imports this file, and must not sweep itself."""
    # %% Run it: a row per run, whatever happens
    sweep = Sweep(
        "worked-study", BASE, {"vehicles": [10, 40, 80], "gate": ["open", "certified"], "seed": [1, 2, 3, 4]}
    )
    outcome = run_sweep(sweep, OUT)
    print(f"{outcome.done} runs made in {outcome.seconds:.0f} s, {outcome.present} were there already\n")

    # %% Load it: one line, tidy tables, units in the names
    results = read_results(OUT)
    runs = results.runs

    # %% How much do they drive, and is the difference more than luck?
    print(compute_mean(runs=runs, value="km_per_h").round(1).to_string(index=False), "\n")
    print(compute_paired(runs=runs, baseline="open", value="km_per_h").round(2).to_string(index=False), "\n")

    # %% How often do they lock up?
    print(compute_deadlock_rate(runs=runs).round(2).to_string(index=False), "\n")

    # %% One run, closely: whose laps take longest, and how much of that is waiting?
    scenario = Scenario.from_dict({**BASE, "vehicles": 40, "gate": "certified", "seed": 1})
    one = run(scenario, OUT / "one-run", overwrite=True)
    end_s = one.summary["duration_s"]
    laps = compute_laps(events=one.events, end_s=end_s)
    holds = compute_holds(events=one.events, end_s=end_s)
    print(laps.nlargest(5, "lap_s").to_string(index=False), "\n")
    print(f"{holds['hold_s'].sum():.0f} s of holds, {holds['hold_s'].max():.0f} s the longest\n")

    # %% All of it on one page
    print(write_report(results, OUT / "report.html").page)


if __name__ == "__main__":
    main()
