"""The crossings of a run: which places begin at the same crossing, and which ways over it conflict."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations

import networkx as nx

from loopgate.control.places import Leg, Movement, Place
from loopgate.vehicles.keeper import Keeper, Way

__all__ = ["crossings"]


def crossings(
    paths: Iterable[Sequence[Leg]], number: Mapping[Place, int], lease_s: float
) -> tuple[list[Keeper], dict[int, int]]:
    """Return the keepers of crossings, and for each place the number of the keeper before it.

    Ways over junctions belong to one crossing if they lead to the same place, share a movement, or conflict.

    Parameters
    ----------
    paths
        Closed paths of vehicles.
    number
        Numbers of places.
    lease_s
        How long leases of ways last [s].
    """
    moves: dict[Way, dict[Movement, None]] = {}
    foes: dict[Movement, set[Movement]] = {}
    for path in paths:
        for leg, after in zip(path, [*path[1:], path[0]], strict=True):
            way = moves.setdefault((number[leg.place], number[after.place]), {})
            way.update(dict.fromkeys(over.movement for over in leg.passes))
            for over in leg.passes:
                foes.setdefault(over.movement, set()).update(over.foes)
    graph: nx.Graph[object] = nx.Graph()
    for one, mine in moves.items():
        graph.add_edge(("place", one[1]), one)
        graph.add_edges_from((one, move) for move in mine)
        graph.add_edges_from((move, foe) for move in mine for foe in foes[move])
    keepers: list[Keeper] = []
    numbers: dict[int, int] = {}
    for part in nx.connected_components(graph):
        ways = sorted(one for one in moves if one in part)
        pairs = {
            pair
            for one, other in combinations(ways, 2)
            if any(not foes[move].isdisjoint(moves[other]) for move in moves[one])
            or any(not foes[move].isdisjoint(moves[one]) for move in moves[other])
            for pair in ((one, other), (other, one))
        }
        numbers.update({one[1]: len(keepers) for one in ways})
        keepers.append(Keeper(frozenset(pairs), lease_s))
    return keepers, numbers
