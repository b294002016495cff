"""A simulation that never saw the gate, as a run: read from SUMO's FCD output."""

from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

from loopgate.errors import ResultsError
from loopgate.folders import temporary_folder
from loopgate.reading import as_path
from loopgate.runs.run import Run, read_run
from loopgate.simulation.fcd.folder import write_fcd_run


def read_fcd(
    file: Path | str,
    network: str,
    out: Path | str | None = None,
    *,
    deadlock_after_s: float = 40.0,
    overwrite: bool = False,
) -> Run:
    """Read the floating-car data (FCD) output of any SUMO simulation as a run.

    The run has figures, the idleness of each street, deadlocks, and positions for the replay. Collisions and
    teleports are not in FCD output.

    Raises `LoopgateError` if the file is no FCD output of this network, or the folder cannot be written.

    Parameters
    ----------
    file
        The file that SUMO wrote with ``--fcd-output``, plain or compressed.
    network
        A ``.net.xml`` file, a ``.sumocfg`` (its network), or ``sumo:NAME``.
    out
        The run folder to write; None keeps no files, and then there is no replay.
    deadlock_after_s
        Time that vehicles must stand in a circle to count as a deadlock [s].
    overwrite
        Whether an earlier run in `out` may be replaced.

    Examples
    --------
    >>> from loopgate import Scenario, read_fcd, run
    >>> roads = {"network": "networks/order2.net.xml", "routes": "routes/order2.rou.xml"}
    >>> made = run(Scenario(**roads, duration_s=60, gate="open", outputs="fcd"), "out/with-fcd")
    >>> read = read_fcd("out/with-fcd/fcd.xml.gz", roads["network"], "out/read")
    >>> read.summary["outcome"], len(read.vehicles)
    ('done', 5)
    """
    with ExitStack() as stack:
        folder = Path(out) if out is not None else stack.enter_context(temporary_folder()) / "run"
        write_fcd_run(
            as_path(file, "FCD output", ResultsError),
            str(network),
            folder,
            deadlock_after_s=deadlock_after_s,
            overwrite=overwrite,
        )
        made = read_run(folder)
    return made if out is not None else replace(made, folder=None)
