"""Loops as GeoJSON, GPX and KML."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from loopgate.arrays import Floats
from loopgate.export.formats import Features, feature, file_names, geojson, gpx, kml, write
from loopgate.export.loop_lines import LoopLine, find_turns, loop_line
from loopgate.network.loop import Loop
from loopgate.network.projection import Projection
from loopgate.network.road import RoadNetwork


def export_loops(
    network: RoadNetwork, loops: Sequence[Loop], folder: Path | str, *, left_out: Mapping[str, str] = {}
) -> list[Path]:
    """Write loops and their streets as map files (GeoJSON, GPX, KML); return their paths.

    ``loops.geojson`` and ``streets.geojson`` hold all loops and streets; ``loops/NAME.gpx`` and
    ``loops/NAME.kml`` hold one loop with its turn list. Longitude and latitude (WGS 84) follow from the
    network's projection.

    Raises `NetworkError` if the network has no projection, `ResultsError` if a file cannot be written.

    Parameters
    ----------
    left_out
        Reasons why streets are not covered, by edge; these streets are written too.

    Examples
    --------
    >>> from loopgate import RoadNetwork, find_loops
    >>> from loopgate.export import export_loops
    >>> network = RoadNetwork.open("sumo:DRT")
    >>> files = export_loops(network, find_loops(network, 1, seed=1).loops, "out/maps")
    >>> [file.name for file in files]
    ['loops.geojson', 'streets.geojson', 'loop0.gpx', 'loop0.kml']
    """
    projection = Projection.of(network)
    ways = [loop_line(loop) for loop in loops]
    folder = Path(folder)
    on: dict[str, list[str]] = {}
    for way in ways:
        for edge in dict.fromkeys(way.edges):
            on.setdefault(edge, []).append(way.name)
    streets = [
        street_feature(
            network, projection, edge, loops=" ".join(on.get(edge, [])), why_not=left_out.get(edge)
        )
        for edge in [*on, *(edge for edge in left_out if edge not in on)]
    ]
    return [
        write(folder / "loops.geojson", geojson(loop_features(network, projection, ways))),
        write(folder / "streets.geojson", geojson(streets)),
        *write_ways(network, projection, ways, folder / "loops"),
    ]


def street_feature(
    network: RoadNetwork, projection: Projection, edge: str, **more: object
) -> dict[str, object]:
    """Return an edge as a feature: rightmost lane, name, name of the street, length [m], and more."""
    record = network.edges[edge]
    line = projection.lonlat(record.lanes[0].shape)
    return feature(line, edge=edge, street=record.street, length_m=record.length_m, **more)


def loop_features(network: RoadNetwork, projection: Projection, ways: Sequence[LoopLine]) -> Features:
    """Return loops as features: name, length of a lap [m], number of edges, streets in driving order."""
    return [
        feature(
            projection.lonlat(way.line),
            loop=way.name,
            length_m=way.length_m,
            edges=len(way.edges),
            streets=", ".join(dict.fromkeys(filter(None, (network.edges[e].street for e in way.edges)))),
        )
        for way in ways
    ]


def write_ways(
    network: RoadNetwork, projection: Projection, ways: Sequence[LoopLine], folder: Path
) -> list[Path]:
    """Write each loop as GPX and KML, with its turn list; return the files."""
    names = file_names(way.name for way in ways)
    files = []
    for way in ways:
        line = projection.lonlat(way.line)
        turns = list(_told(network, projection, way))
        files.append(write(folder / f"{names[way.name]}.gpx", gpx(way.name, line, turns)))
        files.append(write(folder / f"{names[way.name]}.kml", kml(way.name, line, turns)))
    return files


def _told(network: RoadNetwork, projection: Projection, way: LoopLine) -> list[tuple[Floats, str, str]]:
    turns = find_turns(network, way.edges, way.begins_m)
    points = projection.lonlat(np.array([turn.point for turn in turns]))
    return [
        (point, turn.text, f"at {turn.at_m:.0f} m, edge {turn.edge}")
        for point, turn in zip(points, turns, strict=True)
    ]
