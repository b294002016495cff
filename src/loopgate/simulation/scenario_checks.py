"""Checks that the settings of a scenario go together."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

from loopgate.errors import ScenarioError
from loopgate.gates import check_gate
from loopgate.negotiation.registry import check_negotiation
from loopgate.simulation.sumo_words import own_words

if TYPE_CHECKING:
    from loopgate.simulation.scenario import Scenario

LONGEST_GATED_STEP_S = 1.0
"""Longest step under a gate [s]: SUMO's drivers keep a headway of one second only if steps are no longer."""


def check(scenario: Scenario) -> None:
    """Raise `ScenarioError` if settings of a scenario contradict each other; the text names them."""
    _check_names(scenario.gate, scenario.rule_for_negotiation)
    _check_incidents(scenario)
    _check_decide(scenario)
    if scenario.traffic and scenario.gated and scenario.abstraction != "queues":
        msg = (
            f"traffic: with gate {scenario.gate} it works on abstraction queues only; on "
            f"{scenario.abstraction} the gate does not know where ordinary vehicles are in the way"
        )
        raise ScenarioError(msg)
    if sum(map(bool, (scenario.vehicles, scenario.vehicles_per_km, scenario.on_loops))) > 1:
        msg = "vehicles, vehicles_per_km, on_loops: each sets the number of vehicles; give one"
        raise ScenarioError(msg)
    if scenario.weights and not scenario.revisit_s:
        msg = "weights: they divide revisit_s, the longest time between visits; give revisit_s too"
        raise ScenarioError(msg)
    if scenario.spacing == "hold" and not scenario.gated:
        msg = "spacing: hold works under a gate only, where vehicles can be held; take advice, or a gate"
        raise ScenarioError(msg)
    if scenario.gated and scenario.step_s > LONGEST_GATED_STEP_S:
        msg = (
            f"step_s is {scenario.step_s}; expected at most {LONGEST_GATED_STEP_S:g} under a gate, or "
            "vehicles drive into each other; gate open takes longer ones"
        )
        raise ScenarioError(msg)
    own = dict(own_words(scenario.sumo))
    if (scenario.positions or scenario.fcd) and (
        (scenario.positions and scenario.fcd) or "fcd-output" in own
    ):
        msg = "fcd: SUMO writes positions to one file only; give positions (positions.csv.gz) or fcd"
        raise ScenarioError(msg)
    if scenario.on_deadlock == "teleport" and scenario.gated:
        msg = "on_deadlock: teleport works with gate open only; no gated vehicle jumps past its gate"
        raise ScenarioError(msg)


def _check_incidents(scenario: Scenario) -> None:
    if scenario.incidents and scenario.gated and scenario.abstraction != "queues":
        msg = "incidents: they work on abstraction queues only, where vehicles are led round them"
        raise ScenarioError(msg)


def _check_decide(scenario: Scenario) -> None:
    if scenario.by_messages is None:
        return
    kind = scenario.gate.partition(":")[0], scenario.abstraction
    of_paper = kind == ("algorithm2", "segments") and not scenario.by_messages.processes
    wrong = {
        f"gate {scenario.gate} on {scenario.abstraction}": kind != ("certified", "queues") and not of_paper,
        "traffic": bool(scenario.traffic),
        "incidents": bool(scenario.incidents),
    }
    for what, there in wrong.items():
        if there:
            msg = (
                "decide: vehicles works with gate certified on queues, or algorithm2 on segments (not as "
                f"processes), without ordinary traffic and incidents; found {what}; take central"
            )
            raise ScenarioError(msg)


@lru_cache(maxsize=256)
def _check_names(gate: str, negotiation: str) -> None:
    """Check gate and negotiation as far as possible without roads; cached for sweeps."""
    check_gate(gate)
    check_negotiation(negotiation)
