"""Chooses the strongest promise for a start, and its liveness proof."""

import math
from collections.abc import Iterator

from loopgate.errors import GateError, UnsafeStartError
from loopgate.gates.base import Reason
from loopgate.gates.certified.chain_rule import ChainRule
from loopgate.gates.certified.crowding import refuse_crowds
from loopgate.gates.certified.deadlock import stuck_for_good
from loopgate.gates.certified.exploration import Exploration
from loopgate.gates.certified.free_slots import FreeSlots
from loopgate.gates.certified.homes import Homes
from loopgate.gates.certified.liveness_proof import LivenessProof
from loopgate.gates.certified.occupancy import Occupancy
from loopgate.gates.certified.search import Budget, BudgetError
from loopgate.gates.certified.system_index import SystemIndex
from loopgate.model import System

_SMALL = 200_000
"""Up to this many combinations of positions, the exact exploration is used where robots have no homes."""


def choose_proof(system: System, promise: str, budget: Budget) -> LivenessProof:
    """Return the proof of a promise, with a witness of the start; see `CertifiedGate` for the order.

    Raises `UnsafeStartError` if the promise cannot be given for the start; the text names the robots. Raises
    `GateError` if a witness does not pass the gate's own check: a fault of ours.

    Parameters
    ----------
    promise
        ``everyone``, ``somebody`` or ``auto``.
    budget
        Of each exact search; where `Exploration` is chosen it is raised to what that needs.
    """
    layout = SystemIndex(system)
    if layout.hopeless:
        msg = (
            f"gate certified: robots that come to rest for good in shared states block "
            f"{layout.names(layout.hopeless)} for ever; end their paths elsewhere"
        )
        raise UnsafeStartError(msg)
    nodes = budget.nodes
    failed: GateError = UnsafeStartError("gate certified: no proof")
    for proof in _proofs(layout, promise, budget):
        budget.nodes = max(nodes, _SMALL) if isinstance(proof, Exploration) else nodes
        stand = Occupancy.of(proof.layout, system.initial)
        try:
            if proof.begin(system.initial, stand):
                return proof
        except BudgetError:
            other = "" if isinstance(proof, Homes | ChainRule) else ", or ask for promise=somebody"
            msg = f"gate certified: the start could not be shown live within the budget; raise budget{other}"
            failed = UnsafeStartError(msg)
            continue
        failed = _refusal(proof, stand)
        if not isinstance(proof, FreeSlots):
            break
    raise failed from None


def _proofs(layout: SystemIndex, promise: str, budget: Budget) -> Iterator[LivenessProof]:
    """Yield the proofs that may keep the promise, the strongest first."""
    system = layout.system
    flow = ChainRule(system, budget)
    if promise != "somebody":
        if flow.by_chain_alone:
            refuse_crowds(layout, Occupancy.of(layout, system.initial))
            flow.for_everyone = True
            yield flow
            return
        if not layout.homeless:
            yield Homes(layout, budget)
            return
        roomy = FreeSlots.applies(layout)
        small = math.prod(len(path) for path in layout.path) <= _SMALL
        if (small and not (promise == "auto" and roomy and layout.all_wide)) or (
            promise == "everyone" and not roomy
        ):
            yield Exploration(layout, budget)
        if roomy:
            yield FreeSlots(layout, budget)
        if promise == "everyone":
            return
    restless = flow.layout.homeless
    if restless:
        msg = (
            f"gate certified: robots {layout.names(restless)} share every state on their paths and none "
            "of these holds two; give each a state of its own or one that holds two"
        )
        raise UnsafeStartError(msg)
    yield flow


def _refusal(proof: LivenessProof, stand: Occupancy) -> GateError:
    """Return why a start is refused for which `proof` has no witness."""
    if proof.missing is Reason.FAULT:
        return GateError(
            "gate certified: what shows the start to be live did not pass the gate's own check; "
            "this is a fault of loopgate: please report it with the system"
        )
    layout = stand.layout
    everyone = list(range(len(layout.path)))
    stuck = stuck_for_good(stand, everyone)
    if not stuck and isinstance(proof, FreeSlots):
        return UnsafeStartError(
            "gate certified: the start could not be shown to be live for everyone: no moves lead to a slot "
            "free in every place; start fewer robots, or ask for promise=somebody"
        )
    if not stuck and isinstance(proof, ChainRule):
        away = [i for i, p in enumerate(stand.at) if not layout.home[i][p]]
        return UnsafeStartError(
            f"gate certified: the start could not be shown to be live: robots {layout.names(away)} "
            "start in places that hold one, and not all of them find a slot in the next that holds two; "
            "start them there, or fewer of them"
        )
    names = layout.names(stuck or everyone)
    return UnsafeStartError(
        f"gate certified: the start is not live: robots {names} cannot all go on; start them elsewhere"
    )
