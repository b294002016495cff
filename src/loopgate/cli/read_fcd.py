"""`loopgate read-fcd`: the FCD output of any SUMO simulation as a run folder."""

from __future__ import annotations

from pathlib import Path

import click

from loopgate.cli.terminal import print_json


@click.command(
    name="read-fcd",
    epilog="""
    \b
    Example:
      sumo -c my.sumocfg --fcd-output fcd.xml.gz
      loopgate read-fcd fcd.xml.gz my.sumocfg -o out/mine
      loopgate replay out/mine --open

    \b
    Exit codes: 0 done, 2 bad input or a full disk, 3 deadlock.
    """,
)
@click.argument("fcd", type=click.Path(path_type=Path))
@click.argument("network")
@click.option("-o", "--out", type=click.Path(path_type=Path), required=True, help="Run folder.")
@click.option("--overwrite", is_flag=True, help="Replace an earlier run in the run folder.")
@click.option(
    "--deadlock-after",
    "deadlock_after_s",
    type=click.FloatRange(min=1.0),
    default=40.0,
    show_default=True,
    help="Time of standing after which vehicles may be in a deadlock [s].",
)
@click.option("--json", "as_json", is_flag=True, help="Print the summary as JSON only.")
def read_fcd(
    *, fcd: Path, network: str, out: Path, overwrite: bool, deadlock_after_s: float, as_json: bool
) -> int:
    """Read FCD, the FCD output of a SUMO simulation of NETWORK, into a run folder.

    The simulation need not know loopgate. The run folder has figures, the idleness of each street and
    deadlocks; replay and report work on it.
    """
    from loopgate.cli.run import exit_code
    from loopgate.cli.tables import print_summary
    from loopgate.cli.terminal import show_progress
    from loopgate.simulation.fcd.folder import write_fcd_run

    with show_progress("simulated seconds") as report:
        summary = write_fcd_run(
            fcd, network, out, deadlock_after_s=deadlock_after_s, overwrite=overwrite, tell=report
        )
    if as_json:
        print_json(summary, indent=1)
    else:
        print_summary(summary, out)
    return exit_code(summary)
