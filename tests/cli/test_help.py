"""Help comes at once: no command imports what only its work needs."""

from __future__ import annotations

import subprocess
import sys

import pytest

HEAVY = {"jinja2", "libsumo", "matplotlib", "numba", "numpy", "pandas", "pyarrow", "rich", "scipy"}
ASK = """
import sys
from loopgate.cli.main import cli
cli.main(sys.argv[1:], standalone_mode=False)
print(*sorted({name.partition(".")[0] for name in sys.modules}), file=sys.stderr)
"""


@pytest.mark.parametrize("words", [("--help",), ("run", "--help"), ("sweep", "--help"), ("report", "--help")])
def test_help_imports_nothing_heavy(words: tuple[str, ...]) -> None:
    """Listing the commands, and showing the options of one, loads neither tables nor roads nor compilers."""
    ended = subprocess.run([sys.executable, "-c", ASK, *words], capture_output=True, text=True, check=True)
    assert "Usage: " in ended.stdout
    assert set(ended.stderr.split()).isdisjoint(HEAVY)
