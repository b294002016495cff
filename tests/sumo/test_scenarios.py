"""Scenarios of SUMO's own generators: nothing of them is dropped under a gate."""

from pathlib import Path

import pytest
import scenarios

pytestmark = pytest.mark.sumo


@pytest.mark.parametrize("kind", ["detectors", "parking", "lines"])
def test_nothing_is_dropped(tmp_path: Path, kind: str) -> None:
    """As many vehicles and the same outputs as under SUMO's rules, no lock, no collision."""
    row = scenarios.compare(kind, tmp_path / kind)
    assert row["dropped"] == row["locks, certified"] == row["collisions, certified"] == 0
    assert row["loaded, certified"] >= 150
    assert row["distance_km, certified"] > 100.0
