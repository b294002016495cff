"""Options without effect are named, with the reason."""

from __future__ import annotations

from typing import Any

import pytest

from loopgate.simulation.scenario import Scenario
from loopgate.simulation.unused import without_effect

NETWORK = "networks/ring3.net.xml"


@pytest.mark.parametrize(
    ("given", "kind", "told"),
    [
        ({}, (True, True, False), []),
        ({"loops": 5}, (False, True, False), []),
        (
            {"loops": 5, "loop_length_m": (100.0, 200.0), "routes": "c.rou.xml"},
            (True, True, False),
            ["--loops, --length have no effect: the loops are those of c.rou.xml"],
        ),
        (
            {"max_shared": 0.1, "piece_m": 50.0},
            (False, True, False),
            ["--max-shared, --piece have no effect: the roads are cut into queues, not into segments"],
        ),
        ({"max_shared": 0.1, "abstraction": "segments"}, (False, True, False), []),
        (
            {"spacing": "hold"},
            (True, False, True),
            ["--spacing has no effect: no vehicle is on a closed loop"],
        ),
        ({"spacing": "hold"}, (True, True, True), []),
        ({"who": "bus"}, (True, True, False), ["--gated has no effect: all vehicles are on closed loops"]),
        ({"who": "bus"}, (True, True, True), []),
        ({"who": "all"}, (True, True, False), []),
    ],
)
def test_what_has_no_effect_is_told(given: dict[str, Any], kind: tuple[bool, ...], told: list[str]) -> None:
    """Each once, by its name on the command line."""
    from_file, closed, once = kind
    scenario = Scenario(network=NETWORK, **given)
    assert list(without_effect(scenario, 600.0, from_file=from_file, closed=closed, once=once)) == told


@pytest.mark.parametrize("what", ["kill=2,kill_at=500", "cut=30,cut_at=500"])
def test_what_would_happen_after_the_run_is_told(what: str) -> None:
    """A disturbance of vehicles that decide."""
    decide = f"{'processes' if 'kill' in what else 'vehicles'}:{what}"
    scenario, kinds = (
        Scenario(network=NETWORK, decide=decide),
        {"from_file": True, "closed": True, "once": False},
    )
    (told,) = without_effect(scenario, 500.0, **kinds)
    assert told.endswith("_at 500 has no effect: the run ends at 500 s")
    assert without_effect(scenario, 501.0, **kinds) == ()
