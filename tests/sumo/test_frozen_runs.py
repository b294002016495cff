"""Short runs over all that a gate can be asked to do, whose traces and calls to SUMO are known by hash.

Where one differs the drive does something else than it did. If that is meant, say why in the commit and renew
the hashes: ``python tests/sumo/test_frozen_runs.py``; with the names of runs that only says which differ.
"""

from __future__ import annotations

import hashlib
import json
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any, Final

import pytest
from heart import draw_trips
from made_networks import netgenerate, small_roundabout, two_rings_of_road
from stopping import loops_with_stops

from loopgate.network import RoadNetwork, generate_loops
from loopgate.results.recorder import read_events
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.watching.deadlock_detector import Deadlock, DeadlockDetector
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
    network=str(ROOT / "networks" / "grid5-priority.net.xml"), loops=12, vehicles=90, duration_s=80.0
)
ACTUATED = replace(GRID, network=str(ROOT / "networks" / "grid5-actuated.net.xml"), vehicles=60)
TOWN = Scenario(
    network="sumo:DRT", traffic=f"{TEMPORARY}/town.rou.xml", loops=30, vehicles=100, duration_s=100.0
)

SCENARIOS: Final[dict[str, Scenario]] = {
    "open": replace(GRID, gate="open", vehicles=60),
    "open, lights off": replace(ACTUATED, gate="open", lights="off"),
    **{f"order2 {gate}": replace(ORDER2, gate=gate) for gate in ("collision", "one-step", "algorithm2")},
    **{f"order2 {gate}": replace(ORDER2, gate=gate) for gate in ("banker", "certified")},
    "order2 random": replace(ORDER2, negotiation="random"),
    "ring3 collision": replace(RING3, gate="collision"),
    "ring3 everyone": replace(RING3, gate="certified:promise=everyone"),
    "pressure": replace(GRID, loops=30, vehicles=240),
    "no reserve": replace(GRID, loops=40, vehicles=330, negotiation="pressure:crowded=2", duration_s=300.0),
    "served": replace(GRID, loops=40, vehicles=330, serve_after_s=20.0, duration_s=120.0),
    "served, lights obeyed": replace(ACTUATED, vehicles=240, loops=30, lights="obey", serve_after_s=30.0),
    "warm-up": replace(GRID, warmup_s=30.0, duration_s=40.0),
    "half steps": replace(GRID, step_s=0.5, duration_s=60.0),
    **{name: replace(GRID, negotiation=name) for name in ("oldest", "random")},
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
    "lanes": Scenario(network="sumo:DRT", loops=20, vehicles=60, duration_s=60.0),
    "lanes, oldest": Scenario(
        network="sumo:DRT", loops=20, vehicles=60, duration_s=60.0, negotiation="oldest"
    ),
    "second city, lights obeyed": Scenario(
        network="sumo:bs3d", loops=10, vehicles=30, lights="obey", duration_s=100.0
    ),
    "a loop that passes edges several times": replace(
        GRID,
        network=f"{TEMPORARY}/small.net.xml",
        routes=f"{TEMPORARY}/small.rou.xml",
        loops=0,
        vehicles=2,
        gate="certified:promise=somebody",
    ),
    "braking over several laps": replace(
        GRID,
        network=f"{TEMPORARY}/rings.net.xml",
        routes=f"{TEMPORARY}/rings.rou.xml",
        loops=0,
        vehicles=2,
        gate="certified:promise=somebody",
    ),
    "left turners": replace(GRID, network=f"{TEMPORARY}/wide.net.xml", loops=20, vehicles=90, seed=294),
    "trips, more than fit": replace(
        GRID, routes=f"{TEMPORARY}/trips.rou.xml", loops=0, vehicles=0, duration_s=150.0
    ),
    "trips, lights obeyed": replace(
        ACTUATED, routes=f"{TEMPORARY}/trips.rou.xml", loops=0, vehicles=0, lights="obey", duration_s=100.0
    ),
    "stops and parking": replace(
        GRID,
        routes=f"{TEMPORARY}/stops.rou.xml",
        stops=f"{TEMPORARY}/stops.add.xml",
        loops=0,
        vehicles=0,
        duration_s=300.0,
    ),
    "closures and breakdowns": replace(
        GRID,
        incidents=f"{TEMPORARY}/incidents.toml",
        vehicles=60,
        duration_s=150.0,
    ),
    "held apart": replace(GRID, spacing="hold", vehicles=60),
    "a town among ordinary traffic": replace(TOWN, lights="off"),
    "a town among ordinary traffic, lights obeyed": replace(TOWN, lights="obey"),
    "misled": replace(GRID, vehicles=60, duration_s=60.0),
    "misled, oldest": replace(GRID, vehicles=60, duration_s=60.0, negotiation="oldest"),
}
ACTS = (
    "hold",
    "release",
    "brake",
    "forget_stops",
    "change_lane",
    "put_on_lane",
    "keep_to",
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
    trips = [(number, rng.sample(edges, 2)) for number in range(50)]
    lines = [f'<trip id="o{n}" depart="{3 * n}" from="{start}" to="{end}"/>' for n, (start, end) in trips]
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

    ring = ("r0", "r1", "r2", "r3")
    small_roundabout(folder / "small.net.xml")
    round_and_round = " ".join(["in", *ring, *ring, "r0", "r1", "out"])
    (folder / "small.rou.xml").write_text(
        f'<routes><route id="L" edges="{round_and_round}"/></routes>', encoding="utf-8"
    )
    two_rings_of_road(folder / "rings.net.xml")
    lines = ['<vType id="car" length="5" minGap="2.5" decel="0.5" accel="2.6"/>']
    lines += [f'<route id="L{k}" edges="e{k}0 e{k}1 e{k}2 e{k}3"/>' for k in range(2)]
    (folder / "rings.rou.xml").write_text(f"<routes>{''.join(lines)}</routes>", encoding="utf-8")
    spider = "--spider --spider.arm-number=6 --spider.circle-number=2 --spider.space-radius=100 --seed=103294"
    options = f"{spider} -L 3 -j traffic_light --default.junctions.radius=8"
    netgenerate(options, folder / "wide.net.xml")
    write_trips(folder, network)
    write_stops(folder, network)
    draw_trips("sumo:DRT", 1.0, 100.0, 1, folder / "town.rou.xml")


def write_trips(folder: Path, network: RoadNetwork) -> None:
    """Write trips of cars, vans and buses on twenty ways, three in a second; and incidents for others."""
    rng, edges = Random(2), sorted(network.edges)
    kinds = {"car": (5.0, 2.5), "van": (7.0, 1.5), "bus": (12.0, 3.5)}
    lines = [f'<vType id="{k}" length="{m}" minGap="{gap}"/>' for k, (m, gap) in kinds.items()]
    ways = [rng.sample(edges, 2) for _ in range(20)]
    for number in range(300):
        (start, end), kind = rng.choice(ways), rng.choice(("car", "car", "car", "van", "bus"))
        depart = f'id="t{number}" type="{kind}" depart="{number / 3:.0f}"'
        lines.append(f'<trip {depart} from="{start}" to="{end}"/>')
    (folder / "trips.rou.xml").write_text(f"<routes>{''.join(lines)}</routes>", encoding="utf-8")
    incidents = (
        '[[closures]]\nedge = "C2C1"\nfrom = 20\nto = 120\n'
        '[[closures]]\nlane = "B2C2_0"\nfrom = 100\nto = 160\n'
        '[[breakdowns]]\nvehicle = "v1"\nfrom = 45\nto = 180\n[[breakdowns]]\nvehicle = "v9"\nfrom = 90\n'
    )
    (folder / "incidents.toml").write_text(incidents, encoding="utf-8")


def write_stops(folder: Path, network: RoadNetwork) -> None:
    """Write loops with stops on every third road, and a flow of vehicles that park among others."""
    lines = loops_with_stops(generate_loops(network, 10, length_m=(500.0, 1500.0)))
    ring = 'edges="B2C2 C2C1 C1B1 B1B2"'
    lines += [
        f'<route id="long" {ring}><stop parkingArea="yard" duration="100"/></route>',
        f'<route id="short" {ring}><stop parkingArea="kerb" duration="30"/></route>',
        '<flow id="p" route="short" begin="2" period="9" number="8"/>',
        '<vehicle id="l" route="long" depart="0"/><vehicle id="m" route="long" depart="20"/>',
    ]
    lines.sort(key=lambda line: 'depart="20"' in line or "<flow" in line)
    places = (
        '<parkingArea id="yard" lane="C2C1_0" startPos="20" endPos="60" roadsideCapacity="3"/>'
        '<parkingArea id="kerb" lane="B1B2_0" startPos="10" endPos="70" roadsideCapacity="6"/>'
    )
    (folder / "stops.rou.xml").write_text(f"<routes>{''.join(lines)}</routes>", encoding="utf-8")
    (folder / "stops.add.xml").write_text(f"<additional>{places}</additional>", encoding="utf-8")


class Witness(DeadlockDetector):
    """A watch that keeps what the gate says of those it refuses."""

    said: list[str]

    def check(self) -> Deadlock | None:
        """Ask about every vehicle."""
        if self._at_gate is not None:
            for vehicle in self._traffic.vehicles():
                refused = self._at_gate(vehicle)
                if refused is not None:
                    sets, place = refused()
                    ordered = sorted(sorted(some) for some in sets)
                    self.said.append(f"{self._traffic.now_s:g} {vehicle} {ordered} {place}")
        return super().check()


def noting(name: str, calls: list[str]) -> Callable[..., object]:
    """Return a method of `SumoTraffic` that notes what it was told and what came of it."""
    call = getattr(SumoTraffic, name)

    def note(self: SumoTraffic, vehicle: str, *args: object, **options: object) -> object:
        done: object = "refused"
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

    def wrong(self: SumoTraffic, vehicles: Sequence[str]) -> list[float]:
        at_m = read(self, vehicles)
        return [one + 60.0 for one in at_m[:10]] + at_m[10:] if self.now_s > 30.0 else at_m

    patch.setattr(SumoTraffic, "odometers", wrong)


def digests(name: str, folder: Path) -> dict[str, str]:
    """Run a scenario; return hashes of trace, calls to SUMO, what the gate said, and figures."""
    scenario = SCENARIOS[name]
    keys = ("network", "routes", "traffic", "stops", "incidents")
    paths = {key: getattr(scenario, key).replace(TEMPORARY, str(folder)) for key in keys}
    Witness.said = []
    calls: list[str] = []
    with pytest.MonkeyPatch.context() as patch:
        for act in ACTS:
            patch.setattr(SumoTraffic, act, noting(act, calls))
        if name.startswith("misled"):
            mislead(patch)
        summary = simulate(replace(scenario, **paths), folder / "run", overwrite=True, detector=Witness)
    rows = read_events(folder / "run" / "events.parquet").to_csv(index=False)
    figures: dict[str, Any] = {key: summary.get(key) for key in FIGURES}
    return {
        "rows": _hash(rows),
        "calls": _hash("\n".join(calls)),
        "said": _hash("\n".join(Witness.said)),
        "refusals": " ".join(summary["refusals"]),
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


def test_refusals_of_all_kinds_are_among_these_runs() -> None:
    """Else they would say nothing of them."""
    known = json.loads(FROZEN.read_text(encoding="utf-8"))
    refusals = {reason for run_digests in known.values() for reason in run_digests["refusals"].split()}
    by_the_gate = {"occupied", "crossing", "deadlock", "reserve", "service", "red", "traffic"}
    assert refusals == by_the_gate | {"closed", "spacing", "stop"}


def differing(names: Sequence[str]) -> dict[str, dict[str, str]]:
    """Return the hashes of all of these runs, and print the names of those that are not as they were."""
    known = json.loads(FROZEN.read_text(encoding="utf-8")) if FROZEN.exists() else {}
    made = {}
    with tempfile.TemporaryDirectory() as folder_name:
        write_inputs(Path(folder_name))
        for name in names:
            made[name] = digests(name, Path(folder_name))
            if made[name] != known.get(name):
                sys.stdout.write(f"{name}: differs\n")
    return made


if __name__ == "__main__":
    if len(sys.argv) > 1:
        differing(sys.argv[1:])
    else:
        FROZEN.write_text(json.dumps(differing(list(SCENARIOS)), indent=1) + "\n", encoding="utf-8")
