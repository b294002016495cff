"""Whole runs in SUMO: gated, open, repeated, interrupted, and a configuration as it is."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from loopgate.audit import audit_events
from loopgate.control import holds
from loopgate.errors import ScenarioError
from loopgate.model import read_system
from loopgate.results.columns import EVENT, PLACE, STAGE, TIME
from loopgate.results.figures import FIGURES
from loopgate.results.recorder import read_events
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario
from loopgate.traffic.sumo import SumoTraffic

pytestmark = pytest.mark.sumo

CITY = Scenario(
    network="sumo:bs3d", loops=4, max_shared=0.5, duration_s=900.0, gate="algorithm2", abstraction="segments"
)
GRID = Path(__file__).parents[2] / "networks" / "grid5-priority.net.xml"
LOCKS = Scenario(
    network=str(GRID), loops=40, vehicles=240, gate="open", abstraction="segments", loops_seed=2, seed=2
)
"""After two minutes a circle has closed."""


def test_a_gated_run_is_clean_and_everybody_gets_round(tmp_path: Path) -> None:
    """No collision, no teleport, no deadlock, no trespass; every vehicle completes laps."""
    summary = simulate(CITY, tmp_path / "run")
    assert set(summary) <= {key for figure in FIGURES for key in figure.keys.split()}
    assert summary["outcome"] == "done"
    assert (summary["collisions"], summary["teleports"], summary["deadlocks"]) == (0, 0, [])
    assert summary["audit"] == "clean"
    assert summary["vehicles_without_a_lap"] == summary["overruns"] == summary["trespasses"] == 0
    assert (summary["promise"], summary["promise_of"]) == ("", "")
    for name in ("events.parquet", "vehicles.parquet", "edges.parquet", "scenario.toml", "system.json"):
        assert (tmp_path / "run" / name).is_file(), name


def test_the_same_seed_gives_the_same_trace_byte_for_byte(tmp_path: Path) -> None:
    """Twice in this process, and once more through a socket to another."""
    simulate(CITY, tmp_path / "a")
    simulate(CITY, tmp_path / "b")
    simulate(CITY, tmp_path / "c", backend="traci")
    traces = [(tmp_path / name / "events.parquet").read_bytes() for name in "abc"]
    assert traces[0] == traces[1] == traces[2]


def test_stages_are_traced_and_leave_the_trace_the_same(tmp_path: Path) -> None:
    """The trace names the stage of each grant; times, which differ, are in the summary alone."""
    scenario = Scenario(**{**CITY.to_dict(), "gate": "certified", "duration_s": 300.0})
    summary = simulate(scenario, tmp_path / "a")
    simulate(scenario, tmp_path / "b")
    first, second = ((tmp_path / name / "events.parquet").read_bytes() for name in "ab")
    assert first == second
    assert {s: times["count"] for s, times in summary["stage_us"].items()} == summary["stages"]
    assert summary["promise"] == "everyone"
    assert "everyone can go on for ever" in summary["promise_of"]
    events = read_events(tmp_path / "a" / "events.parquet")
    granted = events[events[EVENT] == "grant"]
    assert not granted.empty
    assert set(granted[STAGE]) <= set(summary["stages"])


def test_another_seed_gives_another_trace(tmp_path: Path) -> None:
    """The seed is not ignored."""
    simulate(CITY, tmp_path / "a")
    simulate(Scenario(**{**CITY.to_dict(), "seed": 2, "loop_length_m": (400.0, 2000.0)}), tmp_path / "b")
    first, second = ((tmp_path / name / "events.parquet").read_bytes() for name in "ab")
    assert first != second


def test_the_audit_of_a_real_trace_finds_a_grant_taken_away(tmp_path: Path) -> None:
    """Mutation: without one of its grants, the same trace breaks the rules."""
    simulate(CITY, tmp_path / "run")
    events = read_events(tmp_path / "run" / "events.parquet")
    system = read_system(tmp_path / "run" / "system.json")
    assert audit_events(events, system) == []
    grants = events.index[(events[EVENT] == "grant") & events[PLACE].str.startswith("zone")]
    assert audit_events(events.drop(index=grants[len(grants) // 2]), system)


def test_a_gridlocked_grid_ends_in_a_named_deadlock(tmp_path: Path) -> None:
    """Under SUMO's priority rules 240 vehicles lock up; the run ends there and names the circle."""
    summary = simulate(LOCKS, tmp_path / "run")
    assert summary["outcome"] == "deadlock"
    (deadlock,) = summary["deadlocks"]
    assert summary["duration_s"] < 3600.0
    assert len(deadlock["vehicles"]) == len(deadlock["places"]) >= 2
    events = read_events(tmp_path / "run" / "events.parquet")
    named = events[events[EVENT] == "deadlock"]
    assert set(named["reason"]) == set(named["vehicle"]) == set(deadlock["vehicles"])
    assert (named[TIME] == deadlock["noticed_at_s"]).all()
    assert 0.0 <= deadlock["noticed_at_s"] - deadlock["closed_at_s"] <= 60.0


def test_on_deadlock_teleport_goes_on(tmp_path: Path) -> None:
    """As long as a circle stands, a vehicle of it is put ahead where it has room."""
    summary = simulate(replace(LOCKS, duration_s=600.0, on_deadlock="teleport"), tmp_path / "run")
    assert summary["duration_s"] == pytest.approx(600.0, abs=1.0)
    assert summary["deadlocks"]
    assert summary["teleports"] > len(summary["deadlocks"])
    assert summary["collisions"] == 0
    events = read_events(tmp_path / "run" / "events.parquet")
    assert (events[EVENT] == "teleport").sum() == summary["teleports"]


def test_a_configuration_runs_as_it_is(tmp_path: Path) -> None:
    """Its own vehicles, some of which arrive; the run ends with the last of them."""
    (tmp_path / "r.rou.xml").write_text(
        '<routes><route id="r" edges="A0B0 B0C0 C0D0"/>'
        '<flow id="f" route="r" begin="0" end="100" number="5"/></routes>'
    )
    (tmp_path / "s.sumocfg").write_text(
        f'<configuration><net-file value="{GRID}"/><route-files value="r.rou.xml"/></configuration>'
    )
    summary = simulate(Scenario(network=str(tmp_path / "s.sumocfg"), gate="open"), tmp_path / "run")
    assert (summary["outcome"], summary["vehicles"], summary["loops"]) == ("done", 5, 0)
    assert summary["duration_s"] < 300.0
    assert summary["distance_km"] == pytest.approx(5 * 0.27, abs=0.15)


@pytest.mark.parametrize(
    "given", [{"spacing": "advice"}, {"starts": "even"}, {"revisit_s": 60.0}, {"districts": "d.xml"}]
)
def test_what_is_for_loops_is_refused_where_there_are_none(tmp_path: Path, given: dict[str, Any]) -> None:
    """A configuration as it is has no vehicles on loops: the key is named, not dropped."""
    (tmp_path / "s.sumocfg").write_text(f'<configuration><net-file value="{GRID}"/></configuration>')
    scenario = Scenario(network=str(tmp_path / "s.sumocfg"), gate="open", **given)
    with pytest.raises(ScenarioError, match=f"{next(iter(given))} .* is for vehicles on loops"):
        simulate(scenario, tmp_path / "run")


def test_an_interrupted_run_keeps_what_it_has(tmp_path: Path) -> None:
    """Ctrl-C: results up to then, marked as interrupted."""

    def tick(now_s: float, course: object) -> None:
        del course
        if now_s > 300.0:
            raise KeyboardInterrupt

    summary = simulate(CITY, tmp_path / "run", tick=tick)
    assert summary["outcome"] == "interrupted"
    assert 290.0 < summary["duration_s"] < 320.0
    assert read_events(tmp_path / "run" / "events.parquet")[TIME].max() > 250.0
    assert (tmp_path / "run" / "summary.json").is_file()


def test_sumo_forgets_the_stops_that_vehicles_have_made(monkeypatch: pytest.MonkeyPatch) -> None:
    """A vehicle that is held again and again does not make SUMO remember every stop for good."""
    kept: list[int] = []
    reached: Counter[str] = Counter()
    halted = SumoTraffic.halted

    def counting(self: SumoTraffic) -> Sequence[str]:
        vehicles = halted(self)
        reached.update(vehicles)
        kept.extend(len(self._vehicle.getStops(vehicle, -1000)) for vehicle in vehicles)
        return vehicles

    monkeypatch.setattr(SumoTraffic, "halted", counting)
    monkeypatch.setattr(holds, "_MOST", 2)
    simulate(
        Scenario(network=str(GRID), loops=3, vehicles=60, duration_s=1800.0, loop_length_m=(400.0, 900.0))
    )
    assert max(reached.values()) > 30
    assert max(kept) < 15
