"""Reads which streets to cover, and their weights, from the command line and from files."""

import math
from collections.abc import Collection
from pathlib import Path

import shapely

from loopgate.errors import RouteError
from loopgate.network.clock import as_number
from loopgate.network.road import RoadNetwork
from loopgate.network.xml_file import read_xml
from loopgate.reading import is_file, read_words, refusing, shown

_LEAST_CORNERS = 3
_HEAVIEST = 1000.0
_FARTHEST_M = 1e9


def read_streets(network: RoadNetwork, wish: str, vclass: str, *, option: str) -> tuple[str, ...]:
    """Return the edges that an option names.

    Raises `RouteError` if it is none of these, or names no edge of the network.

    Parameters
    ----------
    wish
        The corners of a polygon, ``x,y x,y x,y ...`` in the network's coordinates [m]; edges by name,
        separated by commas or blanks; or a file: edges by name (one a line, ``edge:NAME`` as netedit saves a
        selection, or separated by blanks), or an XML file with ``<poly shape="...">``. In a polygon lie the
        edges whose middle does.
    vclass
        Of the edges in a polygon only those open to this class count.
    option
        Its name, for messages.
    """
    if not is_file(wish):
        names = wish.replace(",", " ").split()
        if names and all(name in network.edges for name in names):
            return tuple(dict.fromkeys(names))
        corners = [corner.split(",") for corner in wish.split()]
        if (
            not all(len(corner) > 1 and not math.isnan(as_number(corner[0])) for corner in corners)
            or not corners
        ):
            missing = next((name for name in names if name not in network.edges), wish)
            msg = (
                f"{option} {shown(wish)}: no such file, and no edge {missing} in {network.name}; it takes a "
                "file, edges EDGE,EDGE,..., or the corners of a polygon: x,y x,y x,y"
            )
            raise RouteError(msg)
        return _inside(network, (vclass,), [_polygon(wish, f"{option} {shown(wish)}")], "the polygon")
    with refusing(wish, "list of streets", RouteError, wrong="not a list of edges"):
        text = read_words(wish)
    if text.lstrip().startswith("<"):
        return _inside(network, (vclass,), [area for _, area in _polygons(wish)], wish)
    edges = [
        _edge(network, name, wish) for name in text.split() if not name.startswith(("junction:", "lane:"))
    ]
    if not edges:
        msg = f"{wish}: no edges in it; expected their names, one a line"
        raise RouteError(msg)
    return tuple(dict.fromkeys(edges))


def _edge(network: RoadNetwork, name: str, file: str) -> str:
    edge = name.removeprefix("edge:")
    if edge not in network.edges:
        msg = f"{file}: edge {edge} is not in the network {network.name}; correct it or leave it out"
        raise RouteError(msg)
    return edge


def _polygon(corners: str, what: str) -> shapely.Polygon:
    try:
        points = [(float(x), float(y)) for x, y in (corner.split(",")[:2] for corner in corners.split())]
    except ValueError:
        points = []
    if len(points) < _LEAST_CORNERS or not all(abs(x) <= _FARTHEST_M for point in points for x in point):
        msg = f"{what}: expected at least three corners x,y x,y x,y in the network's coordinates [m]"
        raise RouteError(msg)
    return shapely.Polygon(points).buffer(0)


def _polygons(file: str) -> list[tuple[str, shapely.Polygon]]:
    top = read_xml(Path(file), root="additional", what="file of polygons", error=RouteError)
    found = []
    for number, poly in enumerate(top.iter("poly"), 1):
        name = poly.get("id") or f"polygon {number}"
        found.append((name, _polygon(poly.get("shape", ""), f"{file}: poly {name}")))
    if not found:
        msg = f'{file}: no polygon in it; expected <poly id="..." shape="x,y x,y x,y"/>'
        raise RouteError(msg)
    return found


def read_districts(network: RoadNetwork, file: str, classes: Collection[str]) -> dict[str, tuple[str, ...]]:
    """Return, for each polygon of an XML file, the edges open to a class with their middle in the polygon.

    Raises `RouteError` if there is no polygon in it, one is none, or has no edge inside; the text names it.
    """
    return {name: _inside(network, classes, [area], f"{file}: poly {name}") for name, area in _polygons(file)}


def _inside(
    network: RoadNetwork, classes: Collection[str], areas: list[shapely.Polygon], what: str
) -> tuple[str, ...]:
    whole = shapely.union_all(areas)
    found = tuple(
        edge.id
        for edge in network.edges.values()
        if any(edge.allows(vclass) for vclass in classes)
        and whole.covers(shapely.LineString(edge.lanes[0].shape).interpolate(0.5, normalized=True))
    )
    if not found:
        msg = f"{what}: no edge of {network.name} open to {', '.join(classes)} has its middle inside"
        raise RouteError(msg)
    return found


def read_weights(network: RoadNetwork, file: str) -> dict[str, float]:
    """Read weights of streets from lines ``EDGE WEIGHT``: how many times as often to visit them.

    Raises `RouteError` if a line is invalid; the text names file and line.
    """
    weights: dict[str, float] = {}
    with refusing(file, "list of weights", RouteError, wrong="not a list of edges with weights"):
        lines = read_words(file).splitlines()
    for number, line in enumerate(lines, 1):
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        weight = as_number(words[1]) if len(words) == 2 else math.nan  # noqa: PLR2004  a pair
        if not 1.0 <= weight <= _HEAVIEST:
            msg = (
                f"{file}: line {number}: {shown(line)}; expected an edge and a weight from 1 to {_HEAVIEST:g}"
            )
            raise RouteError(msg)
        weights[_edge(network, words[0], file)] = weight
    return weights
