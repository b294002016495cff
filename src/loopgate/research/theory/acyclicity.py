"""Liveness by a SAT solver: who goes first in each conflict, so that nobody waits in a circle.

An exact answer of another kind than the oracle's, for systems too large for that; and the yardstick that the
certified gate is measured against. Needs python-sat, which is no dependency of loopgate itself
(``pip install sumo-loopgate[sat]``).
"""

from __future__ import annotations

from itertools import combinations
from typing import TypeAlias

import networkx as nx

from loopgate.errors import LoopgateError
from loopgate.model import Configuration, System


class AcyclicityError(LoopgateError):
    """The system is of a kind that the encoding does not cover, or the solver is not installed."""


_Move: TypeAlias = tuple[int, int]
"""A robot and the number of its move, counted from the configuration on."""

_Order: TypeAlias = tuple[_Move, _Move]


class _Encoding:
    """One variable per pair of visits that exclude each other: the first passes before the second."""

    def __init__(self, system: System, configuration: Configuration) -> None:
        visits: dict[int, list[tuple[int, int, int]]] = {}
        self.static: nx.DiGraph[_Move] = nx.DiGraph()
        self.free: list[tuple[_Order, _Order]] = []
        for i, path in enumerate(system.paths):
            p = configuration.positions[i]
            events = [(i, 0)]
            step = 0
            while not system.private[path[p]]:
                visits.setdefault(path[p], []).append((i, step, step + 1))
                following = system.robots[i].next_position(p)
                if following is None:
                    msg = f"robot {system.robots[i].id}: it ends in the shared state {system.states[path[p]]}"
                    raise AcyclicityError(msg)
                p = following
                step += 1
                if step > len(path):
                    msg = f"robot {system.robots[i].id}: it has no private state"
                    raise AcyclicityError(msg)
                events.append((i, step))
            nx.add_path(self.static, events)
        for here in visits.values():
            for (i, enter, leave), (j, enter2, leave2) in combinations(here, 2):
                if i == j:
                    continue
                forth, back = ((i, leave), (j, enter2)), ((j, leave2), (i, enter))
                if enter == 0:
                    self.static.add_edge(*forth)
                elif enter2 == 0:
                    self.static.add_edge(*back)
                else:
                    self.free.append((forth, back))


def live_by_order(system: System, configuration: Configuration) -> bool:
    """Return whether `configuration` is live, by choosing for each pair of visits which one goes first.

    The configuration is live iff some choice leaves the order of all moves without a circle; a clause per
    circle found forbids it, until there is none or no choice is left (lazy cycle clauses).

    Source: single-unit resource allocation as acyclicity of orders; NP-complete (Lawley and Reveliotis 2001).
    Raises `AcyclicityError` if the system is not of that kind or python-sat is missing.

    Parameters
    ----------
    system
        Every robot has a private state, shared states hold one, no terminal is shared.
    """
    try:
        from pysat.solvers import Solver  # noqa: PLC0415 - python-sat is an extra
    except ImportError as error:
        msg = "liveness by SAT needs python-sat: pip install sumo-loopgate[sat]"
        raise AcyclicityError(msg) from error
    if any(room > 1 and not private for room, private in zip(system.room, system.private, strict=True)):
        msg = "liveness by SAT covers states that hold one robot"
        raise AcyclicityError(msg)
    encoding = _Encoding(system, configuration)
    with Solver(name="minisat22") as sat:
        while sat.solve():
            clauses = _circles_of(encoding, sat.get_model() or [])
            if not clauses:
                return True
            for clause in clauses:
                sat.add_clause(clause)
    return False


def _circles_of(encoding: _Encoding, model: list[int]) -> list[list[int]]:
    """Return a clause for each circle found in the order of moves that `model` chooses."""
    graph = encoding.static.copy()
    because: dict[_Order, int] = {}
    for v, (forth, back) in enumerate(encoding.free, start=1):
        chosen = v > len(model) or model[v - 1] > 0
        edge = forth if chosen else back
        if not graph.has_edge(*edge):
            because[edge] = -v if chosen else v
            graph.add_edge(*edge)
    # One circle for each strongly connected component that has any.
    parts = map(graph.subgraph, nx.strongly_connected_components(graph))
    circles = (nx.find_cycle(part) for part in parts if len(part) > 1)
    return [[because[edge] for edge in circle if edge in because] for circle in circles]
