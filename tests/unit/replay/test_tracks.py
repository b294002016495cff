"""Recorded positions become tracks by vehicle."""

import gzip
from pathlib import Path

import pytest

from loopgate.errors import ResultsError
from loopgate.replay.tracks import read_tracks

HEAD = "timestep_time;vehicle_id;vehicle_x;vehicle_y;vehicle_angle;vehicle_odometer"


def recorded(folder: Path, *rows: str) -> Path:
    file = folder / "positions.csv.gz"
    file.write_bytes(gzip.compress("\n".join((HEAD, *rows, "")).encode()))
    return file


def test_rounded_and_sorted_by_vehicle(tmp_path: Path) -> None:
    """Tenths of a metre, parts of a turn, on the clock of the events; known vehicles come first."""
    file = recorded(
        tmp_path,
        "0.00;b;1.04;-2.06;90.00;0.00",
        "0.00;a;5.00;5.00;359.9;7.50",
        "0.50;b;2.00;-2.00;180.00;0.97",
    )
    tracks = read_tracks(file, 0.5, known=("a",))
    assert tracks.vehicles == ("a", "b")
    assert (tracks.first_s, tracks.frames) == (0.5, 2)
    assert tracks.owner.tolist() == [0, 1]
    assert tracks.begin.tolist() == [0, 0]
    assert tracks.count.tolist() == [1, 2]
    assert tracks.x.tolist() == [50, 10, 20]
    assert tracks.y.tolist() == [50, -21, -20]
    assert tracks.heading.tolist() == [0, 64, 128]
    assert tracks.odometer_m.tolist() == [7.5, 0.0, 0.97]
    assert tracks.frame(1.0) == 1


def test_a_track_ends_where_a_vehicle_is_off_the_road_or_put_elsewhere(tmp_path: Path) -> None:
    """Nobody is drawn sliding across the map; steps with nobody in them are no rows."""
    rows = ["0;a;0;0;0;0", "1;a;10;0;0;10", "2;;;;;", "3;a;20;0;0;20", "4;a;900;0;0;30"]
    tracks = read_tracks(recorded(tmp_path, *rows), 1.0)
    assert tracks.begin.tolist() == [0, 3, 4]
    assert tracks.count.tolist() == [2, 1, 1]
    assert [begin for begin, _ in tracks.rows_of()[0]] == [0, 3, 4]


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ((), "there is nobody in it"),
        (("0;a;1e12;0;0;0",), "vehicle_x is no number"),
        (("0;a;x;0;0;0",), "no readable positions"),
    ],
)
def test_what_is_no_record_is_refused(tmp_path: Path, rows: tuple[str, ...], words: str) -> None:
    """One line that names the file."""
    with pytest.raises(ResultsError, match=words) as caught:
        read_tracks(recorded(tmp_path, *rows), 1.0)
    assert "positions.csv.gz" in str(caught.value)
