"""Runs of networks that the project does not know, gated, with positions: what was not as it should be.

``python analysis/unseen.py NET [NET ...]`` drives each network with three sets of random loops, 50 to 400
vehicles, lights off and obeyed, for a quarter of an hour; ``--made 200`` drives as many made ones of every
kind for five minutes each. Runs that are done are kept in the results folder and not repeated; a study may
be ended at any time.
"""

from __future__ import annotations

import argparse
import json
import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pandas as pd
from frame_table import frame_table
from made_networks import narrow_streets, netgenerate, roundabouts
from rich.console import Console
from sweep_runs import sweep_runs

from loopgate.errors import ResultsError
from loopgate.network import RoadNetwork
from loopgate.results import columns as c
from loopgate.sweep import Sweep

ROOT = Path(__file__).resolve().parents[1]
PACKAGED = ("sumo:DRT", "sumo:bs3d")
OVERLAPS, FINDINGS, RUNS, ENDED, LOCKED, WAIT_OFF, WAIT_OBEYED, MADE = (
    "overlaps",
    "findings",
    "runs",
    "ended",
    "locked",
    "wait_off_s",
    "wait_obeyed_s",
    "warnings",
)
HEADINGS = {
    c.NETWORK: "network",
    RUNS: "runs",
    ENDED: "aborted",
    LOCKED: "locked",
    c.COLLISIONS: "collisions",
    c.OVERRUNS: "overruns",
    c.TRESPASSES: "trespasses",
    c.STRAYS: "strays",
    OVERLAPS: "overlaps",
    FINDINGS: "other findings",
    WAIT_OFF: "wait, off [s]",
    WAIT_OBEYED: "wait, obeyed [s]",
}
BASE: dict[str, Any] = {
    "abstraction": "queues",
    "gate": "certified",
    "duration_s": 900.0,
    "positions": True,
    "on_deadlock": "continue",
}


def made(count: int, folder: Path) -> Iterator[tuple[str, dict[str, Any]]]:
    """Make networks of every kind, always the same; yield each with what is to be driven on it."""
    folder.mkdir(parents=True, exist_ok=True)
    for number in range(count):
        file = folder / f"made{number:03d}.net.xml"
        if not file.exists():
            _make(random.Random(number), file, number)
        rng = random.Random(f"vehicles {number}")
        scenario = {
            "loops": 30,
            "vehicles": min(rng.choice((30, 80, 150)), _room(file)),
            "lights": rng.choice(("off", "obey")),
            "seed": number,
            "duration_s": 300.0,
        }
        yield str(file), scenario


def _room(file: Path) -> int:
    """Return how many vehicles a network has room for, about: one every 40 m of its streets."""
    network = RoadNetwork.open(file)
    streets = {lane.edge: lane.length_m for lane in network.lanes.values() if not lane.internal}
    return max(2, round(sum(streets.values()) / 40.0))


def _make(rng: random.Random, file: Path, number: int) -> None:
    kind = number % 10
    if kind == 8:  # noqa: PLR2004  two of ten kinds are no kinds of netgenerate
        roundabouts(file, lanes=rng.choice((1, 2, 3)), options=rng.choice(("", "--lefthand")))
        return
    if kind == 9 and number % 20 == 9:  # noqa: PLR2004  as above
        narrow_streets(file)
        return
    shape = rng.choice(
        (
            f"--rand --rand.iterations={rng.randrange(40, 120)} --rand.min-angle={rng.choice((20, 45))}",
            f"--spider --spider.arm-number={rng.randrange(4, 9)} --spider.circle-number={rng.choice((2, 3))}",
            f"--grid --grid.number={rng.randrange(3, 6)} --grid.length={rng.randrange(60, 200)}",
        )
    )
    options = [
        shape,
        f"--seed={number}",
        f"-L {rng.choice((1, 1, 2, 3))}",
        f"-j {rng.choice(('priority', 'right_before_left', 'allway_stop', 'traffic_light'))}",
        rng.choice(("", "--turn-lanes 1 --turn-lanes.length 30")),
        rng.choice(("", "", "--lefthand")),
        rng.choice(("", "", "--rand.random-lanenumber")) if "--rand " in shape else "",
        rng.choice(("", "", "", "--no-internal-links")),
        rng.choice(("", "", f"--default.junctions.radius={rng.choice((2, 8))}")),
    ]
    netgenerate(" ".join(options), file)


def given(
    names: list[str], seeds: int, vehicles: list[int], rules: list[str], turns: dict[str, Any]
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield networks by name with what is to be driven on each; `turns` says whether vehicles turn round."""
    for name in names:
        for seed in range(1, seeds + 1):
            for count in vehicles:
                for lights in rules:
                    yield (
                        name,
                        {
                            "loops": 60,
                            "loop_length_m": "600:4000",
                            "loops_seed": seed,
                            "vehicles": count,
                            "seed": seed,
                            "lights": lights,
                            **turns,
                        },
                    )


def table(runs: pd.DataFrame) -> pd.DataFrame:
    """Return a row per network, or one for all made ones."""
    rows = []
    for name, group in runs.groupby(c.NETWORK, sort=False):
        done = group[group[c.STATUS] == c.STATUS_OK]
        found = [text for audit in done[c.AUDIT] if audit != "clean" for text in json.loads(audit)]
        overlaps = sum("bodies overlap" in text for text in found)
        wait = {lights: part[c.LONGEST_WAIT].max() for lights, part in done.groupby(c.LIGHTS)}
        rows.append(
            {
                c.NETWORK: Path(str(name)).name,
                RUNS: len(group),
                ENDED: len(group) - len(done),
                LOCKED: int((done[c.DEADLOCKS] > 0).sum()),
                **{n: int(done[n].sum()) for n in (c.COLLISIONS, c.OVERRUNS, c.TRESPASSES, c.STRAYS)},
                OVERLAPS: overlaps,
                FINDINGS: len(found) - overlaps,
                WAIT_OFF: wait.get("off"),
                WAIT_OBEYED: wait.get("obey"),
            }
        )
    return pd.DataFrame(rows)


def main() -> None:
    """Run what is missing, then print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("networks", nargs="*", help=f"network files or names; with none {' '.join(PACKAGED)}")
    parser.add_argument("--made", type=int, default=0, help="drive so many made networks instead")
    parser.add_argument("--seeds", type=int, default=3, help="sets of random loops")
    parser.add_argument("--vehicles", type=int, nargs="+", default=[50, 150, 300, 400])
    parser.add_argument("--lights", nargs="+", default=["off", "obey"], choices=("off", "obey"))
    parser.add_argument(
        "--u-turns", action="store_true", help="loops may turn round: corridors have no others"
    )
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "unseen", help="results folder")
    options = parser.parse_args()
    if options.made:
        cases = made(options.made, options.out / "networks")
    else:
        turns = {"u_turns": True} if options.u_turns else {}
        cases = given(
            options.networks or list(PACKAGED), options.seeds, options.vehicles, options.lights, turns
        )
    include = [{"network": name, **scenario} for name, scenario in cases]
    sweep = Sweep("unseen", BASE, {}, include=include, folder=Path.cwd())
    runs = sweep_runs(sweep, options.out, workers=options.jobs)
    if runs.empty:
        msg = f"{options.out}: no rows of this study"
        raise ResultsError(msg)
    console = Console(highlight=False, width=max(Console().width, 150))
    if options.made:
        console.print(frame_table(table(runs.assign(**{c.NETWORK: "made"})), HEADINGS, title="made networks"))
    else:
        console.print(frame_table(table(runs), HEADINGS, title="900 s each"))
    strange = runs[(runs[c.STATUS] != c.STATUS_OK) | (runs[c.KEPT] == False)]  # noqa: E712  it can be missing
    for row in strange.to_dict("records"):
        why = row[c.ERROR] or f"{row[c.COLLISIONS]} collisions, audit {row[c.AUDIT]}"
        console.print(
            f"{row[c.NETWORK]}, {row[c.VEHICLES]} vehicles, seed {row[c.SEED]}, {row[c.LIGHTS]}: {why[:400]}"
        )


if __name__ == "__main__":
    main()
