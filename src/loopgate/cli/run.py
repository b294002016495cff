"""`loopgate run`: one simulation, from a network and loops to a run folder."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from loopgate.cli.main import EXIT_DEADLOCK, EXIT_STARVING, EXIT_UNCLEAN
from loopgate.cli.terminal import EXIT_INTERRUPTED, Time, print_json, without_way_out
from loopgate.errors import NobodyGatedError
from loopgate.simulation.scenario import Scenario, kinds, option_name, options, read_scenario

if TYPE_CHECKING:
    from loopgate.simulation.loop_run import RunCourse


class GroupedCommand(click.Command):
    """A command whose help lists its options in groups; other options come last, under "Options".

    ``--help`` shows the options that a first run needs, ``--help-all`` all of them.

    Parameters
    ----------
    groups
        The parameters of each group in their order, by the title of the group.
    first
        The parameters that a first run needs; all if empty.
    """

    def __init__(
        self,
        *args: Any,  # noqa: ANN401  as click has them
        groups: Mapping[str, tuple[str, ...]],
        first: Sequence[str] = (),
        **more: Any,  # noqa: ANN401
    ) -> None:
        super().__init__(*args, **more)
        self.groups, self.first = groups, first
        if first:
            self.params.append(
                click.Option(
                    ["--help-all"],
                    is_flag=True,
                    is_eager=True,
                    expose_value=False,
                    callback=self._help_all,
                    help="Show all options and exit.",
                )
            )

    @staticmethod
    def _help_all(ctx: click.Context, _param: click.Parameter, wanted: bool) -> None:  # noqa: FBT001  as click calls it
        if wanted:
            ctx.meta[HELP_ALL] = True
            click.echo(ctx.get_help())
            ctx.exit()

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Read the arguments; for an unknown option name those that begin with it."""
        try:
            return super().parse_args(ctx, args)
        except click.NoSuchOption as error:
            names = [name for param in self.get_params(ctx) for name in param.opts]
            longer = [name for name in names if name.startswith(error.option_name)]
            raise click.NoSuchOption(
                error.option_name, possibilities=longer or error.possibilities, ctx=ctx
            ) from error

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options, group by group."""
        known = {p.name: row for p in self.get_params(ctx) if (row := p.get_help_record(ctx)) is not None}
        if self.first and HELP_ALL not in ctx.meta:
            all_of_them = sum(len(names) for names in self.groups.values())
            last = [row for row in known.values() if "--help" in row[0]]
            with formatter.section(f"Options ({len(self.first)} of {all_of_them})"):
                formatter.write_dl([*(known[name] for name in self.first), *last])
            return
        for title, names in self.groups.items():
            with formatter.section(title):
                formatter.write_dl([known.pop(name) for name in names])
        with formatter.section("Options"):
            formatter.write_dl(list(known.values()))


HELP_ALL = "loopgate.help_all"
"""Set in the context of a command whose help is to show all options."""

OPTIONS = options()

Command = Callable[..., Any]


def scenario_options(command: Command) -> Command:
    """Give a command an option for each key of a scenario; options that the user leaves out are None."""
    of_keys = kinds()
    for field, said in [pair for group in OPTIONS.values() for pair in group.items()]:
        kind, rule = of_keys[field]
        more: dict[str, Any] = {"type": kind if kind in (int, float) else str, "metavar": said.metavar}
        if field.endswith("_s"):
            more["type"] = Time()
        if rule.words:
            more["type"] = click.Choice(rule.words)
        elif kind is bool:
            more = {"is_flag": True, "default": None}
        command = click.option(f"--{option_name(field)}", field, help=said.help, **more)(command)
    return command


GROUPS = {title: tuple(keys) for title, keys in OPTIONS.items()} | {
    "Output": ("out", "overwrite", "as_json", *OPTIONS["Output"]),
    "SUMO": (*OPTIONS["SUMO"], "gui", "traci"),
}
"""The options by heading, each in the order of use."""

FIRST = (
    *("routes", "loops", "vehicles", "stops", "traffic", "gate", "lights", "incidents"),
    *("duration_s", "seed", "out", "overwrite", "gui"),
)
"""The options that a first run needs."""


@click.command(
    cls=GroupedCommand,
    groups=GROUPS,
    first=FIRST,
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
@scenario_options
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
    from loopgate.simulation.sumo_options import refuse_too_many

    given = {key: value for key, value in given.items() if value is not None}
    scenario = _scenario(network, given)
    refuse_too_many(scenario)

    from loopgate.cli.terminal import show_progress  # what follows takes seconds to load
    from loopgate.simulation.loop_run import standstill_text
    from loopgate.simulation.run import simulate

    backend = "gui" if gui else "traci" if traci else "libsumo"
    seconds = int(scenario.warmup_s + scenario.duration_s)
    with show_progress("simulated seconds", total=seconds) as report:

        def tick(now_s: float, course: RunCourse) -> None:
            done = min(seconds, int(now_s - course.begin_s + scenario.warmup_s))
            told = standstill_text(course)
            report(done, more=f"; {told}" if told else "")

        try:
            summary = simulate(scenario, out, tick=tick, backend=backend, overwrite=overwrite)
        except NobodyGatedError as error:
            if "gate" in given or "who" in given or network.endswith(".toml"):
                raise
            click.echo(
                f"warning: {without_way_out(error)}; all drive by SUMO's rules, as with --gate open", err=True
            )
            scenario = dataclasses.replace(scenario, gate="open")
            summary = simulate(scenario, out, tick=tick, backend=backend, overwrite=overwrite)
    if as_json:
        print_json(summary, indent=1)
    else:
        from loopgate.cli.tables import print_summary

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
