"""Simulates a scenario and returns its results."""

from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

from loopgate.errors import ScenarioError
from loopgate.folders import temporary_folder
from loopgate.gates.registry import name_gate
from loopgate.negotiation.registry import name_negotiation
from loopgate.reading import of_kind
from loopgate.runs.run import Run, read_run
from loopgate.simulation.loop_run import Tick
from loopgate.simulation.run import simulate
from loopgate.simulation.scenario import Scenario


def run(
    scenario: Scenario,
    out: Path | str | None = None,
    *,
    gate: object = None,
    negotiation: object = None,
    tick: Tick | None = None,
    backend: str = "libsumo",
    overwrite: bool = False,
) -> Run:
    """Simulate a scenario in SUMO, and return its results.

    Raises `LoopgateError` if the parts of the scenario do not fit together, SUMO refuses it, or the disk is
    full; the message names the part.

    Parameters
    ----------
    out
        The run folder to write; None keeps no files.
    gate
        Replaces the scenario's gate: a name as in a scenario, or a class or function that takes the `System`
        and returns a gate.
    negotiation
        Replaces the scenario's negotiation: a name, a negotiation object, or a class or function that takes a
        `random.Random` and returns a negotiation.
    tick
        Called every ten simulated seconds with the simulated time [s] and the rows of the flow table so far.
    backend
        ``libsumo``, ``traci`` or ``gui``.
    overwrite
        Whether an earlier run in `out` may be replaced.

    Returns
    -------
    Run
        Its figures (`summary`) and tables (`events`, `vehicles`, `edges`).

    Examples
    --------
    >>> from loopgate import Scenario, run
    >>> roads = {"network": "networks/order2.net.xml", "routes": "routes/order2.rou.xml"}
    >>> made = run(Scenario(**roads, gate="open", duration_s=120))
    >>> made.summary["outcome"]
    'done'
    >>> len(made.vehicles)
    5
    """
    scenario = of_kind(
        Scenario, scenario, "run: the scenario", ScenarioError, "a Scenario, as Scenario.from_dict makes"
    )
    if gate is not None:
        scenario = replace(scenario, gate=name_gate(gate))
    if negotiation is not None:
        scenario = replace(scenario, negotiation=name_negotiation(negotiation))
    with ExitStack() as stack:
        folder = Path(out) if out is not None else stack.enter_context(temporary_folder()) / "run"
        simulate(scenario, folder, tick=tick, backend=backend, overwrite=overwrite)
        made = read_run(folder)
    return made if out is not None else replace(made, folder=None)
