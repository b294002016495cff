"""How short one loop over all streets can be: the cheapest circulation in whole numbers that hangs together.

    python analysis/one_loop.py NETWORK

solves the programme, cuts off parts that do not hang together, and solves it again until it is one piece.
What is printed bounds `loopgate loops NETWORK --cover all --count 1` from below, on the streets as they are:
rings on which nobody can wait are taken like any others.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.optimize import Bounds, LinearConstraint, OptimizeResult, milp
from scipy.sparse import csr_array, vstack
from scipy.sparse.csgraph import breadth_first_order, connected_components, maximum_flow

from loopgate.network import RoadNetwork
from loopgate.network.cover.design import CoverTask, make_design
from loopgate.network.cover.lane_graph import LaneGraph, lane_graph

Mask = npt.NDArray[np.bool_]

_UNITS = 10_000
"""Flows are counted in such parts of one."""


class Programme:
    """Each choice of nodes is visited, what comes into a node leaves it, and no cut keeps parts apart."""

    def __init__(self, graph: LaneGraph, wanted: set[str]) -> None:
        self.graph = graph
        count, every = len(graph.edges), np.arange(len(graph.tail))
        streets = sorted(wanted)
        row = {edge: k for k, edge in enumerate(streets)}
        into = [
            (row[graph.edges[head]], arc) for arc, head in enumerate(graph.head) if graph.edges[head] in row
        ]
        ones = np.ones(len(every))
        leaves = csr_array((ones, (graph.tail, every)), shape=(count, len(every)))
        comes = csr_array((ones, (graph.head, every)), shape=(count, len(every)))
        visits = csr_array((np.ones(len(into)), np.array(into).T), shape=(len(row), len(every)))
        self._rows = vstack([comes - leaves, visits])
        nodes = [[k for k, edge in enumerate(graph.edges) if edge == one] for one in streets]
        self._sure = np.zeros(count, dtype=bool)
        self._sure[[some[0] for some in nodes if len(some) == 1]] = True
        self._cuts: list[npt.NDArray[np.float64]] = []

    def solved(self, *, whole: bool) -> OptimizeResult:
        """Solve it, with the cuts so far."""
        count, arcs = len(self.graph.edges), len(self.graph.tail)
        rows = vstack([self._rows, csr_array(np.array(self._cuts))]) if self._cuts else self._rows
        low = np.ones(rows.shape[0])
        low[:count] = 0.0
        high = np.where(np.arange(len(low)) < count, 0.0, np.inf)
        return milp(
            self.graph.length_m,
            constraints=LinearConstraint(rows, low, high),
            integrality=np.full(arcs, int(whole)),
            bounds=Bounds(0.0, np.inf),
            options={"mip_rel_gap": 0.0, "time_limit": 600.0},
        )

    def cut(self, times: npt.NDArray[np.float64]) -> bool:
        """Add what keeps parts of a solution apart that less than one whole way leads out of; whether any."""
        parts = self._apart(times)
        self._cuts += [(part[self.graph.tail] & ~part[self.graph.head]).astype(float) for part in parts]
        return bool(parts)

    def _apart(self, times: npt.NDArray[np.float64]) -> list[Mask]:
        graph, count = self.graph, len(self.graph.edges)
        used = times >= 1.0 - 1e-6
        links = csr_array((np.ones(used.sum()), (graph.tail[used], graph.head[used])), shape=(count, count))
        number, label = connected_components(links, directed=False)
        wanted = np.unique(label[self._sure])
        tail, head = label[graph.tail], label[graph.head]
        between = tail != head
        flow = np.rint(times[between] * _UNITS).astype(np.int32)
        capacity = csr_array((flow, (tail[between], head[between])), shape=(number, number)).tocsr()
        capacity.sum_duplicates()
        root, found, done = int(np.bincount(label).argmax()), [], set[int]()
        for part in wanted.tolist():
            if part == root or part in done:
                continue
            most = maximum_flow(capacity, part, root)
            if most.flow_value < _UNITS - 20:
                rest = capacity - most.flow
                rest.data[rest.data < 0] = 0
                rest.eliminate_zeros()
                inside = np.zeros(number, dtype=bool)
                inside[breadth_first_order(rest, part, return_predecessors=False)] = True
                found.append(inside[label])
                done |= set(np.flatnonzero(inside).tolist())
        return found


def main() -> None:
    """Solve it for a network and print each step."""
    words = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    words.add_argument("network", type=Path)
    words.add_argument("--rounds", type=int, default=20, help="of cuts at most; the bound holds at each")
    given = words.parse_args()
    network = RoadNetwork.open(str(given.network))
    design = make_design(network, CoverTask())
    graph = lane_graph(
        network, vclass=design.task.vclass, u_turns=design.task.u_turns, change_m=design.task.change_m
    )
    programme = Programme(graph.within(graph.components()[0]), set(design.required))
    solution = programme.solved(whole=False)
    least = solution.fun
    print(f"circulation {least:.0f} m, found {design.ways.length(design.tour.tolist()):.0f} m", flush=True)
    for whole in (False, True):
        solution = programme.solved(whole=whole)
        for _ in range(given.rounds):
            if solution.x is None or not programme.cut(np.asarray(solution.x)):
                break
            solution = programme.solved(whole=whole)
        bound = solution.mip_dual_bound if whole else solution.fun
        print(
            f"{'in whole numbers' if whole else 'in parts'}: at least {bound / least - 1.0:.3%} over it",
            flush=True,
        )


if __name__ == "__main__":
    main()
