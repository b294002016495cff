"""A loop as a line on the map, with the list of its turns."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from loopgate.arrays import Floats
from loopgate.network.loop import Loop
from loopgate.network.road import RoadNetwork

_STRAIGHT_DEG = 30.0
_ROUND_DEG = 150.0


@dataclass(frozen=True, slots=True)
class Turn:
    """One line of a loop's turn list: an instruction and its position on the map."""

    at_m: float
    """Distance from the loop's beginning [m]."""
    point: tuple[float, float]
    """Where the street begins, network coordinates [m]."""
    text: str
    edge: str


@dataclass(frozen=True, slots=True)
class LoopLine:
    """A loop as a line on the map.

    Attributes
    ----------
    name
        The name of the loop.
    line
        Points of a lap, network coordinates [m], shape (n, 2).
    edges
        Edges in driving order.
    begins_m
        Distance of each edge's beginning from the loop's beginning [m].
    length_m
        Length of a lap [m].
    """

    name: str
    line: Floats
    edges: tuple[str, ...]
    begins_m: tuple[float, ...]
    length_m: float


def loop_line(loop: Loop) -> LoopLine:
    """Return a loop as a line on the map; the line is closed if the loop is.

    Examples
    --------
    >>> from loopgate import RoadNetwork, read_loops
    >>> from loopgate.export import loop_line
    >>> network = RoadNetwork.open("networks/ring3.net.xml")
    >>> way = loop_line(read_loops(network, "routes/ring3.rou.xml").loops[0])
    >>> way.edges[0], len(way.begins_m) == len(way.edges)
    ('p1b', True)
    """
    points = loop.curve()[0]
    line = np.vstack((points, points[:1])) if loop.closed else points
    begins = tuple(span.begin_m for span in loop.roads)
    return LoopLine(loop.id, distinct(line), loop.edges, begins, loop.length_m)


def distinct(line: Floats) -> Floats:
    """Return a line without repeated points."""
    keep = np.concatenate(([True], np.abs(np.diff(line, axis=0)).max(axis=1, initial=0.0) > 0.0))
    kept: Floats = line[keep] if keep.sum() > 1 else line[:2]
    return kept


def find_turns(network: RoadNetwork, edges: Sequence[str], begins_m: Sequence[float]) -> list[Turn]:
    """Return the turn list of a loop: its first street, each turn, and each new street name.

    Turns of less than 30 degrees are *straight on*, those of more than 150 degrees *turn round*.

    Parameters
    ----------
    edges
        Edges in driving order; the last leads to the first.
    begins_m
        Distance of each edge's beginning from the loop's beginning [m].

    Examples
    --------
    >>> from loopgate import RoadNetwork, read_loops
    >>> from loopgate.export import find_turns, loop_line
    >>> network = RoadNetwork.open("networks/ring3.net.xml")
    >>> way = loop_line(read_loops(network, "routes/ring3.rou.xml").loops[0])
    >>> [turn.text for turn in find_turns(network, way.edges, way.begins_m)][0]
    'start on edge p1b'
    """
    turns: list[Turn] = []
    for k, (edge, at_m) in enumerate(zip(edges, begins_m, strict=True)):
        here, before = network.edges[edge], network.edges[edges[k - 1]]
        point = here.lanes[0].shape[0]
        if k == 0:
            turns.append(Turn(at_m, point, f"start on {_called(here.street, edge)}", edge))
            continue
        angle = _heading(here.lanes[0].shape[:2]) - _heading(before.lanes[0].shape[-2:])
        angle = (angle + 180.0) % 360.0 - 180.0
        if abs(angle) < _STRAIGHT_DEG and here.street == before.street:
            continue
        into = "on" if here.street and here.street == before.street else "into"
        what = "straight on" if abs(angle) < _STRAIGHT_DEG else _TURNS[angle > 0.0]
        what = "turn round" if abs(angle) > _ROUND_DEG else what
        turns.append(Turn(at_m, point, f"{what} {into} {_called(here.street, edge)}", edge))
    return turns


_TURNS = {True: "turn left", False: "turn right"}


def _called(street: str, edge: str) -> str:
    return street or f"edge {edge}"


def _heading(points: Sequence[tuple[float, float]]) -> float:
    """Return the direction from the first to the last point [degrees], against the clock from east."""
    (x, y), (u, v) = points[0], points[-1]
    return float(np.degrees(np.arctan2(v - y, u - x)))
