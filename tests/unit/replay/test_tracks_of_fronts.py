"""What the drive knew of fronts becomes tracks, drawn where the loops lie."""

from dataclasses import replace
from math import nan
from pathlib import Path

import pandas as pd
import pytest

from loopgate.audit.layout import Layout, LoopLeg, LoopSpan, LoopWay, VehicleBody
from loopgate.errors import ResultsError
from loopgate.replay.scene import read_fronts
from loopgate.results.columns import FRONT, TIME, VEHICLE


def square(side_m: float = 100.0) -> Layout:
    """Return a loop driven east, north, west, south; `v` starts 20 m from its beginning."""
    corners = [(0.0, 0.0), (side_m, 0.0), (side_m, side_m), (0.0, side_m), (0.0, 0.0)]
    lap_m = 4 * side_m
    spans = tuple(LoopSpan(side_m * k, side_m * (k + 1), (f"s{k}",)) for k in range(4))
    return Layout(
        step_s=0.5,
        room={"A": 5},
        loops={"square": LoopWay(lap_m, spans, (LoopLeg("A", 0.0, lap_m, ()),))},
        vehicles={
            "v": VehicleBody("square", 5.0, 1.8, 20.0, 0),
            "w": VehicleBody("square", 5.0, 1.8, 250.0, 0),
        },
        movements={},
        shapes={f"s{k}": (corners[k], corners[k + 1]) for k in range(4)},
    )


def recorded(folder: Path, *rows: tuple[float, str, int]) -> Path:
    file = folder / "fronts.parquet"
    frame = pd.DataFrame(rows, columns=[TIME, VEHICLE, FRONT])
    frame.astype({TIME: float, VEHICLE: "str", FRONT: "int32"}).to_parquet(file)
    return file


def test_on_the_curve_of_the_loop(tmp_path: Path) -> None:
    """Round corners and round the loop; the step before the first record is the start."""
    file = recorded(tmp_path, (1.0, "v", 1500), (1.0, "w", 2600), (1.5, "v", 4100), (1.5, "w", 2600))
    tracks = read_fronts(file, 0.5, square())
    assert (tracks.vehicles, tracks.first_s, tracks.frames) == (("v", "w"), 0.5, 3)
    assert tracks.count.tolist() == [3, 3]
    assert tracks.x.tolist() == [200, 1000, 100, 500, 400, 400]
    assert tracks.y.tolist() == [0, 500, 0, 1000, 1000, 1000]
    assert tracks.heading.tolist() == [64, 0, 64, 192, 192, 192]
    assert tracks.odometer_m.tolist() == [20.0, 150.0, 410.0, 250.0, 260.0, 260.0]


def test_a_body_round_a_corner_points_from_rear_to_front(tmp_path: Path) -> None:
    """Its rear is 3 m before the corner, its front 2 m behind it."""
    tracks = read_fronts(recorded(tmp_path, (1.0, "v", 1020)), 0.5, square())
    assert tracks.count.tolist() == [2]  # the other was never there
    assert tracks.heading.tolist()[1] == 40  # atan2(3, 2), 56 degrees clockwise from north


def test_one_moved_ahead_begins_anew(tmp_path: Path) -> None:
    """Nobody is drawn between where it was and where it was put."""
    tracks = read_fronts(recorded(tmp_path, (1.0, "v", 300), (1.5, "v", 5000)), 0.5, square(1000.0))
    assert tracks.count.tolist() == [2, 1]


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ([(1.0, "x", 5)], "'x'"),
        ([], "nobody in it"),
        ([(nan, "v", 5)], "no time of a run"),
        ([(1e300, "v", 5)], "no time of a run"),
    ],
)
def test_what_does_not_fit_is_refused(tmp_path: Path, rows: list[tuple[float, str, int]], words: str) -> None:
    """A vehicle that the layout does not know, nobody at all, a time that is none."""
    with pytest.raises(ResultsError, match=words):
        read_fronts(recorded(tmp_path, *rows), 0.5, square())


def test_a_layout_of_something_else_is_refused(tmp_path: Path) -> None:
    """Loops without a length have no place for anybody."""
    known = square()
    layout = replace(known, loops={"square": LoopWay(0.0, known.loops["square"].spans, ())})
    with pytest.raises(ResultsError, match="nowhere on the loops"):
        read_fronts(recorded(tmp_path, (1.0, "v", 5)), 0.5, layout)
