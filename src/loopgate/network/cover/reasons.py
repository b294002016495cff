"""Why streets lie on no closed walk, for one vehicle class."""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum

import networkx as nx

from loopgate.network.road import RoadNetwork


class CoverReason(StrEnum):
    """Why a street cannot be covered."""

    CLOSED = "closed to the class"
    U_TURN = "only turning round leads on"
    ENTRY = "leads into the network, and nothing leads to it (entry of the map)"
    EXIT = "leads out of the network, and nothing leads back (exit of the map)"
    TURN_BAN = "only a turn leads on or back that is banned"
    LANES = "only a change of lanes leads on, on an edge too short for it"
    APART = "another part of the network, from which no way leads to the rest and back"
    TOO_LONG = "its shortest closed walk is longer than asked for"
    QUEUES = "vehicles cannot queue on the way"


def why_not_covered(
    network: RoadNetwork, covered: Iterable[str], wanted: Iterable[str], *, vclass: str, u_turns: bool
) -> dict[str, CoverReason]:
    """Return for each wanted edge that is not covered the reason; O(edges + connections).

    Parameters
    ----------
    network, vclass, u_turns
        As the loops were designed.
    covered
        Edges that can be covered; they can be reached from each other.
    wanted
        Edges to look at.
    """
    core = set(covered)
    left = [edge for edge in wanted if edge not in core]
    if not left or not core:
        return {edge: CoverReason.CLOSED for edge in left if not network.edges[edge].allows(vclass)} | {
            edge: CoverReason.U_TURN if not u_turns else CoverReason.EXIT
            for edge in left
            if network.edges[edge].allows(vclass)
        }
    allowed = [c for c in network.connections if network.allows(c, vclass)]
    straight = _graph((c.from_edge, c.to_edge) for c in allowed if u_turns or c.direction != "t")
    turning = _graph((c.from_edge, c.to_edge) for c in allowed)
    into: dict[str, list[str]] = {}
    for edge in network.edges.values():
        if edge.allows(vclass):
            into.setdefault(edge.from_junction, []).append(edge.id)
    anyhow = _graph(
        (edge.id, other)
        for edge in network.edges.values()
        if edge.allows(vclass)
        for other in into.get(edge.to_junction, ())
        if network.edges[other].to_junction != edge.from_junction
    )
    hub = min(core)
    # The first that holds is the reason.
    tests = {
        CoverReason.LANES: _with(straight, hub),
        CoverReason.U_TURN: _with(turning, hub),
        CoverReason.TURN_BAN: _with(anyhow, hub),
        CoverReason.EXIT: nx.descendants(straight, hub),
        CoverReason.ENTRY: nx.ancestors(straight, hub),
    }
    return {
        name: next((reason for reason, edges in tests.items() if name in edges), CoverReason.APART)
        if network.edges[name].allows(vclass)
        else CoverReason.CLOSED
        for name in left
    }


def _graph(pairs: Iterable[tuple[str, str]]) -> nx.DiGraph[str]:
    graph: nx.DiGraph[str] = nx.DiGraph()
    graph.add_edges_from(pairs)
    return graph


def _with(graph: nx.DiGraph[str], node: str) -> set[str]:
    """Return the nodes that can be reached from a node and lead back to it."""
    if node not in graph:
        return set()
    return {*nx.descendants(graph, node), node} & {*nx.ancestors(graph, node), node}
