"""What the drive does when a step is too full, or is interrupted."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from loopgate.drive import ground
from loopgate.errors import TrafficError
from loopgate.results.recorder import read_events
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario
from loopgate.traffic.sumo import SumoTraffic

pytestmark = pytest.mark.sumo

GRID = str(Path(__file__).parents[2] / "networks" / "grid5-priority.net.xml")
DENSE = Scenario(network=GRID, loops=40, vehicles=300, duration_s=600.0, warmup_s=200.0, lights="off")


def test_more_events_than_find_room_in_one_step_end_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """One clear line rather than a trace with holes."""
    monkeypatch.setattr(ground, "FULL", 0)
    with pytest.raises(TrafficError, match=r"events of one step at \d+ s found no room"):
        simulate(replace(DENSE, duration_s=60.0))


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
    summary = simulate(DENSE, tmp_path / "run")
    assert summary["outcome"] == "interrupted"
    events = read_events(tmp_path / "run" / "events.parquet")
    assert calls["hold"] == 50
    assert not events.duplicated().any()
