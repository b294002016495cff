"""Chooses lanes that share the traffic, for routes that vehicles drive once and for loops."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, NamedTuple

from loopgate.errors import RouteError
from loopgate.network.lanes import (
    TWO_WAY_LANES,
    Cost,
    LaneStep,
    Layer,
    arriving_on,
    check_route,
    find_costs,
    find_layers,
    follow,
    make_spans,
)
from loopgate.network.loop import LaneSpan, Loop
from loopgate.network.road import RoadNetwork

LEAST_CHANGE_M = 10.0
"""The shortest edge on which a car can change lanes [m]: its length, its gap and some spare length."""


class Shortest(NamedTuple):
    """The shortest edges [m] on which a vehicle can change lanes, and on which others can also wait."""

    change_m: float = LEAST_CHANGE_M
    """`change_m`: on which a vehicle can change lanes."""
    apart_m: float = 42.2
    """`apart_m`: on which vehicles can also wait before the change and after it; by default cars."""


_OF_CARS: Final = Shortest()

_CHANGE = 0.4
"""Costs that choose lanes. For a lane change, with the square of the lanes by which it goes: it shuts all;"""

_HURRY = 20.0
"""for each lane change per metre of the edge;"""

_JOINED = 5.0
"""for each lane change on an edge without space to wait before it and after it: the change then belongs to a
crossing, and keeps it shut for long. That is worse than all that other vehicles on a lane cost;"""

_WISH = 0.35
"""for arriving on another lane than the file wants, without changing lanes for it;"""

_BESIDE = 100.0
"""for entering or leaving an edge with a stop on another lane than the stop's;"""

_ELSEWHERE = 2.0
"""for a lane from which as many vehicles go elsewhere as use the fullest lane: all wait behind the first;"""

_CROWD = 1.0
"""for a lane as full as the fullest, with the fourth power of the load on the lane entered or the lane left,
whichever is fuller: to come from an empty lane into a full one spares no time. With a quarter of it, lanes
of right turns stay empty where lights are obeyed; with three times as much, vehicles change lanes so often
that they lose more by it than in full lanes;"""

_BUSY = 0.3
"""for a lane as full as the fullest, in proportion to the same load: in networks where one lane is far
fuller than all others, these share their traffic too;"""

_CUT = 0.03
"""for a change of lanes, times the vehicles on the edge for each that changes there: a change cuts the
edge for all, and those that change share what all lose. Without this, few vehicles cut many edges: RESCO's
`ingolstadt7` with lights obeyed loses 230 s in place of 106 s. With 0.01 to 0.03 it loses the same."""

_ROOMY = 1.5
"""An edge is short for a change up to so many times the shortest edge with places before it and after it. The
cost `_CUT` grows with the square of what is missing: places of two slots pass vehicles slowly. Without this,
377 of 598 vehicles get round a ring of six arms with edges of 45 m, in place of 547."""

_ANY: Mapping[str, int] = {}


def change_on(edge: str) -> str:
    """Return the name under which a `Load` has the vehicles that change lanes on an edge."""
    return f"change on {edge}"


class Load:
    """How many vehicles leave each lane, by its id, leave it for an edge, and change lanes on each edge.

    The names of the last two are ``lane>edge`` and `change_on`.

    `most`: the greatest of these numbers, known at any time: each trip of a hundred thousand asks for it.
    """

    def __init__(self, of: Mapping[str, int] = _ANY) -> None:
        self.of = dict(of)
        self._having = Counter(self.of.values())
        self.most = max(self.of.values(), default=0)

    def add(self, names: Iterable[str], vehicles: int = 1) -> None:
        """Add vehicles to each of these."""
        of, having = self.of, self._having
        for name in names:
            number = of.get(name, 0)
            of[name] = number + vehicles
            having[number] -= 1
            having[number + vehicles] += 1
            self.most = max(self.most, number + vehicles)

    def take(self, names: Iterable[str], vehicles: int = 1) -> None:
        """Take vehicles away from each of these, which have as many."""
        of, having = self.of, self._having
        for name in names:
            number = of[name]
            of[name] = number - vehicles
            having[number] -= 1
            having[number - vehicles] += 1
            while self.most and not having[self.most]:
                self.most -= 1


_NOBODY: Final = Load()


@dataclass(frozen=True, slots=True)
class LaneWishes:
    """The lanes on which a vehicle wants to depart and arrive, by index.

    Attributes
    ----------
    depart, arrive
        First and last lane; None for any. A vehicle changes no lanes for the last.
    stop
        On edges with stops, the lane of the stop; -1 for any.
    """

    depart: int | None = None
    arrive: int | None = None
    stop: Mapping[str, int] = field(default_factory=dict)


_NO_WISHES = LaneWishes()


def make_route(
    network: RoadNetwork,
    name: str,
    edges: Sequence[str],
    *,
    vclass: str = "passenger",
    source: str = "",
    load: Load = _NOBODY,
    shortest: Shortest = _OF_CARS,
    wishes: LaneWishes = _NO_WISHES,
) -> Loop:
    """Make an open route over edges, which vehicles drive once.

    Few lane changes, on long edges, are weighed against lanes that many other vehicles use, above all
    vehicles that go elsewhere from them. Two-way lanes, and changes on edges too short for them, are the last
    choice.

    Raises `RouteError` if an edge is missing or closed to the class, two edges are not connected, or no lanes
    lead to the end.

    Parameters
    ----------
    network, name, edges, vclass, source
        As for `make_loop`; the last edge need not lead anywhere.
    load
        How many vehicles already use each lane, and go from it to which edge.
    shortest
        The shortest edges on which a vehicle can change lanes.
    wishes
        The lanes that the vehicle wants.
    """
    choices = RouteChoices(network)
    return choices.make(
        name, edges, vclass=vclass, source=source, load=load, shortest=shortest, wishes=wishes
    )


class RouteChoices:
    """A cache of the possible lanes on routes, for many vehicles.

    Parameters
    ----------
    network
        The network of the routes.
    """

    def __init__(self, network: RoadNetwork) -> None:
        self._network = network
        self._layers: dict[tuple[tuple[str, ...], str, bool], list[Layer]] = {}
        self._spans: dict[tuple[LaneStep, ...], tuple[LaneSpan, ...]] = {}
        self._unasked: dict[tuple[tuple[str, ...], str, Shortest, bool], Loop] = {}
        """Routes as asked for, for vehicles without wishes on empty lanes."""

    def make(
        self,
        name: str,
        edges: Sequence[str],
        *,
        vclass: str = "passenger",
        source: str = "",
        load: Load = _NOBODY,
        shortest: Shortest = _OF_CARS,
        wishes: LaneWishes = _NO_WISHES,
        closed: bool = False,
    ) -> Loop:
        """Make a route with chosen lanes: see `make_route`. `closed`: whether its end leads to its begin."""
        asked = tuple(edges), vclass, shortest, closed
        unasked = not load.of and wishes == _NO_WISHES
        if unasked and asked in self._unasked:
            return replace(self._unasked[asked], id=name)
        found = self._choose(name, edges, vclass, source, load, shortest, wishes, closed=closed)
        if unasked:
            self._unasked[asked] = found
        return found

    def _choose(
        self,
        name: str,
        edges: Sequence[str],
        vclass: str,
        source: str,
        load: Load,
        shortest: Shortest,
        wishes: LaneWishes,
        *,
        closed: bool,
    ) -> Loop:
        network, what = self._network, f"{source}: route {name}" if source else f"route {name}"
        key = tuple(edges), vclass, closed
        if key not in self._layers:
            check_route(network, edges, vclass=vclass, what=what, closed=closed)
            self._layers[key] = find_layers(network, edges, vclass, closed=closed)
        layers = [dict(layer) for layer in self._layers[key]]
        if layers and not closed and wishes.stop.get(edges[-1], -1) >= 0:  # it changes lanes for its stop
            lanes = network.edges[edges[-1]].lanes
            layers[-1] = arriving_on(lanes, wishes.stop[edges[-1]], vclass) or layers[-1]
        most = max(1, load.most)
        for edge, layer in zip(edges, layers, strict=True):
            length_m = network.edges[edge].length_m
            short, taken = length_m < shortest.change_m, shortest.apart_m / length_m
            lane = wishes.stop.get(edge, -1)
            for enter, steps in layer.items():
                weighed: list[tuple[Cost, LaneStep]] = []
                for cost, step in steps:
                    own = _once(network, cost, step, load.of, most, taken, short=short)
                    if lane >= 0:
                        own = own[0], own[1] + _BESIDE * ((enter != lane) + (step.onward.from_lane != lane))
                    if layer is layers[-1] and wishes.arrive not in (None, enter):
                        own = own[0], own[1] + _WISH
                    weighed.append((own, step))
                layer[enter] = weighed
        first, costs = _best_round(layers) if closed else _best_way(layers, wishes)
        if first is None:
            msg = f"{what}: no lanes open to {vclass} lead all the way, though its edges are connected"
            raise RouteError(msg)
        way = tuple(follow(layers, costs, first))
        if way not in self._spans:
            self._spans[way] = make_spans(network, way, [[step] for step in way])
        movements = tuple(step.onward for step in way)
        return Loop(
            name, tuple(edges), self._spans[way], movements if closed else movements[:-1], closed=closed
        )


_Found = tuple[int | None, list[dict[int, Cost]]]
"""The first lane, None if no lanes lead all the way; and for each edge the costs from each lane entered."""


def _best_way(layers: Sequence[Layer], wishes: LaneWishes) -> _Found:
    costs = find_costs(layers, layers[-1] if layers else ())
    ahead = costs[0]
    return min(
        ahead, key=lambda lane: (wishes.depart not in (None, lane), ahead[lane], lane), default=None
    ), costs


def _best_round(layers: Sequence[Layer]) -> _Found:
    """Return the best first lane to which the way leads back."""
    rounds = {lane: find_costs(layers, (lane,)) for lane in layers[0]}
    back = {lane: costs[0][lane] for lane, costs in rounds.items() if lane in costs[0]}
    first = min(back, key=lambda lane: (back[lane], lane), default=None)
    return first, [] if first is None else rounds[first]


def _once(
    network: RoadNetwork,
    cost: Cost,
    step: LaneStep,
    load: Mapping[str, int],
    most: int,
    taken: float,
    *,
    short: bool,
) -> Cost:
    """Return the cost of passing an edge for a vehicle that drives once, the part to avoid most first.

    `taken`: the shortest edge with places before and after a change, as a share of this edge. `short`:
    whether it is too short to change lanes.
    """
    onward, lanes = step.onward, network.edges[step.onward.from_edge].lanes
    two_way, changes = divmod(cost[0], TWO_WAY_LANES)
    lane = lanes[onward.from_lane].id
    entered, left = load.get(lanes[step.enter].id, 0), load.get(lane, 0)
    elsewhere = left - load.get(f"{lane}>{onward.to_edge}", 0) if onward.to_edge else 0
    worth = changes * (_CHANGE * changes + _JOINED * (taken > 1.0)) + _HURRY * cost[1]
    worth += _ELSEWHERE * elsewhere / most
    if changes:
        users = sum(load.get(one.id, 0) for one in lanes)
        worth += _CUT * max(1.0, _ROOMY * taken) ** 2 * users / (1 + load.get(change_on(onward.from_edge), 0))
    worst = two_way + TWO_WAY_LANES * changes * short
    full = max(entered, left) / most
    return TWO_WAY_LANES * worst, worth + _BUSY * full + _CROWD * full**4
