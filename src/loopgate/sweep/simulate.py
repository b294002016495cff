"""The runner that simulates: a scenario's mapping in, a run folder out."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario


def run_scenario(scenario: Mapping[str, Any], out: Path) -> None:
    """Simulate `scenario` and write its run folder to `out`."""
    simulate(Scenario.from_dict(scenario), out, overwrite=True)
