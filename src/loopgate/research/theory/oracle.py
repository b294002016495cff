"""The exact oracle: is a configuration live? By exhaustive search; the judge of every gate."""

from __future__ import annotations

import networkx as nx

from loopgate.errors import LoopgateError
from loopgate.model import Configuration, System


class OracleLimitError(LoopgateError):
    """The system has more configurations than the oracle was allowed to look at."""


class Oracle:
    """Decides liveness exactly by looking at every reachable configuration.

    A configuration is *live* iff every robot can go on for ever: some endless sequence of moves moves
    every robot on a closed path again and again and brings every robot on an open path to its terminal
    state. In a finite system that is so iff a strongly connected set of configurations can be reached
    inside which every robot moves, but for those that stay for good. Where every robot has a private state
    and no terminal state is shared, it is the same as: some sequence of moves brings all robots to private
    or terminal states at once.

    `system`: the system; its moves are those of `System.enabled`. Time and memory are linear in the number of
    configurations and moves reachable from all that was asked. Deciding liveness is NP-complete (Lawley and
    Reveliotis 2001).
    """

    def __init__(self, system: System, *, limit: int = 2_000_000) -> None:
        self._system = system
        self._limit = limit
        self._live: dict[Configuration, bool] = {}

    def live(self, configuration: Configuration) -> bool:
        """Return whether every robot can go on for ever from `configuration`.

        Raises `OracleLimitError` if more than `limit` configurations would have to be looked at.
        """
        if configuration not in self._live:
            self._explore(configuration)
        return self._live[configuration]

    def safe(self, configuration: Configuration, robot: int) -> bool:
        """Return whether the enabled move of `robot` leads to a live configuration."""
        return self.live(self._system.moved(configuration, robot))

    def _explore(self, root: Configuration) -> None:
        graph, mover = self._reachable(root)
        system = self._system
        components = nx.condensation(graph)
        good: set[int] = set()
        for component in reversed(list(nx.topological_sort(components))):
            members: set[Configuration] = components.nodes[component]["members"]
            some = next(iter(members))
            need = {i for i in range(len(system.robots)) if not system.finished(some, i)}
            inside = {mover[u, v] for u in members for v in graph.successors(u) if v in members}
            if need <= inside or any(after in good for after in components.successors(component)):
                good.add(component)
            for member in members:
                self._live[member] = component in good

    def _reachable(
        self, root: Configuration
    ) -> tuple[nx.DiGraph[Configuration], dict[tuple[Configuration, Configuration], int]]:
        system = self._system
        graph: nx.DiGraph[Configuration] = nx.DiGraph()
        mover: dict[tuple[Configuration, Configuration], int] = {}
        graph.add_node(root)
        open_list = [root]
        while open_list:
            here = open_list.pop()
            for robot in range(len(system.robots)):
                if not system.enabled(here, robot):
                    continue
                there = system.moved(here, robot)
                if there not in graph:
                    if graph.number_of_nodes() >= self._limit:
                        msg = f"more than {self._limit} configurations; give the oracle a smaller system"
                        raise OracleLimitError(msg)
                    open_list.append(there)
                graph.add_edge(here, there)
                mover[here, there] = robot
        return graph, mover
