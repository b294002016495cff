"""The edge-coloured digraph of a system, and Prop. 1 (Zhou et al. 2020, Def. 5 and 6)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import networkx as nx

from loopgate.model import RobotId, StateId, System


@dataclass(frozen=True, slots=True)
class DoubleEdge:
    """Two states that are connected by edges of several colours, against Prop. 1."""

    states: tuple[StateId, StateId]
    robots: tuple[RobotId, ...]


def digraph(system: System) -> nx.MultiDiGraph[StateId]:
    """Return the edge-coloured digraph ``G_T``: a vertex per state, an edge per move, coloured by its robot.

    Vertices have the attributes ``private``, ``capacity`` and ``visitors`` (how many robots); edges have
    ``robot`` (its name) and ``colour`` (its number).
    """
    graph: nx.MultiDiGraph[StateId] = nx.MultiDiGraph()
    for state, name in enumerate(system.states):
        graph.add_node(
            name,
            private=system.private[state],
            capacity=system.room[state],
            visitors=len(system.visitors[state]),
        )
    for number, robot in enumerate(system.robots):
        for position, here in enumerate(robot.path):
            following = robot.next_position(position)
            if following is not None:
                graph.add_edge(here, robot.path[following], robot=str(robot.id), colour=number)
    return graph


def proposition1(system: System) -> list[DoubleEdge]:
    """Return the pairs of states connected by edges of two or more colours, in either direction.

    Empty iff Prop. 1 holds. Such states should have been one state: the segments behind them touch.
    """
    colours: dict[tuple[int, int], set[int]] = {}
    for number, robot in enumerate(system.robots):
        path = system.paths[number]
        for position, here in enumerate(path):
            following = robot.next_position(position)
            if following is not None:
                there = path[following]
                colours.setdefault((min(here, there), max(here, there)), set()).add(number)
    return [
        DoubleEdge(
            (system.states[low], system.states[high]), tuple(system.robots[i].id for i in sorted(robots))
        )
        for (low, high), robots in sorted(colours.items())
        if len(robots) > 1
    ]


def write_graphml(system: System, file: Path | str) -> None:
    """Write the edge-coloured digraph as GraphML."""
    nx.write_graphml(digraph(system), file)
