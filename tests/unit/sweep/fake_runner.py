"""A runner that needs no SUMO: a run folder whose figures follow from the scenario alone.

Throughput rises with the vehicles and falls past 80; the gate `open` locks up from 60 vehicles on, later for
greater seeds. Further scenario keys: `sleep_s`, `trouble` (`raise`, `bug`, `die`, `hang`,
`disk`), and `touch`, a file to make when the run begins.
"""

from __future__ import annotations

import errno
import itertools
import json
import os
import signal
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from loopgate.errors import ScenarioError
from loopgate.results.columns import EVENT_COLUMNS, VEHICLE_COLUMNS

EDGES = 12


def run(scenario: Mapping[str, Any], out: Path) -> None:
    """Write a run folder to `out`."""
    if "touch" in scenario:
        Path(scenario["touch"]).touch()
    time.sleep(float(scenario.get("sleep_s", 0)))
    _trouble(scenario.get("trouble"))
    vehicles, seed = int(scenario["vehicles"]), int(scenario.get("seed", 0))
    gate, duration = str(scenario.get("gate", "open")), float(scenario.get("duration_s", 600))
    random = np.random.default_rng([vehicles, seed, len(gate)])
    locked = gate == "open" and vehicles >= 60
    at = min(duration, 100.0 + 30 * seed + 5000 / vehicles)
    end = at if locked else duration
    lap = (40 + vehicles) * (1.0 if gate == "open" else 0.8)
    rows: list[tuple[float, str, str, str, str]] = []
    for vehicle in range(vehicles):
        rows.append((0.0, f"v{vehicle}", "start", "p0", ""))
        times = np.arange(lap, end, lap) + random.uniform(0, lap / 4, len(np.arange(lap, end, lap)))
        rows += [(float(t), f"v{vehicle}", "lap", "p0", "") for t in times if t <= end]
    rows += [(float(t), "v0", "edge", f"e{i % EDGES}", "") for i, t in enumerate(np.arange(0, end, 9))]
    if gate != "open":
        rows += [(20.0, "v0", "refuse", "p1", "occupied"), (31.0, "v0", "refuse", "p1", "crossing")]
        rows += [(35.0, "v0", "grant", "p1", "free")]
    events = pd.DataFrame(rows, columns=list(EVENT_COLUMNS[:5]))
    events.to_parquet(out / "events.parquet", index=False)
    _tables(out, vehicles, end, locked=locked)
    _edges(random, vehicles).to_parquet(out / "edges.parquet", index=False)
    laps = int((events["event"] == "lap").sum())
    hours = end / 3600
    deadlocks = (
        [
            {
                "closed_at_s": at,
                "noticed_at_s": at + 60,
                "vehicles": ["v0", "v1", "v2"],
                "places": ["a", "b", "c"],
            }
        ]
        if locked
        else []
    )
    summary = {
        "network": scenario.get("network", "fake"),
        "abstraction": "queues",
        "gate": gate,
        "negotiation": "oldest",
        "seed": seed,
        "vehicles": vehicles,
        "loops": scenario.get("loops", scenario.get("on_loops", 4)),
        "duration_s": end,
        "laps": laps,
        "distance_km": laps * 0.5,
        "mean_speed_mps": 500 / lap,
        "laps_per_h": laps / hours,
        "km_per_h": laps * 0.5 / hours,
        "hold_s": float(vehicles),
        "stood_s": 3.0 * vehicles,
        "longest_wait_s": 17.0,
        "longest_waits_s": {} if gate == "open" else {"crossing": 12.0 + seed, "occupied": vehicles / 10},
        "idleness_s": 12.0,
        "worst_idleness_s": 80.0 + seed,
        "unvisited_edges": 0,
        "coverage_edges": 0.5,
        "coverage_lane_km": 0.4,
        "outcome": "deadlock" if locked else "done",
        "deadlocks": deadlocks,
        "collisions": 0,
        "teleports": 0,
        "decisions": laps * 10,
        "refusals": {"occupied": laps, "unsafe": 2},
        "decision_us": {"median": 20.0 + vehicles / 10, "p99": 90.0, "max": 400.0},
        "wall_s": {"sumo": 0.1, "gate": 0.02, "total": 0.2},
        "audit": "not gated" if gate == "open" else "clean",
        "warnings": [f"{scenario.get('network', 'fake')}: found 4 of 12 loops"],
        "versions": {"loopgate": "0", "sumo": "1.28.0"},
        "command": f"loopgate run {scenario.get('network', 'fake')} --vehicles {vehicles} --seed {seed}",
    }
    (out / "scenario.toml").write_text(f"duration_s = {duration}\n", encoding="utf-8")
    (out / "summary.json").write_text(json.dumps(summary), encoding="utf-8")


def _edges(random: np.random.Generator, vehicles: int) -> pd.DataFrame:
    angle = np.linspace(0, 2 * np.pi, EDGES + 1)
    ends = [f"{100 * np.cos(a):.1f},{100 * np.sin(a):.1f}" for a in angle]
    return pd.DataFrame(
        {
            "edge": [f"e{i}" for i in range(EDGES)],
            "length_m": 52.0,
            "visits": random.integers(1, 50, EDGES),
            "mean_revisit_s": random.uniform(5, 50, EDGES) * 40 / vehicles,
            "max_revisit_s": random.uniform(50, 90, EDGES),
            "weighted_revisit_s": random.uniform(50, 60, EDGES),
            "idleness_s": random.uniform(5, 20, EDGES) * 40 / vehicles,
            "worst_idleness_s": random.uniform(60, 90, EDGES),
            "hold_s": random.uniform(0, 2, EDGES) * vehicles,
            "stood_s": np.linspace(1, 3, EDGES) * vehicles,
            "junction": [f"J{i // 2}" for i in range(EDGES)],
            "shape": [f"{a} {b}" for a, b in itertools.pairwise(ends)],
        }
    )


def _tables(out: Path, vehicles: int, end: float, *, locked: bool) -> None:
    """Write the other tables of a run folder; in a deadlock three vehicles stand from the start."""
    names = [f"v{n}" for n in range(vehicles)]
    standing = [end if locked and n < 3 else 0.0 for n in range(vehicles)]
    columns = dict.fromkeys(VEHICLE_COLUMNS, 0.0) | {"loop": "l0", "loop_length_m": 624.0}
    table = pd.DataFrame(columns, index=range(vehicles)).assign(
        vehicle=names, standing_s=standing, stood_s=3.0
    )
    table.to_parquet(out / "vehicles.parquet", index=False)
    time_s = np.arange(10.0, end, 10.0)
    flow = pd.DataFrame(
        {"time_s": time_s, "vehicles": vehicles, "standing": 2.0, "distance_m": 90.0, "laps": 1}
    )
    flow.to_parquet(out / "flow.parquet", index=False)
    begins = [52.0 * i for i in range(EDGES)]
    loops = pd.DataFrame({"loop": "l0", "edge": [f"e{i}" for i in range(EDGES)], "begin_m": begins})
    loops.to_parquet(out / "loops.parquet", index=False)


def _trouble(kind: object) -> None:
    if kind == "raise":
        msg = "edge e7: no lane\nfor passenger"
        raise ScenarioError(msg)
    if kind == "bug":
        kind = 1 // 0
    if kind == "die":
        os.kill(os.getpid(), signal.SIGKILL)
    if kind == "hang":
        time.sleep(60)
    if kind == "disk":
        msg = "cannot write"
        raise ScenarioError(msg) from OSError(errno.ENOSPC, "No space left on device")
