"""The order of a higher-order deadlock, exactly by Definition 11 of Zhou et al. 2020."""

from __future__ import annotations

from loopgate.errors import LoopgateError
from loopgate.theory.circuits import Circuit, sub_circuit

__all__ = ["OrderLimitError", "order"]


class OrderLimitError(LoopgateError):
    """A circuit has more sub-circuits than the computation of its order was allowed to look at."""


def order(circuit: Circuit, *, limit: int = 200_000) -> int | None:
    """Return the order of `circuit`, or None if it is a deadlock of no order.

    A deadlock cycle has order 0. A circuit has order ``k`` iff (1) the one-step move of each of its movable
    robots leaves a sub-circuit of lower order, and (2) one of them leaves order ``k - 1``. Only the robots of
    the circuit count, as in the paper's example (Fig. 4): others, among them those that a move excludes, are
    taken to drive away. A circuit none of whose robots can move, without being a deadlock cycle, contains a
    smaller deadlock and has no order itself (Remark 1).

    Raises
    ------
    OrderLimitError
        If more than `limit` sub-circuits would have to be looked at; their number can be exponential in
        ``|SE(W)|``.
    """
    memory: dict[Circuit, int | None] = {}

    def visit(circuit: Circuit) -> int | None:
        if circuit.is_deadlock_cycle:
            return 0
        if circuit in memory:
            return memory[circuit]
        if len(memory) >= limit:
            msg = f"a circuit of {len(circuit.walks)} robots has over {limit} sub-circuits; raise the limit"
            raise OrderLimitError(msg)
        found = [visit(left) if left is not None else None for left in _lefts(circuit)]
        orders = [k for k in found if k is not None]
        memory[circuit] = 1 + max(orders) if orders and len(orders) == len(found) else None
        return memory[circuit]

    return visit(circuit)


def _lefts(circuit: Circuit) -> list[Circuit | None]:
    """Return what each move of a movable robot of the circuit leaves of it."""
    tails = {walk.tail for walk in circuit.walks}
    return [
        sub_circuit(circuit, index) for index, walk in enumerate(circuit.walks) if walk.states[1] not in tails
    ]
