"""`from loopgate import ...`: all of it is there, and nothing is loaded before it is used."""

import pydoc
import subprocess
import sys

import pytest

import loopgate


@pytest.mark.parametrize("name", loopgate.__all__)
def test_every_name_can_be_imported(name: str) -> None:
    """A name that is listed exists where it is looked for."""
    assert getattr(loopgate, name) is not None
    assert name in dir(loopgate)


def test_other_names_are_no_attributes() -> None:
    """A misspelt name is an error that says so."""
    with pytest.raises(AttributeError, match="'loopgate' has no attribute 'ru'"):
        loopgate.ru  # noqa: B018 - it is the access that is tested


def test_importing_the_package_loads_nothing_heavy() -> None:
    """The command line's help must not wait for pandas, Matplotlib or SUMO."""
    program = (
        "import loopgate, sys; print([m for m in ('pandas', 'matplotlib', 'libsumo') if m in sys.modules])"
    )
    assert subprocess.run([sys.executable, "-c", program], check=True, capture_output=True).stdout == b"[]\n"


def test_help_of_a_scenario_shows_plain_types() -> None:
    """Not the rules by which values are checked."""
    shown = pydoc.plain(pydoc.render_doc(loopgate.Scenario))
    assert "network: str, routes: str = ''" in shown
    assert "Annotated" not in shown.partition("Attributes")[0].partition("Methods defined")[0]


RECORDS = ("ReportFiles", "SweepOutcome")
"""Classes that only hold what a function returns; the example is the function's."""


@pytest.mark.parametrize("name", loopgate.__all__)
def test_help_of_each_name_can_be_read(name: str) -> None:
    """A sentence of its own, an example, and nothing that only the machine understands."""
    shown = pydoc.plain(pydoc.render_doc(getattr(loopgate, name)))
    own = shown.partition("Methods defined here")[0].partition("Methods inherited")[0]
    assert ">>> " in own or name in RECORDS
    assert " object at 0x" not in shown
    assert "<lambda>" not in own
    assert "Annotated[" not in own
    first = (getattr(loopgate, name).__doc__ or "").partition("\n")[0]
    assert first.endswith(".")
    assert len(first.split()) > 3
