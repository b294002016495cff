"""The lanes that a vehicle takes on its route: round a closed one, or once from its beginning to its end."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from loopgate.errors import RouteError
from loopgate.network.loop import LaneSpan, Loop
from loopgate.network.records import Connection, Lane
from loopgate.network.road import RoadNetwork

LEAST_CHANGE_M = 10.0
"""The shortest edge on which a car can change lanes [m]: its length and gap, and some to spare."""


@dataclass(frozen=True, slots=True)
class _Step:
    """Passing one edge: lane on which it is entered, movement by which it is left."""

    enter: int
    onward: Connection


_Cost = tuple[int, float]
"""Lanes changed, then how hurried the changes are (lanes per metre of edge)."""

_TWO_WAY_LANES = 1000
"""A lane on which others come the opposite way counts as so many changes of lanes: see `make_loop`."""

_FREE: _Cost = (0, 0.0)

_CHANGE = 0.4
"""Costs that choose the lanes of vehicles that drive once: each lane changed;"""

_HURRY = 20.0
"""each lane changed per metre of the edge;"""

_WISH = 0.35
"""arriving on another lane than the file wants, for which nobody changes lanes;"""

_BESIDE = 100.0
"""coming onto an edge, or leaving it, on another lane than the one to stop on there;"""

_ELSEWHERE = 2.0
"""as many as use the fullest lane who go elsewhere from this one: behind one that waits all wait;"""

_CROWD = 0.25
"""a lane as full as the fullest; it goes with the fourth power."""

_ANY: Mapping[str, int] = {}


@dataclass(frozen=True, slots=True)
class LaneWishes:
    """Lanes on which a vehicle that drives once is to be, by index.

    Attributes
    ----------
    depart, arrive
        At the beginning and at the end; None for any. Nobody changes lanes for the second.
    stop
        On edges where it stops; -1 for any.
    """

    depart: int | None = None
    arrive: int | None = None
    stop: Mapping[str, int] = field(default_factory=dict)


_NO_WISHES = LaneWishes()


def make_loop(
    network: RoadNetwork,
    name: str,
    edges: Sequence[str],
    *,
    vclass: str = "passenger",
    source: str = "",
    on_lanes: Mapping[str, int] = _ANY,
) -> Loop:
    """Make the loop over these edges; the last must lead to the first.

    Lanes are chosen so that the vehicle changes lanes as little as possible over the round: the lanes that
    make the turns, by dynamic programming round the loop. Where it has to change, or could as well take
    another lane, the spans name all lanes of all ways round with as few changes: SUMO may take any of them.

    Lanes that the opposite edge shares (a track in a street) are taken only where there is no other way:
    SUMO drives beside them if it can, whatever it is told.

    Raises `RouteError` if an edge is missing or closed to the class, two edges are not connected, the last
    does not lead to the first, or no lanes lead round.

    Parameters
    ----------
    edges
        Normal edges in driving order; an edge may come twice.
    vclass
        SUMO vehicle class that must be allowed.
    source
        File the route comes from, for messages.
    on_lanes
        Edges on which the vehicle stops, and the lane for it, or -1 for several or any: kept to if there is
        a way.

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
    for edge in edges:
        _check_edge(network, edge, vclass, what)
    for number, edge in enumerate(edges):
        _check_pair(network, edges, number, vclass, what, edge)
    layers = _layers(network, edges, vclass)
    ways = _fewest_changes(_wanted(layers, edges, on_lanes)) if on_lanes else None
    ways = ways or _fewest_changes(layers)
    if ways is None:
        msg = (
            f"{what}: no lanes open to {vclass} lead all the way round, though its edges are connected; "
            f"add edges where the vehicle can change lanes, or connections in netedit"
        )
        raise RouteError(msg)
    return Loop(name, tuple(edges), tuple(_spans(network, edges, ways)), frozenset(on_lanes))


def make_route(
    network: RoadNetwork,
    name: str,
    edges: Sequence[str],
    *,
    vclass: str = "passenger",
    source: str = "",
    load: Mapping[str, int] = _ANY,
    change_m: float = LEAST_CHANGE_M,
    wishes: LaneWishes = _NO_WISHES,
) -> Loop:
    """Make the way over these edges that is driven once: a loop that is not closed.

    Few changes of lanes, on long edges, are weighed against a lane that many others use, above all those who
    go elsewhere from it. Two-way lanes, and changes on edges too short for them, come last of all.

    Raises `RouteError` if an edge is missing or closed to the class, two edges are not connected, or no lanes
    lead there.

    Parameters
    ----------
    network, name, edges, vclass, source
        As for `make_loop`; the last edge need not lead anywhere.
    load
        How many vehicles use each lane already, by its id, and from it to an edge, by ``lane>edge``.
    change_m
        The shortest edge on which a vehicle can change lanes [m].
    wishes
        Lanes on which it is to be.
    """
    what = f"{source}: route {name}" if source else f"route {name}"
    for edge in edges:
        _check_edge(network, edge, vclass, what)
    for number, edge in enumerate(edges[:-1]):
        _check_pair(network, edges, number, vclass, what, edge)
    layers = _layers(network, edges, vclass, closed=False)
    ahead: dict[int, _Cost] = {}
    costs: list[dict[int, _Cost]] = []
    most = max(1, max(load.values(), default=1))
    for edge, layer in zip(reversed(edges), reversed(layers), strict=True):
        here: dict[int, _Cost] = {}
        short = network.edges[edge].length_m < change_m
        for enter, steps in layer.items():
            for number, (cost, step) in enumerate(steps):
                own = _once(network, cost, step, load, most, short=short)
                if (lane := wishes.stop.get(edge, -1)) >= 0:
                    beside = (enter != lane) + (step.onward.from_lane != lane)
                    own = _add(own, (0, _BESIDE * beside))
                steps[number] = own, step
                rest = _FREE if not costs else ahead.get(step.onward.to_lane)
                if not costs and wishes.arrive not in (None, enter):
                    rest = (0, _WISH)
                if rest is not None:
                    total = _add(own, rest)
                    here[enter] = min(total, here.get(enter, total))
        costs.append(here)
        ahead = here
    if not ahead:
        msg = f"{what}: no lanes open to {vclass} lead all the way, though its edges are connected"
        raise RouteError(msg)
    costs.insert(0, dict.fromkeys(range(len(network.edges[edges[-1]].lanes)), _FREE))
    first = min(ahead, key=lambda lane: (wishes.depart not in (None, lane), ahead[lane], lane))
    chosen = _follow(layers, costs[::-1], first)
    ways = _Ways(chosen, [[step] for step in chosen])
    return Loop(name, tuple(edges), tuple(_spans(network, edges, ways)), closed=False)


def _once(
    network: RoadNetwork, cost: _Cost, step: _Step, load: Mapping[str, int], most: int, *, short: bool
) -> _Cost:
    """Return what passing an edge costs who drives once, first of all what is done only where it must be."""
    onward, lanes = step.onward, network.edges[step.onward.from_edge].lanes
    two_way, changes = divmod(cost[0], _TWO_WAY_LANES)
    lane = lanes[onward.from_lane].id
    entered, left = load.get(lanes[step.enter].id, 0), load.get(lane, 0)
    elsewhere = left - load.get(f"{lane}>{onward.to_edge}", 0) if onward.to_edge else 0
    worth = _CHANGE * changes + _HURRY * cost[1] + _ELSEWHERE * elsewhere / most
    worst = two_way + _TWO_WAY_LANES * changes * short
    return _TWO_WAY_LANES * worst, worth + _CROWD * ((entered + left) / (2 * most)) ** 4


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


@dataclass(frozen=True, slots=True)
class _Ways:
    """The chosen way round, and for each edge the steps of every way round with as few changes."""

    chosen: list[_Step]
    all: list[list[_Step]]


_Layer = dict[int, list[tuple[_Cost, _Step]]]
"""The choices on one edge: for each lane entered, the steps and their cost."""


def _layers(network: RoadNetwork, edges: Sequence[str], vclass: str, *, closed: bool = True) -> list[_Layer]:
    layers: list[_Layer] = []
    for number, edge in enumerate(edges):
        lanes = network.edges[edge].lanes
        connections = _made(network, network.between(edge, edges[(number + 1) % len(edges)], vclass))
        layer: _Layer = {}
        if not closed and number + 1 == len(edges):
            layers.append(
                {n: [(_FREE, _arrives(lane))] for n, lane in enumerate(lanes) if vclass in lane.allowed}
            )
            break
        for enter in range(len(lanes)):
            for connection in connections:
                low, high = sorted((enter, connection.from_lane))
                if all(vclass in lanes[index].allowed for index in range(low, high + 1)):
                    shared = sum(lanes[index].two_way for index in range(low, high + 1))
                    cost = (high - low) + _TWO_WAY_LANES * shared, (high - low) / max(lanes[0].length_m, 0.1)
                    layer.setdefault(enter, []).append((cost, _Step(enter, connection)))
        layers.append(layer)
    return layers


def _arrives(lane: Lane) -> _Step:
    """Return how the last edge of a route is passed on a lane: to nowhere."""
    return _Step(lane.index, Connection(lane.edge, lane.index, "", lane.index, (), "", "", -1, None))


def _wanted(layers: Sequence[_Layer], edges: Sequence[str], on_lanes: Mapping[str, int]) -> list[_Layer]:
    """Return the choices by which edges are passed on their wanted lanes, or else entered or left on them."""
    found: list[_Layer] = []
    for edge, layer in zip(edges, layers, strict=True):
        lane = on_lanes.get(edge)
        some = [_choices(layer, lane, whole=whole) for whole in (True, False)] if lane is not None else []
        found.append(next((one for one in some if one), layer))
    return found


def _choices(layer: _Layer, lane: int, *, whole: bool) -> _Layer:
    chosen: _Layer = {}
    for enter, steps in layer.items():
        on = [s for s in steps if (enter == lane) + (s[1].onward.from_lane == lane) > (1 if whole else 0)]
        if on:
            chosen[enter] = on
    return chosen


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


def _fewest_changes(layers: Sequence[_Layer]) -> _Ways | None:
    """Return the ways round that change the fewest lanes, or None if none closes; O(edges * lanes^4)."""
    rounds = {first: _costs(layers, first) for first in layers[0]}
    totals = {first: costs[0][first] for first, costs in rounds.items() if first in costs[0]}
    if not totals:
        return None
    best = min(totals, key=lambda first: (totals[first], first))
    fewest = totals[best][0]
    every: list[list[_Step]] = [[] for _ in layers]
    for first, total in totals.items():
        if total[0] == fewest:
            for number, steps in enumerate(_on_fewest(layers, rounds[first], first)):
                every[number] += [step for step in steps if step not in every[number]]
    return _Ways(_follow(layers, rounds[best], best), every)


def _costs(layers: Sequence[_Layer], last: int) -> list[dict[int, _Cost]]:
    """Return by edge and lane entered the least cost of reaching lane `last` after the last edge."""
    ahead: dict[int, _Cost] = {last: _FREE}
    costs = [ahead]
    for layer in reversed(layers):
        here: dict[int, _Cost] = {}
        for enter, steps in layer.items():
            for cost, step in steps:
                rest = ahead.get(step.onward.to_lane)
                if rest is not None:
                    total = _add(cost, rest)
                    here[enter] = min(total, here.get(enter, total))
        ahead = here
        costs.append(ahead)
    return costs[::-1]


def _follow(layers: Sequence[_Layer], costs: Sequence[dict[int, _Cost]], first: int) -> list[_Step]:
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


def _on_fewest(layers: Sequence[_Layer], costs: Sequence[dict[int, _Cost]], first: int) -> list[list[_Step]]:
    """Return for each edge the steps of all ways from lane `first` that change the fewest lanes."""
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


def _add(one: _Cost, other: _Cost) -> _Cost:
    return one[0] + other[0], one[1] + other[1]


def _spans(network: RoadNetwork, edges: Sequence[str], ways: _Ways) -> list[LaneSpan]:
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
