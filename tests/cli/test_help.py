"""Help comes at once: no command imports what only its work needs."""

from __future__ import annotations

import os
import re
import subprocess
import sys

import click
import pytest
from click.testing import CliRunner

from loopgate.cli.main import cli, study
from loopgate.cli.run import FIRST, OPTIONS, GroupedCommand, run
from loopgate.simulation.scenario import kinds, option_name

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
    assert heads == [heads[0], "Options:", "Commands:"]
    assert "..." not in shown.stdout.replace("[ARGS]...", "")
    assert max(map(len, lines)) <= 80
    drive = shown.stdout.partition("Commands:")[2]
    order = [drive.index(f"\n  {name} ") for name in ("loops", "inspect", "run", "sweep", "report")]
    assert order == sorted(order)


def test_options_of_a_run_are_grouped() -> None:
    """Each in one group; only --help is left over."""
    command = cli.get_command(click.Context(cli), "run")
    assert isinstance(command, GroupedCommand)
    grouped = [name for names in command.groups.values() for name in names]
    options = [param.name for param in command.params if isinstance(param, click.Option)]
    assert sorted(grouped) == sorted(set(map(str, options)) - {"help_all"})
    assert list(command.groups) == ["Loops", "Vehicles", "Gate", "Watching", "Output", "SUMO"]


def test_every_command_that_prints_figures_prints_json() -> None:
    """A script need not read a table."""
    commands = {(group, name) for group in (cli, study) for name in group.list_commands(click.Context(group))}
    for group, name in commands - {(cli, "study")}:
        command = group.get_command(click.Context(group), name)
        assert command is not None
        assert name in _FILES_ONLY or any("--json" in option.opts for option in command.params), name


def test_help_of_a_run_is_short_and_all_of_it_is_one_option_away() -> None:
    """A beginner reads a page; a key of a scenario that is left out of it stands in the other."""
    short, whole = (CliRunner().invoke(cli, ["run", words]).output for words in ("--help", "--help-all"))
    for field in kinds().keys() - {"network"}:
        assert f"--{option_name(field)}" in whole
    assert sum(line.strip().startswith("-") for line in short.splitlines()) == len(FIRST) + 2
    assert "--help-all" in short


@pytest.mark.parametrize(
    ("words", "hint"),
    [
        ("run n.net.xml --step 0.5", "--step-length"),
        ("run n.net.xml --duration 10minutes", "10min"),
        ("run n.net.xml --begin 9.30am", "h:m"),
        ("run n.net.xml --duration 9:30", "h:m:s"),
        ("loops n.net.xml --vehicles 4", "loopgate run"),
        ("explore s.json", "loopgate study explore"),
    ],
)
def test_a_near_miss_gets_the_way_out(words: str, hint: str) -> None:
    """What a person expects to work, and does not, names what does."""
    ended = CliRunner().invoke(cli, words.split())
    assert ended.exit_code == 2
    assert hint in ended.output


def test_times_are_read_as_people_write_them() -> None:
    """Seconds, SUMO's clock, and with a unit."""
    (duration,) = (param for param in run.params if param.name == "duration_s")
    units = {"10min": 600.0, "1.5h": 5400.0, "90s": 90.0, "2h30min": 9000.0, "1h 5s": 3605.0}
    for text, time_s in {"600": 600.0, "0:10:00": 600.0, **units}.items():
        assert duration.type.convert(text, duration, None) == time_s
    (begin,) = (param for param in run.params if param.name == "begin_s")
    for text, time_s in {"9:30": 34200.0, "9:30:15": 34215.0, "60": 60.0, "1.5h": 5400.0}.items():
        assert begin.type.convert(text, begin, None) == time_s


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


def test_a_run_begins_without_what_it_does_not_need() -> None:
    """Each of these takes a tenth of the time to the first step, and longer where nothing is kept."""
    heavy = ("networkx", "asyncio", "rich", "matplotlib", "numba", "altair")
    code = f"import sys, loopgate.simulation.run; print([m for m in {heavy} if m in sys.modules])"
    assert subprocess.check_output([sys.executable, "-c", code], text=True) == "[]\n"
