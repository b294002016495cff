"""Where fronts are, kept step by step without a question to the simulator."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from limits import no_file_beyond

from loopgate.errors import ResultsError
from loopgate.results.columns import FRONT, TIME, VEHICLE
from loopgate.simulation.watching import flow
from loopgate.simulation.watching.flow import FrontRecorder


class Driven(SimpleNamespace):
    """A simulation, its drive and its recorder at once, that can tell time and names and nothing else."""

    def __init__(self, *names: str) -> None:
        self.vehicles, self.at_m = names, np.zeros(len(names))
        words = ["", "d", "c", "b", "a", *names]
        super().__init__(now_s=0.0, words=words, code=words.index, changes=0)
        self.names, self.fronts = lambda: self.vehicles, lambda: self.at_m

    def drive(self, step_s: float, *far_m: float) -> None:
        self.now_s += step_s
        self.at_m = self.at_m + far_m


def recorder(file: Path, driven: Any) -> FrontRecorder:  # noqa: ANN401  stands for all
    return FrontRecorder(file, driven, driven, driven)


@pytest.mark.parametrize("batch", [1, 5, 1000])
def test_one_row_per_vehicle_and_step(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, batch: int) -> None:
    """In tenths of a metre, whether it is written step by step, in pieces or at once."""
    monkeypatch.setattr(flow, "_BATCH", batch)
    driven = Driven("a", "b")
    made = recorder(tmp_path / "fronts.parquet", driven)
    for _ in range(4):
        driven.drive(0.5, 1.26, 400.0)
        made.look()
    made.close()
    made.close()
    table = pd.read_parquet(tmp_path / "fronts.parquet").sort_values([VEHICLE, TIME])
    assert table[VEHICLE].tolist() == ["a"] * 4 + ["b"] * 4
    assert table[TIME].tolist() == [0.5, 1.0, 1.5, 2.0] * 2
    assert table[FRONT].tolist() == [13, 25, 38, 50, 4000, 8000, 12000, 16000]


def test_vehicles_that_come_later(tmp_path: Path) -> None:
    """Other vehicles have the numbers; each keeps its name."""
    driven = Driven("a", "b")
    made = recorder(tmp_path / "fronts.parquet", driven)
    driven.drive(1.0, 1.0, 2.0)
    made.look()
    late = Driven("b", "c", "d")
    driven.vehicles, driven.at_m, driven.changes = late.vehicles, late.at_m, 1
    driven.drive(1.0, 3.0, 4.0, 5.0)
    made.look()
    made.close()
    table = pd.read_parquet(tmp_path / "fronts.parquet")
    assert table[[TIME, VEHICLE, FRONT]].to_numpy().tolist() == [
        [1.0, "a", 10],
        [1.0, "b", 20],
        [2.0, "b", 30],
        [2.0, "c", 40],
        [2.0, "d", 50],
    ]


def test_a_run_that_ends_at_once_leaves_an_empty_table(tmp_path: Path) -> None:
    """Interrupted before anybody drove."""
    recorder(tmp_path / "fronts.parquet", Driven("a")).close()
    assert pd.read_parquet(tmp_path / "fronts.parquet").empty


def test_up_to_a_full_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One line that names the file; what was written before can be read."""
    monkeypatch.setattr(flow, "_BATCH", 5000)
    driven, rng = Driven(*map(str, range(50))), np.random.default_rng(1)
    made = recorder(tmp_path / "fronts.parquet", driven)

    def drive_on() -> None:
        for _ in range(2000):
            driven.drive(1.0, *rng.uniform(0.0, 30.0, 50))
            made.look()

    with no_file_beyond(200_000), pytest.raises(ResultsError, match=r"fronts\.parquet: cannot be written"):
        drive_on()
    made.close()
    assert len(pd.read_parquet(tmp_path / "fronts.parquet")) > 5000
