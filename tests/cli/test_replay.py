"""`loopgate replay` by exit code and output."""

import json
from pathlib import Path

import pytest
import sumo
from click.testing import CliRunner

from loopgate.cli.main import cli
from loopgate.errors import LoopgateError, ResultsError
from loopgate.replay import make_replay
from loopgate.replay.scene import load_scene
from loopgate.replay.tracks import TURN
from loopgate.runs.run import read_run

pytestmark = pytest.mark.sumo

NETWORK = "networks/order2.net.xml"
NEAR_DM = 2
"""Both are rounded to a tenth of a metre."""


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Run a minute with positions."""
    folder = tmp_path_factory.mktemp("replay") / "seen"
    options = ["--routes", "routes/order2.rou.xml", "--duration", "60", "--positions", "-o", str(folder)]
    assert CliRunner().invoke(cli, ["run", NETWORK, *options]).exit_code == 0
    return folder


def test_writes_one_page_without_links(seen: Path) -> None:
    """By default beside the run; nothing in it points outside."""
    answer = CliRunner().invoke(cli, ["replay", str(seen)])
    assert answer.exit_code == 0
    page = (seen / "replay.html").read_text(encoding="utf-8")
    assert answer.output.startswith(str(seen / "replay.html"))
    assert "http" not in page.split('id="data"')[0].replace('http-equiv="Content', "")
    assert "unsafe" not in page


def test_two_runs_share_their_streets(seen: Path) -> None:
    """Side by side: the second adds its vehicles only."""
    one, two = make_replay(seen), make_replay(seen, seen)
    assert two.title == "order2: loopgate, certified beside loopgate, certified"
    assert len(two.html) - len(one.html) < len(one.html) / 2
    assert make_replay(seen).html == one.html


@pytest.mark.parametrize("gate", ["certified", "open"])
def test_without_positions_it_shows_the_same(gate: str, tmp_path: Path) -> None:
    """What the drive knew of its vehicles is where SUMO had them: front and direction, step by step."""
    options = ["--routes", "routes/order2.rou.xml", "--duration", "300", "--positions", "--gate", gate]
    assert CliRunner().invoke(cli, ["run", NETWORK, *options, "-o", str(tmp_path)]).exit_code == 0
    recorded = load_scene(tmp_path)
    (tmp_path / "positions.csv.gz").unlink()
    known = load_scene(tmp_path)
    assert known.tracks.vehicles == recorded.tracks.vehicles
    assert known.tracks.count.tolist() == recorded.tracks.count.tolist()
    for axis in ("x", "y"):
        off = getattr(known.tracks, axis) - getattr(recorded.tracks, axis)
        assert abs(off).max() <= NEAR_DM
    turned = (known.tracks.heading - recorded.tracks.heading + TURN // 2) % TURN - TURN // 2
    assert abs(turned).max() < TURN / 32
    assert known.happenings.laps == recorded.happenings.laps
    assert known.happenings.holds == recorded.happenings.holds
    assert len(known.happenings.visits) == len(recorded.happenings.visits)


def test_a_configuration_as_it_is(tmp_path: Path) -> None:
    """Vehicles that come and go, streets, no places."""
    config = Path(sumo.SUMO_HOME) / "tools" / "game" / "cross.sumocfg"
    options = ["--gate", "open", "--duration", "60", "--positions", "-o", str(tmp_path / "as-is")]
    assert CliRunner().invoke(cli, ["run", str(config), *options]).exit_code == 0
    scene = load_scene(tmp_path / "as-is")
    assert len(scene.tracks.vehicles) > 10
    assert scene.streets["lanes"]
    assert not scene.ways.places
    assert make_replay(tmp_path / "as-is").title == "cross.sumocfg: SUMO's own rules"


def test_a_notebook_shows_it(seen: Path) -> None:
    """`Run.replay` is a frame that holds the page."""
    shown = read_run(seen).replay()._repr_html_()
    assert shown.startswith("<iframe")
    assert "<script" not in shown.replace("&lt;script", "")


def test_the_streets_are_drawn_where_the_network_is_gone(seen: Path, tmp_path: Path) -> None:
    """A run folder that was taken elsewhere has the lanes of its loops."""
    moved = tmp_path / "moved"
    moved.mkdir()
    for file in seen.iterdir():
        (moved / file.name).write_bytes(file.read_bytes().replace(b"networks/order2", b"networks/gone"))
    assert len(make_replay(moved).html) > 10_000


def test_refusals_name_the_way_out(seen: Path, tmp_path: Path) -> None:
    """Neither loops nor positions: the command that records them; no run, or three: what was expected."""
    bare = tmp_path / "bare"
    bare.mkdir()
    (bare / "summary.json").write_bytes((seen / "summary.json").read_bytes())
    command = json.loads((seen / "summary.json").read_text())["command"]
    for folders, words in (
        ([bare], f"no positions were recorded; run it again with them: {command}"),
        ([tmp_path / "none"], "cannot read the summary"),
        ([seen] * 3, "one run or two"),
    ):
        with pytest.raises(LoopgateError, match=words.replace("(", r"\(")):
            CliRunner().invoke(
                cli, ["replay", *map(str, folders)], catch_exceptions=False, standalone_mode=False
            )


@pytest.mark.parametrize("name", ["layout.json", "fronts.parquet"])
def test_a_folder_copied_in_part_is_told_what_it_lacks(seen: Path, tmp_path: Path, name: str) -> None:
    """Nothing has to be run again: the file is where the folder was copied from."""
    for file in seen.iterdir():
        if file.name not in {name, "positions.csv.gz"}:
            (tmp_path / file.name).write_bytes(file.read_bytes())
    with pytest.raises(LoopgateError, match=f"{name}: it is missing, .* copy the whole folder of the run"):
        make_replay(tmp_path)


@pytest.mark.parametrize(
    "name",
    ["summary.json", "scenario.toml", "layout.json", "events.parquet", "positions.csv.gz", "fronts.parquet"],
)
def test_damaged_files_are_refused_in_one_line(seen: Path, tmp_path: Path, name: str) -> None:
    """Whatever is cut short, the line names it."""
    for file in seen.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    if name == "fronts.parquet":
        (tmp_path / "positions.csv.gz").unlink()
    content = (tmp_path / name).read_bytes()
    (tmp_path / name).write_bytes(content[: len(content) // 3] + b"\0[")
    with pytest.raises(ResultsError, match=str(tmp_path / name)) as caught:
        make_replay(tmp_path)
    assert "\n" not in str(caught.value)
