"""Progress where stderr is no terminal."""

import io
import re
import time

import pytest

from loopgate.cli.terminal import show_progress


def test_sparse_lines_say_how_long_it_will_take(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """40 of 100 were there before; 20 in 60 s leave 40 for two minutes."""
    now = 0.0
    monkeypatch.setattr("loopgate.cli.terminal.time.monotonic", lambda: now)
    with show_progress("grid", total=100) as report:
        report(40)
        now = 60.0
        report(60)
    assert capsys.readouterr().err == "grid: 60 of 100, 2 min left\n"


def test_a_live_line_fits_eighty_columns(monkeypatch: pytest.MonkeyPatch) -> None:
    """A long name of a sweep leaves out its middle, and never the count and the times."""
    terminal = io.StringIO()
    terminal.isatty = lambda: True  # type: ignore[method-assign]
    monkeypatch.setattr("sys.stderr", terminal)
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr("loopgate.cli.terminal._QUICK_S", 0.0)
    with show_progress("certified on networks/somewhere/grid5-priority.net.xml, simulated seconds") as report:
        report(86_399, 86_400)
        time.sleep(0.3)
    shown = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", terminal.getvalue())
    lines = [line.strip("\r") for line in shown.splitlines() if "86399/86400" in line]
    assert lines
    assert all(len(line) <= 80 and line.startswith("certified on ") for line in lines)
    assert all(re.search(r"conds .*86399/86400 +\d:\d\d:\d\d", line) for line in lines)
