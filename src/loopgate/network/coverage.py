"""Coverage: the share of a network that closed loops reach."""

from collections.abc import Iterable
from dataclasses import dataclass

from loopgate.network.loop import Loop
from loopgate.network.road import RoadNetwork


@dataclass(frozen=True, slots=True)
class Coverage:
    """Edges and lanes on loops, among the edges and lanes open to a vehicle class."""

    edges: int
    lane_km: float
    """`edges` and `lane_km`: how many edges, and the length of their lanes [km], that are open to the
    class."""
    visited_edges: int
    visited_lane_km: float
    """`visited_edges` and `visited_lane_km`: the edges, and their lane length, that lie on loops."""

    @property
    def of_edges(self) -> float:
        """The share of edges on loops, 0 to 1; 0 if the network has none."""
        return self.visited_edges / self.edges if self.edges else 0.0

    @property
    def of_lane_km(self) -> float:
        """The share of lane length on loops, 0 to 1; 0 if the network has none."""
        return self.visited_lane_km / self.lane_km if self.lane_km > 0.0 else 0.0


def measure_coverage(network: RoadNetwork, loops: Iterable[Loop], *, vclass: str = "passenger") -> Coverage:
    """Measure how much of a network lies on loops; O(lanes + spans).

    An edge counts if one of its lanes is open to the class and a loop names the edge. Lanes count if a
    vehicle on the loop may be on them. Roads inside junctions are left out. If the class cannot drive the
    loops, as cars on loops of a tram, roads count that are open to all classes that can drive all loops.
    """
    spans = [span for loop in loops for span in loop.roads]
    driven = [network.lanes[span.lane_id].allowed for span in spans]
    can = frozenset.intersection(*driven) if driven else frozenset()
    classes = can if can and vclass not in can else {vclass}
    lanes = {
        lane.id: lane.length_m
        for edge in network.edges.values()
        for lane in edge.lanes
        if classes <= lane.allowed
    }
    edges = {network.lanes[lane].edge for lane in lanes}
    visited = {lane for span in spans for lane in span.lane_ids} & lanes.keys()
    return Coverage(
        edges=len(edges),
        lane_km=sum(lanes.values()) / 1000.0,
        visited_edges=len({span.edge for span in spans} & edges),
        visited_lane_km=sum(length for lane, length in lanes.items() if lane in visited) / 1000.0,
    )
