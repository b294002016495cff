"""Reads the positions of vehicles along their loops from ``fronts.parquet``, as positions on the map."""

from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

from loopgate.arrays import Floats
from loopgate.audit.layout import Layout
from loopgate.errors import ResultsError
from loopgate.reading import refusing
from loopgate.replay.lines import loop_curve
from loopgate.replay.tracks import LARGEST_M, MOST_STEPS, PER_M, TURN, Tracks, make_tracks
from loopgate.results.columns import FRONT, FRONTS_PER_M, TIME, VEHICLE
from loopgate.results.table_reading import NO_PARQUET, check_columns


def read_fronts(file: Path, step_s: float, layout: Layout) -> Tracks:
    """Read the positions of the fronts along their loops (``fronts.parquet``).

    A vehicle on the lane of its loop is drawn within 0.15 m of its position in SUMO. A vehicle on another
    lane, or about to change lanes, is drawn on the lane of its loop.

    Raises `ResultsError` if the file cannot be read, does not fit the layout, or has no vehicle.
    """
    names = tuple(layout.vehicles)
    numbers = {name: number for number, name in enumerate(names)}
    with refusing(file, "table", ResultsError, wrong=NO_PARQUET):
        check_columns(pq.read_schema(file), (TIME, VEHICLE, FRONT), file)
        table = pq.read_table(file, columns=[TIME, VEHICLE, FRONT], read_dictionary=[VEHICLE])
        table.validate(full=True)
        if not len(table):
            msg = f"{file}: there is nobody in it"
            raise ResultsError(msg)
        words = table.column(VEHICLE).unify_dictionaries().combine_chunks()
        known = np.array([numbers[word] for word in words.dictionary.to_pylist()], dtype=np.int64)
        vehicle = known[words.indices.to_numpy(zero_copy_only=False)]
        steps = np.rint(table.column(TIME).to_numpy() / step_s)
        if not (np.abs(steps) <= MOST_STEPS).all():
            msg = f"{TIME} is no time of a run"
            raise ValueError(msg)
        step = steps.astype(np.int64)
        front_m = table.column(FRONT).to_numpy().astype(np.float64) / FRONTS_PER_M
    # What is recorded begins after the second step; after the first those on the road stand where they start.
    there = np.unique(vehicle[step == step.min()])
    starts = np.array([body.start_m for body in layout.vehicles.values()])
    vehicle = np.concatenate((there, vehicle))
    step = np.concatenate((np.full(len(there), step.min() - 1), step))
    front_m = np.concatenate((starts[there], front_m))
    order = np.lexsort((step, vehicle))
    vehicle, step, front_m = vehicle[order], step[order], front_m[order]
    ends = np.searchsorted(vehicle, np.arange(len(names) + 1))
    x, y, heading = np.empty((3, len(step)))
    curves = {name: loop_curve(layout, loop) for name, loop in layout.loops.items()}
    for number, body in enumerate(layout.vehicles.values()):
        rows = slice(ends[number], ends[number + 1])
        curve, lap_m = curves[body.loop], layout.loops[body.loop].length_m
        with np.errstate(invalid="ignore", divide="ignore"):  # told below
            x[rows], y[rows] = front = _at(curve, lap_m, front_m[rows])
            east, north = front - _at(curve, lap_m, front_m[rows] - body.length_m)
        heading[rows] = np.arctan2(east, north) * (TURN / (2.0 * np.pi))
    if not (np.abs((x, y)) <= LARGEST_M).all():
        msg = f"{file}: vehicles are nowhere on the loops of the layout beside it"
        raise ResultsError(msg)
    whole = (np.rint(values).astype(np.int64) for values in (x * PER_M, y * PER_M, heading))
    across, up, turn = whole
    return make_tracks(names, step_s, (step, vehicle, across, up, turn % TURN), front_m)


def _at(curve: tuple[Floats, Floats], lap_m: float, arc_m: Floats) -> Floats:
    """Return the points at some arc lengths, of shape (2, n) [m]."""
    points, arcs = curve
    return np.array([np.interp(arc_m % lap_m, arcs, points[:, axis]) for axis in (0, 1)])
