"""Loops and runs as maps: an independent reader finds them on the network, within a metre."""

import re
from pathlib import Path
from typing import Any

import geopandas
import gpxpy
import numpy as np
import pandas as pd
import pyproj
import pytest
import shapely
from command import loopgate

from loopgate import RoadNetwork, Run, Scenario, read_loops, run
from loopgate.errors import NetworkError, ResultsError
from loopgate.export import export_loops, find_turns, vehicle_day
from loopgate.network.projection import Projection

pytestmark = pytest.mark.sumo

PLACE: dict[str, Any] = {"crs": "+proj=utm +zone=33 +ellps=WGS84 +datum=WGS84 +units=m"}
OFFSET = (-398790.46, -5809246.45)
"""The projection of the network, as its file has it; read here by hand."""


def on_network(frame: geopandas.GeoDataFrame) -> geopandas.GeoSeries:
    """Return shapes in coordinates of the network, by GeoPandas' own way back."""
    return frame.to_crs(PLACE["crs"]).translate(*OFFSET)


def lanes(network: RoadNetwork) -> shapely.Geometry:
    """Return all lanes of the network, those inside junctions too."""
    return shapely.union_all([shapely.LineString(lane.shape) for lane in network.lanes.values()])


def farthest_m(shapes: geopandas.GeoSeries, ground: shapely.Geometry) -> float:
    """Return how far a corner of some shape is from the ground [m]."""
    points = shapely.points(shapely.get_coordinates(shapes.to_numpy()))
    shapely.prepare(ground)
    return float(shapely.distance(points, ground).max())


@pytest.fixture(scope="module")
def covering(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make covering loops by the command line, with their maps."""
    folder = tmp_path_factory.mktemp("cover")
    square = "1000,1000 1700,1000 1700,1700 1000,1700"
    cover = ["loops", "sumo:DRT", "--cover", square, "--count", "3"]
    made = loopgate(*cover, "-o", folder / "l.rou.xml", "--export", folder / "maps")
    assert made.returncode == 0, made.stderr
    return folder


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """Make a run on loops."""
    folder = tmp_path_factory.mktemp("run")
    return run(Scenario(network="sumo:DRT", loops=3, vehicles=9, duration_s=120), folder / "one")


def test_covering_loops_lie_on_the_network(covering: Path) -> None:
    """Every corner of every loop and street is within a metre of a lane; loops are as long as they say."""
    network = RoadNetwork.open("sumo:DRT")
    ground = lanes(network)
    loops = {loop.id: loop for loop in read_loops(network, covering / "l.rou.xml").loops}
    drawn = geopandas.read_file(covering / "maps" / "loops.geojson")
    assert set(drawn["loop"]) == set(loops)
    shapes = on_network(drawn)
    assert farthest_m(shapes, ground) < 1.0
    for name, shape in zip(drawn["loop"], shapes, strict=True):
        assert shape.length == pytest.approx(loops[name].length_m, rel=0.03)
    streets = geopandas.read_file(covering / "maps" / "streets.geojson")
    assert farthest_m(on_network(streets), ground) < 1.0
    assert {edge for loop in loops.values() for edge in loop.edges} <= set(streets["edge"])


def test_receivers_read_the_same_loops(covering: Path) -> None:
    """The track of each GPX file lies on the network; its route has the turns, by name of street."""
    network = RoadNetwork.open("sumo:DRT")
    ground = lanes(network)
    loops = {loop.id: loop for loop in read_loops(network, covering / "l.rou.xml").loops}
    back = pyproj.Transformer.from_crs("EPSG:4326", PLACE["crs"], always_xy=True)
    for name, loop in loops.items():
        read = gpxpy.parse((covering / "maps" / "loops" / f"{name}.gpx").read_text(encoding="utf-8"))
        [track], [route] = read.tracks, read.routes
        points = [(point.longitude, point.latitude) for point in track.segments[0].points]
        plane = np.column_stack(back.transform(*np.array(points).T)) + OFFSET
        shapely.prepare(ground)
        assert float(shapely.distance(shapely.points(plane), ground).max()) < 1.0
        assert track.length_2d() == pytest.approx(loop.length_m, rel=0.03)
        told = [str(point.name) for point in route.points]
        assert told[0].startswith("start on ")
        named = {network.edges[edge].street for edge in loop.edges} - {""}
        assert named
        assert all(any(street in words for words in told) for street in named)
        kml = (covering / "maps" / "loops" / f"{name}.kml").read_text(encoding="utf-8")
        [line] = re.findall(r"<LineString>.*?<coordinates>(.*?)</coordinates>", kml)
        pairs = [tuple(map(float, pair.split(","))) for pair in line.split()]
        assert np.allclose(pairs, points, atol=1e-7)


def test_turns_are_those_of_the_network() -> None:
    """Left and right as SUMO names the movements, where they are sharp."""
    network = RoadNetwork.open("networks/grid5-priority.net.xml")
    edges = ("A0B0", "B0B1", "B1A1", "A1A0")
    told = [turn.text for turn in find_turns(network, edges, (0.0, 1.0, 2.0, 3.0))]
    assert told == [
        "start on edge A0B0",
        "turn left into edge B0B1",
        "turn left into edge B1A1",
        "turn left into edge A1A0",
    ]
    assert [turn.text for turn in find_turns(network, edges[:2], (0.0, 1.0))][1:] == told[1:2]
    back = find_turns(network, ("A0A1", "A1B1", "B1B0"), (0.0, 1.0, 2.0))
    assert [turn.text.partition(" into")[0] for turn in back[1:]] == ["turn right", "turn right"]


def test_a_run_is_a_map(made: Run, tmp_path: Path) -> None:
    """Streets with the figures of the table, loops, places with waits; a day for every vehicle."""
    files = {file.name for file in made.export(tmp_path)}
    assert {"streets.geojson", "loops.geojson", "places.geojson", "v1.csv"} <= files
    ground = lanes(RoadNetwork.open("sumo:DRT"))
    assert made.streets is not None
    for layer in ("streets", "loops", "places"):
        frame = geopandas.read_file(tmp_path / f"{layer}.geojson")
        assert len(frame)
        assert farthest_m(on_network(frame), ground) < 1.0
        assert len(made.geo(layer)) == len(frame)
    streets = geopandas.read_file(tmp_path / "streets.geojson").set_index("edge")
    table = made.streets.set_index("edge")
    assert np.allclose(streets["idleness_s"], table.loc[streets.index, "idleness_s"], atol=1e-3)
    assert len(streets) == len(table)


def test_the_day_of_a_vehicle(made: Run) -> None:
    """Its edges in their order, with street, clock and place."""
    assert made.folder is not None
    day = vehicle_day(made.folder, "v1")
    entered = made.events[(made.events["vehicle"] == "v1") & (made.events["event"] == "edge")]
    assert day.loc[day["what"] == "enters", "edge"].tolist() == entered["place"].tolist()
    assert day["clock"].str.fullmatch(r"0:0[0-2]:[0-5]\d").all()
    assert day.loc[day["what"] == "enters", ["lon", "lat"]].notna().all().all()
    with pytest.raises(ResultsError, match="the run has no vehicle nobody"):
        vehicle_day(made.folder, "nobody")


def test_replay_and_report_write_maps_too(made: Run, tmp_path: Path) -> None:
    """By the option of the command line, the same files."""
    for command in ("replay", "report"):
        out = str(tmp_path / f"{command}.html")
        done = loopgate(command, str(made.folder), "-o", out, "--export", tmp_path / command)
        assert done.returncode == 0, done.stderr
        assert pd.read_csv(tmp_path / command / "days" / "v1.csv")["what"].iloc[0] == "starts"


def test_a_report_is_written_where_no_map_can_be(tmp_path: Path) -> None:
    """The network has no projection: the line says so, after the page."""
    folder = tmp_path / "run"
    run(Scenario(network="networks/ring3.net.xml", routes="routes/ring3.rou.xml", duration_s=20.0), folder)
    done = loopgate("report", folder, "-o", tmp_path / "r.html", "--export", tmp_path / "maps")
    assert done.returncode == 2
    assert "no geographic projection" in done.stderr
    assert str(tmp_path / "r.html") in done.stdout
    assert (tmp_path / "r.html").is_file()


def test_a_network_without_projection(tmp_path: Path) -> None:
    """One line that names the file and the way out."""
    network = RoadNetwork.open("networks/ring3.net.xml")
    with pytest.raises(
        NetworkError, match=r"ring3.net.xml: the network has no geographic projection .*--proj"
    ):
        export_loops(network, read_loops(network, "routes/ring3.rou.xml").loops, tmp_path)


@pytest.mark.parametrize("parameter", ["+proj=nothing", "no projection at all"])
def test_a_projection_that_is_none(parameter: str, tmp_path: Path) -> None:
    """PROJ's refusal is a line of ours."""
    network = RoadNetwork.open("networks/ring3.net.xml")
    text = network.file.read_text(encoding="utf-8")
    changed = tmp_path / "n.net.xml"
    changed.write_text(
        re.sub(r'projParameter="[^"]*"', f'projParameter="{parameter}"', text), encoding="utf-8"
    )
    with pytest.raises(NetworkError, match=r"n.net.xml: PROJ does not know the projection"):
        Projection.of(RoadNetwork.open(changed))
