"""Recorded positions, read in pieces that end between two steps."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pandas as pd
import pyarrow as pa
import pyarrow.csv

from loopgate.arrays import Floats, Ints
from loopgate.errors import ResultsError
from loopgate.reading import refusing

ATTRIBUTES = ("id", "lane", "pos", "speed", "odometer", "x", "y", "angle")
"""Attributes that SUMO is asked to write of every vehicle at every step."""

_BLOCK_BYTES = 8_000_000
_LARGEST = 1e10
"""Of any figure; in metres, some years of driving."""
_WORDS = ("vehicle_id", "vehicle_lane")
_NUMBERS = ("timestep_time", *(f"vehicle_{name}" for name in ("pos", "speed", "odometer", "x", "y", "angle")))


@dataclass(frozen=True, slots=True)
class Positions:
    """The recorded positions of vehicles: a row for each vehicle and step, in order of time.

    Attributes
    ----------
    time_s
        When the step had been driven, on the clock of the events [s].
    vehicle, lane
        Numbers in the lists that were given; -1 for others.
    lane_name
        The lanes' names as recorded.
    pos_m, odometer_m, x_m, y_m
        Position of the front on its lane, distance driven, network coordinates [m].
    angle_deg
        Direction from rear to front, clockwise from north.
    """

    time_s: Floats
    vehicle: Ints
    lane: Ints
    lane_name: npt.NDArray[np.object_]
    pos_m: Floats
    speed_mps: Floats
    odometer_m: Floats
    x_m: Floats
    y_m: Floats
    angle_deg: Floats


def read_positions(
    file: Path, vehicles: dict[str, int], lanes: dict[str, int], step_s: float
) -> Iterator[Positions]:
    """Read the positions that SUMO wrote (``positions.csv.gz``), whole steps at a time.

    Raises `ResultsError` if it cannot be read.

    Parameters
    ----------
    file
        The table; compressed if its name ends in ``.gz``.
    vehicles, lanes
        Numbers by name.
    step_s
        Length of a step [s]: SUMO writes the time at which the step began.
    """
    with refusing(file, "positions", ResultsError):
        rest: pd.DataFrame | None = None
        with open_positions(file, (*_WORDS, *_NUMBERS)) as reader:
            for batch in reader:
                frame = batch.to_pandas()
                for name in _WORDS:
                    frame[name] = frame[name].astype("category")
                if rest is not None and len(rest):
                    frame = pd.concat([_plain(rest), _plain(frame)], ignore_index=True)
                last = frame["timestep_time"].iloc[-1]
                whole = frame["timestep_time"].to_numpy() < last
                rest = frame[~whole]
                if whole.any():
                    yield _positions(frame[whole], vehicles, lanes, step_s)
        if rest is not None and len(rest):
            yield _positions(rest, vehicles, lanes, step_s)


def open_positions(file: Path, columns: Iterable[str]) -> pyarrow.csv.CSVStreamingReader:
    """Open some columns of SUMO's positions, to be read in pieces."""
    word = pa.dictionary(pa.int32(), pa.string())
    types = {name: word if name in _WORDS else pa.float64() for name in columns}
    return pyarrow.csv.open_csv(
        file,
        read_options=pyarrow.csv.ReadOptions(block_size=_BLOCK_BYTES, use_threads=False),
        parse_options=pyarrow.csv.ParseOptions(delimiter=";"),
        convert_options=pyarrow.csv.ConvertOptions(column_types=types, include_columns=list(types)),
    )


def _plain(frame: pd.DataFrame) -> pd.DataFrame:
    return frame.astype(dict.fromkeys(_WORDS, object))


def _positions(
    frame: pd.DataFrame, vehicles: dict[str, int], lanes: dict[str, int], step_s: float
) -> Positions:
    def numbers(name: str, known: dict[str, int]) -> Ints:
        codes, words = pd.factorize(frame[name])
        table = np.array([known.get(str(word), -1) for word in words], dtype=np.int64)
        return np.asarray(table[codes])

    def column(name: str) -> Floats:
        values = frame[name].to_numpy(dtype=np.float64)
        # Where nobody drives, SUMO leaves fields empty.
        if not (np.abs(values[vehicle >= 0]) <= _LARGEST).all():
            msg = f"{name} of a vehicle is missing or no number up to {_LARGEST:g}"
            raise ValueError(msg)
        return values

    vehicle = numbers("vehicle_id", vehicles)
    return Positions(
        time_s=column("timestep_time") + step_s,
        vehicle=vehicle,
        lane=numbers("vehicle_lane", lanes),
        lane_name=frame["vehicle_lane"].to_numpy(dtype=object),
        pos_m=column("vehicle_pos"),
        speed_mps=column("vehicle_speed"),
        odometer_m=column("vehicle_odometer"),
        x_m=column("vehicle_x"),
        y_m=column("vehicle_y"),
        angle_deg=column("vehicle_angle"),
    )
