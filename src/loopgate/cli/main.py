"""The `loopgate` command: a group of subcommands, each in a module of its own, imported when used."""

import importlib
import io
import os
import sys
from collections.abc import Sequence
from typing import Any, cast

import click

from loopgate.cli.terminal import EXIT_INTERRUPTED, listen, only_json
from loopgate.disk import DISK_FULL, disk_error
from loopgate.errors import LoopgateError
from loopgate.versions import DISTRIBUTION, ledger_words

EXIT_DEADLOCK = 3
EXIT_UNCLEAN = 4
EXIT_STARVING = 5
EXIT_BAD_INPUT = 2

_DRIVE = "example", "loops", "inspect", "run", "read-fcd", "replay", "sweep", "report"
_STUDY = "explore", "trace", "montecarlo", "verify", "check-certificate", "paper", "warm-up"
_HIDDEN = ("vehicle",)
"""Commands in the order of a first use; each is a function in a module of the same name. Runs with ``--decide
processes`` start the hidden command themselves."""

_WHOLE = 500
"""So many letters of a first sentence are shown: all."""


class _LazyGroup(click.Group):
    """Import a command only when it is called, so that ``--help`` is quick."""

    def __init__(self, *args: Any, shown: Sequence[str], hidden: Sequence[str] = (), **more: Any) -> None:  # noqa: ANN401
        super().__init__(*args, **more)
        self.shown, self.hides = shown, hidden

    def list_commands(self, ctx: click.Context) -> list[str]:
        return [*self.shown, *super().list_commands(ctx)]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in (*self.shown, *self.hides):
            return super().get_command(ctx, cmd_name)
        name = cmd_name.replace("-", "_")
        return cast("click.Command", getattr(importlib.import_module(f"loopgate.cli.{name}"), name))

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        known = [(name, self.get_command(ctx, name)) for name in self.list_commands(ctx)]
        rows = [(name, command.get_short_help_str(_WHOLE)) for name, command in known if command]
        with formatter.section("Commands"):
            formatter.write_dl(rows)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        try:
            return super().resolve_command(ctx, args)
        except click.UsageError as error:
            if args[0] not in _STUDY:
                raise
            msg = f"{error.message} It is a study: loopgate study {args[0]}"
            raise click.UsageError(msg, ctx) from error


@click.group(
    cls=_LazyGroup, shown=_DRIVE, hidden=_HIDDEN, context_settings={"help_option_names": ["-h", "--help"]}
)
@click.version_option(package_name=DISTRIBUTION, message=f"%(prog)s, version %(version)s, {ledger_words()}")
def cli() -> None:
    """Vehicles on closed loops in a SUMO road network: no collision; no lock while none stands for good."""


@cli.group(cls=_LazyGroup, shown=_STUDY)
def study() -> None:
    """Study gates on systems without roads: exhaustive search, certificates, the experiments of the paper."""


def main() -> None:
    """Run the command line; errors of the package become one line on stderr and exit code 2."""
    listen()
    for stream in (sys.stdout, sys.stderr):
        # Names may hold what the terminal's encoding does not.
        if isinstance(stream, io.TextIOWrapper) and stream.errors == "strict":
            stream.reconfigure(errors="backslashreplace")
    try:
        _check_words(sys.argv[1:])
        with only_json(wanted="--json" in sys.argv):
            code = cli.main(standalone_mode=False)
        sys.stdout.flush()
    except click.ClickException as error:
        error.show()
        code = EXIT_BAD_INPUT
    except (click.Abort, KeyboardInterrupt):
        click.echo("loopgate: interrupted", err=True)
        code = EXIT_INTERRUPTED
    except LoopgateError as error:
        click.echo(f"loopgate: {error}", err=True)
        code = EXIT_BAD_INPUT
    except OSError as error:
        if error.errno not in DISK_FULL:
            raise
        # All that the package writes names its file; what is left is what it prints.
        what = error.filename or "output"
        click.echo(f"loopgate: {what}: cannot be written ({disk_error(error)})", err=True)
        sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115, PTH123  else its end fails as well
        code = EXIT_BAD_INPUT
    sys.exit(code)


def _check_words(words: Sequence[str]) -> None:
    """Refuse a word that is no UTF-8: tables, pages and SUMO could not hold it as the name of a file."""
    for word in words:
        try:
            word.encode()
        except UnicodeEncodeError as error:
            msg = f"{word}: no UTF-8, so neither SUMO nor a page can name such a file; give it another name"
            raise LoopgateError(msg) from error
