"""Reads which streets to cover, and their weights, from the command line and from files."""

import math
from collections.abc import Callable, Collection, Iterable
from functools import partial
from pathlib import Path

import shapely

from loopgate.errors import RouteError
from loopgate.network.clock import as_number
from loopgate.network.road import RoadNetwork
from loopgate.network.road_graph import parts_with_loops
from loopgate.network.xml_file import read_xml
from loopgate.reading import is_file, meant, read_words, refusing, shown

_LEAST_CORNERS = 3
_HEAVIEST = 1000.0
_FARTHEST_M = 1e9


def read_streets(
    network: RoadNetwork, wish: str, vclass: str, *, option: str, u_turns: bool | None = None
) -> tuple[str, ...]:
    """Return the edges that an option names.

    Raises `RouteError` if it is none of these, or names no edge or street of the network.

    Parameters
    ----------
    wish
        The corners of a polygon, ``x,y x,y x,y ...`` in the network's coordinates [m]; edges by name or
        streets by name, separated by commas (edges also by blanks); or a file: one edge or street a line
        (``edge:NAME`` as netedit saves a selection; edges also separated by blanks), or an XML file with
        ``<poly shape="...">``. In a polygon lie the edges whose middle does.
    vclass
        Of the edges in a polygon or on a street only those open to this class count.
    option
        Its name, for messages.
    u_turns
        If given, take of a street only its longest edge on a closed walk, with or without turning round.
    """
    on_walks: Collection[str] = ()
    if u_turns is not None:
        on_walks = {
            e for part in parts_with_loops(network, vclass=vclass, u_turns=u_turns) for e in part.edges
        }
    named = partial(_named, network, vclass=vclass, longest_of=on_walks)
    listed = partial(_listed, network=network, named=named)
    if not is_file(wish):
        edges, missing = listed(wish.split(","))
        if edges and not missing:
            return tuple(edges)
        corners = [corner.split(",") for corner in wish.split()]
        if corners and all(len(corner) > 1 and not math.isnan(as_number(corner[0])) for corner in corners):
            return _inside(network, (vclass,), [_polygon(wish, f"{option} {shown(wish)}")], "the polygon")
        if network.on_street(missing):
            msg = f"{option} {shown(wish)}: street {missing} of {network.name} is closed to {vclass}"
            raise RouteError(msg)
        msg = (
            f"{option} {shown(wish)}: no such file, and no edge or street {missing or wish} open to {vclass} "
            f"in {network.name}; it takes a file, EDGE,EDGE,..., names of streets, or the corners of a "
            f"polygon: x,y x,y x,y{meant(missing, _open_names(network, vclass))}"
        )
        raise RouteError(msg)
    with refusing(wish, "list of streets", RouteError, wrong="not a list of edges"):
        text = read_words(wish)
    if text.lstrip().startswith("<"):
        return _inside(network, (vclass,), [area for _, area in _polygons(wish)], wish)
    edges, missing = listed(text.splitlines())
    if missing:
        msg = f"{wish}: edge or street {missing} open to {vclass} is not in the network {network.name}; "
        msg += f"correct it or leave it out{meant(missing, _open_names(network, vclass))}"
        raise RouteError(msg)
    if not edges:
        msg = f"{wish}: no edges in it; expected their names, one a line"
        raise RouteError(msg)
    return tuple(edges)


def _open_names(network: RoadNetwork, vclass: str) -> dict[str, None]:
    """Return the names of edges and streets that a class may use, for "did you mean"."""
    edges = [edge for edge in network.edges.values() if edge.allows(vclass)]
    return dict.fromkeys([*(edge.id for edge in edges), *(edge.street for edge in edges if edge.street)])


def _listed(
    parts: Iterable[str], *, network: RoadNetwork, named: Callable[[str], list[str]]
) -> tuple[list[str], str]:
    """Return the edges of names, and the first name that is none of an edge or a street."""
    edges: list[str] = []
    for part in filter(None, map(str.strip, parts)):
        for name in part.split() if part not in network.edges and not network.on_street(part) else [part]:
            if name.startswith(("junction:", "lane:")):  # in a selection of netedit
                continue
            if not (found := named(name.removeprefix("edge:"))):
                return edges, part if part.startswith(name) else name
            edges += found
    return list(dict.fromkeys(edges)), ""


def _named(network: RoadNetwork, name: str, *, vclass: str, longest_of: Collection[str]) -> list[str]:
    """Return the edge of a name, or the edges of the street with this name that a class may use.

    Of a street only the longest edge among `longest_of`, if any of it is among them.
    """
    if name in network.edges:
        return [name]
    found = [edge for edge in network.on_street(name) if network.edges[edge].allows(vclass)]
    best = max(set(found) & set(longest_of), key=lambda e: (network.edges[e].length_m, e), default=None)
    return found if best is None else [best]


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
    """Read weights from lines ``EDGE WEIGHT`` or ``STREET WEIGHT``: how many times as often to visit them.

    Raises `RouteError` if a line is invalid; the text names file and line.
    """
    weights, seen = dict[str, float](), dict[str, float]()
    with refusing(file, "list of weights", RouteError, wrong="not a list of edges with weights"):
        lines = read_words(file).splitlines()
    for number, line in enumerate(lines, 1):
        if not line.strip() or line.strip().startswith("#"):
            continue
        name, _, word = line.strip().removeprefix("edge:").rpartition(" ")
        weight = as_number(word)
        if not name or not 1.0 <= weight <= _HEAVIEST:
            msg = (
                f"{file}: line {number}: {shown(line)}; expected an edge or a street, and a weight from 1 to "
            )
            msg += f"{_HEAVIEST:g}"
            raise RouteError(msg)
        edges = (name.strip(),) if name.strip() in network.edges else network.on_street(name)
        if not edges:
            msg = (
                f"{file}: edge or street {name} is not in the network {network.name}; correct it or leave it "
            )
            msg += f"out{meant(name, network.names())}"
            raise RouteError(msg)
        if seen.setdefault(name.strip(), weight) != weight:
            msg = f"{file}: line {number}: {name.strip()} has the weight {seen[name.strip()]:g} already"
            raise RouteError(msg)
        weights.update(dict.fromkeys(edges, weight))
    return weights
