"""The order of a higher-order deadlock, exactly by Definition 11 of Zhou et al. 2020."""

from collections.abc import Iterable, Iterator

from loopgate.errors import LoopgateError
from loopgate.gates.algorithm2 import Circuit, Walk, default_lookahead, steps_ahead
from loopgate.model import Configuration, System

_Standing = tuple[tuple[int, int], ...]
"""Pairs of a robot and its position, ascending."""


class OrderLimitError(LoopgateError):
    """An order takes more steps to find than were allowed."""


def order(system: System, configuration: Configuration, circuit: Circuit) -> int | None:
    """Return the order of one circuit of `configuration`; see `Orders.of_circuit`."""
    return Orders(system).of_circuit(configuration, circuit)


class Orders:
    """Finds the orders of deadlocks (Def. 11), and keeps them.

    A deadlock cycle has order 0. A circuit has order ``k`` iff (1) the one-step move of each of its movable
    robots causes a deadlock of lower order with the circuit's robots, and (2) one of these has order
    ``k - 1``. Only the robots of the circuit count, as in the paper's example (Fig. 4): others, among them
    those that a move leaves out, are taken to drive away. Where several circuits are left, the lowest order
    counts (Remark 1).

    Parameters
    ----------
    system
        The system; its states are taken to hold one robot each.
    limit
        The most circuits to look at over the life of the object; their number can be exponential.
    """

    def __init__(self, system: System, *, limit: int = 1_000_000) -> None:
        self._system = system
        self._limit = limit
        self._most = default_lookahead(system)
        self._circuit_orders: dict[_Standing, int | None] = {}
        self._looked = 0

    def of_circuit(self, configuration: Configuration, circuit: Circuit) -> int | None:
        """Return the order of `circuit`, or None if its robots are no deadlock of any order.

        Raises `OrderLimitError` if more than `limit` circuits would have to be looked at.
        """
        return self._visit(self._standing(configuration, circuit.robots), circuit)

    def of_configuration(self, configuration: Configuration) -> int | None:
        """Return the lowest order of the configuration's circuits, or None if none has an order.

        Raises `OrderLimitError` if more than `limit` circuits would have to be looked at.
        """
        return self._lowest(self._standing(configuration, range(len(self._system.robots))))

    def _standing(self, configuration: Configuration, robots: Iterable[int]) -> _Standing:
        positions = configuration.positions
        paths, private = self._system.paths, self._system.private
        return tuple((i, positions[i]) for i in sorted(robots) if not private[paths[i][positions[i]]])

    def _lowest(self, standing: _Standing) -> int | None:
        found: int | None = None
        for circuit in self._circuits(standing):
            inside = set(circuit.robots)
            here = self._visit(tuple(pair for pair in standing if pair[0] in inside), circuit)
            if here is not None and (found is None or here < found):
                found = here
            if found == 0:
                break
        return found

    def _visit(self, standing: _Standing, circuit: Circuit) -> int | None:
        if circuit.is_deadlock_cycle:
            return 0
        # The key leaves the walks out: the robots of a circuit and their places decide what can follow.
        if standing in self._circuit_orders:
            return self._circuit_orders[standing]
        self._looked += 1
        if self._looked > self._limit:
            msg = f"orders of circuits: more than {self._limit} circuits to look at; raise the limit"
            raise OrderLimitError(msg)
        # Where a run comes back to this place, it goes on for ever: no deadlock follows.
        self._circuit_orders[standing] = None
        highest: int | None = None
        for after in self._steps(standing):
            deeper = self._lowest(after)
            if deeper is None:
                return None
            highest = max(deeper, highest or 0)
        self._circuit_orders[standing] = None if highest is None else highest + 1
        return self._circuit_orders[standing]

    def _steps(self, standing: _Standing) -> Iterator[_Standing]:
        """Yield the positions of the robots after each possible step of a robot."""
        paths = self._system.paths
        occupied = {paths[robot][position] for robot, position in standing}
        for index, (robot, position) in enumerate(standing):
            following = self._system.robots[robot].next_position(position)
            if following is None or paths[robot][following] in occupied:
                continue
            moved = () if self._system.private[paths[robot][following]] else ((robot, following),)
            yield (*standing[:index], *moved, *standing[index + 1 :])

    def _circuits(self, standing: _Standing) -> Iterator[Circuit]:
        """Yield the circuits of these robots alone, each beginning with its lowest robot."""
        paths = self._system.paths
        holder = {paths[robot][position]: robot for robot, position in standing}
        walks = {robot: self._walks(robot, position, holder) for robot, position in standing}

        def extend(chain: tuple[Walk, ...], robot: int) -> Iterator[Circuit]:
            for walk in walks[robot]:
                after = holder[walk.head]
                if chain and after == chain[0].robot:
                    yield Circuit((*chain, walk))
                elif after > (chain[0].robot if chain else robot) and all(w.robot != after for w in chain):
                    yield from extend((*chain, walk), after)

        for robot, _ in standing:
            yield from extend((), robot)

    def _walks(self, robot: int, position: int, holder: dict[int, int]) -> list[Walk]:
        path = self._system.paths[robot]
        states = [path[position]]
        heads: set[int] = set()
        walks: list[Walk] = []
        for ahead in steps_ahead(self._system, robot, position, self._most):
            state = path[ahead]
            if self._system.private[state]:
                break
            states.append(state)
            if state not in heads and holder.get(state, robot) != robot:
                heads.add(state)
                walks.append(Walk(robot, tuple(states)))
        return walks
