"""Certificates: what shows that a decision is right, as plain data that others can check.

The checker is `loopgate.research.theory.certificates`; the kinds of certificates are named there.
"""

from collections.abc import Iterable
from typing import Any, TypeAlias

from loopgate.gates.base import Decision, Reason
from loopgate.gates.certified.budget import BudgetError
from loopgate.gates.certified.chain_rule import ChainRule
from loopgate.gates.certified.deadlock import stuck_for_good
from loopgate.gates.certified.exploration import Exploration
from loopgate.gates.certified.free_slots import FreeSlots
from loopgate.gates.certified.homes import Homes
from loopgate.gates.certified.occupancy import Occupancy
from loopgate.gates.certified.proof import Prover
from loopgate.gates.certified.system_index import SystemIndex
from loopgate.model import Configuration, System

Keeper: TypeAlias = Homes | Exploration | FreeSlots | ChainRule
"""The rule that holds the witness of a gate's promise."""

_PROOF_LINES = 100_000


def certify(
    system: System,
    keeper: Keeper,
    configuration: Configuration,
    stand: Occupancy,
    *,
    robot: int,
    decision: Decision,
) -> dict[str, Any] | None:
    """Return the certificate of a decision about an enabled move; None where there is nothing to show.

    Nothing can be shown of a refusal for want of budget, for a fault, or for the sake of another robot; nor
    of one for which only a search speaks that found no slot free everywhere.
    """
    if decision.reason in {Reason.BUDGET, Reason.FAULT, Reason.NEGOTIATION}:
        return None
    if isinstance(keeper, Homes):
        body = _by_homes(system, keeper, stand, robot, decision)
    elif isinstance(keeper, Exploration):
        body = _by_exploration(system, keeper, configuration, stand, robot=robot, admitted=decision.admitted)
    elif isinstance(keeper, FreeSlots):
        body = _roomy(system, keeper, stand, robot, decision)
    else:
        body = _flow(system, keeper, stand, robot, decision)
    if body is None:
        return None
    names = [r.id for r in system.robots]
    return {
        "positions": list(configuration.positions),
        "queues": [[names[i] for i in queue] for queue in configuration.queues],
        "robot": names[robot],
        "verdict": "admitted" if decision.admitted else "refused",
        **body,
    }


def _names(system: System, robots: Iterable[int]) -> list[str]:
    return [system.robots[i].id for i in robots]


def _by_homes(
    system: System, keeper: Homes, stand: Occupancy, robot: int, decision: Decision
) -> dict[str, Any] | None:
    if decision.admitted:
        return {"kind": "home", "moves": _names(system, [robot, *(keeper.witness_after(stand, robot) or [])])}
    return _dead(keeper.layout, stand, robot, "dead")


def _dead(layout: SystemIndex, stand: Occupancy, robot: int, kind: str) -> dict[str, Any] | None:
    there = stand.copy()
    there.step(robot)
    waiting = _waiting(layout, there)
    if waiting:
        return waiting
    try:
        lines = Prover(layout, _PROOF_LINES).prove(there)
    except BudgetError:
        return None
    return None if lines is None else {"kind": kind, "proof": lines}


def _waiting(layout: SystemIndex, there: Occupancy) -> dict[str, Any] | None:
    stuck = stuck_for_good(there, range(len(there.at)))
    return {"kind": "wait", "robots": _names(layout.system, stuck)} if stuck else None


def _by_exploration(
    system: System,
    keeper: Exploration,
    configuration: Configuration,
    stand: Occupancy,
    *,
    robot: int,
    admitted: bool,
) -> dict[str, Any]:
    if admitted:
        approach, circle = keeper.way_from(system.moved(configuration, robot))
        moves = _names(system, [robot, *approach])
        return {"kind": "round", "approach": moves, "circle": _names(system, circle)}
    there = stand.copy()
    there.step(robot)
    return _waiting(stand.layout, there) or {"kind": "exhausted"}


def _roomy(
    system: System, keeper: FreeSlots, stand: Occupancy, robot: int, decision: Decision
) -> dict[str, Any] | None:
    if decision.admitted:
        moves = [robot, *(keeper.witness_after(robot) or [])]
        return {"kind": "room", "moves": _names(system, moves)}
    there = stand.copy()
    there.step(robot)
    return _waiting(stand.layout, there)


def _flow(
    system: System, keeper: ChainRule, stand: Occupancy, robot: int, decision: Decision
) -> dict[str, Any] | None:
    if decision.admitted and keeper.for_everyone:
        return {"kind": "chain"}
    if decision.admitted:
        return {"kind": "rest", "moves": _names(system, keeper.witness_with(stand, robot))}
    if decision.stage != "chain":
        return _dead(keeper.layout, stand, robot, "no rest")
    target = keeper.target(stand, robot)
    if decision.reason is Reason.OCCUPIED:
        return {"kind": "reserved", "place": system.states[target]}
    return {"kind": "full", "places": [system.states[s] for s in keeper.closes(stand, robot, target)]}
