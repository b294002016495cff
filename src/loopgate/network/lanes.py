"""The lanes of a loop with the fewest lane changes, chosen edge by edge."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from loopgate.errors import RouteError
from loopgate.network.loop import LaneSpan, Loop
from loopgate.network.road import IGNORING, Connection, Lane, RoadNetwork

Cost = tuple[int, float]
"""Number of lane changes, then how hurried they are (lanes changed per metre of edge)."""

TWO_WAY_LANES = 1000
"""A lane shared with the opposite direction counts as this many lane changes: see `make_loop`."""

FREE: Cost = (0, 0.0)

_ANY: Mapping[str, int] = {}


@dataclass(frozen=True, slots=True)
class LaneStep:
    """One edge of a route: the lane on which a vehicle enters, and the movement by which it leaves."""

    enter: int
    onward: Connection


Layer = dict[int, list[tuple[Cost, LaneStep]]]
"""The choices on one edge: for each lane entered, the steps and their cost."""


def make_loop(
    network: RoadNetwork,
    name: str,
    edges: Sequence[str],
    *,
    vclass: str = "passenger",
    source: str = "",
    on_lanes: Mapping[str, int] = _ANY,
    leave_on: Mapping[str, int] = _ANY,
) -> Loop:
    """Make a loop from edge ids in driving order; the last edge must lead to the first.

    Lanes are chosen by dynamic programming so that a lap has as few lane changes as possible. Where the
    vehicle must change lanes, or another lane is as good, the spans name all possible lanes, since SUMO may
    take any of them. Lanes that the opposite edge shares (a track in a street) are used only if there is no
    other way.

    Raises `RouteError` if an edge is missing or closed to the vehicle class, two edges are not connected, the
    last edge does not lead to the first, or no lanes lead round.

    Parameters
    ----------
    edges
        Normal edges in driving order; an edge may occur twice.
    vclass
        SUMO vehicle class that must be allowed.
    source
        File the route comes from, for messages.
    on_lanes
        For each edge with a stop the index of the stop's lane, or -1 for any lane; used if possible.
    leave_on
        For some edges the index of the lane on which to leave the edge; used if possible.

    Examples
    --------
    >>> from loopgate import RoadNetwork
    >>> from loopgate.network import make_loop
    >>> network = RoadNetwork.open("networks/ring3.net.xml")
    >>> loop = make_loop(network, "mine", ["p1b", "p1c", "s1", "l1", "s2", "p1a"])
    >>> round(loop.length_m, 2), len(loop.spans)
    (628.44, 12)
    """
    what = f"{source}: route {name}" if source else f"route {name}"
    if not edges:
        msg = f"{what}: it has no edges; a loop needs at least one"
        raise RouteError(msg)
    check_route(network, edges, vclass=vclass, what=what, closed=True)
    layers = find_layers(network, edges, vclass, closed=True)
    found = _fewest_changes(_wanted(layers, edges, on_lanes)) if on_lanes else None
    found = found or (_fewest_changes(_left_on(layers, edges, leave_on)) if leave_on else None)
    found = found or _fewest_changes(layers)
    if found is None:
        msg = (
            f"{what}: no lanes open to {vclass} lead all the way round, though its edges are connected; "
            f"add edges where the vehicle can change lanes, or connections in netedit"
        )
        raise RouteError(msg)
    way, every = found
    movements = tuple(step.onward for step in way)
    return Loop(name, tuple(edges), make_spans(network, way, every), movements, frozenset(on_lanes))


def _wanted(layers: Sequence[Layer], edges: Sequence[str], on_lanes: Mapping[str, int]) -> list[Layer]:
    """Return the choices that pass edges on their wanted lanes, or at least enter or leave on them."""
    found: list[Layer] = []
    for edge, layer in zip(edges, layers, strict=True):
        lane = on_lanes.get(edge)
        some = [_choices(layer, lane, whole=whole) for whole in (True, False)] if lane is not None else []
        found.append(next((one for one in some if one), layer))
    return found


def _left_on(layers: Sequence[Layer], edges: Sequence[str], lanes: Mapping[str, int]) -> list[Layer]:
    """Return the choices that leave edges on these lanes, where that is possible."""
    found: list[Layer] = []
    for edge, layer in zip(edges, layers, strict=True):
        kept = {
            enter: [step for step in steps if step[1].onward.from_lane == lanes.get(edge)]
            for enter, steps in layer.items()
        }
        some = {enter: steps for enter, steps in kept.items() if steps}
        found.append(some or layer)
    return found


def _choices(layer: Layer, lane: int, *, whole: bool) -> Layer:
    chosen: Layer = {}
    for enter, steps in layer.items():
        on = [s for s in steps if (enter == lane) + (s[1].onward.from_lane == lane) > (1 if whole else 0)]
        if on:
            chosen[enter] = on
    return chosen


def _fewest_changes(layers: Sequence[Layer]) -> tuple[list[LaneStep], list[list[LaneStep]]] | None:
    """Return the best closed sequence of steps, and for each edge the steps of all that are as good.

    None if no sequence closes. O(edges * lanes^4).
    """
    rounds = {first: find_costs(layers, (first,)) for first in layers[0]}
    totals = {first: costs[0][first] for first, costs in rounds.items() if first in costs[0]}
    if not totals:
        return None
    best = min(totals, key=lambda first: (totals[first], first))
    fewest = totals[best][0]
    every: list[list[LaneStep]] = [[] for _ in layers]
    for first, total in totals.items():
        if total[0] == fewest:
            for number, steps in enumerate(_on_fewest(layers, rounds[first], first)):
                every[number] += [step for step in steps if step not in every[number]]
    return follow(layers, rounds[best], best), every


def _on_fewest(layers: Sequence[Layer], costs: Sequence[dict[int, Cost]], first: int) -> list[list[LaneStep]]:
    """Return for each edge the steps of all sequences from lane `first` with the fewest lane changes."""
    reached, found = {first}, []
    for layer, here, ahead in zip(layers, costs, costs[1:], strict=False):
        steps = [
            step
            for enter in sorted(reached)
            for cost, step in layer[enter]
            if step.onward.to_lane in ahead and cost[0] + ahead[step.onward.to_lane][0] == here[enter][0]
        ]
        found.append(steps)
        reached = {step.onward.to_lane for step in steps}
    return found


def check_route(network: RoadNetwork, edges: Sequence[str], *, vclass: str, what: str, closed: bool) -> None:
    """Check that a vehicle class can drive some edges in order, and round again if `closed`.

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
        classes = sorted(set().union(*(lane.allowed for lane in network.edges[edge].lanes)) - {IGNORING})
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
    """Return the possible steps on each edge; unless `closed`, the last edge has no next edge."""
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
            steps = (_changing(lanes, enter, connection, vclass) for connection in connections)
            if some := [step for step in steps if step is not None]:
                layer[enter] = some
        layers.append(layer)
    return layers


def _changing(
    lanes: Sequence[Lane], enter: int, onward: Connection, vclass: str
) -> tuple[Cost, LaneStep] | None:
    """Return the step over an edge from the lane entered to the lane left, with its cost; None if closed."""
    low, high = sorted((enter, onward.from_lane))
    between = lanes[low : high + 1]
    if not all(vclass in lane.allowed for lane in between) or not _may_change(
        lanes, enter, onward.from_lane, vclass
    ):
        return None
    shared = sum(lane.two_way for lane in between)
    cost = (high - low) + TWO_WAY_LANES * shared, (high - low) / max(lanes[0].length_m, 0.1)
    return cost, LaneStep(enter, onward)


def arriving_on(lanes: Sequence[Lane], index: int, vclass: str) -> Layer:
    """Return the steps over the last edge of an open route that lead to one lane, for a stop there."""
    onward = _arrives(lanes[index]).onward
    steps = ((enter, _changing(lanes, enter, onward, vclass)) for enter in range(len(lanes)))
    return {enter: [step] for enter, step in steps if step is not None}


def _may_change(lanes: Sequence[Lane], enter: int, leave: int, vclass: str) -> bool:
    """Return whether vehicles of a class may change from one lane of an edge to another, lane by lane."""
    left = leave > enter
    passed = range(enter, leave) if left else range(enter, leave, -1)
    return all(lanes[index].may_change(vclass, left=left) for index in passed)


def _arrives(lane: Lane) -> LaneStep:
    """Return the step over the last edge of an open route, on one lane."""
    return LaneStep(lane.index, Connection(lane.edge, lane.index, "", lane.index, (), "", "", -1, None))


def movements_made(network: RoadNetwork, vclass: str) -> list[Connection]:
    """Return the movements that vehicles of a class make, in file order."""
    pairs = dict.fromkeys((c.from_edge, c.to_edge) for c in network.connections)
    return [c for pair in pairs for c in _made(network, network.between(*pair, vclass))]


def _made(network: RoadNetwork, connections: Sequence[Connection]) -> list[Connection]:
    """Return the movements that SUMO makes: onto a shared lane only if its lane leads to no other lane."""

    def shared(c: Connection) -> bool:
        return network.edges[c.to_edge].lanes[c.to_lane].two_way

    apart = {c.from_lane for c in connections if not shared(c)}
    return [c for c in connections if not (shared(c) and c.from_lane in apart)]


def find_costs(layers: Sequence[Layer], last: Iterable[int]) -> list[dict[int, Cost]]:
    """Return for each edge and entry lane the least cost to a lane of `last` on the last edge."""
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


def follow(layers: Sequence[Layer], costs: Sequence[dict[int, Cost]], first: int) -> list[LaneStep]:
    """Return the cheapest sequence of steps from lane `first`; on ties the rightmost lane."""
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


def make_spans(
    network: RoadNetwork, way: Sequence[LaneStep], every: Sequence[Sequence[LaneStep]]
) -> tuple[LaneSpan, ...]:
    """Return the lanes of a sequence of steps as spans."""
    spans: list[LaneSpan] = []
    for step, steps in zip(way, every, strict=True):
        onward = step.onward
        lanes = network.edges[onward.from_edge].lanes
        swept = {
            index
            for s in steps
            for index in range(min(s.enter, s.onward.from_lane), max(s.enter, s.onward.from_lane) + 1)
        }
        beside = [lanes[index] for index in sorted(swept - {onward.from_lane})]
        _append(spans, lanes[onward.from_lane], beside, entered=step.enter)
        others = [s.onward for s in steps if s.onward != onward]
        for k, lane_id in enumerate(onward.via):
            inside = {c.via[min(k, len(c.via) - 1)]: None for c in others if c.via}
            _append(spans, network.lanes[lane_id], [network.lanes[b] for b in inside if b != lane_id])
    return tuple(spans)


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
