"""The function `attach`: puts vehicles of a running SUMO simulation under a gate."""

from pathlib import Path
from typing import Any

from loopgate.errors import ScenarioError
from loopgate.gates.registry import check_gate, name_gate
from loopgate.negotiation.registry import name_negotiation
from loopgate.network import RoadNetwork
from loopgate.reading import as_path, at_least
from loopgate.simulation.attaching.attached import Attached
from loopgate.simulation.scenario import LONGEST_GATED_STEP_S, STANDING
from loopgate.simulation.settings import check_options
from loopgate.traffic.running import RunningSumo

_LIGHTS = ("obey", "keep")


def attach(  # noqa: PLR0913 - what a gate may be told; all but the simulation by name
    sumo: Any,  # noqa: ANN401  neither libsumo nor traci has types
    *,
    gate: object = "certified",
    negotiation: object = "pressure",
    lights: str = "obey",
    seed: int = 1,
    starving_s: float = 600.0,
    standing: str = "contain",
    folder: Path | str | None = None,
    overwrite: bool = False,
) -> Attached:
    """Put vehicles of your running SUMO simulation under a gate.

    Parameters
    ----------
    sumo
        The module ``libsumo`` or ``traci``, or a connection of traci, with a running simulation.
    gate
        A gate's name, with options behind a colon, or a class that is called with a `System`.
    negotiation
        A negotiation's name, with options behind a colon, a class, or a negotiation object.
    lights
        ``obey``: the gate grants nothing at red; ``keep``: vehicles get grants at red, and then wait for
        green.
    seed
        Seed of the negotiation's random numbers.
    starving_s
        Time without a grant, hardly driving, after which a vehicle counts as starving [s].
    standing
        ``contain``: vehicles are led round a blocked place; ``wait``: vehicles wait.
    folder
        A run folder to write, for ``loopgate replay`` and ``loopgate report``: events, the positions of all
        vehicles after each step, and figures; complete when the ``with`` block ends.
    overwrite
        Whether an earlier run in `folder` may be replaced.

    Returns
    -------
    Attached
        Use it in a ``with`` statement: `Attached.add` puts vehicles under the gate, `Attached.after_step` is
        called after each step, `Attached.leave` releases vehicles.

    Raises
    ------
    LoopgateError
        If no simulation is running, or a setting of it would let gated vehicles collide; the message names
        the setting.

    Examples
    --------
    >>> import libsumo
    >>> import loopgate
    >>> files = ["-n", "networks/grid5-priority.net.xml", "-r", "routes/grid5.rou.xml"]
    >>> _ = libsumo.start(["sumo", *files, "--no-step-log", "--no-warnings"])
    >>> for bus in ("bus1", "bus2"):
    ...     libsumo.vehicle.add(bus, "loop0")
    >>> with loopgate.attach(libsumo) as gate:
    ...     gate.add("bus1", "bus2")
    ...     while libsumo.simulation.getTime() < 120:
    ...         libsumo.simulationStep()
    ...         happened = gate.after_step()
    >>> libsumo.close()
    >>> gate.summary["vehicles"], gate.summary["trespasses"]
    (2, 0)
    """
    running = RunningSumo(sumo)
    _check_settings(running)
    gate_name, negotiation_name = name_gate(gate), name_negotiation(negotiation)
    check_gate(gate_name)
    if gate_name == "open":
        msg = "gate open: it leaves all to SUMO's right of way, so there is nothing to attach"
        raise ScenarioError(msg)
    if lights not in _LIGHTS:
        msg = f"lights is {lights!r}; expected one of {', '.join(_LIGHTS)}"
        raise ScenarioError(msg)
    if standing not in STANDING:
        msg = f"standing is {standing!r}; expected one of {', '.join(STANDING)}"
        raise ScenarioError(msg)
    starving_s = at_least(1.0, starving_s, "starving_s", ScenarioError, "a number of seconds, from 1 on")
    return Attached(
        running,
        RoadNetwork.open(running.setting("net-file")),
        {"gate": gate_name, "negotiation": negotiation_name, "lights": lights, "seed": seed},
        starving_s=starving_s,
        standing=standing,
        folder=None if folder is None else as_path(folder, "folder", ScenarioError),
        overwrite=overwrite,
    )


def _check_settings(running: RunningSumo) -> None:
    """Refuse settings of SUMO with which vehicles drive in ways that a gate does not expect."""
    step_s = running.traffic.step_s
    if step_s > LONGEST_GATED_STEP_S:
        msg = (
            f"step-length is {step_s:g}; expected at most {LONGEST_GATED_STEP_S:g} under a gate, or vehicles "
            "drive into each other"
        )
        raise ScenarioError(msg)
    check_options(running.setting, source="the running simulation", known=False)
