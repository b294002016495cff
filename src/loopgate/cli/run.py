"""`loopgate run`: one simulation, from a network and loops to a run folder."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from loopgate.cli.grouped import GroupedCommand
from loopgate.cli.interrupts import EXIT_INTERRUPTED
from loopgate.cli.json_output import print_json
from loopgate.cli.main import EXIT_DEADLOCK, EXIT_STARVING, EXIT_UNCLEAN
from loopgate.errors import NobodyGatedError
from loopgate.simulation.scenario import (
    ABSTRACTIONS,
    ARRIVING,
    DRIVERS,
    LIGHTS,
    ON_DEADLOCK,
    SPACINGS,
    STANDING,
    STARTS,
    Scenario,
    read_scenario,
)

if TYPE_CHECKING:
    from loopgate.simulation.loop_run import RunCourse


GROUPS = {
    "Loops": ("routes", "loops", "loop_length_m", "max_shared", "u_turns", "loops_seed"),
    "Vehicles": ("vehicles", "vehicles_per_km", "on_loops", "types", "drivers", "starts", "stops", "traffic"),
    "Gate": (
        *("gate", "gated", "abstraction", "negotiation", "decide", "serve_after_s", "lights", "spacing"),
        *("arriving", "incidents", "standing", "rho_m", "piece_m"),
    ),
    "Watching": ("revisit_s", "weights", "districts", "on_deadlock", "deadlock_after_s", "starving_s"),
    "Output": ("out", "overwrite", "as_json", "positions", "fcd", "tripinfo", "edgedata"),
    "SUMO": ("duration_s", "warmup_s", "seed", "step_s", "sumo", "gui", "traci"),
}
"""The options by what they are about, each in the order of use."""


@click.command(
    cls=GroupedCommand,
    groups=GROUPS,
    epilog="""
    \b
    Examples:
      loopgate run sumo:DRT --loops 60 --vehicles 400 -o out/drt
      loopgate run sumo:DRT --loops 12 --max-shared 0.4 --abstraction segments --gate algorithm2
      loopgate run my.net.xml --routes loops.rou.xml --gate open -o out/open
      loopgate run some.sumocfg
      loopgate run some.sumocfg --gate open
      loopgate run scenario.toml --seed 2 -o out/seed2

    \b
    Exit codes: 0 done, 2 bad input or a full disk, 3 deadlock, 4 a gated run with a collision, an
    overrun, a trespass or another finding of the audit, 5 vehicles starved behind one that stands,
    130 interrupted.

    \b
    Ctrl-C, SIGTERM and SIGHUP interrupt: the run folder then holds the results up to that moment.
    """,
)
@click.argument("network")
@click.option("--routes", help="Route file or .sumocfg with closed loops.")
@click.option("--stops", help="Additional files with the stops that route files name: FILE,FILE.")
@click.option("--traffic", help="Route file or .sumocfg with ordinary vehicles, which keep SUMO's rules.")
@click.option("--loops", type=int, help="Number of random loops, if there is no --routes.")
@click.option("--length", "loop_length_m", metavar="MIN:MAX", help="Length of random loops [m].")
@click.option(
    "--max-shared", type=float, help="Largest share of a random loop in zones with other loops, 0 to 1."
)
@click.option(
    "--u-turns", is_flag=True, default=None, help="Let vehicles on random loops turn round at junctions."
)
@click.option("--loops-seed", type=int, help="Seed of the random loops.")
@click.option("--vehicles", type=int, help="Number of vehicles. Default: one per loop.")
@click.option(
    "--vehicles-per-km", type=float, help="Number of vehicles per kilometre of loop, in place of --vehicles."
)
@click.option("--on-loops", help="Number of vehicles on each loop, in place of --vehicles: loop0=3,loop4=1.")
@click.option(
    "--types", help="Vehicle types and their shares: bus=1,car=4. Types of the route file, or SUMO's classes."
)
@click.option("--gate", help="Gate: name or name:option=value. Under 'open' SUMO's right of way rules.")
@click.option(
    "--gated",
    help="Vehicles under the gate, if trips are read: all (default), loops, a vType, or a file of names.",
)
@click.option(
    "--abstraction",
    type=click.Choice(ABSTRACTIONS),
    help="Cut roads into queues (places) or segments (the paper).",
)
@click.option(
    "--negotiation",
    help="Order of requests: oldest (default on segments), pressure (default on queues), random.",
)
@click.option(
    "--serve-after",
    "serve_after_s",
    type=float,
    help="Serve a vehicle that has waited this long for a grant [s]; 0: never.",
)
@click.option(
    "--decide",
    metavar="WHO",
    help="Who decides slots and the chain rule: central (default), vehicles:range=150,loss=0.1,delay=0.2, or "
    "processes (of the same options): one for each vehicle.",
)
@click.option(
    "--lights",
    type=click.Choice(LIGHTS),
    help="Traffic lights: off (default with a gate), keep (default for open), obey (grants into green).",
)
@click.option(
    "--spacing",
    type=click.Choice(SPACINGS),
    help="Even spacing on loops: none, hold (at gates; default with --revisit), advice (speeds).",
)
@click.option(
    "--starts",
    type=click.Choice(STARTS),
    help="Start positions: random (default), or even (more vehicles on longer laps, evenly spaced).",
)
@click.option(
    "--drivers",
    type=click.Choice(DRIVERS),
    help="human (default): as the vehicle types say; machine: no dawdling, short headway.",
)
@click.option(
    "--arriving",
    type=click.Choice(ARRIVING),
    help="Refused vehicles: brake late (standing, default), or slow early to be granted at speed (rolling).",
)
@click.option(
    "--revisit", "revisit_s", type=float, help="Name the streets that went unseen for longer than this [s]."
)
@click.option("--weights", help="File of streets to visit more often: lines EDGE WEIGHT (with --revisit).")
@click.option("--districts", help="XML file of polygons: the run says how well each district was watched.")
@click.option("--incidents", help="TOML file of closures and breakdowns.")
@click.option(
    "--standing",
    type=click.Choice(STANDING),
    help="If a vehicle stands long: contain (default) leads loops round it; leave besides takes vehicles "
    "without a way off the road for that time; wait does neither.",
)
@click.option(
    "--starving",
    "starving_s",
    type=float,
    help="Name vehicles that get no grant for this long while others do [s].",
)
@click.option("--duration", "duration_s", type=float, help="Measured simulated time [s].")
@click.option("--warmup", "warmup_s", type=float, help="Simulated time before the measured time [s].")
@click.option("--seed", type=int, help="Seed of SUMO, start positions and negotiation.")
@click.option("--step-length", "step_s", type=float, help="Simulation step [s].")
@click.option("--rho", "rho_m", type=float, help="Safe radius of the segments abstraction [m].")
@click.option("--piece", "piece_m", type=float, help="Longest private piece of the segments abstraction [m].")
@click.option(
    "--on-deadlock", type=click.Choice(ON_DEADLOCK), help="Stop the run at a deadlock, or continue."
)
@click.option(
    "--deadlock-after",
    "deadlock_after_s",
    type=float,
    help="Time that vehicles stand in a circle before it counts as a deadlock [s].",
)
@click.option(
    "--positions",
    is_flag=True,
    default=None,
    help="Record the position of every vehicle at every step; the audit then checks crossings and bodies.",
)
@click.option("--fcd", is_flag=True, default=None, help="SUMO writes fcd.xml.gz into the run folder.")
@click.option("--tripinfo", is_flag=True, default=None, help="SUMO writes tripinfo.xml into the run folder.")
@click.option("--edgedata", is_flag=True, default=None, help="SUMO writes edgedata.xml into the run folder.")
@click.option("--sumo", metavar="OPTIONS", help="More options for SUMO: '--lanechange-output lc.xml ...'.")
@click.option(
    "-o", "--out", type=click.Path(path_type=Path), help="Run folder. Without it no files are kept."
)
@click.option("--overwrite", is_flag=True, help="Replace an earlier run in the run folder.")
@click.option("--gui", is_flag=True, help="Show the run in sumo-gui (through traci).")
@click.option("--traci", is_flag=True, help="Run SUMO as a process of its own (through traci).")
@click.option("--json", "as_json", is_flag=True, help="Print the summary as JSON only.")
def run(
    network: str,
    *,
    out: Path | None,
    overwrite: bool,
    gui: bool,
    traci: bool,
    as_json: bool,
    **given: Any,  # noqa: ANN401  the scenario checks its own fields
) -> int:
    """Run vehicles on closed loops through NETWORK under a gate.

    NETWORK is a .net.xml or .net.xml.gz file, sumo:NAME for a network of the SUMO package (sumo:DRT,
    sumo:bs3d), a .sumocfg, or a scenario.toml; options given here go before what the scenario says.

    Defaults: the certified gate on queues, ordered by pressure, one hour, seed 1. That works on any road
    network; segments is the abstraction of the paper, with one vehicle per loop.
    """
    from loopgate.simulation.demand.early import refuse_too_many

    given = {key: value for key, value in given.items() if value is not None}
    scenario = _scenario(network, given)
    refuse_too_many(scenario)

    from loopgate.cli.progress import show_progress  # what follows takes seconds to load
    from loopgate.cli.tables import print_summary
    from loopgate.simulation.run import simulate

    backend = "gui" if gui else "traci" if traci else "libsumo"
    seconds = int(scenario.warmup_s + scenario.duration_s)
    with show_progress("simulated seconds", total=seconds) as report:

        def tick(now_s: float, course: RunCourse) -> None:
            report(min(seconds, int(now_s - course.begin_s + scenario.warmup_s)))

        try:
            summary = simulate(scenario, out, tick=tick, backend=backend, overwrite=overwrite)
        except NobodyGatedError as error:
            if "gate" in given or "gated" in given or network.endswith(".toml"):
                raise
            why = str(error).removesuffix("; or --gate open")
            click.echo(f"warning: {why}; all drive by SUMO's rules, as with --gate open", err=True)
            scenario = dataclasses.replace(scenario, gate="open")
            summary = simulate(scenario, out, tick=tick, backend=backend, overwrite=overwrite)
    if as_json:
        print_json(summary, indent=1)
    else:
        print_summary(summary, out)
    return exit_code(summary)


def exit_code(summary: Mapping[str, Any]) -> int:
    """Return the exit code of a run; an interrupt comes before all other outcomes."""
    if summary["outcome"] == "interrupted":
        return EXIT_INTERRUPTED
    if summary.get("clean") is False:
        return EXIT_UNCLEAN
    return {"deadlock": EXIT_DEADLOCK, "starving": EXIT_STARVING}.get(summary["outcome"], 0)


def _scenario(network: str, given: dict[str, Any]) -> Scenario:
    if not network.endswith(".toml"):
        return Scenario.from_dict({"network": network, **given}, source="loopgate run")
    known = dataclasses.asdict(read_scenario(network))
    return Scenario.from_dict({**known, **given}, source=network)
