"""The roads of a network in tables of ordinary traffic (`loopgate.drive.around`)."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping
from itertools import pairwise
from typing import Any

from numpy.typing import NDArray

from loopgate.drive.around import EdgeRow, JunctionRow, LaneRow, LinkRow
from loopgate.drive.codes import NOBODY
from loopgate.drive.rows import table
from loopgate.network import RoadNetwork

__all__ = ["Roads"]


class Roads:
    """The tables of a network's roads, and the row numbers of edges and lanes.

    Parameters
    ----------
    network
        The roads.
    """

    def __init__(self, network: RoadNetwork) -> None:
        self.lanes: Mapping[str, int] = _numbered(network.lanes)
        """Lanes by name."""
        self.no_edge = len(network.edges)
        """The number of all that are no roads, as connectors."""
        self._edges = _numbered(network.edges)
        through_m = {
            (c.from_edge, c.to_edge): sum(network.lanes[lane].length_m for lane in c.via)
            for c in network.connections
        }
        self.junctions: Mapping[tuple[str, str], int] = _numbered(through_m)
        """Junctions by the edges before and behind them."""
        edges: dict[str, list[float]] = {
            "length_m": [*(max(lane.length_m for lane in e.lanes) for e in network.edges.values()), math.inf],
            "limit_mps": [*(max(lane.speed_mps for lane in e.lanes) for e in network.edges.values()), 0.0],
        }
        lanes = network.lanes.values()
        links, places = self._links(network)
        columns: dict[str, Any] = {
            **places,
            "length_m": [lane.length_m for lane in lanes],
            "speed_mps": [lane.speed_mps for lane in lanes],
            "edge": [self.edge(lane.edge) for lane in lanes],
            "inside": [lane.internal for lane in lanes],
        }
        nobody = dict.fromkeys(("place", "first", "last", "over"), NOBODY)
        self.tables: Mapping[str, NDArray[Any]] = {
            "edges": table(EdgeRow, edges),
            "lanes": table(LaneRow, columns | nobody, length=len(lanes)),
            "links": links,
            "junctions": table(
                JunctionRow,
                {"through_m": list(through_m.values()), "first": NOBODY, "last": NOBODY},
                length=len(through_m),
            ),
        }

    def edge(self, name: str) -> int:
        """Return the row number of an edge."""
        return self._edges.get(name, self.no_edge)

    def route(self, edges: Iterable[str]) -> list[tuple[int, int]]:
        """Return the row numbers of a route's edges, each with the junction behind it, or `NOBODY`."""
        names = [*edges, ""]
        return [(self.edge(e), self.junctions.get((e, ahead), int(NOBODY))) for e, ahead in pairwise(names)]

    def _links(self, network: RoadNetwork) -> tuple[NDArray[Any], dict[str, list[int]]]:
        """Return the links, and the slice of links of each lane."""
        ahead: dict[str, dict[int, int]] = defaultdict(dict)
        behind: dict[str, dict[int, int]] = defaultdict(dict)
        for c in network.connections:
            begin, end = f"{c.from_edge}_{c.from_lane}", f"{c.to_edge}_{c.to_lane}"
            way = (begin, *c.via)
            for lane in way:
                ahead[lane][self.edge(c.to_edge)] = self.lanes[end]
            for before, lane in pairwise(way):
                behind[lane][int(NOBODY)] = self.lanes[before]
            behind[end][self.edge(c.from_edge)] = self.lanes[way[-1]]
        rows: list[tuple[int, int]] = []
        columns: dict[str, list[int]] = defaultdict(list)
        for lane in network.lanes:
            for name, links in (("ahead", ahead[lane]), ("behind", behind[lane])):
                columns[f"{name}_at"].append(len(rows))
                rows += links.items()
                columns[f"{name}_end"].append(len(rows))
        made = table(LinkRow, length=len(rows))
        made[:] = rows
        return made, columns


def _numbered(names: Iterable[Any]) -> dict[Any, int]:
    return {name: number for number, name in enumerate(names)}
