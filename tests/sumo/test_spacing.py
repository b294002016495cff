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


def test_advice_lets_streets_wait_less() -> None:
    """Twelve vehicles on two loops, which bunch without it: idleness falls, and nobody runs through."""
    none, advice = figures("none"), figures("advice")
    assert advice["clean"]
    assert advice["worst_idleness_s"] < 0.8 * none["worst_idleness_s"]
    assert advice["idleness_s"] < none["idleness_s"]
