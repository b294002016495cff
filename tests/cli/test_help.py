"""Help comes at once: no command imports what only its work needs."""

from __future__ import annotations

import os
import re
import subprocess
import sys

import click
import pytest

from loopgate.cli.main import cli
from loopgate.cli.run import OPTIONS, GroupedCommand
from loopgate.simulation.scenario import kinds

HEAVY = {"jinja2", "libsumo", "matplotlib", "numba", "numpy", "pandas", "pyarrow", "rich", "scipy"}
ASK = """
import sys
from loopgate.cli.main import cli
cli.main(sys.argv[1:], standalone_mode=False)
print(*sorted({name.partition(".")[0] for name in sys.modules}), file=sys.stderr)
"""

_FILES_ONLY = {"replay", "example", "vehicle"}
"""Commands that print no figures."""


@pytest.mark.parametrize("words", [("--help",), ("run", "--help"), ("sweep", "--help"), ("report", "--help")])
def test_help_imports_nothing_heavy(words: tuple[str, ...]) -> None:
    """Listing the commands, and showing the options of one, loads neither tables nor roads nor compilers."""
    ended = subprocess.run([sys.executable, "-c", ASK, *words], capture_output=True, text=True, check=True)
    assert "Usage: " in ended.stdout
    assert set(ended.stderr.split()).isdisjoint(HEAVY)


def test_commands_are_grouped_with_whole_sentences() -> None:
    """What one drives with first, in the order of use; no sentence ends in dots; 80 columns are enough."""
    program = [sys.executable, "-c", ASK, "--help"]
    shown = subprocess.run(
        program, capture_output=True, text=True, check=True, env={**os.environ, "COLUMNS": "80"}
    )
    lines = shown.stdout.splitlines()
    heads = [line for line in lines if line and not line.startswith(" ")]
    assert heads == [heads[0], "Options:", "Drive:", "Study gates:", "Aboard:"]
    assert "..." not in shown.stdout.replace("[ARGS]...", "")
    assert max(map(len, lines)) <= 80
    drive = shown.stdout.partition("Drive:")[2].partition("Study gates:")[0]
    order = [drive.index(f"\n  {name} ") for name in ("loops", "inspect", "run", "sweep", "report")]
    assert order == sorted(order)


def test_options_of_a_run_are_grouped() -> None:
    """Each in one group; only --help is left over."""
    command = cli.get_command(click.Context(cli), "run")
    assert isinstance(command, GroupedCommand)
    grouped = [name for names in command.groups.values() for name in names]
    options = [param.name for param in command.params if isinstance(param, click.Option)]
    assert sorted(grouped) == sorted(map(str, options))
    assert list(command.groups) == ["Loops", "Vehicles", "Gate", "Watching", "Output", "SUMO"]


def test_every_command_that_prints_figures_prints_json() -> None:
    """A script need not read a table."""
    for name in cli.list_commands(click.Context(cli)):
        command = cli.get_command(click.Context(cli), name)
        assert command is not None
        assert name in _FILES_ONLY or any("--json" in option.opts for option in command.params), name


def test_the_command_is_a_module_too() -> None:
    """``python -m loopgate`` says what the script says."""
    said = subprocess.check_output([sys.executable, "-m", "loopgate", "--version"], text=True)
    assert re.fullmatch(
        r"(python -m )?loopgate, version \S+, (plain ledger \(.+\): .+|compiled ledger)\n", said
    )


def test_each_key_of_a_scenario_has_an_option() -> None:
    """Under one heading; only the network is an argument."""
    told = [key for keys in OPTIONS.values() for key in keys]
    assert sorted(told) == sorted(kinds().keys() - {"network"})
