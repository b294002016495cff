"""A run that is interrupted in the middle of a step."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from loopgate.results.recorder import read_events
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario
from loopgate.traffic.sumo import SumoTraffic

pytestmark = pytest.mark.sumo

GRID = str(Path(__file__).parents[2] / "networks" / "grid5-priority.net.xml")
DENSE = Scenario(network=GRID, loops=40, vehicles=300, duration_s=600.0, warmup_s=200.0, lights="off")


@pytest.mark.parametrize("method", ["hold", "release"])
def test_an_interruption_while_vehicles_are_told_something_writes_no_row_twice(
    method: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The rows of that step are there, once."""
    tell, calls, at_s = getattr(SumoTraffic, method), Counter[str](), list[float]()

    def interrupted(self: SumoTraffic, vehicle: str, *where: Any) -> Any:  # noqa: ANN401  as they come
        told = tell(self, vehicle, *where)
        calls[method] += 1
        if calls[method] == 50:
            at_s.append(self.now_s)
            raise KeyboardInterrupt
        return told

    monkeypatch.setattr(SumoTraffic, method, interrupted)
    summary = simulate(DENSE, tmp_path / "run")
    assert summary["outcome"] == "interrupted"
    events = read_events(tmp_path / "run" / "events.parquet")
    assert calls[method] >= 50
    assert [events["time_s"].max()] == at_s
    assert not events.duplicated().any()
    assert events["event"].eq("grant").any()
