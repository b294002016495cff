"""The compiled engine beside the plain one: the same run, row for row."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pandas as pd
import pytest

from loopgate.errors import TrafficError
from loopgate.results.recorder import read_events
from loopgate.simulation import run as running
from loopgate.simulation.compiled import engine as compiled_engine
from loopgate.simulation.compiled.engine import CompiledEngine
from loopgate.simulation.run import run
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.watch import Deadlock, Watch

pytestmark = pytest.mark.sumo

GRID = str(Path(__file__).parents[2] / "networks" / "grid5-priority.net.xml")
DENSE = Scenario(network=GRID, loops=40, vehicles=300, duration_s=600.0, warmup_s=200.0, lights="off")
SCENARIOS = {
    "dense grid": DENSE,
    "no reserve": replace(DENSE, vehicles=400, negotiation="pressure:crowded=2", duration_s=1500.0),
    "half steps": replace(DENSE, vehicles=120, step_s=0.5, duration_s=300.0),
    "city": Scenario(network="sumo:DRT", loops=60, vehicles=100, duration_s=900.0, lights="off", seed=3),
    "second city": Scenario(network="sumo:bs3d", loops=20, vehicles=100, duration_s=900.0, lights="off"),
}
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


@pytest.mark.parametrize("name", SCENARIOS)
def test_it_makes_the_same_run(name: str, tmp_path: Path) -> None:
    """Every row of the trace, every figure of the summary, and whom each refused vehicle waits for."""
    traces, summaries, said = [], [], []
    for compiled in (False, True):
        Witness.said = []
        folder = tmp_path / str(compiled)
        summary = run(SCENARIOS[name], folder, compiled=compiled, watch=Witness)
        said.append(Witness.said)
        traces.append(read_events(folder / "events.parquet"))
        summaries.append({key: value for key, value in summary.items() if key not in WALL})
        vehicles = pd.read_parquet(folder / "vehicles.parquet")
        summaries[-1]["vehicles.parquet"] = vehicles.to_csv()
        assert summary["stage_us"]["chain"]["count"] == summary["decisions"] > 0
    pd.testing.assert_frame_equal(traces[0], traces[1])
    assert summaries[0] == summaries[1]
    assert said[0] == said[1]
    assert said[0]


def test_refusals_of_all_kinds_are_among_those_runs(tmp_path: Path) -> None:
    """Else the comparison above would say nothing of them."""
    refusals = run(SCENARIOS["no reserve"], tmp_path / "a")["refusals"]
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
