"""Speed advice in real simulations."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pytest

from loopgate import Scenario, run

pytestmark = pytest.mark.sumo


def figures(spacing: str) -> Mapping[str, Any]:
    return run(
        Scenario(
            network="networks/grid5-priority.net.xml",
            loops=2,
            vehicles=12,
            warmup_s=600.0,
            duration_s=1200.0,
            spacing=spacing,
        )
    ).summary


@pytest.mark.parametrize("spacing", ["hold", "advice"])
def test_streets_wait_less(spacing: str) -> None:
    """Twelve vehicles on two loops, which bunch without it: idleness falls, and nobody runs through."""
    none, spaced = figures("none"), figures(spacing)
    assert spaced["clean"]
    assert spaced["spacing"] == spacing
    assert spaced["worst_idleness_s"] < 0.8 * none["worst_idleness_s"]
    assert spaced["idleness_s"] < none["idleness_s"]
    assert spaced["idleness_s"] < 1.2 * spaced["watch"]["idleness_if_even_s"]
    assert ("spacing" in spaced["refusals"]) == (spacing == "hold")


@pytest.mark.parametrize("gate", ["certified", "banker"])
def test_holding_under_any_gate(gate: str) -> None:
    """Whether the gate's decisions are compiled or not, a watch is held evenly spaced."""
    scenario = Scenario(
        network="networks/grid5-priority.net.xml",
        loops=2,
        vehicles=8,
        starts="even",
        gate=gate,
        duration_s=300.0,
        revisit_s=120.0,
    )
    summary = run(scenario).summary
    assert summary["spacing"] == "hold"
    assert summary["refusals"]["spacing"] > 0
    assert summary["clean"]
