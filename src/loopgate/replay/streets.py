"""The streets behind a replay: roads of the network round the loops, else lanes that vehicles drive on."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from loopgate.audit.layout import Layout
from loopgate.errors import LoopgateError
from loopgate.network import RoadNetwork
from loopgate.replay.tracks import PER_M

Box = tuple[float, float, float, float]
"""Smallest and largest x, smallest and largest y [m]."""

_CARS = frozenset({"passenger", "bus", "delivery"})
_WIDTH_M = 3.2
_SIMPLER_M = 0.2
"""Simplified shapes may differ from the real ones by this much [m]."""


def open_network(scenario: Mapping[str, Any], folder: Path) -> RoadNetwork | None:
    """Return the network of a run; None if it cannot be read any more.

    A relative path is tried from the working directory, then from the run folder.
    """
    name = str(scenario.get("network", ""))
    for tried in (name, str(folder / name)):
        try:
            return RoadNetwork.open(tried)
        except LoopgateError:
            continue
    return None


def flat(line: npt.ArrayLike, *, closed: bool = False) -> list[int]:
    """Return a line as x, y of its first point, then the steps from point to point, in tenths of a metre."""
    points = np.asarray(line, dtype=np.float64)
    made = shapely.Polygon(points) if closed and len(points) > 3 else shapely.LineString(points)  # noqa: PLR2004  a triangle stays
    simple = shapely.get_coordinates(shapely.simplify(made, _SIMPLER_M))
    whole = np.rint((simple if len(simple) > 1 else points) * PER_M).astype(np.int64)
    return [int(value) for value in np.diff(whole, axis=0, prepend=np.zeros((1, 2), dtype=np.int64)).ravel()]


def draw_streets(network: RoadNetwork | None, layout: Layout | None, box: Box) -> dict[str, Any]:
    """Return the streets in a box: lanes by width [tenths of a metre], and outlines of junctions."""
    lanes: dict[int, list[list[int]]] = {}
    junctions: list[list[int]] = []
    if network is not None:
        edges = [edge for edge in network.edges.values() if any(edge.allows(name) for name in _CARS)]
        for edge in edges:
            for lane in edge.lanes:
                if lane.allowed & _CARS and _inside(lane.shape, box):
                    lanes.setdefault(round(lane.width_m * PER_M), []).append(flat(lane.shape))
        names = {name: None for edge in edges for name in (edge.from_junction, edge.to_junction)}
        shapes = [network.junctions[name].shape for name in names]
        junctions = [
            flat(shape, closed=True)
            for shape in shapes
            if len(shape) > 2 and _inside(shape, box)  # noqa: PLR2004
        ]
    elif layout is not None:
        lanes[round(_WIDTH_M * PER_M)] = [flat(shape) for shape in layout.shapes.values()]
    return {"lanes": [[width, lines] for width, lines in sorted(lanes.items())], "junctions": junctions}


def _inside(shape: Sequence[tuple[float, float]], box: Box) -> bool:
    xs, ys = [x for x, _ in shape], [y for _, y in shape]
    return max(xs) >= box[0] and min(xs) <= box[1] and max(ys) >= box[2] and min(ys) <= box[3]
