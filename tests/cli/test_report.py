"""The command `loopgate report`: exit codes, and what it prints."""

from pathlib import Path

import pytest
from command import loopgate

from loopgate.sweep.task import load_runner


@pytest.mark.usefixtures("undrawn")
def test_a_report_on_a_run_folder(tmp_path: Path) -> None:
    """A single run, no sweep; the page lies where it was asked for."""
    (tmp_path / "run").mkdir()
    run = load_runner(f"{Path(__file__).parents[1] / 'unit' / 'sweep' / 'fake_runner.py'}:run")
    run({"vehicles": 10, "gate": "certified"}, tmp_path / "run")
    result = loopgate("report", "run", "-o", "page.html", cwd=tmp_path)
    assert (result.returncode, result.stdout) == (0, "page.html, 5 figures and 19 tables in page-files\n")
    assert "1 run, none failed." in (tmp_path / "page.html").read_text(encoding="utf-8")


def test_no_results_is_one_line_and_exit_code_2(tmp_path: Path) -> None:
    """No traceback."""
    result = loopgate("report", "nothing", cwd=tmp_path)
    assert result.returncode == 2
    assert result.stderr.startswith("loopgate: nothing: no results; expected rows/")
    assert len(result.stderr.splitlines()) == 1
