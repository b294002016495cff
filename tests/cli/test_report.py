"""The command `loopgate report`: exit codes, and what it prints."""

import subprocess
import sys
from pathlib import Path

from command import loopgate


def test_a_report_on_a_run_folder(tmp_path: Path) -> None:
    """A single run, no sweep; the page lies where it was asked for."""
    script = (
        "import sys; sys.path.insert(0, sys.argv[1]); from pathlib import Path; import fake_runner;"
        "Path('run').mkdir(); fake_runner.run({'vehicles': 10, 'gate': 'certified'}, Path('run'))"
    )
    fake = str(Path(__file__).parents[1] / "unit" / "sweep")
    subprocess.run([sys.executable, "-c", script, fake], cwd=tmp_path, check=True)
    result = loopgate("report", "run", "-o", "page.html", cwd=tmp_path)
    assert (result.returncode, result.stdout) == (0, "page.html, 9 figures and 19 tables in page-files\n")
    assert "1 run, none failed." in (tmp_path / "page.html").read_text(encoding="utf-8")


def test_no_results_is_one_line_and_exit_code_2(tmp_path: Path) -> None:
    """No traceback."""
    result = loopgate("report", "nothing", cwd=tmp_path)
    assert result.returncode == 2
    assert result.stderr.startswith("loopgate: nothing: no results; expected rows/")
    assert len(result.stderr.splitlines()) == 1
