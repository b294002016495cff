"""FCD output of simulations that knew no gate."""

from __future__ import annotations

import json
from math import atan2, degrees
from pathlib import Path

import pytest
import shapely
from click.testing import CliRunner

from loopgate.cli.main import cli
from loopgate.errors import LoopgateError
from loopgate.network import RoadNetwork
from loopgate.simulation.fcd.film import Film
from loopgate.simulation.fcd.folder import write_fcd_run
from loopgate.simulation.fcd.frames import SeenVehicle

GRID = "networks/grid5-priority.net.xml"
BLOCK = ("C1D1", "D1D2", "D2C2", "C2C1")
"""Four streets round a block, each leading to the next."""


def frame(time_s: int, full: tuple[str, ...] = BLOCK) -> str:
    """Write a frame in which vehicles stand on all lanes of streets, bumper to bumper."""
    rows = []
    network = RoadNetwork.open(GRID)
    for lane in (lane for edge in full for lane in network.edge(edge).lanes):
        line = shapely.LineString(lane.shape)
        (x0, y0), (x1, y1) = lane.shape[0], lane.shape[-1]
        angle = degrees(atan2(x1 - x0, y1 - y0)) % 360.0
        pos = lane.length_m - 0.5
        while pos > 5.0:
            point = line.interpolate(pos)
            rows.append(
                f'<vehicle id="{lane.id}:{pos:.0f}" x="{point.x:.2f}" y="{point.y:.2f}" angle="{angle:.1f}"'
                f' speed="0.00" pos="{pos:.2f}" lane="{lane.id}" type="car"/>'
            )
            pos -= 7.5
    return f'<timestep time="{time_s}.00">{"".join(rows)}<person id="p"/></timestep>'


def written(folder: Path, *frames: str) -> Path:
    """Write FCD output."""
    file = folder / "fcd.xml"
    file.write_text(f"<fcd-export>{''.join(frames)}</fcd-export>", encoding="utf-8")
    return file


def test_a_full_block_is_a_deadlock_once_it_has_stood_for_longer_than_drivers_are_patient(
    tmp_path: Path,
) -> None:
    """FCD output does not tell who wants to go where, so for some time the first may wait for others."""
    for until_s, found in ((240, 1), (180, 0)):
        file = written(
            tmp_path, *(frame(0).replace('"0.00">', f'"{t}.00">', 1) for t in range(0, until_s, 10))
        )
        summary = write_fcd_run(file, GRID, tmp_path / f"run{found}")
        assert len(summary["deadlocks"]) == found
        if found:
            (deadlock,) = summary["deadlocks"]
            assert {place.rpartition("_")[0] for place in deadlock["places"]} == set(BLOCK)
            assert deadlock["closed_at_s"] <= 20.0


@pytest.mark.parametrize(
    ("frames", "said"),
    [
        (("",), "there are 0 frames in it"),
        (('<timestep time="0"/>', '<timestep time="1"/>'), "there is no vehicle in it"),
        (('<timestep time="0"/>', '<timestep time="60"/>'), "frames are 60 s apart"),
        (('<timestep time="1"/>', '<timestep time="0"/>'), "a frame at 0 s comes after one at 1 s"),
        (
            ('<timestep time="0"/>', '<timestep time="1"/>', '<timestep time="7"/>'),
            "after the frame at 1 s comes 7 s",
        ),
        (('<timestep time="0"><vehicle id="a"/></timestep>',), "an element has no lane"),
        (("<timestep",), "cut short or damaged"),
    ],
)
def test_what_is_wrong_with_a_file_is_said_in_a_line(
    frames: tuple[str, ...], said: str, tmp_path: Path
) -> None:
    """With its name."""
    with pytest.raises(LoopgateError, match=said) as raised:
        write_fcd_run(written(tmp_path, *frames), GRID, tmp_path / "run")
    assert "fcd.xml" in str(raised.value)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("C1D1_0", "elsewhere_0"), "which grid5-priority.net.xml does not have"),
        ((' x="', ' x="9999'), "fcd-output.geo"),
    ],
)
def test_output_of_another_network_is_refused(change: tuple[str, str], said: str, tmp_path: Path) -> None:
    """By the lane of the first vehicle, and by where it is."""
    frames = [frame(t, BLOCK[:1]).replace(*change) for t in (0, 1)]
    with pytest.raises(LoopgateError, match=said):
        write_fcd_run(written(tmp_path, *frames), GRID, tmp_path / "run")


def test_the_command_exits_with_3_at_a_deadlock_and_a_replay_can_be_made(tmp_path: Path) -> None:
    """As `loopgate run` does."""
    file = written(tmp_path, *(frame(0).replace('"0.00">', f'"{t}.00">', 1) for t in range(0, 240, 10)))
    out = tmp_path / "read"
    done = CliRunner().invoke(
        cli, ["read-fcd", str(file), GRID, "-o", str(out), "--json"], standalone_mode=False
    )
    assert done.return_value == 3
    assert json.loads(done.stdout)["deadlocks"]
    assert CliRunner().invoke(cli, ["replay", str(out)]).exit_code == 0
    assert (out / "replay.html").is_file()


def test_a_street_that_no_frame_shows_was_passed_all_the_same() -> None:
    """A vehicle that is on A0A1 and then on A2A3 came over A1A2; where no way leads, nothing is made up."""
    film = Film(RoadNetwork.open(GRID), 1.0)
    frames = [
        SeenVehicle("v", "", f"{edge}_0", 5.0, 20.0, 0.0, 0.0, 0.0) for edge in ("A0A1", "A2A3", "E4E3")
    ]
    found = [film.show(float(n), [one]) for n, one in enumerate(frames)]
    assert found == [[], [("v", "A1A2"), ("v", "A2A3")], [("v", "E4E3")]]
