"""Short runs over all that a gate can be asked to do, whose traces and calls to SUMO are known by hash.

Where one differs the drive does something else than it did. If that is meant, say why in the commit and renew
the hashes: ``python tests/sumo/test_frozen_runs.py``.
"""

from __future__ import annotations

import hashlib
import json
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any

import pytest

from loopgate.network import RoadNetwork, generate_loops
from loopgate.results.recorder import read_events
from loopgate.simulation.run import run
from loopgate.simulation.scenario import Scenario
from loopgate.traffic.sumo import SumoTraffic

pytestmark = pytest.mark.sumo

ROOT = Path(__file__).parents[2]
FROZEN = Path(__file__).with_name("frozen_runs.json")
TEMPORARY = "somewhere"

ORDER2 = Scenario(
    network=str(ROOT / "networks" / "order2.net.xml"),
    routes=str(ROOT / "routes" / "order2.rou.xml"),
    abstraction="segments",
    duration_s=900.0,
)
RING3 = replace(
    ORDER2,
    network=str(ROOT / "networks" / "ring3.net.xml"),
    routes=str(ROOT / "routes" / "ring3.rou.xml"),
)
GRID = Scenario(
    network=str(ROOT / "networks" / "grid5-priority.net.xml"), loops=12, vehicles=90, duration_s=120.0
)
ACTUATED = replace(GRID, network=str(ROOT / "networks" / "grid5-actuated.net.xml"), vehicles=60)

SCENARIOS: dict[str, Scenario] = {
    "open": replace(GRID, gate="open", vehicles=60),
    "open, lights off": replace(ACTUATED, gate="open", lights="off"),
    **{f"order2 {gate}": replace(ORDER2, gate=gate) for gate in ("collision", "one-step", "algorithm2")},
    **{f"order2 {gate}": replace(ORDER2, gate=gate) for gate in ("banker", "certified", "agents")},
    "order2 random": replace(ORDER2, negotiation="random"),
    "ring3 collision": replace(RING3, gate="collision"),
    "ring3 everyone": replace(RING3, gate="certified:promise=everyone"),
    "pressure": replace(GRID, loops=30, vehicles=240),
    "no reserve": replace(GRID, loops=40, vehicles=330, negotiation="pressure:crowded=2", duration_s=300.0),
    "warm-up": replace(GRID, warmup_s=50.0, duration_s=60.0),
    "half steps": replace(GRID, step_s=0.5, duration_s=60.0),
    **{name: replace(GRID, negotiation=name) for name in ("oldest", "platoon", "random")},
    "queues collision": replace(GRID, gate="collision", vehicles=150),
    "queues one-step": replace(GRID, gate="one-step"),
    "queues algorithm2": replace(GRID, gate="algorithm2", vehicles=40),
    "queues somebody": replace(GRID, gate="certified:promise=somebody,budget=50", loops=4, vehicles=4),
    "a loop each": replace(GRID, loops=12, vehicles=12),
    "one vehicle": replace(GRID, loops=1, vehicles=1),
    "lights kept": replace(ACTUATED, lights="keep"),
    "lights obeyed": replace(ACTUATED, lights="obey"),
    "lights obeyed on segments": replace(ORDER2, lights="obey"),
    "ordinary traffic": replace(GRID, traffic=f"{TEMPORARY}/others.rou.xml", vehicles=40),
    "ordinary traffic, lights obeyed": replace(
        ACTUATED, traffic=f"{TEMPORARY}/others.rou.xml", vehicles=40, lights="obey"
    ),
    "long and slow vehicles": replace(GRID, routes=f"{TEMPORARY}/kinds.rou.xml", loops=0, vehicles=0),
    "all kinds of cars": replace(GRID, routes=f"{TEMPORARY}/cars.rou.xml", loops=0, vehicles=0),
    "lanes": Scenario(network="sumo:DRT", loops=20, vehicles=60, duration_s=100.0),
    "lanes, oldest": Scenario(
        network="sumo:DRT", loops=20, vehicles=60, duration_s=60.0, negotiation="oldest"
    ),
    "second city, lights obeyed": Scenario(
        network="sumo:bs3d", loops=10, vehicles=30, lights="obey", duration_s=100.0
    ),
    "misled": replace(GRID, vehicles=60, duration_s=80.0),
    "misled, oldest": replace(GRID, vehicles=60, duration_s=80.0, negotiation="oldest"),
}
ACTS = (
    "hold",
    "release",
    "brake",
    "forget_stops",
    "change_lane",
    "put_on_lane",
    "stand",
    "put_under_gate",
)
FIGURES = (
    "decisions", "refusals", "stages", "messages", "hold_s", "longest_wait_s", "laps", "distance_km",
    "overruns", "trespasses", "strays", "outcome", "deadlocks", "audit", "warnings", "at_lights", "others",
)  # fmt: skip


def write_inputs(folder: Path) -> None:
    """Write ordinary traffic between random roads of the grid, and route files with types of vehicles."""
    network = RoadNetwork.open(GRID.network)
    rng = Random(1)
    edges = sorted(network.edges)
    trips = [(number, *rng.sample(edges, 2)) for number in range(50)]
    lines = [f'<trip id="o{n}" depart="{3 * n}" from="{start}" to="{end}"/>' for n, start, end in trips]
    (folder / "others.rou.xml").write_text(f"<routes>{''.join(lines)}</routes>", encoding="utf-8")
    loops = generate_loops(network, 8, length_m=(500.0, 1500.0))
    routes = [f'<route id="{loop.id}" edges="{" ".join(loop.edges)}"/>' for loop in loops]
    for name, kinds in (
        ("cars", [(5.0, 2.6, 4.5), (7.0, 1.5, 3.5), (6.0, 2.0, 6.0)]),
        ("kinds", [(5.0, 2.6, 4.5), (7.0, 1.0, 3.0), (12.0, 1.2, 6.0)]),
    ):
        types = [
            f'<vType id="k{k}" length="{length}" accel="{accel}" decel="{decel}"/>'
            for k, (length, accel, decel) in enumerate(kinds)
        ]
        vehicles = [
            f'<vehicle id="x{k}" type="k{k // 8 % 3}" route="{loops[k % 8].id}" depart="0"/>'
            for k in range(70)
        ]
        text = f"<routes>{''.join(types + routes + vehicles)}</routes>"
        (folder / f"{name}.rou.xml").write_text(text, encoding="utf-8")


def noting(name: str, calls: list[str]) -> Callable[..., object]:
    """Return a method of `SumoTraffic` that notes what it was told and what came of it."""
    call = getattr(SumoTraffic, name)

    def note(self: SumoTraffic, vehicle: str, *args: object, **options: object) -> object:
        done = "refused"
        try:
            done = call(self, vehicle, *args, **options)
        finally:
            told = [*args, *options.values()]
            if not (name == "forget_stops" and done is False):
                calls.append(f"{self.now_s:g} {name} {vehicle} {told} {done}")
        return done

    return note


def mislead(patch: pytest.MonkeyPatch) -> None:
    """Let ten vehicles be thought to be 60 m further on than they are, from the first half minute on."""
    read = SumoTraffic.odometers

    def wrong(self: SumoTraffic, vehicles: Sequence[str]) -> Iterator[float]:
        for number, at_m in enumerate(read(self, vehicles)):
            yield at_m + (60.0 if number < 10 and self.now_s > 30.0 else 0.0)

    patch.setattr(SumoTraffic, "odometers", wrong)


def digests(name: str, folder: Path) -> dict[str, str]:
    """Run a scenario; return hashes of the rows of its trace, of the calls to SUMO, and of its figures."""
    scenario = SCENARIOS[name]
    paths = {key: getattr(scenario, key).replace(TEMPORARY, str(folder)) for key in ("routes", "traffic")}
    calls: list[str] = []
    with pytest.MonkeyPatch.context() as patch:
        for act in ACTS:
            patch.setattr(SumoTraffic, act, noting(act, calls))
        if name.startswith("misled"):
            mislead(patch)
        summary = run(replace(scenario, **paths), folder / "run", overwrite=True)
    rows = read_events(folder / "run" / "events.parquet").to_csv(index=False)
    figures: dict[str, Any] = {key: summary.get(key) for key in FIGURES}
    return {
        "rows": _hash(rows),
        "calls": _hash("\n".join(calls)),
        "figures": _hash(json.dumps(figures, sort_keys=True).replace(str(folder), "")),
    }


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:12]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make a folder with the inputs."""
    made = tmp_path_factory.mktemp("frozen")
    write_inputs(made)
    return made


@pytest.mark.parametrize("name", SCENARIOS)
def test_a_run_is_as_it_was(name: str, folder: Path) -> None:
    """Row for row, call for call."""
    known = json.loads(FROZEN.read_text(encoding="utf-8"))
    assert digests(name, folder) == known[name]


def renew() -> None:
    """Write the hashes of all runs as they are now, and say which differ."""
    known = json.loads(FROZEN.read_text(encoding="utf-8")) if FROZEN.exists() else {}
    made = {}
    with tempfile.TemporaryDirectory() as name:
        write_inputs(Path(name))
        for run_name in SCENARIOS:
            made[run_name] = digests(run_name, Path(name))
            if made[run_name] != known.get(run_name):
                sys.stdout.write(f"{run_name}: differs\n")
    FROZEN.write_text(json.dumps(made, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    renew()
