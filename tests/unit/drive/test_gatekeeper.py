"""What is decided in compiled code, and what the gate and the negotiation are asked themselves."""

from random import Random
from typing import Any

import pytest

from builders import system
from loopgate.drive.gatekeeper import Gatekeeper
from loopgate.gates import make_gate
from loopgate.negotiation.registry import make_negotiation

RING = {f"r{k}": "a b c d" for k in range(3)}
WIDE = {"capacity": dict.fromkeys("abcd", 2), "fifo": tuple("abcd"), "starts": {"r0": 0, "r1": 1, "r2": 2}}


@pytest.mark.parametrize(
    ("change", "compiled"),
    [
        ({}, True),
        ({"negotiation": "pressure:patience=30"}, True),
        ({"negotiation": "oldest"}, False),
        ({"gate": "algorithm2"}, False),
        ({"gate": "certified:promise=everyone"}, True),
        ({"capacity": {"a": 2, "b": 2, "c": 2}}, False),
        ({"fifo": ("a", "b", "c")}, False),
    ],
    ids=str,
)
def test_only_the_chain_rule_and_pressure_are_compiled(
    change: dict[str, Any],
    compiled: bool,  # noqa: FBT001  a case
) -> None:
    """Where every place is a FIFO state that holds two."""
    spec: dict[str, Any] = {"gate": "certified:promise=somebody", "negotiation": "pressure", **WIDE, **change}
    robots = system(RING, starts=spec["starts"], capacity=spec["capacity"], fifo=spec["fifo"])
    negotiation = make_negotiation(spec["negotiation"], Random(1))
    keeper = Gatekeeper(negotiation)
    keeper.change(robots, make_gate(spec["gate"], robots))
    assert keeper.compiled == compiled
