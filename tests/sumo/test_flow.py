"""Standing and driving over time, by vehicle, by edge and in all."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario

pytestmark = pytest.mark.sumo

GRID = str(Path(__file__).parents[2] / "networks" / "grid5-priority.net.xml")


@pytest.mark.parametrize("gate", ["open", "certified"])
def test_standing_is_counted_once_and_whole(tmp_path: Path, gate: str) -> None:
    """Sixty vehicles on twelve loops: by vehicle, by edge and over time it is the same, gate or no gate."""
    folder = tmp_path / "run"
    scenario = Scenario(
        network=GRID, loops=12, vehicles=60, gate=gate, duration_s=200.0, warmup_s=50.0, positions=True
    )
    summary = simulate(scenario, folder)
    vehicles, edges, flow = (
        pd.read_parquet(folder / f"{name}.parquet") for name in ("vehicles", "edges", "flow")
    )
    assert summary["stood_s"] == vehicles["stood_s"].sum() == pytest.approx(edges["stood_s"].sum())
    assert summary["stood_s"] > summary["hold_s"] >= 0.0
    late = flow[flow["time_s"] > flow["time_s"].min() - 10.0 + 50.0]
    assert (late["standing"] * 10.0).sum() == pytest.approx(summary["stood_s"])
    assert late["distance_m"].sum() / 1000.0 == pytest.approx(summary["distance_km"], rel=1e-6)
    assert late["laps"].sum() == summary["laps"]
    assert set(flow["vehicles"]) == {60}
    seen = pd.read_csv(folder / "positions.csv.gz", sep=";")
    time_s = next(name for name in seen.columns if name.endswith("time"))
    speed = next(name for name in seen.columns if name.endswith("speed"))
    measured = seen[seen[time_s] >= seen[time_s].max() - 199.0]
    assert (measured[speed] < 0.1).sum() == pytest.approx(
        summary["stood_s"], abs=0.01 * summary["stood_s"] + 1
    )
    name = next(name for name in seen.columns if name.endswith("id"))
    stands = measured[speed] < 0.1
    spells = measured[stands].groupby([measured[name], (~stands).groupby(measured[name]).cumsum()]).size()
    longest = spells.groupby(level=0).max()
    assert summary["longest_stood_s"] == vehicles["longest_stood_s"].max()
    assert summary["longest_stood_s"] == pytest.approx(longest.max(), abs=2.0)
    assert longest[summary["longest_stood"]] == longest.max()
