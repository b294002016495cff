"""Progress where stderr is no terminal."""

import pytest

from loopgate.cli.progress import show_progress


def test_sparse_lines_say_how_long_it_will_take(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """40 of 100 were there before; 20 in 60 s leave 40 for two minutes."""
    now = 0.0
    monkeypatch.setattr("loopgate.cli.progress.time.monotonic", lambda: now)
    with show_progress("grid", total=100) as report:
        report(40)
        now = 60.0
        report(60)
    assert capsys.readouterr().err == "grid: 60 of 100, 2 min left\n"
