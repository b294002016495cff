"""Runs in one process share networks, loops and layouts, and are none the wiser."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from loopgate.abstraction import queue_layout, segments
from loopgate.cache import Cache
from loopgate.network import road, routes_file
from loopgate.simulation.demand import allotment
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario

pytestmark = pytest.mark.sumo

NETWORKS = Path(__file__).parents[2] / "networks"


def test_a_run_after_others_is_the_same_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Other gates, seeds and numbers of vehicles in between change nothing of what is shared."""
    for module in (queue_layout, allotment, road, routes_file, segments):
        monkeypatch.setattr(module, "_KEPT", Cache(8))
    road_net = str(NETWORKS / "grid5-priority.net.xml")

    def traced(name: str, **options: object) -> pd.DataFrame:
        given = {"network": road_net, "loops": 12, "duration_s": 300, "gate": "collision", **options}
        simulate(Scenario.from_dict(given), tmp_path / name)
        return pd.read_parquet(tmp_path / name / "events.parquet")

    first = traced("first", vehicles=30)
    traced("more", vehicles=36, gate="open", seed=2)
    traced("other loops", loops=9, gate="one-step")
    pd.testing.assert_frame_equal(traced("again", vehicles=30), first)
    assert len(first) > 100
