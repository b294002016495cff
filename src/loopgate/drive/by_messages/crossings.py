"""The crossings of a run: which places begin at the same one, and which ways over it are in conflict."""

from __future__ import annotations

from itertools import combinations
from typing import Any, cast

import networkx as nx

from loopgate.drive.tables import Tables
from loopgate.vehicles.keeper import Keeper, Way

__all__ = ["crossings"]


def crossings(tables: Tables, lease_s: float) -> tuple[list[Keeper], dict[int, int]]:
    """Return the keepers of crossings, and by place the number of the one before it.

    Ways are of one crossing that lead to the same place, share a lane of a junction, or are in conflict.
    """
    moves = _moves(tables)
    foes = _foes(tables)
    graph: nx.Graph[object] = nx.Graph()
    for way, mine in moves.items():
        graph.add_edge(("place", way[1]), way)
        graph.add_edges_from((way, move) for move in mine)
        graph.add_edges_from((move, foe) for move in mine for foe in foes[move])
    keepers: list[Keeper] = []
    numbers: dict[int, int] = {}
    for part in nx.connected_components(graph):
        ways = sorted(one for one in part if one in moves)
        pairs = {
            pair
            for one, other in combinations(ways, 2)
            if any(not foes[move].isdisjoint(moves[other]) for move in moves[one])
            or any(not foes[move].isdisjoint(moves[one]) for move in moves[other])
            for pair in ((one, other), (other, one))
        }
        numbers.update({way[1]: len(keepers) for way in ways})
        keepers.append(Keeper(frozenset(pairs), lease_s))
    return keepers, numbers


def _moves(tables: Tables) -> dict[Way, frozenset[int]]:
    """Return the movements of each way that some vehicle takes."""
    v, legs, passes = (cast("Any", table) for table in (tables.vehicles, tables.legs, tables.passes))
    found: dict[Way, set[int]] = {}
    for at, many in sorted(set(zip(v["leg_at"].tolist(), v["legs"].tolist(), strict=True))):
        places = legs["state"][at : at + many].tolist()
        for k, here in enumerate(places):
            way = here, places[(k + 1) % many]
            between = slice(int(legs["pass_at"][at + k]), int(legs["pass_end"][at + k]))
            found.setdefault(way, set()).update(passes["movement"][between].tolist())
    return {way: frozenset(moves) for way, moves in found.items()}


def _foes(tables: Tables) -> dict[int, set[int]]:
    """Return the movements in conflict with each."""
    passes, foes = cast("Any", tables.passes), cast("Any", tables.foes)
    found: dict[int, set[int]] = {}
    columns = (passes[name].tolist() for name in ("movement", "foe_at", "foe_end"))
    for movement, begin, end in zip(*columns, strict=True):
        found.setdefault(movement, set()).update(foes["movement"][begin:end].tolist())
    return found
