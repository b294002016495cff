"""The lanes that a vehicle takes round a loop: those with the fewest changes."""

from collections.abc import Mapping, Sequence

from loopgate.errors import RouteError
from loopgate.network.lane_steps import (
    Cost,
    Layer,
    Step,
    Ways,
    check_route,
    find_costs,
    find_layers,
    follow,
    make_spans,
)
from loopgate.network.loop import Loop
from loopgate.network.road import RoadNetwork

_ANY: Mapping[str, int] = {}


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
    check_route(network, edges, vclass=vclass, what=what, closed=True)
    layers = find_layers(network, edges, vclass, closed=True)
    ways = _fewest_changes(_wanted(layers, edges, on_lanes)) if on_lanes else None
    ways = ways or _fewest_changes(layers)
    if ways is None:
        msg = (
            f"{what}: no lanes open to {vclass} lead all the way round, though its edges are connected; "
            f"add edges where the vehicle can change lanes, or connections in netedit"
        )
        raise RouteError(msg)
    return Loop(name, tuple(edges), tuple(make_spans(network, edges, ways)), frozenset(on_lanes))


def _wanted(layers: Sequence[Layer], edges: Sequence[str], on_lanes: Mapping[str, int]) -> list[Layer]:
    """Return the choices by which edges are passed on their wanted lanes, or else entered or left on them."""
    found: list[Layer] = []
    for edge, layer in zip(edges, layers, strict=True):
        lane = on_lanes.get(edge)
        some = [_choices(layer, lane, whole=whole) for whole in (True, False)] if lane is not None else []
        found.append(next((one for one in some if one), layer))
    return found


def _choices(layer: Layer, lane: int, *, whole: bool) -> Layer:
    chosen: Layer = {}
    for enter, steps in layer.items():
        on = [s for s in steps if (enter == lane) + (s[1].onward.from_lane == lane) > (1 if whole else 0)]
        if on:
            chosen[enter] = on
    return chosen


def _fewest_changes(layers: Sequence[Layer]) -> Ways | None:
    """Return the ways round that change the fewest lanes, or None if none closes; O(edges * lanes^4)."""
    rounds = {first: find_costs(layers, (first,)) for first in layers[0]}
    totals = {first: costs[0][first] for first, costs in rounds.items() if first in costs[0]}
    if not totals:
        return None
    best = min(totals, key=lambda first: (totals[first], first))
    fewest = totals[best][0]
    every: list[list[Step]] = [[] for _ in layers]
    for first, total in totals.items():
        if total[0] == fewest:
            for number, steps in enumerate(_on_fewest(layers, rounds[first], first)):
                every[number] += [step for step in steps if step not in every[number]]
    return Ways(follow(layers, rounds[best], best), every)


def _on_fewest(layers: Sequence[Layer], costs: Sequence[dict[int, Cost]], first: int) -> list[list[Step]]:
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
