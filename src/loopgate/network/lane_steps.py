"""The steps by which a vehicle can pass the edges of a route, lane by lane, and what they cost."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from loopgate.errors import RouteError
from loopgate.network.loop import LaneSpan
from loopgate.network.records import Connection, Lane
from loopgate.network.road import RoadNetwork

Cost = tuple[int, float]
"""Lanes changed, then how hurried the changes are (lanes per metre of edge)."""

TWO_WAY_LANES = 1000
"""A lane on which others come the opposite way counts as so many changes of lanes: see `make_loop`."""

FREE: Cost = (0, 0.0)


@dataclass(frozen=True, slots=True)
class Step:
    """Passing one edge: lane on which it is entered, movement by which it is left."""

    enter: int
    onward: Connection


@dataclass(frozen=True, slots=True)
class Ways:
    """The chosen way round, and for each edge the steps of every way round with as few changes."""

    chosen: list[Step]
    all: list[list[Step]]


Layer = dict[int, list[tuple[Cost, Step]]]
"""The choices on one edge: for each lane entered, the steps and their cost."""


def check_route(network: RoadNetwork, edges: Sequence[str], *, vclass: str, what: str, closed: bool) -> None:
    """Check that a vehicle of the class can drive over these edges, if `closed` from last to first too.

    Raises `RouteError` if it cannot; the text begins with `what`.
    """
    for edge in edges:
        _check_edge(network, edge, vclass, what)
    for number, edge in enumerate(edges if closed else edges[:-1]):
        _check_pair(network, edges, number, vclass, what, edge)


def _check_edge(network: RoadNetwork, edge: str, vclass: str, what: str) -> None:
    if edge not in network.edges:
        msg = f"{what}: edge {edge} is not in the network {network.name}; correct it or draw the route again"
        raise RouteError(msg)
    if not network.edges[edge].allows(vclass):
        classes = sorted(set().union(*(lane.allowed for lane in network.edges[edge].lanes)))
        most = 5
        for_whom = ", ".join(classes[:most]) + (", ..." if len(classes) > most else "") or "nobody"
        msg = f"{what}: edge {edge} is closed to {vclass} (open to {for_whom}); lead the route round it"
        raise RouteError(msg)


def _check_pair(
    network: RoadNetwork, edges: Sequence[str], number: int, vclass: str, what: str, edge: str
) -> None:
    last = number + 1 == len(edges)
    following = edges[0] if last else edges[number + 1]
    if network.between(edge, following, vclass):
        return
    ways = list(dict.fromkeys(c.to_edge for c in network.outgoing(edge) if network.allows(c, vclass)))
    onward = f"from {edge} a {vclass} can go to {', '.join(ways)}" if ways else f"{edge} leads nowhere"
    if last:
        msg = (
            f"{what}: not a loop: its last edge {edge} does not lead to its first edge {following} "
            f"({onward}); add the edges that lead back; ordinary traffic goes into a file for --traffic"
        )
    else:
        msg = f"{what}: edge {edge} does not lead to edge {following} ({onward}); add the edges between"
    raise RouteError(msg)


def find_layers(network: RoadNetwork, edges: Sequence[str], vclass: str, *, closed: bool) -> list[Layer]:
    """Return the choices on each edge; if not `closed`, the last edge leads nowhere."""
    layers: list[Layer] = []
    for number, edge in enumerate(edges):
        lanes = network.edges[edge].lanes
        connections = _made(network, network.between(edge, edges[(number + 1) % len(edges)], vclass))
        layer: Layer = {}
        if not closed and number + 1 == len(edges):
            layers.append(
                {n: [(FREE, _arrives(lane))] for n, lane in enumerate(lanes) if vclass in lane.allowed}
            )
            break
        for enter in range(len(lanes)):
            for connection in connections:
                low, high = sorted((enter, connection.from_lane))
                if all(vclass in lanes[index].allowed for index in range(low, high + 1)):
                    shared = sum(lanes[index].two_way for index in range(low, high + 1))
                    cost = (high - low) + TWO_WAY_LANES * shared, (high - low) / max(lanes[0].length_m, 0.1)
                    layer.setdefault(enter, []).append((cost, Step(enter, connection)))
        layers.append(layer)
    return layers


def _arrives(lane: Lane) -> Step:
    """Return how the last edge of a route is passed on a lane: to nowhere."""
    return Step(lane.index, Connection(lane.edge, lane.index, "", lane.index, (), "", "", -1, None))


def movements_made(network: RoadNetwork, vclass: str) -> list[Connection]:
    """Return the movements that vehicles of a class make: see `make_loop` for shared lanes; in file order."""
    pairs = dict.fromkeys((c.from_edge, c.to_edge) for c in network.connections)
    return [c for pair in pairs for c in _made(network, network.between(*pair, vclass))]


def _made(network: RoadNetwork, connections: Sequence[Connection]) -> list[Connection]:
    """Return the movements that SUMO makes: from a lane to a shared one only if it leads to no other."""

    def shared(c: Connection) -> bool:
        return network.edges[c.to_edge].lanes[c.to_lane].two_way

    apart = {c.from_lane for c in connections if not shared(c)}
    return [c for c in connections if not (shared(c) and c.from_lane in apart)]


def find_costs(layers: Sequence[Layer], last: Iterable[int]) -> list[dict[int, Cost]]:
    """Return by edge and lane entered the least cost of reaching a lane of `last` after the last edge."""
    ahead = dict.fromkeys(last, FREE)
    costs = [ahead]
    for layer in reversed(layers):
        here: dict[int, Cost] = {}
        for enter, steps in layer.items():
            for cost, step in steps:
                rest = ahead.get(step.onward.to_lane)
                if rest is not None:
                    total = _add(cost, rest)
                    here[enter] = min(total, here.get(enter, total))
        ahead = here
        costs.append(ahead)
    return costs[::-1]


def follow(layers: Sequence[Layer], costs: Sequence[dict[int, Cost]], first: int) -> list[Step]:
    """Return the cheapest way from lane `first`; of equal ones the rightmost."""
    lane, way = first, []
    for layer, ahead in zip(layers, costs[1:], strict=True):
        open_steps = [(cost, step) for cost, step in layer[lane] if step.onward.to_lane in ahead]
        step = min(
            open_steps,
            key=lambda s: (
                _add(s[0], ahead[s[1].onward.to_lane]),
                s[1].onward.from_lane,
                s[1].onward.to_lane,
            ),
        )[1]
        way.append(step)
        lane = step.onward.to_lane
    return way


def _add(one: Cost, other: Cost) -> Cost:
    return one[0] + other[0], one[1] + other[1]


def make_spans(network: RoadNetwork, edges: Sequence[str], ways: Ways) -> list[LaneSpan]:
    """Return the lanes of the chosen way, beside each those of the others."""
    spans: list[LaneSpan] = []
    for edge, step, steps in zip(edges, ways.chosen, ways.all, strict=True):
        leave = step.onward.from_lane
        lanes = network.edges[edge].lanes
        swept = {
            index
            for s in steps
            for index in range(min(s.enter, s.onward.from_lane), max(s.enter, s.onward.from_lane) + 1)
        }
        _append(spans, lanes[leave], [lanes[index] for index in sorted(swept - {leave})], entered=step.enter)
        others = [s.onward for s in steps if s.onward != step.onward]
        for k, lane_id in enumerate(step.onward.via):
            beside = {c.via[min(k, len(c.via) - 1)]: None for c in others if c.via}
            _append(spans, network.lanes[lane_id], [network.lanes[b] for b in beside if b != lane_id])
    return spans


def _append(spans: list[LaneSpan], lane: Lane, beside: Sequence[Lane], *, entered: int | None = None) -> None:
    begin = spans[-1].end_m if spans else 0.0
    spans.append(
        LaneSpan(
            edge=lane.edge,
            lane=lane.index,
            lane_id=lane.id,
            internal=lane.internal,
            begin_m=begin,
            end_m=begin + lane.length_m,
            lane_ids=(lane.id, *(other.id for other in beside)),
            shapes=(lane.shape, *(other.shape for other in beside)),
            entered=None if entered == lane.index else entered,
        )
    )
