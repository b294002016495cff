"""An estimate of the time that a sweep will take, from its finished rows or from a rule of thumb."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from loopgate.errors import SweepError
from loopgate.machines import processors
from loopgate.reading import is_folder, refusing
from loopgate.results import columns as c
from loopgate.runs.results import read_results
from loopgate.sweep.description import Point

_PER_VEHICLE_STEP_S = 20e-6  # wall time per vehicle and simulated second, gate included: a rule of thumb
_PER_RUN_S = 2.0  # reading the network, starting SUMO
_DEFAULT_VEHICLES, _DEFAULT_DURATION_S = 40, 3600.0


@dataclass(frozen=True, slots=True)
class Estimate:
    """The work that is left of a sweep, and the time it will take."""

    present: int
    missing: int
    workers: int
    seconds: float
    """Wall time on all workers together [s]."""
    basis: str
    """The source of the estimate, in words."""


def estimate(points: Sequence[Point], folder: Path, workers: int | None = None) -> Estimate:
    """Estimate the wall time of the points that have no row in `folder`.

    With rows in the folder, their wall time per simulated vehicle-second is taken; without, a rule of thumb.

    Raises `ResultsError` if the folder holds rows that cannot be read.
    """
    processes = workers or processors()
    runs = read_results(folder).runs if is_folder(folder / "rows") else None
    present = set() if runs is None else set(runs[c.KEY])
    missing = [point for point in points if point.key not in present]
    basis, each_s, per_run_s = "rule of thumb, no run finished yet", _PER_VEHICLE_STEP_S, _PER_RUN_S
    if runs is not None and runs[c.TOOK].notna().any():
        done = runs[runs[c.TOOK].notna() & runs[c.VEHICLES].notna() & runs[c.DURATION].notna()]
        size = float((done[c.VEHICLES] * done[c.DURATION]).sum())
        if size:
            basis, each_s, per_run_s = (
                f"from {len(done)} finished runs",
                float(done[c.TOOK].sum()) / size,
                0.0,
            )
    work = sum(per_run_s + each_s * _size(point) for point in missing)
    known = len({point.key for point in points} & present)
    return Estimate(known, len(missing), processes, work / processes, basis)


def _size(point: Point) -> float:
    """Return the vehicle-seconds that a run simulates."""
    scenario = point.scenario
    vehicles = scenario.get("vehicles") or _DEFAULT_VEHICLES
    duration = scenario.get(c.DURATION, scenario.get("duration", _DEFAULT_DURATION_S))
    warmup = scenario.get(c.WARMUP, scenario.get("warmup", 0.0))
    with refusing(point.key, "run of the sweep", SweepError):
        return float(vehicles) * (float(duration) + float(warmup))
