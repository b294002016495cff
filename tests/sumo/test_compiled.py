"""The compiled engine beside the plain one: the same run, row for row."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pandas as pd
import pytest
from made_networks import netgenerate, small_roundabout, two_rings_of_road

from loopgate.errors import TrafficError
from loopgate.network import RoadNetwork, generate_loops
from loopgate.results.recorder import read_events
from loopgate.simulation import run as running
from loopgate.simulation.compiled import engine as compiled_engine
from loopgate.simulation.compiled.engine import CompiledEngine
from loopgate.simulation.fleet import Fleet
from loopgate.simulation.run import run
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.sensing import Floats
from loopgate.simulation.watch import Deadlock, Watch
from loopgate.traffic.sumo import SumoTraffic

pytestmark = pytest.mark.sumo

GRID = str(Path(__file__).parents[2] / "networks" / "grid5-priority.net.xml")
DENSE = Scenario(network=GRID, loops=40, vehicles=300, duration_s=600.0, warmup_s=200.0, lights="off")
SCENARIOS = {
    "dense grid": DENSE,
    "no reserve": replace(DENSE, vehicles=340, negotiation="pressure:crowded=2", duration_s=1500.0),
    "half steps": replace(DENSE, vehicles=120, step_s=0.5, duration_s=300.0),
    "city": Scenario(network="sumo:DRT", loops=60, vehicles=100, duration_s=900.0, lights="off", seed=3),
    "second city": Scenario(network="sumo:bs3d", loops=20, vehicles=100, duration_s=900.0, lights="off"),
}
SOMEBODY = "certified:promise=somebody"
WALL = ("wall_s", "decision_us", "stage_us", "command")


class Witness(Watch):
    """A watch that keeps what the gate says of those it refuses."""

    said: list[tuple[float, str, list[list[str]], str]]

    def check(self) -> Deadlock | None:
        if self._at_gate is not None:
            for vehicle in self._traffic.vehicles():
                refused = self._at_gate(vehicle)
                if refused is not None:
                    sets, place = refused()
                    ordered = sorted(sorted(some) for some in sets)
                    self.said.append((self._traffic.now_s, vehicle, ordered, place))
        return super().check()


@dataclass
class Made:
    """What a run left, and what it asked of SUMO."""

    events: pd.DataFrame
    vehicles: pd.DataFrame
    summary: dict[str, Any]
    said: list[tuple[float, str, list[list[str]], str]]
    calls: list[tuple[float, str, str]]


def noting(name: str, calls: list[tuple[float, str, str]]) -> Callable[..., object]:
    """Return a method of `SumoTraffic` that notes what it did."""
    call = getattr(SumoTraffic, name)

    def note(self: SumoTraffic, vehicle: str, *args: object) -> object:
        done = call(self, vehicle, *args)
        if done is not False:
            calls.append((self.now_s, name, vehicle))
        return done

    return note


def make(scenario: Scenario, folder: Path, *, compiled: bool) -> Made:
    """Run, with all calls noted that hold vehicles, let them go, or make SUMO forget their stops."""
    calls: list[tuple[float, str, str]] = []
    with pytest.MonkeyPatch.context() as patch:
        for name in ("hold", "release", "forget_stops"):
            patch.setattr(SumoTraffic, name, noting(name, calls))
        Witness.said = []
        summary = run(scenario, folder, compiled=compiled, watch=Witness)
    return Made(
        read_events(folder / "events.parquet"),
        pd.read_parquet(folder / "vehicles.parquet"),
        {key: value for key, value in summary.items() if key not in WALL},
        Witness.said,
        calls,
    )


def same(scenario: Scenario, folder: Path, *, in_order: bool = True) -> Made:
    """Run by both engines; every row, figure, answer and call must be the same."""
    plain = make(scenario, folder / "plain", compiled=False)
    made = make(scenario, folder / "compiled", compiled=True)
    if not in_order:
        for one in (plain, made):
            one.events = one.events.sort_values(list(one.events.columns[:4]), ignore_index=True)
            one.summary["audit"] = sorted(one.summary["audit"])
    pd.testing.assert_frame_equal(plain.events, made.events)
    pd.testing.assert_frame_equal(plain.vehicles, made.vehicles)
    assert plain.summary == made.summary
    assert plain.said == made.said
    assert plain.calls == made.calls
    assert made.summary["decisions"] > 0
    return made


@pytest.mark.parametrize("name", SCENARIOS)
def test_it_makes_the_same_run(name: str, tmp_path: Path) -> None:
    """Every row of the trace, every figure, whom each refused vehicle waits for, every call."""
    made = same(SCENARIOS[name], tmp_path)
    assert made.said
    assert (name == "no reserve") <= ("forget_stops" in {call for _, call, _ in made.calls})


def test_vehicles_of_all_kinds(tmp_path: Path) -> None:
    """Short and long, quick and slow to brake."""
    loops = generate_loops(RoadNetwork.open(GRID), 8, length_m=(500.0, 1500.0))
    kinds = [(5.0, 2.6, 4.5), (7.0, 1.0, 3.0), (12.0, 1.2, 6.0)]
    lines = [
        f'<vType id="k{k}" length="{length}" accel="{accel}" decel="{decel}"/>'
        for k, (length, accel, decel) in enumerate(kinds)
    ]
    lines += [f'<route id="{loop.id}" edges="{" ".join(loop.edges)}"/>' for loop in loops]
    lines += [
        f'<vehicle id="x{k}" type="k{k // 8 % 3}" route="{loops[k % 8].id}" depart="0"/>' for k in range(90)
    ]
    routes = written(tmp_path / "kinds.rou.xml", *lines)
    same(Scenario(network=GRID, routes=routes, duration_s=900.0), tmp_path)


def test_left_turners_that_wait_on_the_junction(tmp_path: Path) -> None:
    """Where nothing may be foreseen of one that has to wait for a third."""
    options = (
        "--spider --spider.arm-number=6 --spider.circle-number=2 --spider.space-radius=100 --seed=103294"
    )
    net = netgenerate(
        f"{options} -L 3 -j traffic_light --default.junctions.radius=8", tmp_path / "wide.net.xml"
    )
    same(Scenario(network=str(net), loops=40, vehicles=150, seed=294, duration_s=300.0), tmp_path)


def written(file: Path, *elements: str) -> str:
    """Write a route file."""
    file.write_text(f"<routes>{''.join(elements)}</routes>", encoding="utf-8")
    return str(file)


def test_a_loop_that_passes_the_same_short_edges_several_times(tmp_path: Path) -> None:
    """Two and a half times round a small roundabout: one leg crosses a movement more than once."""
    ring = ("r0", "r1", "r2", "r3")
    net = small_roundabout(tmp_path / "small.net.xml")
    edges = ["in", *ring, *ring, "r0", "r1", "out"]
    routes = written(tmp_path / "r.rou.xml", f'<route id="L" edges="{" ".join(edges)}"/>')
    same(Scenario(network=str(net), routes=routes, vehicles=2, gate=SOMEBODY, duration_s=300.0), tmp_path)


@pytest.mark.parametrize("decel", [0.5, 1.0, 4.5])
def test_vehicles_that_brake_over_several_laps(decel: float, tmp_path: Path) -> None:
    """Each holds its own places again and again."""
    net = two_rings_of_road(tmp_path / "rings.net.xml")
    lines = [f'<vType id="car" length="5" minGap="2.5" decel="{decel}" accel="2.6"/>']
    lines += [f'<route id="L{k}" edges="e{k}0 e{k}1 e{k}2 e{k}3"/>' for k in range(2)]
    routes = written(tmp_path / "r.rou.xml", *lines)
    same(Scenario(network=str(net), routes=routes, vehicles=2, gate=SOMEBODY, duration_s=200.0), tmp_path)


def test_what_should_never_happen_is_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ten vehicles are thought to be 60 m further on than they are, from the first minute on."""
    read, reads = Fleet.read, Counter[Fleet]()

    def wrong(self: Fleet) -> Floats:
        odometer = read(self)
        reads[self] += 1
        if reads[self] > 60:
            odometer[:10] += 60.0
        return odometer

    monkeypatch.setattr(Fleet, "read", wrong)
    # Who is braked is noted outside of compiled code, after the rest of the step.
    made = same(replace(DENSE, vehicles=60, warmup_s=0.0, duration_s=70.0), tmp_path, in_order=False)
    assert made.summary["trespasses"] > 0


def test_refusals_of_all_kinds_are_among_those_runs(tmp_path: Path) -> None:
    """Else the comparison above would say nothing of them."""
    summary = run(SCENARIOS["no reserve"], tmp_path / "a")
    assert summary["promise"] == "everyone"
    refusals = summary["refusals"]
    refusals |= run(DENSE, tmp_path / "b")["refusals"]
    assert set(refusals) == {"crossing", "occupied", "deadlock", "reserve"}


@pytest.mark.parametrize(
    ("change", "compiled"),
    [
        ({}, True),
        ({"negotiation": "pressure:patience=30"}, True),
        ({"negotiation": "platoon"}, False),
        ({"negotiation": "oldest"}, False),
        ({"gate": "algorithm2"}, False),
        ({"gate": "certified:promise=everyone", "vehicles": 4, "loops": 4}, False),
        ({"vehicles": 1, "loops": 1}, False),
        ({"network": "sumo:DRT", "lights": "obey"}, False),
    ],
    ids=str,
)
def test_it_drives_only_what_it_knows(
    change: dict[str, Any],
    compiled: bool,  # noqa: FBT001  a parameter of the test
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Certified by the chain rule alone, pressure, and nothing else in the way."""
    made = Mock(wraps=CompiledEngine)
    monkeypatch.setattr(running, "CompiledEngine", made)
    run(replace(DENSE, **{"vehicles": 100, "duration_s": 10.0, "warmup_s": 0.0} | change))
    assert made.called == compiled


def test_more_events_than_find_room_in_one_step_end_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """One clear line rather than a trace with holes."""
    monkeypatch.setattr(compiled_engine, "FULL", 0)
    with pytest.raises(TrafficError, match=r"events of one step at \d+ s found no room"):
        run(replace(DENSE, duration_s=60.0))


def test_an_interruption_while_vehicles_are_held_writes_no_row_twice(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The rows of that step are there, once."""
    hold, calls = SumoTraffic.hold, Counter[str]()

    def interrupted(self: SumoTraffic, vehicle: str, *where: Any) -> None:  # noqa: ANN401  as they come
        hold(self, vehicle, *where)
        calls["hold"] += 1
        if calls["hold"] == 50:
            raise KeyboardInterrupt

    monkeypatch.setattr(SumoTraffic, "hold", interrupted)
    summary = run(DENSE, tmp_path / "run")
    assert summary["outcome"] == "interrupted"
    events = read_events(tmp_path / "run" / "events.parquet")
    assert calls["hold"] == 50
    assert not events.duplicated().any()
