"""Whether everyone gets round in dense traffic, and what the longest waits are for, without service and with.

    python analysis/in_traffic.py --seeds 5 --jobs 2

drives two hours each of the five-by-five grid with 400 vehicles and with the most that can start (40 random
loops of 400 to 2000 m), and of south-east Berlin with 600 and 1,000 (60 loops of 400 to 3000 m), lights off
and obeyed; once with ``--serve-after 0`` and once as it is. Runs that are done are kept in the results folder
and not repeated; a study may be ended at any time, and ``--table`` prints what there is so far.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pandas as pd

from loopgate.cli.terminal import show_progress
from loopgate.errors import TooManyVehiclesError
from loopgate.results.columns import EVENT, LOOP_LENGTH, TIME, VEHICLE, Event
from loopgate.results.recorder import read_events
from loopgate.simulation.run import simulate
from loopgate.simulation.run_folder import EVENTS, VEHICLES
from loopgate.simulation.scenario import Scenario

ROOT = Path(__file__).resolve().parents[1]
HOUR_S = 3600.0
DURATION_S = 2 * HOUR_S
MOST = 100_000
"""More than fits anywhere."""

LIT = {"off": "priority", "obey": "actuated"}
CAUSES = ("crossing", "occupied", "deadlock", "reserve", "service", "red")
LATE = "lapless"
PLACES = (("grid", 400), ("berlin", 600), ("grid", MOST), ("berlin", 1000))


def scenario(place: str, vehicles: int, lights: str, seed: int, serve_after_s: float | None) -> Scenario:
    """Return what is driven; None is the patience that runs have by themselves."""
    network, loops, length_m = "sumo:DRT", 60, (400.0, 3000.0)
    if place == "grid":
        network = str(ROOT / "networks" / f"grid5-{LIT[lights]}.net.xml")
        loops, length_m = 40, (400.0, 2000.0)
    made = Scenario(
        network=network,
        loops=loops,
        loop_length_m=length_m,
        loops_seed=seed,
        seed=seed,
        vehicles=vehicles,
        lights=lights,
        duration_s=DURATION_S,
        on_deadlock="continue",
    )
    if serve_after_s is None:
        return made
    return Scenario(**{**made.to_dict(), "loop_length_m": length_m, "serve_after_s": serve_after_s})


def drive(wanted: Scenario) -> dict[str, Any]:
    """Drive it, with fewer vehicles where so many cannot start; return what the table needs."""
    with TemporaryDirectory() as name:
        folder = Path(name) / "run"
        try:
            summary = simulate(wanted, folder)
        except TooManyVehiclesError as error:
            fewer = {**wanted.to_dict(), "loop_length_m": wanted.loop_length_m, "vehicles": error.fitting}
            summary = simulate(Scenario(**fewer), folder, overwrite=True)
        lapping = read_events(folder / EVENTS, (Event.LAP,))
        vehicles = pd.read_parquet(folder / VEHICLES)
    keys = ("vehicles", "distance_km", "laps", "longest_wait_s", "longest_wait", "longest_waits_s", "clean")
    late = lapless(lapping, vehicles, summary["mean_speed_mps"])
    return {key: summary[key] for key in keys} | {"deadlocks": len(summary["deadlocks"]), LATE: late}


def lapless(events: pd.DataFrame, vehicles: pd.DataFrame, mean_speed_mps: float) -> int:
    """Count the vehicles without a lap in the last hour whose lap, at the mean speed of all, is no longer."""
    late = events[(events[EVENT] == str(Event.LAP)) & (events[TIME] > DURATION_S - HOUR_S)]
    without = vehicles[~vehicles[VEHICLE].isin(late[VEHICLE])]
    return int((without[LOOP_LENGTH] < mean_speed_mps * HOUR_S).sum())


def tasks(seeds: int) -> Iterator[tuple[str, Scenario]]:
    """Yield all runs by name, one seed after the other."""
    for seed in range(1, seeds + 1):
        for place, vehicles in PLACES:
            for lights in LIT:
                for after, serve_after_s in (("before", 0.0), ("after", None)):
                    many = "most" if vehicles == MOST else str(vehicles)
                    name = f"{place}-{many}-{lights}-{after}-{seed}"
                    yield name, scenario(place, vehicles, lights, seed, serve_after_s)


def table(rows: Iterable[tuple[str, Mapping[str, Any]]]) -> Iterator[str]:
    """Yield the lines of a table: a row per place, number of vehicles and lights, before / after."""
    frame = pd.DataFrame([{**dict(zip(NAMES, name.split("-"), strict=True)), **row} for name, row in rows])
    causes = " | ".join(f"for {cause} [s]" for cause in CAUSES)
    yield (
        "| | vehicles | lights | seeds | vehicle-km | of before | without a lap | longest wait [s] "
        f"| {causes} |"
    )
    yield "|" + "---|" * (8 + len(CAUSES))
    for (place, many, lights), group in frame.groupby(["place", "many", "lights"], sort=False):
        both = group.pivot_table(index="seed", columns="when", values="distance_km").dropna()
        if both.empty or set(both.columns) != {"before", "after"}:
            continue
        known = group[group["seed"].isin(both.index)]
        pairs = [known[known["when"] == when] for when in ("before", "after")]
        numbers = sorted({int(n) for n in group["vehicles"]})
        vehicles = str(numbers[0]) if len(numbers) == 1 else f"{numbers[0]} to {numbers[-1]}"
        cells = [
            vehicles + (", the most" if many == "most" else ""),
            str(lights),
            str(len(both)),
            _pair(f"{part['distance_km'].mean():.0f}" for part in pairs),
            f"{both['after'].sum() / both['before'].sum():.3f}",
            _pair(str(int(part[LATE].sum())) for part in pairs),
            _pair(f"{part['longest_wait_s'].max():.0f}" for part in pairs),
            *(_pair(f"{_longest(part, cause):.0f}" for part in pairs) for cause in CAUSES),
        ]
        yield f"| {place} | " + " | ".join(cells) + " |"


NAMES = ("place", "many", "lights", "when", "seed")


def _longest(part: pd.DataFrame, cause: str) -> float:
    return max(float(waits.get(cause, 0.0)) for waits in part["longest_waits_s"])


def _pair(cells: Iterable[str]) -> str:
    return " / ".join(cells)


def main() -> None:
    """Make the runs that are missing, and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--jobs", type=int, default=1, help="runs at the same time")
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "in_traffic", help="folder of the results")
    parser.add_argument("--table", action="store_true", help="make no runs, print what there is")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    files = {name: given.out / f"{name}.json" for name, _ in tasks(given.seeds)}
    missing = [(name, wanted) for name, wanted in tasks(given.seeds) if not files[name].exists()]
    if not given.table:
        make(missing, files, given.jobs)
    rows = [(name, json.loads(f.read_text(encoding="utf-8"))) for name, f in files.items() if f.exists()]
    if not rows:
        print(f"no run is done yet in {given.out}")
        return
    print("\n".join(table(rows)))
    for name, row in rows:
        if not row["clean"] or row["deadlocks"]:
            print(f"{name}: clean {row['clean']}, {row['deadlocks']} deadlocks")


def make(missing: Sequence[tuple[str, Scenario]], files: Mapping[str, Path], jobs: int) -> None:
    """Make runs, and write what the table needs of each as soon as it is done."""
    with (
        ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool,
        show_progress("runs", total=len(files)) as report,
    ):
        under_way = {pool.submit(drive, wanted): name for name, wanted in missing}
        for done, future in enumerate(as_completed(under_way), start=len(files) - len(missing) + 1):
            file = files[under_way[future]]
            whole = file.with_suffix(".part")
            whole.write_text(json.dumps(future.result(), indent=1) + "\n", encoding="utf-8")
            whole.replace(file)
            report(done)


if __name__ == "__main__":
    main()
