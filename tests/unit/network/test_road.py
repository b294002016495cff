"""Networks of the SUMO package, read into records."""

from __future__ import annotations

import gzip
import itertools
from collections import Counter
from pathlib import Path

import pytest
import shapely
import sumolib

from loopgate.errors import NetworkError
from loopgate.network import RoadNetwork, packaged_networks


@pytest.fixture(scope="module")
def bs3d() -> RoadNetwork:
    return RoadNetwork.open("sumo:bs3d")


def test_names_of_the_package() -> None:
    """The networks that the documentation names are there; an unknown name lists them."""
    assert {"DRT", "bs3d", "grid6", "square"} <= packaged_networks().keys()
    with pytest.raises(NetworkError, match=r"sumo:nowhere: no such network .* sumo:DRT"):
        RoadNetwork.open("sumo:nowhere")


def test_every_movement_has_its_way_through_the_junction(bs3d: RoadNetwork) -> None:
    """Via lanes exist, are internal, and join the two lanes: the chain begins and ends where they do."""
    for connection in bs3d.connections:
        if not bs3d.allows(connection):
            continue
        lanes = [bs3d.lanes[lane] for lane in connection.via]
        assert lanes
        assert all(lane.internal for lane in lanes)
        shapes = [
            bs3d.edges[connection.from_edge].lanes[connection.from_lane].shape,
            *(lane.shape for lane in lanes),
            bs3d.edges[connection.to_edge].lanes[connection.to_lane].shape,
        ]
        for one, following in itertools.pairwise(shapes):
            assert one[-1] == pytest.approx(following[0], abs=0.6)
    assert any(len(connection.via) == 2 for connection in bs3d.connections)


def test_links_agree_with_the_request_matrix(bs3d: RoadNetwork) -> None:
    """Links number a junction's movements without gaps; foes are mutual."""
    for junction in bs3d.junctions.values():
        links = sorted(c.link for c in bs3d.connections if c.junction == junction.id)
        if not junction.foes or not links:
            continue
        assert len(set(links)) == len(links)
        assert links[-1] < len(junction.foes)
        for one, foes in enumerate(junction.foes):
            assert all(one in junction.foes[other] for other in foes)


def test_foes_cross_or_merge(bs3d: RoadNetwork) -> None:
    """Two movements into one lane are foes: a check of the numbering against the roads themselves."""
    checked = 0
    into: dict[tuple[str, int], list[int]] = {}
    cars = [c for c in bs3d.connections if bs3d.allows(c) and c.link >= 0]
    for number, c in enumerate(cars):
        into.setdefault((c.to_edge, c.to_lane), []).append(number)
    for numbers in into.values():
        for one in numbers:
            for other in numbers:
                if cars[one].from_edge != cars[other].from_edge:
                    checked += 1
                    assert bs3d.are_foes(cars[one], cars[other])
    assert checked > 100


def test_movements_that_pedestrians_cross(bs3d: RoadNetwork) -> None:
    """A crossing lies across each; a network without crossings has none."""
    assert not any(bs3d.is_walked(c) for c in bs3d.connections)
    drt = RoadNetwork.open("sumo:DRT")
    walks: dict[str, list[shapely.LineString]] = {}
    for edge in sumolib.net.readNet(
        str(drt.file), withInternal=True, withPedestrianConnections=True
    ).getEdges():
        if edge.getFunction() == "crossing":
            line = shapely.LineString(edge.getLanes()[0].getShape())
            walks.setdefault(edge.getID()[1:].rpartition("_c")[0], []).append(line)
    cars = [c for c in drt.connections if c.via and drt.allows(c) and c.direction != "t"]
    found = Counter(
        (drt.is_walked(c), any(line.crosses(way) for line in walks.get(c.junction, ())))
        for c in cars
        for way in [shapely.LineString([p for lane in c.via for p in drt.lanes[lane].shape])]
    )
    assert found[True, True] > 300
    assert found[False, True] == 0


def test_ignoring_drives_where_it_likes(bs3d: RoadNetwork, tmp_path: Path) -> None:
    """SUMO lets the class ``ignoring`` drive and change on lanes that are closed to all others."""
    assert all(bs3d.allows(connection, "ignoring") for connection in bs3d.connections)
    shut = tmp_path / "shut.net.xml"
    text = bs3d.file.read_text(encoding="utf-8")
    lane = next(
        lane
        for edge in bs3d.edges.values()
        for lane in edge.lanes
        if f'<lane id="{lane.id}" index="{lane.index}" speed' in text
    )
    closed = f'<lane id="{lane.id}" allow="tram" changeLeft="tram" index'
    shut.write_text(text.replace(f'<lane id="{lane.id}" index', closed), encoding="utf-8")
    found = RoadNetwork.open(shut).lanes[lane.id]
    assert "passenger" not in found.allowed
    assert {"ignoring", "tram"} <= found.allowed
    assert found.may_change("ignoring", left=True)


def test_gzipped_network(tmp_path: Path) -> None:
    """A .net.xml.gz reads as the same network."""
    file = packaged_networks()["grid6"]
    packed = tmp_path / "grid6.net.xml.gz"
    packed.write_bytes(gzip.compress(file.read_bytes()))
    assert RoadNetwork.open(packed).connections == RoadNetwork.open("sumo:grid6").connections


def test_buses_have_roads_of_their_own(bs3d: RoadNetwork) -> None:
    """Permissions are kept by class."""
    closed = [edge for edge in bs3d.edges.values() if not edge.allows("passenger")]
    assert any(edge.allows("bus") or edge.allows("pedestrian") for edge in closed)


@pytest.mark.parametrize(
    ("root", "way_out"),
    [("osm", "netconvert --osm-files"), ("routes", "give the network as NETWORK and this file as --routes")],
)
def test_a_file_taken_for_a_network_is_refused_with_the_way_out(
    root: str, way_out: str, tmp_path: Path
) -> None:
    """Raw map data, and routes in place of the network they lie on."""
    file = tmp_path / "city.xml"
    file.write_text(f"<{root}/>", encoding="utf-8")
    with pytest.raises(NetworkError, match=way_out):
        RoadNetwork.open(str(file))
