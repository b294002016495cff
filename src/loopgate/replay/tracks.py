"""The positions of all vehicles at each step, as SUMO recorded them, rounded for the screen."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa

from loopgate.arrays import Floats, Ints
from loopgate.audit.position_table import open_positions
from loopgate.errors import ResultsError
from loopgate.reading import refusing

PER_M = 10
"""Units of position in a metre: positions are whole tenths of a metre."""

TURN = 256
"""Units of heading in a turn."""

LARGEST_M = 1e8
"""The largest coordinate that is accepted [m]."""

MOST_STEPS = 1e9
"""The largest number of steps that is accepted."""

_LONGEST_LEAP_M = 200.0
"""A vehicle that moves farther than this in a step has been put somewhere else [m]."""

_COLUMNS = ("vehicle_id", "timestep_time", "vehicle_x", "vehicle_y", "vehicle_angle", "vehicle_odometer")


@dataclass(frozen=True, slots=True)
class Tracks:
    """Positions by vehicle, then by step."""

    vehicles: tuple[str, ...]
    """Names of the vehicles; known vehicles come first."""
    first_s: float
    step_s: float
    frames: int
    """`first_s`: the time after the first step [s]. `step_s`: the length of a step [s]. `frames`: the number
    of steps."""
    owner: Ints
    begin: Ints
    count: Ints
    """`owner`: the vehicle of each track. `begin`: the number of its first step. `count`: its number of
    steps. Tracks are in the order of the positions. A vehicle that was off the road for a time, or put
    somewhere else, has several tracks."""
    x: Ints
    y: Ints
    """`x`, `y`: the vehicle's front in network coordinates, in tenths of a metre."""
    heading: Ints
    """The direction from rear to front, clockwise from north, in 256ths of a turn."""
    odometer_m: Floats

    def frame(self, time_s: float) -> int:
        """Return the number of the step that ended at a time [s]."""
        return round((time_s - self.first_s) / self.step_s)

    def rows_of(self) -> Mapping[int, list[tuple[int, slice]]]:
        """Return each vehicle's tracks: number of the first step, and the rows."""
        found: dict[int, list[tuple[int, slice]]] = {}
        ends = np.cumsum(self.count).tolist()
        for owner, begin, count, end in zip(
            self.owner.tolist(), self.begin.tolist(), self.count.tolist(), ends, strict=True
        ):
            found.setdefault(owner, []).append((begin, slice(end - count, end)))
        return found


def read_tracks(
    file: Path,
    step_s: float,
    *,
    known: tuple[str, ...] = (),
    report: Callable[[int], None] = lambda _rows: None,
) -> Tracks:
    """Read the positions that SUMO recorded (``positions.csv.gz``).

    Raises `ResultsError` if it cannot be read, or there is nobody in it.

    Parameters
    ----------
    step_s
        Length of a step [s]: SUMO writes the time at which a step began, events have that at which it ended.
    known
        Vehicles that get the first numbers, whether they are on the road or not.
    report
        Told now and then how many rows have been read.
    """
    numbers = {name: number for number, name in enumerate(known)}
    pieces: list[tuple[Ints, ...]] = []
    driven: list[Floats] = []
    rows = 0
    with refusing(file, "positions", ResultsError), open_positions(file, _COLUMNS) as reader:
        for batch in reader:
            table = pa.Table.from_batches([batch]).drop_null()  # SUMO leaves fields empty where nobody is
            piece = _piece(table, numbers, step_s)
            pieces.append(piece)
            driven.append(_column(table, "vehicle_odometer"))
            rows += len(table)
            report(rows)
    if not rows:
        msg = f"{file}: there is nobody in it"
        raise ResultsError(msg)
    step, vehicle, x, y, heading = (np.concatenate(column) for column in zip(*pieces, strict=True))
    return make_tracks(tuple(numbers), step_s, (step, vehicle, x, y, heading), np.concatenate(driven))


def make_tracks(
    vehicles: tuple[str, ...], step_s: float, columns: tuple[Ints, ...], odometer_m: Floats
) -> Tracks:
    """Return positions in any order as tracks.

    Parameters
    ----------
    columns
        Of each position the number of its step, counted from time 0, its vehicle, and `Tracks.x`, `Tracks.y`,
        `Tracks.heading`.
    odometer_m
        Distance driven, of each position [m].
    """
    order = np.lexsort(columns[:2])
    step, vehicle, x, y, heading = (column[order] for column in columns)
    first = int(step.min())
    leap = np.maximum(np.abs(np.diff(x)), np.abs(np.diff(y))) > _LONGEST_LEAP_M * PER_M
    cut = (np.diff(vehicle) != 0) | (np.diff(step) != 1) | leap
    begins = np.concatenate(([0], np.flatnonzero(cut) + 1))
    return Tracks(
        vehicles=vehicles,
        first_s=first * step_s,
        step_s=step_s,
        frames=int(step.max()) - first + 1,
        owner=vehicle[begins],
        begin=step[begins] - first,
        count=np.diff(np.append(begins, len(vehicle))),
        x=x,
        y=y,
        heading=heading,
        odometer_m=odometer_m[order],
    )


def _piece(table: pa.Table, numbers: dict[str, int], step_s: float) -> tuple[Ints, ...]:
    ids = table.column("vehicle_id").combine_chunks()
    ids = ids.chunk(0) if isinstance(ids, pa.ChunkedArray) else ids
    codes = np.array(
        [numbers.setdefault(word, len(numbers)) for word in ids.dictionary.to_pylist()], dtype=np.int64
    )
    turns = _column(table, "vehicle_angle") * (TURN / 360.0)
    return (
        np.rint(_column(table, "timestep_time") / step_s).astype(np.int64) + 1,
        codes[ids.indices.to_numpy(zero_copy_only=False)],
        np.rint(_column(table, "vehicle_x") * PER_M).astype(np.int64),
        np.rint(_column(table, "vehicle_y") * PER_M).astype(np.int64),
        np.rint(turns).astype(np.int64) % TURN,
    )


def _column(table: pa.Table, name: str) -> Floats:
    values = np.asarray(table.column(name).to_numpy(), dtype=np.float64)
    if not (np.abs(values) <= LARGEST_M).all():
        msg = f"{name} is no number up to {LARGEST_M:g}"
        raise ValueError(msg)
    return values
